// How numbers and times are put to people.

import type { Move, TimeLeft } from "./told";

export function amount(value: number | null | undefined, unit = "", digits = 4): string {
  if (value === null || value === undefined) return "–";
  const text = Math.abs(value) < 1e-12 ? "0" : Number(value.toPrecision(digits)).toString();
  return unit === "" || unit === "1" ? text : `${text} ${unit}`;
}

export function signed(value: number | null, unit: string): string {
  if (value === null) return "not known";
  return `${value >= 0 ? "+" : "−"}${amount(Math.abs(value), unit, 3)}`;
}

// A margin. Formulas with several units tell which comparison it is of; records that are older do not, and count in scales of the tags.
export function distance(value: number, unit: string, term: string): string {
  return unit === "1" && !term ? `${signed(value, "1")} times what counts` : signed(value, unit);
}

// What an instrument says: less than half a thousandth of its range is nothing, and no digit is finer than a ten-thousandth.
export function reading(value: number | null | undefined, tag: { unit: string; low: number; high: number }): string {
  const wide = tag.high - tag.low;
  if (value === null || value === undefined || !(wide > 0)) return amount(value, tag.unit);
  if (Math.abs(value) < wide / 2000) return amount(0, tag.unit);
  const finest = 10 ** Math.floor(Math.log10(wide / 1e4));
  return amount(Math.round(value / finest) * finest, tag.unit);
}

function aim(value: number | null, unit: string, digits: number): string {
  return value === null ? "automatic" : amount(value, unit, digits);
}

// From and to of a command, with as many digits as it takes to tell them apart.
export function fromTo(m: Move): [string, string] {
  for (let digits = 4; m.known && digits <= 7; digits++) {
    const before = aim(m.before, "", digits), after = aim(m.after, "", digits);
    if (before !== after) return [aim(m.before, m.unit, digits), aim(m.after, m.unit, digits)];
  }
  return [m.known ? aim(m.before, m.unit, 4) : "not known", aim(m.after, m.unit, 4)];
}

// What is commanded and is not where it is already; a difference that no instrument shows is none.
export function moved(m: Move): boolean {
  const [before, after] = fromTo(m);
  return before !== after;
}

// How long is left, in words; null where what is to come has no time.
export function timeOf(left: TimeLeft, at: number): string | null {
  if (left.from_s === null || left.to_s === null || !["fallback", "limit"].includes(left.until)) return null;
  const first = span(left.from_s - at), last = span(left.to_s - at);
  if (left.to_s - at < 0.5) return "now";
  return left.from_s - at < 0.5 ? `at any moment, within ${last}` : first === last ? first : `${first} to ${last}`;
}

// What a decision costs; null where the twin cannot say.
export function priced(cost: number | null, currency: string): string {
  return cost === null ? "not known" : `${cost.toFixed(1)} ${currency}`;
}

// Only what is certain is 100 %.
export function percent(share: number): string {
  const value = 100 * share;
  if (share < 1 && value >= 99.5) return value < 99.95 ? `${value.toFixed(1)} %` : "> 99.9 %";
  return `${value >= 1 || value === 0 ? value.toFixed(0) : value.toPrecision(2)} %`;
}

// A bound, to two digits where it is small: never rounded to less than it is.
export function atMost(share: number): string {
  const value = 100 * share, digits = value >= 1 || value <= 0 ? 1 : 1 - Math.floor(Math.log10(value));
  return `${(Math.ceil(value * 10 ** digits - 1e-9) / 10 ** digits).toFixed(digits)} %`;
}

export function span(seconds: number): string {
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 120) return `${whole} s`;
  const hours = Math.floor(whole / 3600), minutes = Math.floor((whole % 3600) / 60), rest = whole % 60;
  return hours ? `${hours} h ${minutes} min` : rest ? `${minutes} min ${rest} s` : `${minutes} min`;
}

export function moment(seconds: number): string {
  return `${Math.round(seconds)} s`;
}

export interface Level { mark: string; word: string }
export const LEVELS: Record<string, Level> = {
  normal: { mark: "○", word: "Normal" },
  low: { mark: "◇", word: "Low" },
  medium: { mark: "△", word: "Medium" },
  high: { mark: "▲", word: "High" },
  critical: { mark: "■", word: "Critical" },
};
