// What the server tells, as it tells it. Every text is data: it becomes text of the page and never markup.

import { isKept, kept } from "./kept";

export interface Limit { name: string; text: string; value: number; upper: boolean; hard: boolean }
export interface Tag {
  name: string; text: string; role: string; unit: string; low: number; high: number;
  usual: [number, number] | null; stale_s: number | null; limits: Limit[];
}
export interface SheetLine { text: string; bubble: string; title: boolean; tag: string }
export interface Box {
  x: number; y: number; width: number; height: number; kind: string; icon: string; tip: string; lines: SheetLine[];
}
export interface Arrow { points: [number, number][]; kind: string; tip: string }
export interface Sheet { width: number; height: number; boxes: Box[]; arrows: Arrow[] }
export interface Panel { title: string; unit: string; tags: string[] }
export interface Line { at_s: number; label: string; text: string; tone: string }
export interface Run {
  title: string; notice: string; live: boolean; closed: boolean; attached: boolean; measured: boolean; last_s: number;
  begins_s: number | null; decided_s: number | null; tags: Tag[]; panels: Panel[]; sheet: Sheet | null; lines: Line[];
  beside: boolean; model: string; altered: string;
}

export interface Raised { alarm: string; cause: string; priority: string; since_s: number; acknowledged: boolean }
export interface TimeLeft { until: string; from_s: number | null; to_s: number | null; title: string; text: string }
export interface Overview {
  mode: string; requested: string; shed: string; state: string; level: string; alarm: string; alarm_s: number | null;
  folded: Raised[]; left: TimeLeft; fallback: string; waiting: string; latched: string;
  out_of_service: [string, string][]; shelved: number; finished: string; offers: Offer[];
}
export interface Offer { request: string; digest: string; proposer: string; since_s: number; void_s: number }
export interface Symptom {
  rule: string; text: string; at_s: number | null; value: number | null; times: number | null;
  threshold: number | null; unit: string; feature: string;
}
export interface Explanation {
  name: string; text: string; size: string; probability: number; component: string; supports: string[]; lacks: string[];
  others: string[];
}
export interface Move {
  tag: string; text: string; unit: string; before: number | null; known: boolean; after: number | null;
  rate: number | null;
}
export interface Later { guard: string; state: string; moves: Move[] }
export interface Margin {
  name: string; text: string; formula: string; margin: number; unit: string; at_s: number; member: number;
  scaled: number; hard: boolean; term: string; full: boolean; near: boolean;
  actual: number | null; actual_unit: string; actual_term: string; actual_at_s: number | null;
}
export interface Certificate { draws: number; violations: number; bound: number; level: number; beside: boolean }
export interface Reached { limit: string; members: number; probability: number; earliest_s: number; middle_s: number; latest_s: number }
export interface Foreseen {
  digest: string; from_s: number; length_s: number; members: number; ends_s: number[];
  bands: { tag: string; low: number[]; high: number[] }[]; first: Reached | null; reached: Reached[]; note: string;
}
export interface Foresight { told: Foreseen; limit: string }
export interface Setpoint { tag: string; text: string; unit: string; low: number; high: number; design: number | null; now: number | null }
export interface Option { state: string; label: string; setpoints: Setpoint[] }
export interface Tried {
  at_s: number; state: string; moves: Move[]; approved: boolean; objections: string[]; margins: Margin[]; foresight: Foresight; beside: Foresight;
  cost: number | null; cost_alone: number | null; currency: string; assumed: [string, number][]; learnt_s: number;
}
export interface Proposal {
  what: string; digest: string; proposer: string; at_s: number; stands: string; status: string; since_s: number; released_s: number | null;
  seconds: number; path: string[]; moves: Move[]; later: Later[]; reasons: string[]; approved: boolean;
  members: number; margins: Margin[]; checks: number; certificate: Certificate | null;
  foresight: Foresight | null; beside: Foresight | null;
}
export interface LetBe { at_s: number; state: string; margin: number | null; members: number; margins: Margin[]; checks: number }
export interface Choice {
  what: string; kind: string; by: string; cost: number | null; items: [string, number][]; refused: string; chosen: boolean;
  certificate: Certificate | null;
}
export interface Refusal { at_s: number; what: string; why: string }
export interface Acted { at_s: number; strategy: string; reason: string; moves: Move[]; stands: boolean }
export interface Card {
  since_s: number; over_s: number | null; headline: string; probability: number | null; diagnosed_s: number | null;
  seen: Symptom[]; explanations: Explanation[]; apart: string; alone: string; foresight: Foresight | null; let_be: LetBe | null; proposal: Proposal | null; fallen: Proposal | null; released_s: number | null; currency: string;
  compared_s: number | null; choices: Choice[]; refused: Refusal[]; acted: Acted[]; notes: string[];
}
export interface Moment {
  at_s: number; sampled_s: number; values: Record<string, number | null>;
  quality: Record<string, [string, string]>; targets: Record<string, number | null>; violated: string[];
  fresh: Fresh | null; overview: Overview; whole: boolean; card: Card | null; told: { heading: string; text: string }[]; pace?: Pace | null;
}
export interface Pace { speed: number; paused: boolean; stands: boolean }
export interface Fresh { age_s: number | null; old: boolean; trouble: string; thinking: string }
export interface Trend { times_s: number[]; series: [string, (number | null)[]][] }
export interface FeatureTrend { trend: Trend; unit: string; band: [number, number] }

export interface ListedAlarm {
  alarm: string; cause: string; priority: string; state: string; raised_s: number; returned_s: number | null;
  acknowledged_s: number | null; acknowledged_by: string; shelved_by: string; shelved_until_s: number | null;
  shelved_why: string; first: boolean; times: number;
}
export interface AlarmList { standing: ListedAlarm[]; shelved: ListedAlarm[]; past: ListedAlarm[]; over: number; within: number; flood: boolean }
export interface JournalLine { number: number; at_s: number; kind: string; text: string }
export interface JournalPage { lines: JournalLine[]; kinds: string[]; more: boolean; trouble: string }
export interface Verified { whole: boolean; closed: boolean; signed: number; lines: number; text: string }
export interface Me { people: boolean; codes: boolean; sign_on: string | null; by_sign_on: boolean; orders: boolean; name: string | null; access: "viewer" | "operator" | "engineer" | null; token: string | null }
export interface Retold { text: string; model: string; strange: string[] }
export interface Came { done: boolean; reason: string; counts: boolean }

// What the server does not do, with its number: 401 where somebody must sign in, 0 where nothing came back.
export class Refused extends Error {
  constructor(text: string, readonly status: number, readonly unknown = false) { super(text); }
}

// Whoever asks, and whatever for: that the session is over is heard here.
let over = () => {};
export function whenSignedOut(then: () => void): void { over = then; }

async function answered<T>(path: string, init?: RequestInit): Promise<T> {
  let answer: Response, content: { error?: string; unknown?: boolean };
  try {
    answer = await fetch(path, init);
    content = await answer.json();
  } catch {
    throw new Refused("no answer came", 0, true);
  }
  if (answer.status === 401) over();
  if (!answer.ok) throw new Refused(content.error ?? answer.statusText, answer.status, content.unknown ?? false);
  return content as T;
}

export async function send<T>(method: "POST" | "DELETE", path: string, content: object, token: string | null, longest_ms = 90_000): Promise<T> {
  const headers: Record<string, string> = { "Content-Type": "application/json" };
  if (token) headers["X-Homeostat-Token"] = token;
  return answered<T>(path, { method, headers, body: JSON.stringify(content), signal: AbortSignal.timeout(longest_ms) });
}

// A connection that is dead and never says so would be waited for as long as the page is open.
export async function ask<T>(path: string, query: Record<string, string | number | string[]> = {}, longest_ms = 30_000): Promise<T> {
  if (isKept()) return kept(path, query) as T;
  const words = new URLSearchParams();
  for (const [name, value] of Object.entries(query)) {
    for (const each of Array.isArray(value) ? value : [value]) words.append(name, String(each));
  }
  return answered<T>(`${path}?${words}`, { signal: AbortSignal.timeout(longest_ms) });
}
