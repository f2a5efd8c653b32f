// What a person orders: a dialog that shows what it is about, asks why and for the password, and says what came of it.

import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { ask, Refused, send, type Came, type Card, type Me, type Moment, type Offer, type Proposal } from "./told";
import { Steps } from "./card";
import { distance, moment, span } from "./words";

export interface Asked {
  verb: string; subject: string; digest: string; title: string; button: string; reason: "needed" | "welcome";
  proposal?: Proposal; choices?: [string, string][]; label?: string; note?: string | ((now: Moment) => string); minutes?: number; proven: boolean;
}

export function mayOrder(me: Me): boolean {
  return me.orders && (me.access === "operator" || me.access === "engineer");
}

// The request that waits and is the one on the card: nothing else can be approved from it.
export function offered(card: Card | null, now: Moment): Offer | undefined {
  const digest = card?.proposal?.digest;
  return digest ? now.overview.offers.find((o) => o.digest === digest) : undefined;
}

export function approving(offer: Offer, proposal: Proposal): Asked {
  return { verb: "approve", subject: offer.request, digest: offer.digest, title: "Approve the proposal", button: "Approve",
    reason: "welcome", proposal, proven: true };
}

export function rejecting(offer: Offer, proposal: Proposal): Asked {
  return { verb: "reject", subject: offer.request, digest: "", title: "Reject the proposal", button: "Reject", reason: "needed", proposal, proven: true };
}

function Shown({ proposal }: { proposal: Proposal }) {
  const worst = proposal.margins[0];
  return (
    <div class="about">
      <div class="scroll" tabIndex={0} role="region" aria-label="What would be written"><Steps proposal={proposal} /></div>
      {worst && <p>{distance(worst.margin, worst.unit, worst.term)} at worst: {worst.text || worst.name}, <code>{worst.term || worst.formula}</code>, after {span(worst.at_s)}, in member {worst.member}</p>}
      <p class="quiet">Digest <code>{proposal.digest.slice(0, 16)}</code></p>
    </div>
  );
}

// People of a provider show at the provider that it is them, in a window of its own: for this order and no other.
function useProof(about: Record<string, string>, wanted: boolean): boolean {
  const [proven, prove] = useState(false);
  useEffect(() => {
    if (!wanted) return;
    const look = () => void ask<{ proven: boolean }>("/api/proof", about).then((p) => prove(p.proven), () => {});
    look();
    const again = setInterval(look, 1000);
    return () => clearInterval(again);
  }, [about.subject, wanted]);
  return proven;
}

type State = { kind: "asking" } | { kind: "going" } | { kind: "came"; came: Came } | { kind: "refused"; text: string; unknown: boolean };

// An identifier is used for one order: where the answer is lost the same one is sent again, and is carried out once.
export function OrderDialog({ asked, me, now, close }: { asked: Asked; me: Me; now: Moment; close: () => void }) {
  const dialog = useRef<HTMLDialogElement>(null), reason = useRef<HTMLTextAreaElement>(null), password = useRef<HTMLInputElement>(null);
  const [id] = useState(() => crypto.randomUUID());
  const [subject, choose] = useState(asked.choices ? "" : asked.subject);
  const [minutes, last] = useState(asked.minutes ?? 0);
  const [state, set] = useState<State>({ kind: "asking" });
  const [lost, lose] = useState(false);
  useEffect(() => { dialog.current?.showModal(); }, []);
  const away = asked.proven && me.by_sign_on, about = { id, verb: asked.verb, subject, digest: asked.digest };
  const proven = useProof(about, away && state.kind !== "came" && (!asked.choices || subject !== ""));
  // What was carried out does not wait any more, either: who has lost the answer may ask for it all the same.
  const gone = !lost && asked.proposal !== undefined && !now.overview.offers.some((o) => o.request === asked.subject && o.digest === asked.proposal!.digest);
  const submit = async (e: Event) => {
    e.preventDefault();
    set({ kind: "going" });
    const content = { id, verb: asked.verb, subject, digest: asked.digest, reason: reason.current!.value.trim(), seconds: 60 * minutes, password: password.current?.value ?? "" };
    try {
      set({ kind: "came", came: await send<Came>("POST", "/api/order", content, me.token) });
    } catch (error) {
      const refused = error instanceof Refused ? error : new Refused(String(error), 0, true);
      set({ kind: "refused", text: refused.message, unknown: refused.unknown });
      if (refused.unknown) lose(true);
      if (password.current) password.current.value = "";
    }
  };
  const over = state.kind === "came", note = typeof asked.note === "function" ? asked.note(now) : asked.note;
  return (
    <dialog ref={dialog} class="order" aria-labelledby="order-title" onClose={close}>
      <form onSubmit={submit}>
        <h2 id="order-title">{asked.title}</h2>
        {note && <p aria-live="polite">{note}</p>}
        {asked.proposal && <Shown proposal={asked.proposal} />}
        {!over && <>
          {asked.choices && <label>{asked.label} <select required value={subject} onChange={(e) => choose(e.currentTarget.value)}>
            <option value="">choose</option>{asked.choices.map(([value, text]) => <option key={value} value={value}>{text}</option>)}</select></label>}
          {asked.minutes !== undefined && <label>For how many minutes (480 at most) <input type="number" min={1} max={480} required value={minutes} onInput={(e) => last(Number(e.currentTarget.value))} /></label>}
          <label>Reason{asked.reason === "needed" ? "" : " (if any)"} <textarea ref={reason} rows={2} maxLength={400} required={asked.reason === "needed"} autofocus={asked.proposal !== undefined} /></label>
          {away && <p>{proven ? <b role="status">✓ {me.sign_on} says that it is you.</b>
            : asked.choices && !subject ? <span class="quiet">{me.sign_on} is asked who you are once something is chosen.</span>
            : <a class="button" href={`/oidc/prove?${new URLSearchParams(about)}`} target="_blank" rel="noopener">Show {me.sign_on} that it is you, {me.name} (opens a window)</a>}</p>}
          {asked.proven && !away && <input type="text" name="username" autocomplete="username" value={me.name ?? ""} readOnly hidden />}
          {asked.proven && !away && <label>Your password again, {me.name} <input ref={password} type="password" autocomplete="current-password" required maxLength={128} /></label>}
          {gone && <p class="warn" role="alert">△ This proposal does not wait any more. Close, and look again.</p>}
        </>}
        <div role="status">
          {state.kind === "going" && <p>Asking the guard …</p>}
          {state.kind === "came" && (state.came.done ? <p class="big">✓ Done</p>
            : state.came.counts ? <p class="big">Heard: {state.came.reason}</p> : <p class="big bad">■ Refused: {state.came.reason}</p>)}
          {state.kind === "refused" && <p class="warn">△ {state.unknown ? "Nobody knows yet whether it was carried out: " : ""}{state.text}.{state.unknown && " Send it again: it is carried out once at most."}</p>}
        </div>
        <div class="buttons">
          {!over && <button type="submit" class="act" disabled={state.kind === "going" || (away && !proven) || (gone && asked.verb === "approve")}>{asked.button}</button>}
          <button type="button" onClick={() => dialog.current?.close()}>{over ? "Close" : "Cancel"}</button>
        </div>
      </form>
    </dialog>
  );
}

const MODES: [string, string][] = [
  ["observe", "observe: nobody writes"], ["advise", "advise: what would be released is shown"],
  ["approve", "approve: written after a person's yes"], ["closed-loop", "closed-loop: all that passes the guard is written"]];

// An order acts on the plant as it is now: beside an earlier moment there is nothing to order.
export function Orders({ me, now, live, tags, order }: { me: Me; now: Moment; live: boolean; tags: string[]; order: (asked: Asked) => void }): ComponentChildren {
  const o = now.overview;
  if (!mayOrder(me) || o.finished) return null;
  if (!live) return <p class="quiet">This is not how the plant is now: orders are given once the page is back to live (End).</p>;
  const engineer = me.access === "engineer", out = new Set(o.out_of_service.map(([tag]) => tag));
  const plain = { digest: "", subject: "", proven: true };
  const writes = o.mode === "approve" || o.mode === "closed-loop";
  return (
    <div class="orders" role="group" aria-label="Orders">
      {engineer && <button type="button" onClick={() => order({ ...plain, verb: "mode", title: "Change the mode", button: "Change", reason: "welcome", label: "Mode", choices: MODES, note: (at) => `It is ${at.overview.mode} now.` })}>Mode …</button>}
      {engineer && o.latched && <button type="button" onClick={() => order({ ...plain, verb: "reset", title: "Reset the latch", button: "Reset", reason: "needed", note: `Latched: ${o.latched}. The plant stands in observe after it.` })}>Reset the latch …</button>}
      {writes && !o.latched && <button type="button" onClick={() => order({ ...plain, verb: "fall-back", title: "Have the fallback act now", button: "Fall back", reason: "needed", note: (at) => (at.overview.fallback ? `Fallback ‘${at.overview.fallback}’ would act.` : "") })}>Fall back …</button>}
      <button type="button" onClick={() => order({ ...plain, verb: "note", proven: false, title: "Leave a note for proposers", button: "Leave it", reason: "needed", note: "Proposers that read, as a language model, are shown it for an hour of process time. Nothing is decided by it." })}>Note …</button>
      <button type="button" onClick={() => order({ ...plain, verb: "out-of-service", title: "Take a tag out of service", button: "Take out", reason: "needed", label: "Tag", choices: tags.filter((t) => !out.has(t)).map((t) => [t, t]) })}>Out of service …</button>
      {out.size > 0 && <button type="button" onClick={() => order({ ...plain, verb: "in-service", title: "Bring a tag back into service", button: "Bring back", reason: "welcome", label: "Tag", choices: [...out].map((t) => [t, t]) })}>In service …</button>}
    </div>
  );
}

export function Decision({ offer, proposal, now, order }: { offer: Offer; proposal: Proposal; now: Moment; order: (asked: Asked) => void }) {
  return (
    <div class="decision" role="group" aria-label="Your decision">
      <button type="button" class="act" onClick={() => order(approving(offer, proposal))} title="a">Approve …</button>
      <button type="button" onClick={() => order(rejecting(offer, proposal))} title="r">Reject …</button>
      <span>It waits for your yes or no since {moment(offer.since_s)}, and is void in {span(offer.void_s - now.at_s)}.
        {" "}<span class="quiet">Digest <code>{offer.digest.slice(0, 16)}</code></span></span>
    </div>
  );
}
