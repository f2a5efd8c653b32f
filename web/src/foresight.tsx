// What the twin foresees: time to the first limit, and between what every limited tag stays, with the proposal and without.

import { useEffect, useState } from "preact/hooks";
import { ask, type Card, type Foreseen, type Margin, type Run, type Tag, type Trend } from "./told";
import { amount, distance, moment, percent, span } from "./words";

// What was foreseen before something was done is not what is to come: it says what was averted.
export function TimeLeft({ card, at }: { card: Card; at: number }) {
  const f = card.foresight, told = f?.told;
  if (!f || !told || card.over_s !== null) return null;
  const done = Math.max(card.acted[0]?.at_s ?? -Infinity, card.released_s ?? -Infinity);
  const more = done > -Infinity ? "nothing more is done" : "nothing is done";
  if (!told.members) return <p>△ What follows if {more} is not known: {told.note}</p>;
  const first = told.first, past = done >= told.from_s - 1;
  const who = first && (first.members === told.members ? `all ${told.members} members` : `${first.members} of ${told.members} members, ${percent(first.probability)} probable`);
  const times = first && `from ${moment(told.from_s + first.earliest_s)} to ${moment(told.from_s + first.latest_s)}`;
  if (past) return <p>The twin has not looked ahead since {card.acted[0] && card.acted[0].at_s === done ? "the fallback acted" : "the release"}. Before it, {first ? `a hard limit was foreseen ${times} (${who}): ${f.limit}` : "no hard limit was foreseen to be reached"}.</p>;
  const healthy = card.explanations.length === 0 && <>△ No cause is known, so the twin takes the plant for healthy. </>;
  if (!first) return <p>{healthy}If {more}, no hard limit is reached within {span(told.length_s)} in any of {told.members} members (foreseen at {moment(told.from_s)}).</p>;
  const left = (s: number) => told.from_s + s - at;
  if (left(first.latest_s) < 0) return <p>{healthy}If {more}, the first hard limit was foreseen {times} ({who}): {f.limit}.</p>;
  return <p>{healthy}If {more}, the first hard limit is reached in <b>{span(left(first.earliest_s))} to {span(left(first.latest_s))}</b>, in half of them within {span(left(first.middle_s))} ({who}): {f.limit}.</p>;
}

const WIDE = 320, HIGH = 120, LEFT = 46, RIGHT = 6, TOP = 8, BOTTOM = 18;

interface Drawing { x: (s: number) => number; y: (v: number) => number; low: number; high: number }

function outline(told: Foreseen, low: number[], high: number[], d: Drawing): string {
  const begins = [0, ...told.ends_s.slice(0, -1)];
  const up = high.flatMap((v, k) => [`${d.x(begins[k]!)},${d.y(v)}`, `${d.x(told.ends_s[k]!)},${d.y(v)}`]);
  const down = low.flatMap((v, k) => [`${d.x(begins[k]!)},${d.y(v)}`, `${d.x(told.ends_s[k]!)},${d.y(v)}`]).reverse();
  return [...up, ...down].join(" ");
}

// Limits that are far from everything are said in the table and not drawn: the band would be a line.
function drawing(tag: Tag, length: number, values: number[]): Drawing {
  const least = Math.min(...values), most = Math.max(...values), wide = most - least || Math.abs(most) * 0.01 || 1;
  const near = tag.limits.map((l) => l.value).filter((v) => v > least - 2 * wide && v < most + 2 * wide);
  const low = Math.min(least, ...near) - 0.08 * wide, high = Math.max(most, ...near) + 0.08 * wide;
  return { low, high, x: (s) => +(LEFT + (s / length) * (WIDE - LEFT - RIGHT)).toFixed(1), y: (v) => +(TOP + ((high - v) / (high - low)) * (HIGH - TOP - BOTTOM)).toFixed(1) };
}

function useReadings(run: Run, tag: string, from: number, to: number): Trend | null {
  const [told, tell] = useState<Trend | null>(null), until = Math.round(to);
  useEffect(() => {
    if (!run.measured || until <= from) { tell(null); return; }
    let gone = false;
    ask<Trend>("/api/trend", { tag: [tag], from, to: until, width: 120 }).then((t) => { if (!gone) tell(t); }, () => {});
    return () => { gone = true; };
  }, [tag, from, until, run.measured]);
  return told;
}

export interface Shown { mine?: Foreseen; other?: Foreseen; margins: Margin[]; released: boolean; at: number }

function TagBand({ run, tag, shown }: { run: Run; tag: Tag; shown: Shown }) {
  const { mine, other, released, at } = shown, main = (mine ?? other)!;
  const bandOf = (told?: Foreseen) => told?.bands.find((b) => b.tag === tag.name);
  const a = bandOf(mine), b = bandOf(other);
  const read = useReadings(run, tag.name, main.from_s, mine && !released ? main.from_s : Math.min(at, main.from_s + main.length_s));
  const line = read ? read.times_s.map((s, k) => [s - main.from_s, read.series[0]?.[1][k] ?? null] as const).filter((q): q is readonly [number, number] => q[1] !== null) : [];
  const d = drawing(tag, main.length_s, [...(a ? [...a.low, ...a.high] : []), ...(b ? [...b.low, ...b.high] : []), ...line.map((q) => q[1])]);
  const limits = tag.limits.filter((l) => l.value > d.low && l.value < d.high);
  const worst = shown.margins.filter((m) => tag.limits.some((l) => l.name === m.name))[0];
  const said = `${tag.name}: ${a ? `with the proposal from ${amount(Math.min(...a.low), tag.unit)} to ${amount(Math.max(...a.high), tag.unit)}` : ""}${a && b ? ", " : ""}${b ? `if nothing is done from ${amount(Math.min(...b.low), tag.unit)} to ${amount(Math.max(...b.high), tag.unit)}` : ""}`;
  return (
    <figure class="band">
      <figcaption>{tag.name} <span class="quiet">{tag.text}{tag.unit !== "1" && ` [${tag.unit}]`}</span></figcaption>
      <svg viewBox={`0 0 ${WIDE} ${HIGH}`} role="img" aria-label={said}>
        {b && other && <polygon class="without" points={outline(other, b.low, b.high, d)} />}
        {a && mine && <polygon class="with" points={outline(mine, a.low, a.high, d)} />}
        {limits.map((l) => <g key={l.name + l.value}><line class="bound" x1={LEFT} x2={WIDE - RIGHT} y1={d.y(l.value)} y2={d.y(l.value)} />
          <text x={WIDE - RIGHT} y={d.y(l.value) - 3} text-anchor="end">{l.upper ? "below" : "above"} {l.value}{l.hard ? "" : " (has a price)"}</text></g>)}
        {line.length > 1 && <polyline class="read" points={line.map(([s, v]) => `${d.x(s)},${d.y(v)}`).join(" ")} />}
        <text x={LEFT - 4} y={TOP + 8} text-anchor="end">{amount(d.high, "", 4)}</text>
        <text x={LEFT - 4} y={HIGH - BOTTOM} text-anchor="end">{amount(d.low, "", 4)}</text>
        <text x={LEFT} y={HIGH - 5}>0 s</text><text x={WIDE - RIGHT} y={HIGH - 5} text-anchor="end">{span(main.length_s)}</text>
      </svg>
      {worst && <p class="small">{worst.margin < 0 ? "■ " : ""}Worst {distance(worst.margin, worst.unit, worst.term)} after {span(worst.at_s)}, member {worst.member} <span class="quiet">({worst.name})</span></p>}
    </figure>
  );
}

export function Bands({ run, shown }: { run: Run; shown: Shown }) {
  const { mine, other } = shown, told = mine?.members ? mine : other;
  if (!told?.members) return null;
  const known = new Set(told.bands.map((b) => b.tag));
  const tags = run.tags.filter((t) => t.limits.length > 0 && known.has(t.name));
  if (!tags.length) return null;
  return (
    <div class="part wide"><h2>What is foreseen <span class="quiet">from {moment(told.from_s)} on, {told.members} members of the twin</span></h2>
      <div class="bands">{tags.map((t) => <TagBand key={t.name} run={run} tag={t} shown={shown} />)}</div>
      <p class="legend">{mine && <><span class="key with" /> {shown.released ? "with what was released" : "with these commands"}  </>}<span class="key without" /> if nothing is done  <span class="key limit" /> limit  {shown.released && "line: readings since"}</p>
      <p class="quiet">Between what all members stay; true values as the twin has them, which a wrong instrument does not show.</p></div>
  );
}

export function shownOf(card: Card, at: number): Shown {
  const p = card.proposal, mine = p?.foresight?.told;
  return { mine, other: (mine ? p?.beside : card.foresight)?.told, margins: p?.margins ?? card.let_be?.margins ?? [], released: p?.released_s != null, at };
}
