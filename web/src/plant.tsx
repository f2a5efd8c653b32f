// The plant: its flowsheet with readings, and analogue indicators with what is usual and what is the limit.

import { useMemo, useRef, useState } from "preact/hooks";
import { Behind } from "./behind";
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
    <li class={`indicator ${wrong}`}>
      <Behind word={tag.name} about={tag.text}>{[tag.text, ...tag.limits.map((l) => l.text)].join("\n")}</Behind>
      <svg viewBox="0 0 200 22" role="img" aria-label={`${tag.name} ${reading(value, tag)}`}>
        <rect x="4" y="8" width="192" height="6" class="track" />
        {tag.usual && <rect x={at(tag.usual[0])} y="6" width={Math.max(2, at(tag.usual[1]) - at(tag.usual[0]))} height="10" class="usual" />}
        {tag.limits.map((l) => <g key={`${l.name}${l.value}`} class={l.hard ? "limit hard" : "limit"}><title>{l.text}</title>
          <rect x={l.upper ? at(l.value) : 4} y="8" width={Math.max(0, l.upper ? 196 - at(l.value) : at(l.value) - 4)} height="6" class="beyond" />
          <rect x={at(l.value) - (l.hard ? 2 : 0.75)} y={l.hard ? 1 : 4} width={l.hard ? 4 : 1.5} height={l.hard ? 20 : 14} class="tick" /></g>)}
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

// Boxes as they are read, from left to right, then what flows between them.
function parts(sheet: Sheet): string[] {
  const boxes = sheet.boxes.map((_, k) => k).sort((a, b) => sheet.boxes[a]!.x - sheet.boxes[b]!.x || sheet.boxes[a]!.y - sheet.boxes[b]!.y);
  return [...boxes.map((k) => `b${k}`), ...sheet.arrows.map((_, k) => `a${k}`)];
}

interface Told { id: string; x: number; y: number; above: boolean }
type On<E extends Event> = (e: E & { currentTarget: SVGGElement }) => void;
interface Handlers {
  id: string; tabindex: number; role: "button"; "aria-expanded": boolean; onFocus: On<FocusEvent>; onBlur: () => void;
  onClick: On<MouseEvent>; onKeyDown: On<KeyboardEvent>; onPointerEnter: On<PointerEvent>; onPointerLeave: On<PointerEvent>;
}

// What each part is, told beside it: by pointing, touching, or from the keyboard, where the whole sheet is one stop and arrows go on from part to part.
function useTips(sheet: Sheet): [Told | null, (id: string) => Handlers, preact.RefObject<HTMLDivElement | null>] {
  const around = useRef<HTMLDivElement>(null), order = useMemo(() => parts(sheet), [sheet]);
  const [told, tell] = useState<Told | null>(null), [stop, stopAt] = useState("");
  const show = (id: string, on: Element) => {
    const outer = around.current!.getBoundingClientRect(), inner = on.getBoundingClientRect(), most = around.current!.scrollWidth;
    const above = inner.top + inner.height / 2 > outer.top + outer.height / 2;
    const left = inner.left + inner.width / 2 - outer.left + around.current!.scrollLeft;
    tell({ id, x: Math.min(Math.max(left, 130), Math.max(most - 130, 130)), y: (above ? inner.top : inner.bottom) - outer.top, above });
  };
  const hide = (id: string) => tell((was) => (was?.id === id ? null : was));
  const go = (e: KeyboardEvent, id: string) => {
    const at = order.indexOf(id), last = order.length - 1;
    const to = { ArrowRight: at + 1, ArrowDown: at + 1, ArrowLeft: at - 1, ArrowUp: at - 1, Home: 0, End: last }[e.key];
    if (e.key === "Escape") tell(null);
    else if (e.key === "Enter" || e.key === " ") { if (told?.id === id) tell(null); else show(id, e.currentTarget as Element); }
    else if (to === undefined) return;
    else document.getElementById(`part-${order[Math.min(Math.max(to, 0), last)]}`)?.focus();
    e.preventDefault();
    e.stopPropagation(); // the same keys move through time elsewhere
  };
  const of = (id: string): Handlers => ({
    id: `part-${id}`, tabindex: id === (stop || order[0]) ? 0 : -1, role: "button", "aria-expanded": told?.id === id,
    onFocus: (e) => { stopAt(id); show(id, e.currentTarget); }, onBlur: () => hide(id), onClick: (e) => show(id, e.currentTarget),
    onKeyDown: (e) => go(e, id), onPointerEnter: (e) => { if (e.pointerType === "mouse") show(id, e.currentTarget); },
    onPointerLeave: (e) => { if (e.pointerType === "mouse" && document.activeElement !== e.currentTarget) hide(id); },
  });
  return [told, of, around];
}

export function Flowsheet({ run, sheet, now }: { run: Run; sheet: Sheet; now: Moment }) {
  const suspects = suspected(now);
  const tags = new Map(run.tags.map((t) => [t.name, t]));
  const kinds = [...new Set(sheet.arrows.map((a) => a.kind))];
  const [told, of, around] = useTips(sheet);
  const tip = told && (told.id[0] === "a" ? sheet.arrows[+told.id.slice(1)]?.tip : boxTip(sheet.boxes[+told.id.slice(1)]!, suspects));
  return (
    <>
      <div class="scroll sheet" ref={around} role="region" aria-label="Flowsheet">
        <svg class="flowsheet" viewBox={`-10 -10 ${sheet.width + 20} ${sheet.height + 20}`} role="group" aria-label={`Flowsheet of ${run.title}`}>
          <defs>{kinds.map((k) => <marker key={k} id={`head-${k}`} viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8"
            markerUnits="userSpaceOnUse" orient="auto"><path d="M0 0L8 4L0 8Z" class={`head ${k}`} /></marker>)}</defs>
          {sheet.arrows.map((a, k) => <g key={k} class="part" aria-label={a.tip} {...of(`a${k}`)}>
            <path d={way(a.points)} class="touched" /><path d={way(a.points)} class={`arrow ${a.kind}`} marker-end={`url(#head-${a.kind})`} /></g>)}
          {sheet.boxes.map((b, k) => <Shape key={k} box={b} tags={tags} now={now} suspects={suspects} part={of(`b${k}`)} />)}
        </svg>
        {told && <p class={told.above ? "tip above" : "tip"} aria-hidden="true" style={{ left: `${told.x}px`, top: `${told.y}px` }}>{tip}</p>}
      </div>
      <p class="legend">What a part is: point at it, touch it, or Tab to the flowsheet and go on with ← →; Esc hides it.</p>
    </>
  );
}

// What a box is, and what may be wrong with what is in it.
function boxTip(box: Box, suspects: Map<string, string>): string {
  const found = new Set(box.lines.flatMap((l) => suspects.get(l.bubble) ?? suspects.get(l.text) ?? []));
  return [box.tip || box.lines.map((l) => l.text).join(" "), ...[...found].map((s) => `▲ ${s}`)].join("\n");
}

function Shape({ box, tags, now, suspects, part }: { box: Box; tags: Map<string, Tag>; now: Moment; suspects: Map<string, string>; part: Handlers }) {
  return (
    <g class={`part shape ${box.kind}`} aria-label={boxTip(box, suspects)} {...part}>
      <rect x={box.x} y={box.y} width={box.width} height={box.height} rx={/operator|control/.test(box.kind) ? 0 : 8} class="box" />
      {box.lines.map((line, k) => {
        const y = box.y + 19 + 17 * k, tag = tags.get(line.tag), wrong = tag ? sign(tag, now) : "";
        const suspect = suspects.get(line.bubble) ?? suspects.get(line.text);
        const bubble = `${suspect ? "▲ " : ""}${line.bubble}`, inside = line.bubble ? 8 * bubble.length + 12 : 0;
        return (
          <g key={k} class={wrong}>
            {line.bubble && <rect x={box.x + 9} y={y - 12} width={inside} height={15} rx={7.5} class={suspect ? "bubble suspect" : "bubble"} />}
            {line.bubble && <text x={box.x + 9 + inside / 2} y={y} text-anchor="middle">{bubble}</text>}
            <text x={box.x + 9 + (inside ? inside + 5 : 0)} y={y} class={line.title ? "title" : ""}>{line.text}</text>
            {tag && <text x={box.x + box.width - 9} y={y} text-anchor="end" class="reading">{MARKS[wrong]} {reading(now.values[tag.name], tag)}</text>}
          </g>);
      })}
    </g>
  );
}
