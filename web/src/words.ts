// How numbers and times are put to people.

export function amount(value: number | null | undefined, unit = "", digits = 4): string {
  if (value === null || value === undefined) return "–";
  const text = Math.abs(value) < 1e-12 ? "0" : Number(value.toPrecision(digits)).toString();
  return unit === "" || unit === "1" ? text : `${text} ${unit}`;
}

export function signed(value: number, unit: string): string {
  return `${value >= 0 ? "+" : "−"}${amount(Math.abs(value), unit, 3)}`;
}

// A margin. Formulas with several units tell which comparison it is of; records that are older do not, and count in scales of the tags.
export function distance(value: number, unit: string, term: string): string {
  return unit === "1" && !term ? `${signed(value, "1")} times what counts` : signed(value, unit);
}

export function percent(share: number): string {
  const value = 100 * share;
  return `${value >= 1 || value === 0 ? value.toFixed(0) : value.toPrecision(2)} %`;
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
