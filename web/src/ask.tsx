// What if: setpoints moved inside their ranges, rolled out and judged on a twin. Nothing here is written or proposed.

import { useEffect, useState } from "preact/hooks";
import { Margins, Moves } from "./card";
import { Bands } from "./foresight";
import { ask, send, type Me, type Option, type Run, type Setpoint, type Tried } from "./told";
import { amount, distance, moment, percent, span } from "./words";

type Values = Record<string, number | null>;

function start(option: Option): Values {
  const inside = (s: Setpoint) => (s.now !== null && s.now >= s.low && s.now <= s.high ? s.now : s.design);
  return Object.fromEntries(option.setpoints.map((s) => [s.tag, inside(s)]));
}

function Field({ s, value, set }: { s: Setpoint; value: number | null; set: (v: number | null) => void }) {
  const name = `${s.tag} ${s.text}`, step = (s.high - s.low) / 200 || 1, free = s.high > s.low;
  return (
    <fieldset class="setpoint">
      <legend>{s.tag} <span class="quiet">{s.text}</span></legend>
      {s.design === null && <label class="auto"><input type="checkbox" checked={value === null} disabled={!free && value === null}
        onChange={(e) => set(e.currentTarget.checked ? null : s.low)} /> automatic</label>}
      {value !== null && (free ? <>
        <input type="range" min={s.low} max={s.high} step={step} value={value} aria-label={`${name}, slider`} onInput={(e) => set(Number(e.currentTarget.value))} />
        <input type="number" min={s.low} max={s.high} step="any" required value={Number(value.toPrecision(5))} aria-label={`${name}${s.unit === "1" ? "" : ` in ${s.unit}`}`}
          onChange={(e) => Number.isFinite(e.currentTarget.valueAsNumber) && set(e.currentTarget.valueAsNumber)} />
      </> : <b>{amount(value, s.unit)}</b>)}
      <span class="quiet small">{free ? `${amount(s.low)} to ${amount(s.high, s.unit)}` : "no choice in this state"}</span>
    </fieldset>
  );
}

function Answer({ run, said }: { run: Run; said: Tried }) {
  const worst = said.margins[0], first = said.foresight.told.first;
  return (
    <div class="answer" role="status">
      <p class={said.approved ? "big" : "big bad"}>{said.approved ? "✓ Every check holds on the twin" : "■ It would be refused"}</p>
      {said.objections.slice(0, 4).map((o) => <p key={o}>{o}</p>)}
      <p>{worst && <>Worst margin {distance(worst.margin, worst.unit, worst.term)} ({worst.text}: <code>{worst.term || worst.formula}</code>), after {span(worst.at_s)}, member {worst.member}. </>}
        {first ? `The first hard limit is reached in ${span(first.earliest_s)} to ${span(first.latest_s)}, in ${first.members} of ${said.foresight.told.members} members: ${said.foresight.limit}. `
          : said.foresight.told.members > 0 ? `No hard limit is reached within ${span(said.foresight.told.length_s)}. ` : `The twin cannot say: ${said.foresight.told.note}. `}
        {said.cost !== null && <>It would cost {said.cost.toFixed(1)} {said.currency}{said.cost_alone !== null && `, to do nothing ${said.cost_alone.toFixed(1)} ${said.currency}`}.</>}</p>
      <p class="quiet">Tried at {moment(said.at_s)}, with what was held to be wrong then: {said.assumed.map(([name, p]) => `${name} ${percent(p)}`).join(", ") || "nothing"}. {said.learnt_s > 0
        ? `The twin has learnt its parameters from ${span(said.learnt_s)} of healthy readings.` : "The twin has the parameters of the tables: there were too few healthy readings to learn from."}</p>
      <Moves moves={said.moves} />
      <Margins proposal={{ margins: said.margins, members: said.foresight.told.members, checks: 0 }} />
      <Bands run={run} shown={{ mine: said.foresight.told, other: said.beside.told, margins: said.margins, released: false, at: said.at_s }} />
    </div>
  );
}

export function Ask({ run, me, at }: { run: Run; me: Me; at: number }) {
  const [options, setOptions] = useState<Option[] | null>(null), [state, setState] = useState(""), [values, setValues] = useState<Values>({});
  const [said, say] = useState<Tried | null>(null), [failed, fail] = useState(""), [going, go] = useState(false);
  const choose = (option: Option | undefined) => { setState(option?.state ?? ""); setValues(option ? start(option) : {}); };
  useEffect(() => {
    ask<Option[]>("/api/options", { at }).then((found) => { setOptions(found); choose(found.find((o) => o.setpoints.some((s) => s.high > s.low)) ?? found[0]); }, (e: Error) => fail(e.message));
  }, []);
  const option = options?.find((o) => o.state === state);
  const submit = async (e: Event) => {
    e.preventDefault();
    go(true);
    fail("");
    try { say(await send<Tried>("POST", "/api/trial", { at_s: at, state, values }, me.token)); } catch (error) { say(null); fail((error as Error).message); }
    go(false);
  };
  return (
    <section id="ask" class="wide" tabIndex={-1} aria-label="What if">
      <h2>What if <span class="quiet">at {moment(at)}</span></h2>
      <p>Move setpoints and see what the twin makes of them. <b>Nothing here is written, proposed or kept.</b></p>
      {me.access === "viewer" ? <p class="quiet">A viewer asks the twin nothing.</p>
        : options && !option ? <p class="quiet">Nothing can be tried here: the plant’s folder or its readings are not to be had.</p>
        : option && <form onSubmit={submit}>
          <label>State <select value={state} onChange={(e) => choose(options!.find((o) => o.state === e.currentTarget.value))}>
            {options!.map((o) => <option key={o.state} value={o.state}>{o.label}</option>)}</select></label>
          <div class="setpoints">{option.setpoints.map((s) => <Field key={s.tag} s={s} value={values[s.tag] ?? null} set={(v) => setValues({ ...values, [s.tag]: v })} />)}</div>
          <p class="buttons"><button type="submit" class="act" disabled={going}>{going ? "The twin is working …" : "Try it on the twin"}</button></p>
        </form>}
      {failed && <p class="warn" role="alert">△ {failed}</p>}
      {said && <Answer run={run} said={said} />}
    </section>
  );
}
