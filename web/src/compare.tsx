// Two runs side by side on one time axis: where each stands at the same moment, tags over each other, events beside each other.

import { useEffect, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import { readable } from "./grip";
import { colour } from "./trends";
import { ask, type Moment, type Run, type Trend } from "./told";
import { amount, distance, fromTo, LEVELS, moment, moved, percent, priced, span } from "./words";

const NAMES = ["A", "B"] as const;

function Standing({ name, run, now, at }: { name: string; run: Run; now: Moment | null; at: number }) {
  const card = now?.card, p = card?.proposal, o = now?.overview, worst = p?.margins[0];
  const rows: [string, string][] = !now || !o ? [] : [
    ...(run.altered ? [["Record", `■ ALTERED: ${run.altered}`] as [string, string]] : []), ["State", o.state || "–"], ["Mode", o.mode || "–"],
    ["Alarm", o.alarm ? `${LEVELS[o.level]?.mark ?? ""} ${o.alarm}` : "nothing is wrong"],
    ["Believed", card ? `${card.headline}${card.probability === null ? "" : `, ${percent(card.probability)}`}` : "–"],
    ["Proposed", p ? `${p.path.length ? p.path[p.path.length - 1] : p.what} by ${p.proposer}: ${p.moves.filter(moved).map((m) => `${m.tag} → ${fromTo(m)[1]}`).join(", ")}` : "–"],
    ["Its standing", p?.status ?? (card?.fallen ? `${card.fallen.proposer}: ${card.fallen.status}` : "–")],
    ["Worst margin", worst ? `${distance(worst.margin, worst.unit, worst.term)}, ${worst.text || worst.name}: ${worst.term || worst.formula}` : "–"],
    ["Cost of what was chosen", card ? card.choices.filter((c) => c.chosen).map((c) => priced(c.cost, card.currency))[0] ?? "–" : "–"],
    ["Fallbacks", card?.acted.map((a) => `${a.strategy} at ${moment(a.at_s)}`).join(", ") || "none"],
    ["Beyond a limit", now.violated.join(", ") || "nothing"], ["Ended", o.finished || "not yet"],
  ];
  return (
    <div><h3>{name} <span class="quiet">{run.title}, at {moment(Math.max(0, at))}{at > run.last_s && ` (it ends at ${moment(run.last_s)})`}</span></h3>
      <table><tbody>{rows.map(([what, said]) => <tr key={what}><th scope="row" class="quiet">{what}</th><td>{said}</td></tr>)}</tbody></table></div>
  );
}

function Overlay({ runs, tag, at, offset, theme }: { runs: [Run, Run]; tag: string; at: number; offset: number; theme: string }) {
  const box = useRef<HTMLDivElement>(null), chart = useRef<uPlot | null>(null), known = runs[0].tags.find((t) => t.name === tag);
  const to = Math.max(runs[0].last_s, runs[1].last_s - offset);
  useEffect(() => {
    let gone = false;
    const width = Math.max(240, box.current?.clientWidth ?? 600);
    const load = ["/api/trend", "/api/other/trend"].map((path, k) => ask<Trend>(path, { tag: [tag], from: 0, to: Math.max(1, to + (k ? offset : 0)), width }).catch(() => null));
    void Promise.all(load).then((found) => {
      if (gone || !box.current) return;
      const tables = found.map((t, k) => [(t?.times_s ?? []).map((s) => s - (k ? offset : 0)), t?.series[0]?.[1] ?? []] as uPlot.AlignedData);
      const quiet = colour("--quiet"), faint = colour("--faint"), axis = { stroke: quiet, grid: { stroke: faint, width: 1 }, ticks: { stroke: faint, width: 1 }, font: "12px system-ui, sans-serif" };
      const said = (_u: uPlot, v: number | null) => (v == null ? "–" : amount(v, known?.unit ?? ""));
      chart.current?.destroy();
      chart.current = new uPlot({
        width, height: 220, cursor: { sync: { key: "compare" }, drag: { x: false, y: false } }, scales: { x: { time: false, range: [0, Math.max(1, to)] } },
        axes: [{ ...axis, size: 34, values: (_u, times) => times.map((s) => `${s} s`) }, { ...axis, size: 62 }],
        series: [{ label: "Time", value: (_u, s) => (s == null ? "–" : moment(s)) },
          { label: "A", stroke: colour("--ink"), width: 1.6, spanGaps: true, points: { show: false }, value: said },
          { label: "B", stroke: colour("--line2"), width: 1.6, dash: [6, 4], spanGaps: true, points: { show: false }, value: said }],
        hooks: { draw: [(u) => {
          const x = u.valToPos(at, "x", true);
          u.ctx.strokeStyle = colour("--link");
          u.ctx.beginPath();
          u.ctx.moveTo(x, u.bbox.top);
          u.ctx.lineTo(x, u.bbox.top + u.bbox.height);
          u.ctx.stroke();
        }] },
      }, uPlot.join(tables), box.current);
      readable(chart.current);
    });
    return () => { gone = true; };
  }, [tag, offset, theme, Math.round(at), to]);
  useEffect(() => () => chart.current?.destroy(), []);
  return <figure class="trend"><figcaption>{tag} <span class="quiet">{known?.text}{known && known.unit !== "1" && ` [${known.unit}]`}; A solid, B dashed</span></figcaption><div ref={box} /></figure>;
}

export function Compare({ run, now, theme, seek }: { run: Run; now: Moment; theme: string; seek: (at: number) => void }) {
  const [other, setOther] = useState<Run | null>(null), [there, setThere] = useState<Moment | null>(null), [failed, fail] = useState(""), [missed, miss] = useState("");
  const [aligned, align] = useState(false), [chosen, setTags] = useState<string[]>(() => (run.panels[0]?.tags ?? []).slice(0, 1));
  const offset = aligned && other?.begins_s != null && run.begins_s !== null ? other.begins_s - run.begins_s : 0;
  const at = now.at_s, whole = Math.round(at);
  useEffect(() => { ask<Run>("/api/other/run").then(setOther, (e: Error) => fail(e.message)); }, []);
  useEffect(() => {
    let gone = false;
    ask<Moment>("/api/other/moment", { at: Math.max(0, at + offset) }).then((m) => { if (!gone) { setThere(m); miss(""); } }, (e: Error) => { if (!gone) miss(e.message); });
    return () => { gone = true; };
  }, [whole, offset]);
  if (failed) return <section class="wide"><p class="warn" role="alert">△ {failed}</p></section>;
  if (!other) return <section class="wide"><p class="quiet">Reading the other run …</p></section>;
  const both = run.tags.filter((t) => other.tags.some((u) => u.name === t.name) && !/\.(err|rate|travel)$/.test(t.name));
  const tags = chosen.filter((t) => both.some((u) => u.name === t)), differ = other.title !== run.title;
  const lines = [run.lines.map((l) => ({ ...l, k: 0, on: l.at_s })), other.lines.map((l) => ({ ...l, k: 1, on: l.at_s - offset }))].flat().filter((l) => l.on <= at).sort((a, b) => b.on - a.on).slice(0, 80);
  return (
    <section id="compare" class="wide" tabIndex={-1} aria-label="Two runs">
      <h2>Two runs on one time axis <span class="quiet">at {moment(at)}{offset !== 0 && `; B is shown ${span(Math.abs(offset))} ${offset > 0 ? "earlier" : "later"} than it was`}</span></h2>
      {missed && <p class="warn" role="alert">△ B is not shown as it was at this moment: {missed}</p>}
      {differ && <p class="notice" role="status">△ These are runs of different plants, {both.length ? "of which only tags with the same name are drawn: one name may be two things" : "which have no tag in common: no trend can be drawn over another"}.</p>}
      <p class="filters">{run.begins_s !== null && other.begins_s !== null && <label class="auto"><input type="checkbox" checked={aligned} onChange={(e) => align(e.currentTarget.checked)} /> the first symptom of both at the same place</label>}
        <label>Add a tag <select value="" onChange={(e) => e.currentTarget.value && setTags([...tags, e.currentTarget.value])}><option value="">choose</option>
          {both.filter((t) => !tags.includes(t.name)).map((t) => <option key={t.name} value={t.name}>{t.name}: {t.text}</option>)}</select></label>
        {tags.map((t) => <button type="button" key={t} onClick={() => setTags(tags.filter((x) => x !== t))} aria-label={`Take ${t} away`}>{t} ✕</button>)}</p>
      <div class="pair"><Standing name="A" run={run} now={now} at={at} /><Standing name="B" run={other} now={there} at={at + offset} /></div>
      {tags.map((t) => <Overlay key={t} runs={[run, other]} tag={t} at={at} offset={offset} theme={theme} />)}
      <div class="scroll" tabIndex={0} role="region" aria-label="Events of both"><table class="lines">
        <thead><tr><th class="n">At</th><th>A</th><th>B</th></tr></thead>
        <tbody>{lines.map((l, n) => <tr key={n}><td class="n"><button type="button" class="link" onClick={() => seek(l.on)}>{moment(l.on)}</button></td>
          {NAMES.map((name, k) => <td key={name} class="small">{l.k === k && <><b>{l.label}</b> {l.text}</>}</td>)}</tr>)}</tbody></table></div>
    </section>
  );
}
