// Trends of any tags over any time: wheel, two fingers or + and - to zoom, drag or arrows to pan, a cursor that reads all of them.

import { useEffect, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import { Grip, readable, type Range } from "./grip";
import { isKept } from "./kept";
import { colour, DASHES, legend } from "./trends";
import { ask, type Run, type Trend } from "./told";
import { moment, span } from "./words";

const MOST = 5, LEAST_S = 10;

// One axis for all where the units agree, else each its own, named in the legend.
function options(run: Run, tags: string[], width: number, range: () => Range): uPlot.Options {
  const units = tags.map((n) => run.tags.find((t) => t.name === n)?.unit ?? ""), scales = [...new Set(units)];
  const quiet = colour("--quiet"), faint = colour("--faint");
  const strokes = [colour("--ink"), colour("--line2"), colour("--line3"), quiet, colour("--warn")];
  const axis = { stroke: quiet, grid: { stroke: faint, width: 1 }, ticks: { stroke: faint, width: 1 }, font: "12px system-ui, sans-serif" };
  return {
    width, height: 380, legend: legend(strokes), cursor: { drag: { x: false, y: false } },
    scales: { x: { time: false, range: () => { const { from, to } = range(); return [from, to]; } } },
    axes: [{ ...axis, size: 34, values: (_u, at) => at.map((s) => `${s} s`) },
      ...scales.map((unit, k) => ({ ...axis, scale: unit, size: 64, side: k % 2 ? 1 : 3, label: unit === "1" ? "" : unit, labelSize: 18, grid: { show: k === 0, stroke: faint, width: 1 } }))],
    series: [{ label: "Time", value: (_u, s) => (s == null ? "–" : moment(s)) },
      ...tags.map((label, k) => ({ label, scale: units[k]!, stroke: strokes[k % 5]!, width: 1.5, dash: DASHES[k % 5]!, points: { show: false },
        value: (_u: uPlot, v: number | null) => (v == null ? "–" : `${Number(v.toPrecision(5))}${units[k] === "1" ? "" : ` ${units[k]}`}`) }))],
  };
}

function picture(chart: uPlot, name: string) {
  const paper = document.createElement("canvas"), from = chart.ctx.canvas;
  paper.width = from.width;
  paper.height = from.height;
  const ink = paper.getContext("2d")!;
  ink.fillStyle = colour("--card");
  ink.fillRect(0, 0, paper.width, paper.height);
  ink.drawImage(from, 0, 0);
  const link = document.createElement("a");
  link.href = paper.toDataURL("image/png");
  link.download = name;
  link.click();
}

export function Explorer({ run, at, theme }: { run: Run; at: number; theme: string }) {
  const measured = run.tags.filter((t) => !/\.(err|rate|travel)$/.test(t.name));
  const [tags, setTags] = useState<string[]>(() => (run.panels[0]?.tags ?? measured.slice(0, 1).map((t) => t.name)).slice(0, MOST));
  const [range, setRange] = useState<Range>({ from: Math.max(0, at - 1800), to: at });
  const [mark, setMark] = useState<number | null>(null), [under, setUnder] = useState<number | null>(null), [failed, fail] = useState("");
  const box = useRef<HTMLDivElement>(null), chart = useRef<uPlot | null>(null), held = useRef(range);
  held.current = range;
  const move = (from: number, to: number) => {
    const wide = Math.min(Math.max(LEAST_S, to - from), Math.max(LEAST_S, at)), begin = Math.min(Math.max(0, from), Math.max(0, at - wide));
    setRange({ from: begin, to: begin + wide });
  };
  const zoom = (by: number, around = 0.5) => {
    const { from, to } = held.current, wide = (to - from) * by, centre = from + around * (to - from);
    move(centre - around * wide, centre + (1 - around) * wide);
  };
  const pan = (share: number) => { const { from, to } = held.current, d = share * (to - from); move(from + d, to + d); };
  useEffect(() => {
    if (!tags.length || !box.current) return;
    let gone = false;
    const width = Math.max(240, box.current.clientWidth);
    chart.current?.setScale("x", { min: range.from, max: range.to }); // at once, with what is there; what is seen then follows
    const load = setTimeout(() => void ask<Trend>("/api/trend", { tag: tags, from: range.from, to: range.to, width }).then((told) => {
      if (gone || !box.current) return;
      fail("");
      chart.current?.destroy();
      chart.current = new uPlot({ ...options(run, tags, width, () => held.current),
        hooks: { setCursor: [(u) => setUnder(u.cursor.idx == null ? null : u.data[0][u.cursor.idx] ?? null)],
          draw: [(u) => {
            if (mark === null) return;
            const x = u.valToPos(mark, "x", true);
            u.ctx.strokeStyle = colour("--link");
            u.ctx.beginPath();
            u.ctx.moveTo(x, u.bbox.top);
            u.ctx.lineTo(x, u.bbox.top + u.bbox.height);
            u.ctx.stroke();
          }] } }, [told.times_s, ...told.series.map(([, v]) => v)] as uPlot.AlignedData, box.current);
      readable(chart.current);
    }, (e: Error) => fail(e.message)), 60);
    return () => { gone = true; clearTimeout(load); };
  }, [tags, range, theme, mark]);
  useEffect(() => () => chart.current?.destroy(), []);
  const grip = useRef<Grip | null>(null), hold = useRef(move);
  hold.current = move;
  const gripped = () => (grip.current ??= new Grip(box.current!, () => chart.current, () => held.current, (from, to) => hold.current(from, to), (index) => {
    const at = chart.current?.data[0][index];
    if (at != null) { setUnder(at); setMark(at); }
  }));
  const wheel = (e: WheelEvent) => {
    const u = chart.current;
    if (!u) return;
    e.preventDefault();
    zoom(e.deltaY > 0 ? 1.25 : 0.8, (e.clientX - u.over.getBoundingClientRect().left) / u.over.clientWidth);
  };
  const key = (e: KeyboardEvent) => {
    const act: Record<string, () => void> = { ArrowLeft: () => pan(-0.2), ArrowRight: () => pan(0.2), "+": () => zoom(0.6), "-": () => zoom(1.7) };
    if (act[e.key]) { e.preventDefault(); e.stopPropagation(); act[e.key]!(); }
  };
  const csv = new URLSearchParams([...tags.map((t) => ["tag", t]), ["from", String(range.from)], ["to", String(range.to)]]);
  return (
    <section id="explorer" class="wide" tabIndex={-1} aria-label="Trends of any tags">
      <h2>Trends of any tags <span class="quiet">{moment(range.from)} to {moment(range.to)} ({span(range.to - range.from)})</span></h2>
      <p class="filters"><label>Add a tag <select value="" disabled={tags.length >= MOST} onChange={(e) => e.currentTarget.value && setTags([...tags, e.currentTarget.value])}>
        <option value="">{tags.length >= MOST ? `${MOST} at most` : "choose"}</option>{measured.filter((t) => !tags.includes(t.name)).map((t) => <option key={t.name} value={t.name}>{t.name}: {t.text}</option>)}</select></label>
        {tags.map((t) => <button type="button" key={t} onClick={() => setTags(tags.filter((x) => x !== t))} aria-label={`Take ${t} away`}>{t} ✕</button>)}</p>
      <p class="choice">{([["10 min", 600], ["1 h", 3600], ["8 h", 28800], ["all", 1e9]] as [string, number][]).map(([name, s]) => <button type="button" key={name} onClick={() => move(at - s, at)}>{name}</button>)}
        <button type="button" onClick={() => pan(-0.5)} aria-label="Back">←</button><button type="button" onClick={() => pan(0.5)} aria-label="On">→</button>
        <button type="button" onClick={() => zoom(0.5)} aria-label="Zoom in">+</button><button type="button" onClick={() => zoom(2)} aria-label="Zoom out">−</button>
        {!isKept() && <a class="button" href={`/api/readings.csv?${csv}`} download="readings.csv">Export (CSV)</a>}
        <button type="button" onClick={() => chart.current && picture(chart.current, "trend.png")}>Picture (PNG)</button></p>
      {failed && <p class="warn" role="alert">△ {failed}</p>}
      <div ref={box} class="plot" tabIndex={0} role="application" aria-label="Trend: arrows pan, plus and minus zoom" onWheel={wheel}
        onPointerDown={(e) => gripped().down(e)} onPointerMove={(e) => gripped().over(e)} onPointerUp={(e) => gripped().up(e)} onPointerCancel={(e) => gripped().lost(e)} onKeyDown={key} />
      <p class="quiet" role="status">{mark === null ? "A click, or a short touch, sets a mark to measure from." : <>Mark at {moment(mark)}{under !== null && `; ${span(Math.abs(under - mark))} ${under >= mark ? "after" : "before"} it`} <button type="button" onClick={() => setMark(null)}>Take the mark away</button></>}</p>
    </section>
  );
}
