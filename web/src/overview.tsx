// The first line: what is wrong, in which mode and state, how long is left, what is waited for.

import type { Moment } from "./told";
import { LEVELS, moment, timeOf } from "./words";

function Fact({ name, children, strong }: { name: string; children: preact.ComponentChildren; strong?: boolean }) {
  return <div class={strong ? "fact strong" : "fact"}><dt>{name}</dt><dd>{children}</dd></div>;
}

export function OverviewLine({ title, now }: { title: string; now: Moment }) {
  const o = now.overview;
  const level = LEVELS[o.level] ?? LEVELS.normal!;
  const time = timeOf(o.left, now.at_s);
  return (
    <section class={`overview ${o.level}`} aria-label="Overview" aria-live="polite">
      <h1>{title}</h1>
      <div class="alarm">
        <span class="badge"><span aria-hidden="true">{level.mark}</span> {level.word}</span>
        {o.alarm
          ? <span class="what">{o.alarm}{o.alarm_s !== null && <span class="quiet"> since {moment(o.alarm_s)}</span>}</span>
          : <span class="what quiet">Nothing is wrong</span>}
        {o.folded.length > 0 && (
          <details>
            <summary>{o.folded.length} {o.folded.length === 1 ? "alarm" : "alarms"} beneath</summary>
            <ul>{o.folded.map((a) => (
              <li key={a.alarm}>
                <span aria-hidden="true">{LEVELS[a.priority]?.mark}</span> {a.priority}: {a.cause} <span class="quiet">
                since {moment(a.since_s)}{a.acknowledged ? ", acknowledged" : ", not acknowledged"}</span>
              </li>))}
            </ul>
          </details>)}
      </div>
      <dl>
        <Fact name="Mode">{o.mode || "–"}{o.requested !== o.mode && <b class="warn"> △ requested: {o.requested}</b>}
          {o.shed && <b class="warn"> △ the plant takes no commands: {o.shed}</b>}</Fact>
        <Fact name="State">{o.state || "–"}</Fact>
        <Fact name="Time left" strong={time !== null || o.left.until === "beyond"}>
          {time === null ? `${o.left.until === "beyond" ? "■ " : ""}${o.left.title}` : <>{time}<span class="quiet"> {o.left.title}</span></>}
        </Fact>
        <Fact name="Waiting for">{o.waiting}</Fact>
        {o.latched && <Fact name="Latched" strong>■ {o.latched}</Fact>}
        {o.out_of_service.length > 0 && (
          <Fact name="Out of service">{o.out_of_service.map(([tag, why]) => `${tag}: ${why}`).join("; ")}</Fact>)}
        {o.shelved > 0 && <Fact name="Shelved">{o.shelved} {o.shelved === 1 ? "alarm" : "alarms"}</Fact>}
        {o.finished && <Fact name="Ended">{o.finished}</Fact>}
      </dl>
    </section>
  );
}
