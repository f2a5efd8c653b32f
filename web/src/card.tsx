// The card of an episode: four answers first, then everything that they stand on.

import { Behind } from "./behind";
import { Bands, TimeLeft, shownOf } from "./foresight";
import { FeatureChart } from "./trends";
import { useState } from "preact/hooks";
import { send, type Card, type Certificate, type Choice, type Margin, type Me, type Moment, type Move, type Proposal, type Retold, type Run } from "./told";
import { amount, atMost, distance, fromTo, moment, moved, percent, priced, signed, span, timeOf } from "./words";

export function Moves({ moves }: { moves: Move[] }) {
  const changed = moves.filter(moved), kept = moves.filter((m) => !moved(m));
  return (
    <>
      <table class="moves">
        <thead><tr><th>Tag</th><th class="n">From</th><th><span class="unseen">to</span></th><th class="n">To</th><th>Ramp</th></tr></thead>
        <tbody>{changed.map((m) => [m, ...fromTo(m)] as const).map(([m, before, after]) => (
          <tr key={m.tag}>
            <th scope="row" title={m.text}>{m.tag} <span class="quiet">{m.text}</span></th>
            <td class="n">{before}</td><td aria-label="to">→</td>
            <td class="n"><b>{after}</b></td>
            <td class="quiet">{m.rate === null ? "at once" : `${amount(m.rate, m.unit === "1" ? "" : m.unit, 2)}/s`}</td>
          </tr>))}
        </tbody>
      </table>
      {kept.length > 0 && <p class="quiet">Stays as it is: {kept.map((m) => `${m.tag} ${fromTo(m)[1]}`).join(", ")}</p>}
    </>
  );
}

// Everything that would be written: at once, and then step by step with what must hold before.
export function Steps({ proposal }: { proposal: Proposal }) {
  return (
    <>
      {proposal.moves.length > 0 && <Moves moves={proposal.moves} />}
      {proposal.later.map((s, k) => <div key={k} class="step"><p>Then, when <code>{s.guard}</code>: {s.state}</p>
        {s.moves.length > 0 ? <Moves moves={s.moves} /> : <p class="quiet">Nothing more is commanded.</p>}</div>)}
    </>
  );
}

function MarginRow({ m, most, compared }: { m: Margin; most: number; compared: boolean }) {
  const bad = m.margin < 0;
  const wide = Math.min(100, (100 * Math.abs(m.scaled)) / most);
  const worse = m.actual !== null && m.actual < m.margin && m.actual_unit === m.unit && m.actual_term === m.term;
  return (
    <tr class={bad ? "bad" : m.near ? "near" : ""}>
      <th scope="row">{m.text || m.name} <span class="quiet">{m.name}{m.hard ? "" : ", has a price"}</span><br /><code class="quiet">{m.term || m.formula}</code></th>
      <td class="n"><b>{bad ? "■ " : m.near ? "△ " : ""}{distance(m.margin, m.unit, m.term)}</b>
        {m.full && <span class="quiet"> as good as it can be</span>}</td>
      <td class="bar"><svg viewBox="0 0 100 8" preserveAspectRatio="none" aria-hidden="true">
        <rect width="100" height="8" class="track" /><rect width={m.full ? 100 : wide} height="8" class="fill" /></svg></td>
      <td class="n quiet">{moment(m.at_s)} after</td>
      <td class="n quiet">member {m.member}</td>
      {compared && <td class="n">{m.actual === null ? "–" : <>{worse ? "△ " : ""}{distance(m.actual, m.actual_unit, m.actual_term)}
        {m.actual_term && m.actual_term !== m.term && <span class="quiet"> to {m.actual_term}</span>}</>}</td>}
    </tr>
  );
}

export function Margins({ proposal }: { proposal: Pick<Proposal, "margins" | "members" | "checks"> }) {
  if (!proposal.margins.length) return null;
  const most = Math.max(1, ...proposal.margins.map((m) => Math.min(5, Math.abs(m.scaled))));
  const compared = proposal.margins.some((m) => m.actual !== null);
  return (
    <div class="scroll" tabIndex={0} role="region" aria-label="Margins">
      <table class="margins">
        <thead><tr><th>Limit</th><th class="n">Worst predicted</th><th><span class="unseen">Distance</span></th><th class="n">When</th><th class="n">Worst in</th>
          {compared && <th class="n">Readings so far</th>}</tr></thead>
        <tbody>{proposal.margins.map((m) => <MarginRow key={m.name} m={m} most={most} compared={compared} />)}</tbody>
      </table>
      <p class="quiet">Distance to each limit in the worst of {proposal.members} members, the nearest first.
        {proposal.checks > 0 && ` ${proposal.checks} ${proposal.checks === 1 ? "permissive or target was" : "permissives and targets were"} judged beside them.`}
        {compared && " Readings: their least distance since the release, noise included."}</p>
    </div>
  );
}

// Whose margin the worst one is: what it protects, the comparison, when, and in which member. Where a hard limit is violated by now, that is no answer any more.
function Worst({ m, members, judged, beyond }: { m: Margin; members: number; judged: number; beyond: boolean }) {
  const least = `${m.margin < 0 ? "■ " : ""}${distance(m.margin, m.unit, m.term)}${m.margin < 0 ? "" : " to spare"} at worst`;
  return (
    <>{beyond ? <><p class="big bad">■ A hard limit is violated</p><p>What was judged before does not say what follows now: {least}.</p></>
      : <p class={m.margin < 0 ? "big bad" : "big"}>{least}</p>}
      <p>{m.text || m.name}: <code>{m.term || m.formula}</code>, after {span(m.at_s)}, in member {m.member} of {members}{m.full && ", as good as it can be"}, judged at {moment(judged)}.</p></>
  );
}

function Safe({ card, beyond }: { card: Card; beyond: boolean }) {
  const p = card.proposal, left = card.let_be, acted = p ? undefined : card.acted[0], worst = p?.margins[0];
  if (acted) return <><p class="big quiet">The plant’s prepared safe state</p><p>{acted.stands ? "Its readings confirm it." : "Its readings do not confirm it yet."}</p></>;
  if (p && worst) {
    return <><Worst m={worst} members={p.members} judged={p.at_s} beyond={beyond} />
      {p.certificate && <p>{certified(p.certificate)}.</p>}</>;
  }
  if (left && !p) {
    return left.margins[0] ? <Worst m={left.margins[0]} members={left.members} judged={left.at_s} beyond={beyond} />
      : <><p class="big">{signed(left.margin, "1")} at worst</p><p class="quiet">Of which limit this record does not say.</p></>;
  }
  if (p) return <p class="big quiet">Of its margins this record does not say anything</p>;
  return <p class="big quiet">{card.refused.length ? "Nothing passed the checks" : "Nothing was judged yet"}</p>;
}

// What a proposal is for, in a few words.
function goal(p: Proposal): string {
  if (p.what === "wait") return `Wait ${span(p.seconds)}, then look again`;
  return `${p.path.length ? `Go to ${p.path[p.path.length - 1]}` : p.what}${p.seconds > 0 ? ` for ${span(p.seconds)}` : ""}`;
}

// What fell makes nothing safe: why it fell, and the margin that says what was wrong with it.
function Fallen({ p }: { p: Proposal }) {
  const worst = p.margins[0];
  return (
    <><p class="big">{goal(p)}</p>
      <p class="status">Since {moment(p.since_s)} {p.status}.</p>
      {worst && <p class="quiet">When it was judged, at {moment(p.at_s)}: {distance(worst.margin, worst.unit, worst.term)} at worst, {worst.text || worst.name}.</p>}</>
  );
}

// Most commands that stand in the answer; one more rather than "and 1 more".
const CHIPS = 3;

function Answers({ card, now }: { card: Card; now: Moment }) {
  const p = card.proposal, left = now.overview.left, time = timeOf(left, now.at_s);
  const acted = p ? undefined : card.acted[0], fallen = p || acted || card.let_be ? null : card.fallen;
  const moves = p?.moves.filter(moved) ?? [], more = moves.length - CHIPS, later = p?.later.length ?? 0;
  return (
    <div class="answers">
      <div>
        <h2 class="question">What is wrong</h2>
        <p class="big">{card.headline}</p>
        <p>{card.probability === null ? "No diagnosis." : `${percent(card.probability)} probable${card.explanations[0]?.size ? `, size ${card.explanations[0].size}` : ""}.`} Seen
          at {moment(card.since_s)}{card.over_s !== null && `, over at ${moment(card.over_s)}`}.</p>
      </div>
      <div>
        <h2 class="question">{acted ? "What was done" : p?.released_s != null ? "What was released" : "What is proposed"}</h2>
        {acted ? <><p class="big">■ Fallback ‘{acted.strategy}’ acted</p><p>{acted.reason}</p></>
          : p ? <>
            <p class="big">{goal(p)}</p>
            <p>{moves.slice(0, more > 1 ? CHIPS : CHIPS + 1).map((m) => [m, ...fromTo(m)] as const).map(([m, before, after]) => <span class="chip" key={m.tag}>{m.tag} {before} → <b>{after}</b></span>)}
              {more > 1 && <b class="chip">and {more} more</b>}{later > 0 && <b class="chip">then {later} {later === 1 ? "step" : "steps"} more</b>}</p>
            <p class="status">{p.status.charAt(0).toUpperCase() + p.status.slice(1)} (since {moment(p.since_s)}).</p>
            {card.fallen && <p class="later">Later, at {moment(card.fallen.since_s)}, {goal(card.fallen)}: {card.fallen.status}.</p>}
          </> : card.let_be ? <><p class="big">Leave it alone</p>
            <p>{(card.let_be.margin ?? -1) >= 0 ? `Without action every check holds in ‘${card.let_be.state}’` : "To act would cost more"}, judged at {moment(card.let_be.at_s)}.</p></>
          : <><p class="big quiet">{fallen ? "Nothing any more" : card.compared_s === null ? "Nothing yet" : "No proposal"}</p>
            {!fallen && card.refused[0] && <p>{card.refused[0].what}: {card.refused[0].why}</p>}</>}
      </div>
      <div>
        <h2 class="question">{!fallen ? "Why it is safe" : fallen.stands === "refused" ? "What was refused and why" : "What does not stand, and why"}</h2>
        {fallen ? <Fallen p={fallen} /> : <Safe card={card} beyond={left.until === "beyond"} />}
      </div>
      <div>
        <h2 class="question">How long is left</h2>
        {time !== null ? <p class="big">{time} <span class="quiet">{left.title}</span></p>
          : <p class={left.until === "beyond" ? "big bad" : "big quiet"}>{left.until === "beyond" ? "■ " : ""}{left.title.charAt(0).toUpperCase() + left.title.slice(1)}</p>}
        {left.text && <p>{left.text}</p>}
        {left.until !== "beyond" && <TimeLeft card={card} at={now.at_s} />}
        {card.alone && !card.foresight && <p>If nothing is done: {card.alone}</p>}
      </div>
    </div>
  );
}

function Explanations({ card }: { card: Card }) {
  return (
    <><ul class="explanations">{card.explanations.map((e) => (
      <li key={e.name}>
        <p><b>{percent(e.probability)}</b> {e.text}{e.size && `, size ${e.size}`} <span class="quiet">{e.component}</span></p>
        <svg class="share" viewBox="0 0 100 4" preserveAspectRatio="none" aria-hidden="true">
          <rect width="100" height="4" class="track" /><rect width={100 * e.probability} height="4" class="fill" /></svg>
        {e.supports.length > 0 && <p class="small">+ seen: {e.supports.join("; ")}</p>}
        {e.lacks.length > 0 && <p class="small quiet">− may show and was not seen: {e.lacks.join("; ")}</p>}
        {e.others.length > 0 && <p class="small quiet">− seen, and the tables do not link it: {e.others.join("; ")}</p>}
      </li>))}
    </ul>
    {card.apart && <p class="small">? To tell them apart: {card.apart}</p>}</>
  );
}

// A cost, and behind it what it is made up of.
function CostOf({ choice, currency }: { choice: Choice; currency: string }) {
  const cost = priced(choice.cost, currency);
  if (!choice.items.length) return <>{cost}</>;
  const items = choice.items.map(([name, value]) => `${name} ${value.toFixed(1)}`);
  return <Behind word={cost} about={items.join(", ")}>{items.join("\n")}</Behind>;
}

function certified(c: Certificate): string {
  const what = c.beside ? "do worse than the fallback, which violates a hard limit as well" : "violate a hard limit";
  return `${c.violations} of ${c.draws} draws ${what}: at most ${atMost(c.bound)} (with ${percent(c.level)} confidence)`;
}

// How likely it is to violate a hard limit, and behind it what says so.
function RiskOf({ choice }: { choice: Choice }) {
  const c = choice.certificate;
  return c ? <Behind word={`≤ ${atMost(c.bound)}`} about={certified(c)}>{certified(c)}</Behind> : <span class="quiet">–</span>;
}

function Choices({ card }: { card: Card }) {
  const least = card.choices.find((c) => c.kind === "leave alone");
  return (
    <div class="scroll" tabIndex={0} role="region" aria-label="Costs">
      <table>
        <thead><tr><th>What could be done</th><th class="n">Costs</th><th class="n">Beside leaving alone</th><th class="n">Risk</th><th>May it be done?</th></tr></thead>
        <tbody>{card.choices.map((c, k) => (
          <tr key={k} class={c.chosen ? "chosen" : ""}>
            <th scope="row">{c.chosen ? "✓ " : ""}{c.what} <span class="quiet">{c.by && `by ${c.by}`}</span></th>
            <td class="n"><CostOf choice={c} currency={card.currency} /></td>
            <td class="n">{least && c !== least ? signed(c.cost === null || least.cost === null ? null : c.cost - least.cost, card.currency) : ""}</td>
            <td class="n"><RiskOf choice={c} /></td>
            <td>{c.refused ? <span class="quiet">no: {c.refused}</span> : c.chosen ? "yes, chosen" : "yes"}</td>
          </tr>))}
        </tbody>
      </table>
    </div>
  );
}

function Quality({ now, run }: { now: Moment; run: Run }) {
  const poor = Object.entries(now.quality), all = run.tags.length;
  if (!poor.length) return <p>All {all} tags are good{run.measured ? `; readings of ${moment(now.sampled_s)}.` : "."}</p>;
  return (
    <ul>{poor.map(([tag, [quality, why]]) => <li key={tag} class="warn">△ {tag} is {quality}: {why}</li>)}
      <li class="quiet">{all - poor.length} of {all} tags are good</li></ul>
  );
}

const LANGUAGES: [string, string][] = [["en", "English"], ["de", "Deutsch"], ["fr", "Français"], ["es", "Español"], ["it", "Italiano"], ["pl", "Polski"], ["pt", "Português"], ["tr", "Türkçe"], ["zh", "中文"], ["ja", "日本語"]];

// A model's words stand apart from the facts, and say whose they are.
function RetoldBy({ run, me, at }: { run: Run; me: Me; at: number }) {
  const [language, choose] = useState(() => LANGUAGES.find(([code]) => navigator.language.startsWith(code))?.[0] ?? "en");
  const [said, say] = useState<{ retold: Retold; at: number; language: string } | null>(null), [failed, fail] = useState(""), [going, go] = useState(false);
  const submit = async () => {
    go(true);
    fail("");
    try { say({ retold: await send<Retold>("POST", "/api/retold", { at_s: at, language }, me.token), at, language }); } catch (e) { say(null); fail((e as Error).message); }
    go(false);
  };
  return (
    <div class="retold">
      <p class="choice"><label>Have {run.model} say it in <select value={language} onChange={(e) => choose(e.currentTarget.value)}>{LANGUAGES.map(([code, name]) => <option key={code} value={code} lang={code}>{name}</option>)}</select></label>
        {" "}<button type="button" disabled={going} onClick={() => void submit()}>{going ? "It is asked …" : "Ask it"}</button></p>
      {failed && <p class="warn" role="alert">△ {failed}</p>}
      {said && <blockquote><p><b>△ Words of {said.retold.model}, of {moment(said.at)}, not checked. The facts above count.</b></p>
        {said.retold.strange.length > 0 && <p class="bad">■ Numbers that are not in the facts: {said.retold.strange.join(", ")}</p>}
        <p lang={said.language}>{said.retold.text}</p></blockquote>}
    </div>
  );
}

export function EpisodeCard({ run, me, now, decision }: { run: Run; me: Me; now: Moment; decision: preact.ComponentChildren }) {
  const card = now.card;
  if (!card) return <section class="card" id="card" tabIndex={-1} aria-label="Episode"><h2>Episode</h2><p class="big quiet">Nothing is wrong and nothing was.</p></section>;
  const p = card.proposal;
  return (
    <section class="card" id="card" tabIndex={-1} aria-label="Episode">
      <Answers card={card} now={now} />
      {decision}
      {p && <div class="part wide"><h2>Proposal <span class="quiet">by {p.proposer} at {moment(p.at_s)}: {p.path.join(" → ")}</span></h2>
        {p.reasons.map((r) => <blockquote key={r}>{r}</blockquote>)}
        <Steps proposal={p} />
        <Margins proposal={p} /></div>}
      {card.fallen && <div class="part wide fallen"><h2>No proposal any more <span class="quiet">of {card.fallen.proposer}, judged at {moment(card.fallen.at_s)}: {card.fallen.path.join(" → ")}</span></h2>
        <p>{goal(card.fallen)}: {card.fallen.status}, since {moment(card.fallen.since_s)}.{card.fallen.released_s !== null && ` It was released at ${moment(card.fallen.released_s)}.`}</p>
        <details><summary>What it was to write, and its margins then</summary><Steps proposal={card.fallen} /><Margins proposal={card.fallen} /></details></div>}
      {!p && !card.acted[0] && card.let_be && card.let_be.margins.length > 0 && <div class="part wide"><h2>Without action <span class="quiet">in ‘{card.let_be.state}’, judged at {moment(card.let_be.at_s)}</span></h2>
        <Margins proposal={card.let_be} /></div>}
      <Bands run={run} shown={shownOf(card, now.at_s)} />
      {card.acted.map((a) => <div class="part wide" key={`${a.at_s} ${a.strategy}`}><h2>■ Fallback ‘{a.strategy}’ at {moment(a.at_s)}</h2><p>{a.reason}</p><Moves moves={a.moves} /></div>)}
      <div class="part"><h2>What may be wrong{card.diagnosed_s !== null && <span class="quiet"> judged at {moment(card.diagnosed_s)}</span>}</h2>
        {card.explanations.length ? <Explanations card={card} /> : <p>Nothing was diagnosed.</p>}</div>
      {card.seen.length > 0 && <div class="part"><h2>Evidence</h2>
        {card.seen.map((s) => <div key={s.rule}>
          <p>{s.text}{s.times !== null && <>: <b>{amount(Math.abs(s.times), "1", 2)} times</b> its threshold</>}
            {s.value !== null && <span class="quiet"> ({signed(s.value, s.unit)} from its reference, {s.rule})</span>}</p>
          {run.measured && s.feature && <FeatureChart name={s.feature} at={now.at_s} since={card.since_s} />}
        </div>)}</div>}
      {card.choices.length > 0 && <div class="part wide"><h2>Cost{card.compared_s !== null && <span class="quiet"> compared at {moment(card.compared_s)}</span>}</h2><Choices card={card} /></div>}
      {card.refused.length > 0 && <div class="part wide"><h2>Refused</h2><ul>{card.refused.map((r, k) => (
        <li key={k}><span class="quiet">{moment(r.at_s)}</span> {r.what}: {r.why}</li>))}</ul></div>}
      <div class="part wide"><details class="told"><summary>In words</summary>
        {now.told.map((t) => <p key={t.heading}><b>{t.heading}.</b> {t.text}</p>)}
        <p class="quiet">Made from the facts of this card by templates; nothing is added.</p>
        {run.model && <RetoldBy run={run} me={me} at={now.at_s} />}</details></div>
      <div class="part"><h2>Quality of the data</h2><Quality now={now} run={run} /></div>
      {card.notes.length > 0 && <div class="part"><h2>Notes</h2>{card.notes.map((n) => <blockquote key={n}>{n}</blockquote>)}</div>}
    </section>
  );
}
