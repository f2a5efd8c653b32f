// The page: one run, one moment of it, and how that moves on.

import { render } from "preact";
import { useCallback, useEffect, useLayoutEffect, useMemo, useRef, useState } from "preact/hooks";
import "uplot/dist/uPlot.min.css";
import "./console.css";
import { EpisodeCard } from "./card";
import { OverviewLine } from "./overview";
import { Freshness } from "./fresh";
import { Ask } from "./ask";
import { Alarms } from "./alarms";
import { Compare } from "./compare";
import { Explorer } from "./explorer";
import { JournalView } from "./journal";
import { Flowsheet, Indicators } from "./plant";
import { PaceOfRun, usePace } from "./pace";
import { SPEEDS, usePlayer, type Player } from "./player";
import { Decision, OrderDialog, Orders, approving, mayOrder, offered, rejecting, type Asked } from "./orders";
import { SignIn, Who } from "./people";
import { isKept, load } from "./kept";
import { ask, Refused, whenSignedOut, type Line, type Me, type Run } from "./told";
import { TrendChart } from "./trends";
import { moment, span } from "./words";

const BACKS: [number, string][] = [[600, "10 min"], [1800, "30 min"], [7200, "2 h"], [1e9, "all"]];

function useTheme(): [string, () => void] {
  const [theme, set] = useState(() => localStorage.getItem("theme")
    ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
  document.documentElement.dataset.theme = theme;
  return [theme, () => {
    const other = theme === "dark" ? "light" : "dark";
    localStorage.setItem("theme", other);
    set(other);
  }];
}

function Transport({ run, player, theme, turn }: { run: Run; player: Player; theme: string; turn: () => void }) {
  const at = player.now?.at_s ?? 0, last = Math.max(run.last_s, at);
  return (
    <nav class="transport" aria-label="Replay">
      {run.live
        ? <button type="button" onClick={player.toggle} aria-pressed={player.playing} title="Space">{player.playing ? "● Live" : "○ Back to live"}</button>
        : <button type="button" onClick={player.toggle} aria-pressed={player.playing} title="Space">{player.playing ? "❚❚ Pause" : "▶ Play"}</button>}
      {!run.live && <label>Speed <select value={String(player.speed)} onChange={(e) => player.choose(Number(e.currentTarget.value))}>
        {SPEEDS.map((s) => <option key={s} value={String(s)}>{s} ×</option>)}</select></label>}
      <input type="range" min={0} max={Math.max(1, Math.round(last))} step={1} value={Math.round(at)} aria-label="Process time"
        aria-valuetext={`${moment(at)} of ${moment(last)}`} onInput={(e) => player.seek(Number(e.currentTarget.value))} />
      <span class="clock">{moment(at)} <span class="quiet">of {moment(last)}{at >= 120 && ` (${span(at)})`}</span></span>
      {run.begins_s !== null && !run.live && <button type="button" onClick={() => player.seek(run.begins_s!)} title="e">First symptom</button>}
      <button type="button" onClick={turn} title="t">{theme === "dark" ? "Light" : "Dark"}</button>
      {(player.lost || player.silent_s > 0) && !run.attached && <b class="warn" role="alert">△ The connection is lost: this is how it was at {moment(at)}.</b>}
    </nav>
  );
}

function Log({ lines, at, seek }: { lines: Line[]; at: number; seek: (at: number) => void }) {
  const known = lines.filter((l) => l.at_s <= at).slice(-60).reverse();
  return (
    <section class="log" id="log" tabIndex={-1} aria-label="Events"><h2>Events</h2>
      <ol>{known.map((l, k) => <li key={`${l.at_s} ${known.length - k}`} class={l.tone}>
        <button type="button" onClick={() => seek(l.at_s)}>{moment(l.at_s)}</button> <b>{l.label}</b> {l.text}</li>)}</ol>
    </section>
  );
}

function useKeys(run: Run | null, player: Player, turn: () => void, help: () => void, decide: (yes: boolean) => void, view: (name: View) => void, pause: () => void) {
  // Before it is painted: a key pressed at the first sight of a moment acts on that moment.
  useLayoutEffect(() => {
    const press = (e: KeyboardEvent) => {
      const on = e.target as HTMLElement;
      if (!player.now || e.ctrlKey || e.metaKey || e.altKey || /^(SELECT|TEXTAREA)$/.test(on.tagName) || document.querySelector("dialog[open]")) return;
      if (on.tagName === "INPUT" && ((on as HTMLInputElement).type !== "range" || /^(Arrow|Home|End|Page)/.test(e.key))) return;
      if (e.key === " " && /^(BUTTON|SUMMARY)$/.test(on.tagName)) return;
      const far = e.shiftKey ? 60 : 10;
      const go: Record<string, () => void> = {
        " ": player.toggle, ArrowLeft: () => player.step(-far), ArrowRight: () => player.step(far),
        Home: () => player.seek(0), End: () => (run?.live ? player.follow() : player.seek(run?.last_s ?? 0)), "+": () => player.quicken(1), "-": () => player.quicken(-1),
        6: () => view("alarms"), 7: () => view("trends"), 8: () => view("journal"), 9: () => isKept() || view("ask"), 0: () => view("plant"), c: () => run?.beside && view("compare"),
        t: turn, p: pause, "?": help, a: () => decide(true), r: () => decide(false), e: () => run?.begins_s != null && player.seek(run.begins_s),
        1: () => jump("card"), 2: () => jump("readings"), 3: () => jump("trends"), 4: () => jump("plant"), 5: () => jump("log"),
      };
      const act = go[e.key];
      if (act) { e.preventDefault(); act(); }
    };
    addEventListener("keydown", press);
    return () => removeEventListener("keydown", press);
  });
}

type View = "plant" | "alarms" | "trends" | "journal" | "ask" | "compare";
const VIEWS: [View, string, string][] = [["plant", "Episode and plant", "0"], ["alarms", "Alarms", "6"], ["trends", "Trends", "7"], ["journal", "Journal", "8"], ["ask", "What if", "9"], ["compare", "Two runs", "c"]];

function jump(id: string) {
  const part = document.getElementById(id);
  part?.focus({ preventScroll: true });
  part?.scrollIntoView({ block: "start" });
}

function useMe(): [Me | null, (me: Me) => void, () => void] {
  const [me, setMe] = useState<Me | null>(null);
  const look = useCallback(() => void ask<Me>("/api/me").then(setMe, () => {}), []);
  useEffect(() => { whenSignedOut(look); look(); const again = setInterval(look, 60_000); return () => clearInterval(again); }, []);
  return [me, setMe, look];
}

function App() {
  const [me, setMe, lookAgain] = useMe();
  useTheme();
  if (!me) return <p class="big quiet">Reading the run …</p>;
  if (me.people && !me.name) return <SignIn me={me} signed={setMe} title="Homeostat console" />;
  return <Page key={me.name ?? ""} me={me} signed={setMe} lookAgain={lookAgain} />;
}

function Page({ me, signed, lookAgain }: { me: Me; signed: (me: Me) => void; lookAgain: () => void }) {
  const [run, setRun] = useState<Run | null>(null);
  const [failed, setFailed] = useState("");
  const [back, setBack] = useState(1800);
  const [helped, setHelped] = useState(false);
  const [asked, order] = useState<Asked | null>(null);
  const [theme, turn] = useTheme();
  const [view, show] = useState<View>("plant");
  const player = usePlayer(run, lookAgain);
  const now = player.now, paced = usePace(run, now, player.playing, me);
  const atHead = run !== null && run.live && player.playing;
  const offer = now && mayOrder(me) && atHead ? offered(now.card, now) : undefined;
  useKeys(run, player, turn, () => setHelped(!helped), (yes) => {
    if (offer && now?.card?.proposal) order((yes ? approving : rejecting)(offer, now.card.proposal));
  }, show, paced.toggle);
  const reload = useCallback(() => ask<Run>("/api/run").then((found) => { setRun(found); setFailed(""); }, (e: Error) => {
    if (e instanceof Refused && e.status === 401) lookAgain(); else setFailed(e.message);
  }), []);
  useEffect(() => { void reload(); }, []);
  // A run that goes on has new lines, and some day its readings.
  const told = useRef(0);
  useEffect(() => {
    if (!run || run.closed) return;
    const soon = setTimeout(() => { told.current = performance.now(); void reload(); }, Math.max(0, told.current + 3000 - performance.now()));
    const again = setInterval(() => void reload(), 30_000); // also where nobody follows it
    return () => { clearTimeout(soon); clearInterval(again); };
  }, [now?.told, now && Math.floor(now.at_s / 30), run?.closed, player.playing]);
  const trends = useMemo(() => run?.panels ?? [], [run]);
  if (failed && !run) return <p class="big" role="alert">■ The console does not answer: {failed}</p>;
  if (!run || !now) return <p class="big quiet">Reading the run …</p>;
  document.title = `${now.overview.alarm ? "△ " : ""}${run.title}`;
  const writable = run.tags.filter((t) => now.targets[t.name] !== undefined).map((t) => t.name);
  return (
    <>
      <header><OverviewLine title={run.title} now={now} />
        <div class="desk"><Orders me={me} now={now} live={atHead} tags={writable} order={order} /><Who me={me} signed={signed} /></div></header>
      <Freshness run={run} player={player} />
      <Transport run={run} player={player} theme={theme} turn={turn} />
      <PaceOfRun paced={paced} last={run.live && player.playing ? now.at_s : run.last_s} />
      <nav class="views" aria-label="Views">{VIEWS.filter(([name]) => (name !== "trends" || run.measured) && (name !== "ask" || !isKept()) && (name !== "compare" || run.beside)).map(([name, text, key]) => (
        <button type="button" key={name} aria-pressed={view === name} title={key} onClick={() => show(name)}>{text}{name === "alarms" && now.overview.folded.length ? ` (${now.overview.folded.length})` : ""}</button>))}</nav>
      {run.altered && <p class="stale" role="alert"><b>■ ALTERED.</b> {run.altered}. Nothing after {moment(run.last_s)} is shown: nobody knows what was so then.</p>}
      {run.notice && <p class={run.live || isKept() ? "notice calm" : "notice"} role="status">{run.live || isKept() ? "" : "△ "}{run.notice}</p>}
      {helped && <p class="notice">Space: play or pause. ← →: 10 s, with Shift 60 s. Home, End. + −: speed. e: first symptom. t: theme.{paced.pace ? " p: pause the run, or let it go on." : ""} a: approve, r: reject. 1 card, 2 readings, 3 trends, 4 plant, 5 events. 6 alarms, 7 trends of any tags, 8 journal, 9 what if, c two runs, 0 back.</p>}
      <main class={`${run.measured && view === "plant" ? "" : "single"} ${now.fresh?.old || player.silent_s || player.lost ? "old" : ""}`}>
        {view === "alarms" && <Alarms now={now} me={me} live={atHead} order={order} />}
        {view === "trends" && <Explorer run={run} at={Math.max(now.at_s, 1)} theme={theme} />}
        {view === "journal" && <JournalView seek={(to) => { player.seek(to); show("plant"); }} />}
        {view === "compare" && run.beside && <Compare run={run} now={now} theme={theme} seek={player.seek} />}
        {view === "ask" && <Ask run={run} me={me} at={now.at_s} />}
        {view === "plant" && <>
        <EpisodeCard run={run} me={me} now={now} decision={offer && now.card?.proposal && <Decision offer={offer} proposal={now.card.proposal} now={now} order={order} />} />
        {run.measured && <div class="side">
          <section id="readings" tabIndex={-1} aria-label="Readings"><h2>Readings</h2>
            <Indicators run={run} now={now} />
            <p class="legend">▼ reading  ▲ setpoint  <span class="key usual" /> 98 % of the readings before anything was seen  <span class="key hard" /> hard limit  <span class="key soft" /> other limit  ◇ unusual  ■ beyond a limit  ? poor quality</p>
          </section>
          <section id="trends" tabIndex={-1} aria-label="Trends"><h2>Trends <span class="choice">{BACKS.map(([s, name]) => (
            <button type="button" key={s} aria-pressed={back === s} onClick={() => setBack(s)}>{name}</button>))}</span></h2>
            {trends.map((p) => <TrendChart key={p.title} run={run} panel={p} at={now.at_s} back={back} theme={theme} />)}</section>
        </div>}
        {run.sheet && <section id="plant" class="wide" tabIndex={-1} aria-label="Plant"><h2>Plant</h2>
          <Flowsheet run={run} sheet={run.sheet} now={now} /></section>}
        <Log lines={run.lines} at={now.at_s} seek={player.seek} />
        </>}
      </main>
      <footer class="quiet">Keys: press ?</footer>
      {asked && <OrderDialog asked={asked} me={me} now={now} close={() => order(null)} />}
    </>
  );
}

void load().then(() => render(<App />, document.body), () => { document.body.textContent = "■ What is kept in this file cannot be read."; });
