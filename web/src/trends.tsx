// Trends: readings over time with what is usual and the limits, up to the moment that is looked at and not beyond.

import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import { readable } from "./grip";
import { ask, type FeatureTrend, type Panel, type Run, type Trend } from "./told";

// As many as there may be lines on one chart: no two of them are told apart by colour alone.
export const DASHES = [[], [6, 4], [2, 3], [8, 3, 2, 3], [14, 3, 2, 3, 2, 3]];

// Legends show each line as it is drawn.
export function legend(strokes: string[]): uPlot.Legend {
  return { live: true, markers: { width: 0, fill: (_u, k) => (k ? drawn(strokes[(k - 1) % strokes.length]!, DASHES[(k - 1) % DASHES.length]!) : "none") } };
}

function drawn(stroke: string, dash: number[]): string {
  let at = 0;
  const stops = dash.map((wide, k) => { const from = at; at += wide; return `${k % 2 ? "transparent" : stroke} ${from}px ${at}px`; });
  return dash.length ? `repeating-linear-gradient(90deg, ${stops.join(", ")})` : stroke;
}

export function colour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

interface Band { low: number; high: number; name: string; value?: boolean }

function plot(
  box: HTMLElement, names: string[], data: uPlot.AlignedData, unit: string, bands: Band[], limits: number[], height: number,
): uPlot {
  const ink = colour("--ink"), faint = colour("--faint"), quiet = colour("--quiet"), hard = colour("--hard"), usual = colour("--usual");
  const axis = { stroke: quiet, grid: { stroke: faint, width: 1 }, ticks: { stroke: faint, width: 1 }, font: "12px system-ui, sans-serif" };
  const strokes = [ink, colour("--line2"), colour("--line3"), quiet];
  return new uPlot({
    width: Math.max(200, box.clientWidth), height,
    cursor: { sync: { key: "trends" }, drag: { x: false, y: false } },
    legend: legend(strokes),
    scales: {
      x: { time: false },
      y: { range: (_u, min, max) => {
        const ends = [...limits.filter((l) => min !== null && l > min - 1.5 * (max - min || 1) && l < max + 1.5 * (max - min || 1)), min ?? 0, max ?? 1];
        const low = Math.min(...ends), high = Math.max(...ends), spare = 0.08 * (high - low || 1);
        return [low - spare, high + spare];
      } },
    },
    axes: [{ ...axis, size: 34, values: (_u, at) => at.map((s) => `${s} s`) }, { ...axis, size: 62 }],
    series: [
      { label: "Time", value: (_u, s) => (s === null || s === undefined ? "–" : `${s.toFixed(0)} s`) },
      ...names.map((label, k) => ({
        label, stroke: strokes[k % 4]!, width: k ? 1.4 : 1.8, dash: DASHES[k % 4]!, spanGaps: false, points: { show: false },
        value: (_u: uPlot, v: number | null) => (v === null || v === undefined ? "–" : `${Number(v.toPrecision(4))}${unit === "1" ? "" : ` ${unit}`}`),
      })),
    ],
    hooks: {
      drawClear: [(u) => {
        for (const b of bands) {
          const top = u.valToPos(b.high, "y", true), bottom = u.valToPos(b.low, "y", true);
          const from = Math.max(top, u.bbox.top), to = Math.min(bottom, u.bbox.top + u.bbox.height);
          u.ctx.fillStyle = usual;
          if (to > from) u.ctx.fillRect(u.bbox.left, from, u.bbox.width, to - from);
        }
      }],
      draw: [(u) => {
        u.ctx.strokeStyle = u.ctx.fillStyle = hard;
        u.ctx.lineWidth = devicePixelRatio;
        u.ctx.textAlign = "left";
        u.ctx.textBaseline = "bottom";
        u.ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
        for (const l of limits) {
          const y = u.valToPos(l, "y", true);
          if (y < u.bbox.top || y > u.bbox.top + u.bbox.height) continue;
          u.ctx.beginPath();
          u.ctx.setLineDash([10, 4]);
          u.ctx.moveTo(u.bbox.left, y);
          u.ctx.lineTo(u.bbox.left + u.bbox.width, y);
          u.ctx.stroke();
          u.ctx.fillText(`limit ${l}`, u.bbox.left + 6 * devicePixelRatio, y - 2 * devicePixelRatio);
        }
        u.ctx.setLineDash([]);
      }],
    },
  }, data, box);
}

// One chart that is made again when what it shows is another thing, and only fed where it is the same at a later time.
function useChart(
  load: (width: number) => Promise<{ data: uPlot.AlignedData; make: (box: HTMLElement, data: uPlot.AlignedData) => uPlot }>,
  thing: string, moment: number,
) {
  const box = useRef<HTMLDivElement>(null), chart = useRef<uPlot | null>(null);
  const made = useRef(""), busy = useRef(false), next = useRef<(() => void) | null>(null);
  useEffect(() => {
    const draw = async () => {
      if (!box.current) return;
      if (busy.current) { next.current = draw; return; }
      busy.current = true;
      try {
        const { data, make } = await load(Math.round(box.current.clientWidth));
        if (box.current) {
          if (chart.current && made.current === thing) chart.current.setData(data);
          else {
            chart.current?.destroy();
            chart.current = make(box.current, data);
            readable(chart.current);
            made.current = thing;
          }
        }
        // Where nobody points at it, the legend has the latest values.
        const shown = chart.current;
        requestAnimationFrame(() => {
          if (data[0].length && shown && shown === chart.current && (shown.cursor.left ?? -1) < 0) shown.setLegend({ idx: data[0].length - 1 });
        });
      } catch { /* the page says above that the connection is lost */ }
      busy.current = false;
      const again = next.current;
      next.current = null;
      again?.();
    };
    void draw();
  }, [thing, moment]);
  useEffect(() => {
    const fit = () => chart.current?.setSize({ width: Math.max(200, box.current!.clientWidth), height: chart.current.height });
    addEventListener("resize", fit);
    return () => { removeEventListener("resize", fit); chart.current?.destroy(); chart.current = null; };
  }, []);
  return box;
}

function aligned(trend: Trend): uPlot.AlignedData {
  return [trend.times_s, ...trend.series.map(([, values]) => values)] as uPlot.AlignedData;
}

export function TrendChart({ run, panel, at, back, theme }: { run: Run; panel: Panel; at: number; back: number; theme: string }) {
  const tags = panel.tags.map((n) => run.tags.find((t) => t.name === n)).filter((t) => t !== undefined);
  const limits = [...new Set(tags.flatMap((t) => t.limits.map((l) => l.value)))];
  const first = tags.find((t) => t.role === "PV" && t.usual);
  const bands = first?.usual ? [{ low: first.usual[0], high: first.usual[1], name: "usual" }] : [];
  const to = Math.round(at);
  const box = useChart(async (width) => ({
    data: aligned(await ask<Trend>("/api/trend", { tag: panel.tags, from: Math.max(0, to - back), to, width })),
    make: (into, data) => plot(into, panel.tags, data, panel.unit, bands, limits, 190),
  }), `${panel.title} ${theme}`, to * 1e7 + back);
  return <figure class="trend"><figcaption>{panel.title} {panel.unit !== "1" && <span class="quiet">[{panel.unit}]</span>}</figcaption><div ref={box} /></figure>;
}

export function FeatureChart({ name, at, since }: { name: string; at: number; since: number }) {
  const to = Math.round(at), theme = document.documentElement.dataset.theme ?? "";
  const from = Math.max(0, since - 600);
  const box = useChart(async (width) => {
    const told = await ask<FeatureTrend>("/api/feature", { name, from, to: Math.max(from + 60, to), width });
    const bands = [{ low: told.band[0], high: told.band[1], name: "healthy" }];
    return { data: aligned(told.trend), make: (into: HTMLElement, data: uPlot.AlignedData) => plot(into, [name], data, told.unit, bands, [], 150) };
  }, `${name} ${from} ${theme}`, to);
  return <figure class="trend"><div ref={box} /><figcaption class="quiet">Grey: 98 % of the values of healthy plants</figcaption></figure>;
}
