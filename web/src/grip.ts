// Fingers and the mouse on a chart: one drags it along, two pull it apart, a short touch points at a time.

import type uPlot from "uplot";

export interface Range { from: number; to: number }
interface Held { x: number; value: number }

const STILL_PX = 6, APART_PX = 12;

export class Grip {
  private readonly held = new Map<number, Held>();
  private begun: { x: number; range: Range; moved: boolean } | null = null;

  constructor(private readonly box: HTMLElement, private readonly chart: () => uPlot | null, private readonly range: () => Range,
    private readonly move: (from: number, to: number) => void, private readonly point: (index: number) => void) {}

  // The box keeps the pointer, also beside it: the chart in it is made anew while it is dragged, and what was touched is gone.
  readonly down = (e: PointerEvent): void => {
    const chart = this.chart();
    if (!chart || this.held.size > 1 || (e.pointerType === "mouse" && e.button !== 0)) return;
    this.box.setPointerCapture(e.pointerId);
    const x = this.at(e, chart);
    this.held.set(e.pointerId, { x, value: this.value(x, chart) });
    this.begun = { x, range: this.range(), moved: this.held.size > 1 };
    if (this.held.size > 1) for (const held of this.held.values()) held.value = this.value(held.x, chart);
  };

  readonly over = (e: PointerEvent): void => {
    const chart = this.chart(), held = this.held.get(e.pointerId), begun = this.begun;
    if (!chart || !held || !begun) return;
    held.x = this.at(e, chart);
    const width = chart.over.clientWidth;
    if (this.held.size > 1) {
      const [a, b] = [...this.held.values()] as [Held, Held];
      if (Math.abs(b.x - a.x) < APART_PX || (b.value - a.value) * (b.x - a.x) <= 0) return;
      const wide = ((b.value - a.value) * width) / (b.x - a.x), from = a.value - (a.x / width) * wide;
      this.move(from, from + wide);
      return;
    }
    if (!begun.moved && Math.abs(held.x - begun.x) < STILL_PX) return;
    begun.moved = true;
    const by = ((begun.x - held.x) * (begun.range.to - begun.range.from)) / width;
    this.move(begun.range.from + by, begun.range.to + by);
  };

  readonly up = (e: PointerEvent): void => {
    const chart = this.chart(), held = this.held.get(e.pointerId);
    if (!held) return;
    this.held.delete(e.pointerId);
    const [other] = this.held.values();
    if (other) this.begun = { x: other.x, range: this.range(), moved: true };
    else if (chart && this.begun && !this.begun.moved) this.point(chart.posToIdx(held.x));
  };

  // The browser scrolls the page instead, or the finger is gone.
  readonly lost = (e: PointerEvent): void => { this.held.delete(e.pointerId); };

  private at(e: PointerEvent, chart: uPlot): number { return e.clientX - chart.over.getBoundingClientRect().left; }
  private value(x: number, chart: uPlot): number {
    const { from, to } = this.range();
    return from + (x / chart.over.clientWidth) * (to - from);
  }
}

// A finger on a chart that is not dragged reads it as the mouse does.
export function readable(chart: uPlot): void {
  const read = (e: PointerEvent) => {
    const place = chart.over.getBoundingClientRect();
    if (e.pointerType === "touch") chart.setCursor({ left: e.clientX - place.left, top: e.clientY - place.top });
  };
  chart.over.addEventListener("pointerdown", read);
  chart.over.addEventListener("pointermove", read);
}
