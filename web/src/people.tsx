// Who is at the page: signing in and out.

import { useRef, useState } from "preact/hooks";
import { send, type Me } from "./told";

export function SignIn({ me, signed, title }: { me: Me; signed: (me: Me) => void; title: string }) {
  const [said, say] = useState(""), [busy, setBusy] = useState(false);
  const name = useRef<HTMLInputElement>(null), password = useRef<HTMLInputElement>(null), code = useRef<HTMLInputElement>(null);
  const submit = async (e: Event) => {
    e.preventDefault();
    setBusy(true);
    const proof = { name: name.current!.value, password: password.current!.value, code: code.current?.value ?? "" };
    try {
      signed(await send<Me>("POST", "/api/session", proof, me.token));
    } catch (refused) {
      say((refused as Error).message);
      if (code.current) code.current.value = "";
      if (password.current) { password.current.value = ""; password.current.focus(); }
    }
    setBusy(false);
  };
  return (
    <main class="signin">
      <form onSubmit={submit} aria-label="Sign in">
        <h1>{title}</h1>
        <label>Name <input ref={name} name="name" autocomplete="username" required maxLength={60} autofocus /></label>
        <label>Password <input ref={password} name="password" type="password" autocomplete="current-password" required maxLength={128} /></label>
        {me.codes && <label>Code of your authenticator, if you have one <input ref={code} name="code" inputMode="numeric" autocomplete="one-time-code" pattern="[0-9 ]*" title="six digits" maxLength={12} /></label>}
        {said && <p class="warn" role="alert">△ {said}</p>}
        <button type="submit" disabled={busy}>{busy ? "Signing in …" : "Sign in"}</button>
        {me.sign_on && <a class="button" href="/oidc/sign-in">Sign in with {me.sign_on}</a>}
      </form>
    </main>
  );
}

export function Who({ me, signed }: { me: Me; signed: (me: Me) => void }) {
  if (!me.people || !me.name) return null;
  const out = () => void send<Me>("DELETE", "/api/session", {}, me.token).then(signed, () => location.reload());
  return <span class="who">{me.name}, {me.access} <button type="button" onClick={out}>Sign out</button></span>;
}
