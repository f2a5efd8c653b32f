// The plant: its flowsheet with readings, and analogue indicators with what is usual and what is the limit.

import type { Box, Moment, Run, Sheet, Tag } from "./told";
import { reading, span } from "./words";

type Sign = "" | "unusual" | "violated" | "poor";

// A limit may hold in one of several ways: only the server knows whether it is violated.
function violated(tag: Tag, value: number, now: Moment): boolean {
  return tag.limits.some((l) => now.violated.includes(l.name) && (l.upper ? value > l.value : value < l.value));
}

function sign(tag: Tag, now: Moment): Sign {
  const value = now.values[tag.name];
  if (now.quality[tag.name]) return "poor";
  if (value === null || value === undefined) return "";
  if (violated(tag, value, now)) return "violated";
  if (!tag.usual || tag.role === "SP") return "";
  const spare = Math.max(0.5 * (tag.usual[1] - tag.usual[0]), 1e-3 * (tag.high - tag.low));
  return value < tag.usual[0] - spare || value > tag.usual[1] + spare ? "unusual" : "";
}

const MARKS: Record<Sign, string> = { "": "", unusual: "◇", violated: "■", poor: "?" };

function age(tag: Tag, now: Moment): string {
  const old = now.at_s - now.sampled_s;
  return tag.stale_s !== null && old > tag.stale_s ? `, ${span(old)} old` : "";
}

export function Indicators({ run, now }: { run: Run; now: Moment }) {
  const shown = run.tags.filter((t) => t.role === "PV" && !/\.(err|rate|travel)$/.test(t.name));
  const out = new Map(now.overview.out_of_service), doubts = doubted(run, now);
  return (
    <ul class="indicators">{shown.map((t) => <Indicator key={t.name} tag={t} now={now} out={out.get(t.name)} doubt={doubts.get(t.name)} />)}</ul>
  );
}

function Indicator({ tag, now, out, doubt }: { tag: Tag; now: Moment; out: string | undefined; doubt: string | undefined }) {
  const value = now.values[tag.name], wrong = sign(tag, now), quality = now.quality[tag.name];
  const ends = [...tag.limits.map((l) => l.value), ...(tag.usual ?? []), ...(typeof value === "number" ? [value] : [])];
  const around = tag.usual ? 2.5 * (tag.usual[1] - tag.usual[0]) : 0;
  const low = Math.max(tag.low, Math.min(...ends, tag.high) - around), high = Math.min(tag.high, Math.max(...ends, tag.low) + around);
  const wide = high - low || 1, at = (x: number) => 4 + (192 * (Math.min(Math.max(x, low), high) - low)) / wide;
  const setpoint = now.values[`${tag.name}.sp`];
  return (
    <li class={`indicator ${wrong}`} title={tag.text}>
      <span class="name">{tag.name}</span>
      <svg viewBox="0 0 200 22" role="img" aria-label={`${tag.name} ${reading(value, tag)}`}>
        <rect x="4" y="8" width="192" height="6" class="track" />
        {tag.usual && <rect x={at(tag.usual[0])} y="6" width={Math.max(2, at(tag.usual[1]) - at(tag.usual[0]))} height="10" class="usual" />}
        {tag.limits.map((l) => <g key={`${l.name}${l.value}`} class={l.hard ? "limit hard" : "limit"}><title>{l.text}</title>
          <rect x={l.upper ? at(l.value) : 4} y="8" width={Math.max(0, l.upper ? 196 - at(l.value) : at(l.value) - 4)} height="6" class="beyond" />
          <rect x={at(l.value) - 1} y="3" width="2" height="16" class="tick" /></g>)}
        {typeof setpoint === "number" && <path d={`M${at(setpoint)} 15l4 6h-8z`} class="setpoint"><title>setpoint</title></path>}
        {typeof value === "number" && <path d={`M${at(value)} 7l-5 -7h10z M${at(value) - 0.75} 6h1.5v10h-1.5z`} class="pointer" />}
      </svg>
      <span class="value">{MARKS[wrong] && <span class="mark">{MARKS[wrong]} </span>}{reading(value, tag)}</span>
      {(quality || out !== undefined || age(tag, now)) && (
        <span class="poor">{quality ? `${quality[0]}: ${quality[1]}` : ""}{out !== undefined ? " out of service" : ""}{age(tag, now)}</span>)}
      {doubt !== undefined && <span class="poor">▲ not to be trusted: {doubt}</span>}
    </li>
  );
}

function way(points: [number, number][]): string {
  let said = `M${points[0]![0]} ${points[0]![1]}`;
  for (let k = 1; k < points.length; k++) {
    const [x, y] = points[k - 1]!, [u, v] = points[k]!;
    said += k % 2 === 1 ? `L${u} ${v}` : `C${(x + u) / 2} ${y} ${(x + u) / 2} ${v} ${u} ${v}`;
  }
  return said;
}

// Component that may be faulty -> what may be wrong with it.
function suspected(now: Moment): Map<string, string> {
  const found = new Map<string, string>();
  for (const e of now.card && now.card.over_s === null ? now.card.explanations : []) {
    if (e.probability >= 0.2) for (const c of e.component.split(", ")) if (c) found.set(c, e.text);
  }
  return found;
}

// Tag whose instrument may be faulty -> what may be wrong with it: its reading is not what the plant does.
function doubted(run: Run, now: Moment): Map<string, string> {
  const suspects = suspected(now);
  const lines = run.sheet?.boxes.flatMap((b) => b.lines) ?? [];
  return new Map(lines.flatMap((l) => (l.tag && suspects.has(l.bubble) ? [[l.tag, suspects.get(l.bubble)!] as [string, string]] : [])));
}

export function Flowsheet({ run, sheet, now }: { run: Run; sheet: Sheet; now: Moment }) {
  const suspects = suspected(now);
  const tags = new Map(run.tags.map((t) => [t.name, t]));
  const kinds = [...new Set(sheet.arrows.map((a) => a.kind))];
  return (
    <div class="scroll" tabIndex={0} role="region" aria-label="Flowsheet">
      <svg class="flowsheet" viewBox={`-10 -10 ${sheet.width + 20} ${sheet.height + 20}`} role="img" aria-label={`Flowsheet of ${run.title}`}>
        <defs>{kinds.map((k) => <marker key={k} id={`head-${k}`} viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8"
          markerUnits="userSpaceOnUse" orient="auto"><path d="M0 0L8 4L0 8Z" class={`head ${k}`} /></marker>)}</defs>
        {sheet.arrows.map((a, k) => <path key={k} d={way(a.points)} class={`arrow ${a.kind}`} marker-end={`url(#head-${a.kind})`}><title>{a.tip}</title></path>)}
        {sheet.boxes.map((b, k) => <Shape key={k} box={b} tags={tags} now={now} suspects={suspects} />)}
      </svg>
    </div>
  );
}

function Shape({ box, tags, now, suspects }: { box: Box; tags: Map<string, Tag>; now: Moment; suspects: Map<string, string> }) {
  return (
    <g class={`shape ${box.kind}`}>
      <title>{box.tip}</title>
      <rect x={box.x} y={box.y} width={box.width} height={box.height} rx={/operator|control/.test(box.kind) ? 0 : 8} class="box" />
      {box.lines.map((line, k) => {
        const y = box.y + 19 + 17 * k, tag = tags.get(line.tag), wrong = tag ? sign(tag, now) : "";
        const suspect = suspects.get(line.bubble) ?? suspects.get(line.text);
        const bubble = `${suspect ? "▲ " : ""}${line.bubble}`, inside = line.bubble ? 8 * bubble.length + 12 : 0;
        return (
          <g key={k} class={wrong}>
            {line.bubble && <rect x={box.x + 9} y={y - 12} width={inside} height={15} rx={7.5} class={suspect ? "bubble suspect" : "bubble"}>
              {suspect && <title>{suspect}</title>}</rect>}
            {line.bubble && <text x={box.x + 9 + inside / 2} y={y} text-anchor="middle">{bubble}</text>}
            <text x={box.x + 9 + (inside ? inside + 5 : 0)} y={y} class={line.title ? "title" : ""}>{line.text}</text>
            {tag && <text x={box.x + box.width - 9} y={y} text-anchor="end" class="reading">{MARKS[wrong]} {reading(now.values[tag.name], tag)}</text>}
          </g>);
      })}
    </g>
  );
}
