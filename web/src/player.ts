// How the moment that is shown moves on: played, followed, or sought; and how long nothing was heard.

import { useCallback, useEffect, useRef, useState } from "preact/hooks";
import { isKept, momentAt } from "./kept";
import { ask, type Moment, type Run } from "./told";

export const SPEEDS = [1, 5, 10, 30, 60, 300, 1000];
const SILENT_S = 4, DEAD_S = 15, AGAIN_MS = 2000;

export interface Player {
  now: Moment | null; playing: boolean; speed: number; lost: boolean; silent_s: number;
  seek: (at: number) => void; step: (by: number) => void; toggle: () => void; follow: () => void; quicken: (by: number) => void; choose: (speed: number) => void;
}

// Time since something was heard, by a clock that nobody sets.
function useSilence(playing: boolean): [number, () => void] {
  const heard = useRef(performance.now());
  const [silent, setSilent] = useState(0);
  useEffect(() => {
    heard.current = performance.now();
    setSilent(0);
    if (!playing) return;
    const watch = setInterval(() => setSilent(Math.floor((performance.now() - heard.current) / 1000)), 500);
    return () => clearInterval(watch);
  }, [playing]);
  return [playing && silent >= SILENT_S ? silent : 0, () => { heard.current = performance.now(); }];
}

// Moments come from the server while it plays, one by one where it is paused. What has not changed is not sent again.
export function usePlayer(run: Run | null, refused: () => void): Player {
  const [now, setNow] = useState<Moment | null>(null);
  const [playing, setPlaying] = useState(false);
  const [speed, setSpeed] = useState(10);
  const [lost, setLost] = useState(false);
  const [from, setFrom] = useState(0);
  const [attempt, setAttempt] = useState(0);
  const [silent_s, hear] = useSilence(playing);
  const latest = useRef(0), asked = useRef(0), answered = useRef(0), seen = useRef(0), followed = useRef<EventSource | null>(null);
  const show = useCallback((m: Moment) => {
    seen.current = m.at_s;
    setNow((old) => (m.whole || !old ? m : { ...m, card: old.card, told: old.told }));
  }, []);
  const take = useCallback((m: Moment) => { latest.current = m.at_s; show(m); }, [show]);
  // While a key is held, every answer is shown that is newer than the one before; where the next step goes is known already.
  const look = useCallback(async (at: number) => {
    const mine = ++asked.current;
    latest.current = at;
    try {
      const m = await ask<Moment>("/api/moment", { at });
      if (mine < answered.current) return;
      answered.current = mine;
      setLost(false);
      if (mine === asked.current) take(m); else show(m);
    } catch {
      if (mine < answered.current) return;
      if (mine === asked.current) latest.current = seen.current;
      setLost(true);
      refused();
    }
  }, [take, show]);
  const begun = useRef(false), known = run !== null;
  useEffect(() => {
    if (!run || begun.current) return;
    begun.current = true;
    const hash = Number(location.hash.replace("#t=", ""));
    const begin = Number.isFinite(hash) && location.hash ? Math.min(Math.max(0, hash), run.last_s)
      : run.live ? run.last_s : run.decided_s ?? run.begins_s ?? run.last_s;
    void look(begin);
    setFrom(begin);
    setPlaying(run.live);
    if (run.live) setSpeed(1000); // as fast as it comes
  }, [run]);
  useEffect(() => {
    if (!playing || !known) return;
    if (isKept()) {
      const begun = performance.now();
      const step = setInterval(() => {
        const at = Math.min(from + (speed * (performance.now() - begun)) / 1000, run!.last_s);
        hear();
        take(momentAt(at));
        if (at >= run!.last_s) { clearInterval(step); setPlaying(false); }
      }, 200);
      return () => clearInterval(step);
    }
    const stream = new EventSource(`/api/stream?at=${from}&speed=${speed}`);
    let again: ReturnType<typeof setTimeout> | undefined;
    followed.current = stream;
    stream.onmessage = (e) => {
      if (followed.current !== stream) return; // another moment was asked for meanwhile
      answered.current = ++asked.current; // and what was asked for before may be answered last
      hear();
      setLost(false);
      take(JSON.parse(e.data) as Moment);
    };
    stream.onerror = () => {
      setLost(true);
      // A browser gives up where the answer is an error, as that of a console that was started again.
      if (stream.readyState === EventSource.CLOSED) again = setTimeout(() => { refused(); setFrom(latest.current); setAttempt((n) => n + 1); }, AGAIN_MS);
    };
    stream.addEventListener("end", () => { stream.close(); setPlaying(false); });
    return () => { stream.close(); clearTimeout(again); };
  }, [playing, speed, from, known, attempt]);
  // A connection that is dead may never say so: another one is tried.
  const dead = isKept() ? 0 : Math.floor(silent_s / DEAD_S);
  useEffect(() => { if (dead) { refused(); setFrom(run?.live ? 1e12 : latest.current); setAttempt((n) => n + 1); } }, [dead]);
  const seek = (at: number) => {
    const to = Math.min(Math.max(0, at), Math.max(run?.last_s ?? 0, latest.current));
    followed.current = null;
    if (run?.live) setPlaying(false);
    // Also to where it was played from: that is another beginning.
    if (playing && !run?.live) { latest.current = to; setFrom(to); setAttempt((n) => n + 1); } else void look(to);
  };
  // From where the last one led: a second press does not wait for what the first one asked for.
  const step = (by: number) => seek(latest.current + by);
  const toggle = () => { setFrom(run?.live ? 1e12 : latest.current); setPlaying(!playing); };
  const follow = () => { setFrom(1e12); setPlaying(true); };
  const choose = (s: number) => { setFrom(latest.current); setSpeed(s); };
  const quicken = (by: number) => {
    const near = SPEEDS.findIndex((s) => s >= speed);
    choose(SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, near + by))]!);
  };
  return { now, playing, speed, lost, silent_s, seek, step, toggle, follow, quicken, choose };
}
