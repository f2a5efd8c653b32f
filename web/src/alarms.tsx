// Alarms in their states (ISA-18.2), and how many come at a time.

import { useEffect, useState } from "preact/hooks";
import { isKept } from "./kept";
import { ReportsOf } from "./reports";
import type { Asked } from "./orders";
import { mayOrder } from "./orders";
import { ask, type AlarmList, type ListedAlarm, type Me, type Moment } from "./told";
import { LEVELS, moment, span } from "./words";

const STATES: Record<string, string> = {
  unacknowledged: "● lasts, not acknowledged", acknowledged: "○ lasts, acknowledged",
  "returned, unacknowledged": "◐ over, not acknowledged", shelved: "⏸ shelved", normal: "over",
};

function Row({ a, at, may, order }: { a: ListedAlarm; at: number; may: boolean; order: (asked: Asked) => void }) {
  const level = LEVELS[a.priority] ?? LEVELS.low!;
  const plain = { digest: "", subject: a.alarm, proven: false };
  const open = a.state === "unacknowledged" || a.state === "returned, unacknowledged";
  return (
    <tr class={`alarmrow ${open ? "open" : ""} ${a.priority}`}>
      <td><span class="badge">{level.mark} {level.word}</span></td>
      <th scope="row">{a.cause} <span class="quiet">{a.alarm}{a.times > 1 && `, ${a.times} times in 10 min`}</span>
        {a.first && <b class="first"> ① first</b>}</th>
      <td>{STATES[a.state]}{a.acknowledged_by && <span class="quiet"> by {a.acknowledged_by}</span>}
        {a.shelved_until_s !== null && <span class="quiet"> by {a.shelved_by} for {span(a.shelved_until_s - at)} more: {a.shelved_why}</span>}</td>
      <td class="n">{moment(a.raised_s)}</td><td class="n">{a.returned_s === null ? "–" : moment(a.returned_s)}</td>
      <td class="n">{may && a.state !== "normal" && <>
        {open && <button type="button" onClick={() => order({ ...plain, verb: "acknowledge", title: `Acknowledge ${a.alarm}`, button: "Acknowledge", reason: "welcome", note: a.cause })}>Acknowledge …</button>}
        {a.state === "shelved" ? <button type="button" onClick={() => order({ ...plain, verb: "unshelve", title: `Show ${a.alarm} again`, button: "Show again", reason: "welcome" })}>Show again …</button>
          : a.priority !== "critical" && <button type="button" onClick={() => order({ ...plain, verb: "shelve", title: `Shelve ${a.alarm}`, button: "Shelve", reason: "needed", minutes: 30, note: `${a.cause}. What it watches is watched all the same.` })}>Shelve …</button>}
      </>}</td>
    </tr>
  );
}

export function Alarms({ now, me, live, order }: { now: Moment; me: Me; live: boolean; order: (asked: Asked) => void }) {
  const [list, setList] = useState<AlarmList | null>(null);
  const [past, show] = useState(false), [failed, fail] = useState("");
  useEffect(() => {
    let gone = false; // what was asked for before may be answered last
    void ask<AlarmList>("/api/alarms", { at: now.at_s }).then((found) => { if (!gone) { setList(found); fail(""); } }, (e: Error) => { if (!gone) fail(e.message); });
    return () => { gone = true; };
  }, [now.told, Math.floor(now.at_s / 10)]);
  if (!list) return <section class="wide">{failed ? <p class="warn" role="alert">△ {failed}</p> : <p class="quiet">Reading the alarms …</p>}</section>;
  const rows = [...list.standing, ...list.shelved, ...(past ? list.past : [])];
  return (<>
    <section id="alarms" class="wide" tabIndex={-1} aria-label="Alarms">
      <h2>Alarms <span class="quiet">{list.standing.length} {list.standing.length === 1 ? "stands" : "stand"}, {list.shelved.length} shelved, {list.within} raised in the last 10 min</span></h2>
      {failed && <p class="warn" role="alert">△ These are not the alarms of now: {failed}</p>}
      {list.flood && <p class="stale" role="alert"><b>■ Flood:</b> {list.within} alarms in 10 min. Begin with the first one (①) and with what is critical.</p>}
      <p class="choice"><button type="button" aria-pressed={past} onClick={() => show(!past)}>What is over ({list.over > list.past.length ? `the latest ${list.past.length} of ${list.over}` : list.over})</button>
        {!isKept() && <a class="button" href={`/api/alarms.csv?at=${now.at_s}`} download="alarms.csv">Export (CSV)</a>}</p>
      {rows.length === 0 ? <p class="big quiet">No alarm stands.</p> : (
        <div class="scroll" tabIndex={0} role="region" aria-label="List of alarms"><table>
          <thead><tr><th>Priority</th><th>What</th><th>State</th><th class="n">Raised</th><th class="n">Over</th><th><span class="unseen">Orders</span></th></tr></thead>
          <tbody>{rows.map((a) => <Row key={`${a.alarm} ${a.raised_s}`} a={a} at={now.at_s} may={live && mayOrder(me)} order={order} />)}</tbody>
        </table></div>)}
    </section>
    {!isKept() && <ReportsOf at={now.at_s} me={me} />}
  </>);
}
