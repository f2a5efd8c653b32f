// The pace of a simulated run: how fast it goes on, and whether it stands. A run without one shows nothing of this.

import { useEffect, useState } from "preact/hooks";
import { SPEEDS } from "./player";
import { ask, send, type Me, type Moment, type Pace, type Run } from "./told";
import { moment } from "./words";

const AGAIN_MS = 2000;

export interface Paced { pace: Pace | null; may: boolean; failed: string; toggle: () => void; choose: (speed: number) => void }

// What the stream tells; where no stream is followed, as at an earlier moment, it is asked for.
export function usePace(run: Run | null, now: Moment | null, playing: boolean, me: Me): Paced {
  const [pace, setPace] = useState<Pace | null>(null);
  const [failed, setFailed] = useState("");
  const live = run?.live ?? false, may = me.access !== "viewer";
  useEffect(() => setPace(now?.pace ?? null), [now]);
  useEffect(() => {
    if (!live || playing || !now?.pace) return;
    const again = setInterval(() => void ask<Pace | null>("/api/pace").then(setPace, () => {}), AGAIN_MS);
    return () => clearInterval(again);
  }, [live, playing, now]);
  const change = (to: { paused?: boolean; speed?: number }) => {
    if (!pace || !may) return;
    send<Pace>("POST", "/api/pace", to, me.token).then((came) => { setPace(came); setFailed(""); }, (e: Error) => setFailed(e.message));
  };
  return { pace: live ? pace : null, may, failed, toggle: () => change({ paused: !pace?.paused }), choose: (speed) => change({ speed }) };
}

function said(pace: Pace, last: number): string {
  if (pace.stands) return `The run is paused at ${moment(last)}.`;
  if (pace.paused) return "The run pauses when what is thought now comes to its end.";
  return `The run goes on at ${pace.speed} ×.`;
}

export function PaceOfRun({ paced, last }: { paced: Paced; last: number }) {
  const { pace, may, failed, toggle, choose } = paced;
  if (!pace) return null;
  const speeds = SPEEDS.includes(pace.speed) ? SPEEDS : [...SPEEDS, pace.speed].sort((a, b) => a - b);
  return (
    <nav class={`transport pace ${pace.paused ? "paused" : ""}`} aria-label="Pace of the run">
      {may && <button type="button" onClick={toggle} aria-pressed={pace.paused} title="p">{pace.paused ? "▶ Let the run go on" : "❚❚ Pause the run"}</button>}
      {may && <label>Speed of the run <select value={String(pace.speed)} onChange={(e) => choose(Number(e.currentTarget.value))}>
        {speeds.map((s) => <option key={s} value={String(s)}>{s} ×</option>)}</select></label>}
      <span role="status">{said(pace, last)}</span>
      {failed && <b class="warn" role="alert">△ {failed}</b>}
    </nav>
  );
}
