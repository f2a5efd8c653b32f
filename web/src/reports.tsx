// Reports of shifts and weeks: made where the console runs, taken away as a file.

import { useState } from "preact/hooks";
import { send, type Me } from "./told";
import { moment } from "./words";

const LENGTHS: [string, string][] = [["8h", "8 h"], ["24h", "24 h"], ["7d", "7 days"], ["all", "All"]];
const LONGEST_MS = 130_000;

function take(name: string, page: string): void {
  const at = URL.createObjectURL(new Blob([page], { type: "text/html" })), link = document.createElement("a");
  link.href = at;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(at), 60_000);
}

export function ReportsOf({ at, me }: { at: number; me: Me }) {
  const [making, setMaking] = useState(""), [said, say] = useState(""), [failed, fail] = useState("");
  const make = async (last: string, words: string) => {
    setMaking(words); say(""); fail("");
    try {
      const made = await send<{ name: string; page: string }>("POST", "/api/report", { last, at_s: at }, me.token, LONGEST_MS);
      take(made.name, made.page);
      say(`✓ ${made.name}`);
    } catch (e) { fail((e as Error).message); } finally { setMaking(""); }
  };
  return (
    <section class="wide" aria-label="Reports"><h2>Reports <span class="quiet">what happened until {moment(at)}, as a page to keep</span></h2>
      <p class="choice">{LENGTHS.map(([last, words]) => <button type="button" key={last} disabled={making !== ""} onClick={() => void make(last, words)}>{words === "All" ? "All of it" : `Last ${words}`}</button>)}
        <span role="status">{making ? `The report is being made (${making}) …` : said}</span></p>
      {failed && <p class="warn" role="alert">△ {failed}</p>}
    </section>
  );
}
