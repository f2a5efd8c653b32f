// A run that is kept in the page itself: what a server would answer is looked up here.

import type { AlarmList, FeatureTrend, JournalPage, Moment, Run, Trend, Verified } from "./told";

type Parts = { [field: string]: number | Parts };
type At = [at_s: number, card: number | null, overview: number | null, quality: number, targets: number, alarms: number, told: number];
interface Kept {
  run: Run; moments: At[]; pool: unknown[]; violated: [number, string[]][];
  readings: { times_s: number[]; signals: Record<string, (number | null)[]> } | null;
  features: Record<string, FeatureTrend>; journal: JournalPage; verified: Verified; other?: Kept;
}

const PAGE = 200;
let held: Kept | null = null;

export async function load(): Promise<void> {
  const element = document.getElementById("kept");
  if (!element) return;
  const bytes = Uint8Array.from(atob(element.textContent ?? ""), (c) => c.charCodeAt(0));
  held = (await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).json()) as Kept;
}

export const isKept = (): boolean => held !== null;

// Index of the last one that is not after `at`; -1 for none.
function last(count: number, time: (k: number) => number, at: number): number {
  let low = 0, high = count;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (time(middle) <= at) low = middle + 1; else high = middle;
  }
  return low - 1;
}

function whole(parts: Parts, pool: unknown[]): { [field: string]: unknown } {
  return Object.fromEntries(Object.entries(parts).map(([name, v]) => [name, typeof v === "number" ? pool[v] : whole(v, pool)]));
}

function part<T>(index: number | null, pool: unknown[]): T | null {
  return index === null ? null : (whole(pool[index] as Parts, pool) as T);
}

export function momentAt(at: number, k: Kept = held!): Moment {
  const m = k.moments[Math.max(0, last(k.moments.length, (n) => k.moments[n]![0], at))]!, read = k.readings;
  const n = read ? last(read.times_s.length, (i) => read.times_s[i]!, at) : -1, broken = k.violated[last(k.violated.length, (i) => k.violated[i]![0], at)];
  return {
    at_s: at, sampled_s: n < 0 ? at : read!.times_s[n]!, values: n < 0 ? {} : Object.fromEntries(Object.entries(read!.signals).map(([tag, v]) => [tag, v[n] ?? null])),
    quality: k.pool[m[3]] as Moment["quality"], targets: k.pool[m[4]] as Moment["targets"], violated: broken?.[1] ?? [],
    fresh: null, overview: part<Moment["overview"]>(m[2], k.pool)!, whole: true, card: part(m[1], k.pool), told: k.pool[m[6]] as Moment["told"],
  };
}

// First, last, least and largest of each pixel stay (M4), as on the server.
function thinned(trend: Trend, width: number): Trend {
  const count = trend.times_s.length;
  if (count <= 4 * width) return trend;
  const kept = new Set<number>([0, count - 1]);
  for (let p = 0; p < width; p++) {
    const begin = Math.floor((p * count) / width), end = Math.floor(((p + 1) * count) / width);
    kept.add(begin).add(end - 1);
    for (const [, v] of trend.series) {
      let least = -1, most = -1;
      for (let i = begin; i < end; i++) {
        const x = v[i];
        if (x === null || x === undefined) continue;
        if (least < 0 || x < v[least]!) least = i;
        if (most < 0 || x > v[most]!) most = i;
      }
      if (least >= 0) kept.add(least).add(most);
    }
  }
  const order = [...kept].sort((a, b) => a - b);
  return { times_s: order.map((i) => trend.times_s[i]!), series: trend.series.map(([name, v]) => [name, order.map((i) => v[i]!)]) };
}

function between(trend: Trend, from: number, to: number, width: number): Trend {
  const begin = trend.times_s.findIndex((s) => s >= from), end = last(trend.times_s.length, (i) => trend.times_s[i]!, to) + 1;
  if (begin < 0) return { times_s: [], series: trend.series.map(([name]) => [name, []]) };
  return thinned({ times_s: trend.times_s.slice(begin, end), series: trend.series.map(([name, v]) => [name, v.slice(begin, end)]) }, width);
}

function lines(whole: JournalPage, query: Record<string, string | number | string[]>): JournalPage {
  const k = whole, words = String(query.words ?? "").toLowerCase(), kind = query.kind, before = Number(query.before ?? Infinity);
  const found = k.lines.filter((l) => l.number < before && (!kind || l.kind === kind) && (!words || `${l.kind} ${l.text}`.toLowerCase().includes(words)));
  return { ...k, lines: found.slice(0, PAGE), more: found.length > PAGE };
}

export function kept(path: string, query: Record<string, string | number | string[]>): unknown {
  const theirs = path.startsWith("/api/other/"), k = theirs ? held!.other : held!, n = (name: string, other: number) => Number(query[name] ?? other);
  const spanned = (trend: Trend) => between(trend, n("from", 0), n("to", Infinity), n("width", 800));
  if (!k) throw new Error("there is no other run in this file");
  switch (theirs ? path.replace("/other", "") : path) {
    case "/api/me": return { people: false, codes: false, sign_on: null, by_sign_on: false, orders: false, name: null, access: null, token: null };
    case "/api/run": return k.run;
    case "/api/moment": return momentAt(n("at", k.run.last_s), k);
    case "/api/alarms": return k.pool[k.moments[Math.max(0, last(k.moments.length, (i) => k.moments[i]![0], n("at", k.run.last_s)))]![5]] as AlarmList;
    case "/api/journal": return lines(k.journal, query);
    case "/api/verified": return k.verified;
    case "/api/feature": {
      const found = k.features[String(query.name)];
      if (!found) throw new Error("it is not in this file");
      return { ...found, trend: spanned(found.trend) };
    }
    case "/api/trend": {
      const tags = ([] as string[]).concat(query.tag as string | string[]);
      return spanned({ times_s: k.readings?.times_s ?? [], series: tags.map((t) => [t, k.readings?.signals[t] ?? []]) });
    }
  }
  throw new Error("a file does not answer this");
}
