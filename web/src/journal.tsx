// The journal line by line, and what its verification says.

import { useEffect, useState } from "preact/hooks";
import { isKept } from "./kept";
import { ask, type JournalPage, type Verified } from "./told";
import { moment } from "./words";

// A journal of months is read as a whole for it.
const READ_MS = 600_000;

export function JournalView({ seek }: { seek: (at: number) => void }) {
  const [found, setFound] = useState<JournalPage | null>(null);
  const [said, setSaid] = useState<Verified | null>(null);
  const [kind, setKind] = useState(""), [words, setWords] = useState(""), [before, setBefore] = useState(0), [failed, fail] = useState(""), [unsaid, unsay] = useState("");
  useEffect(() => {
    const query: Record<string, string> = { words };
    if (kind) query.kind = kind;
    if (before) query.before = String(before);
    let gone = false; // what was asked for before may be answered last
    const wait = setTimeout(() => void ask<JournalPage>("/api/journal", query, READ_MS).then((page) => { if (!gone) { setFound(page); fail(""); } }, (e: Error) => { if (!gone) fail(e.message); }), 250);
    return () => { gone = true; clearTimeout(wait); };
  }, [kind, words, before]);
  const verify = () => { setSaid(null); unsay(""); void ask<Verified>("/api/verified", {}, READ_MS).then(setSaid, (e: Error) => unsay(e.message)); };
  useEffect(verify, []);
  return (
    <section id="journal" class="wide" tabIndex={-1} aria-label="Journal">
      <h2>Journal</h2>
      <p role="status">{said ? <b class={said.whole ? "" : "bad"}>{said.whole ? "✓" : "■"} {said.text}</b> : unsaid ? <b class="warn">△ Not verified: {unsaid}</b> : "Being verified …"} {!isKept() && <button type="button" onClick={verify}>Verify again</button>}</p>
      <p class="filters">
        <label>Kind <select value={kind} onChange={(e) => { setKind(e.currentTarget.value); setBefore(0); }}>
          <option value="">all</option>{found?.kinds.map((k) => <option key={k} value={k}>{k}</option>)}</select></label>
        <label>With the words <input type="search" value={words} maxLength={200} onInput={(e) => { setWords(e.currentTarget.value); setBefore(0); }} /></label>
      </p>
      {(failed || found?.trouble) && <p class="warn" role="alert">△ {failed || found?.trouble}</p>}
      <div class="scroll" tabIndex={0} role="region" aria-label="Lines of the journal"><table class="lines">
        <thead><tr><th class="n">Line</th><th class="n">At</th><th>What</th><th>Said</th></tr></thead>
        <tbody>{found?.lines.map((l) => (
          <tr key={l.number}><td class="n quiet">{l.number}</td>
            <td class="n"><button type="button" class="link" onClick={() => seek(l.at_s)}>{moment(l.at_s)}</button></td>
            <td>{l.kind}</td><td class="small"><code>{l.text}</code></td></tr>))}</tbody>
      </table></div>
      <p class="choice">{before > 0 && <button type="button" onClick={() => setBefore(0)}>The latest</button>}
        {found?.more && <button type="button" onClick={() => setBefore(found.lines[found.lines.length - 1]!.number)}>Older ones</button>}</p>
    </section>
  );
}
