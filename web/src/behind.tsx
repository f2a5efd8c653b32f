// What is behind a word: a button that shows and hides it, so that keyboard and finger reach it as a mouse does.

import type { ComponentChildren } from "preact";
import { useId, useState } from "preact/hooks";

export function Behind({ word, about, children }: { word: ComponentChildren; about: string; children: ComponentChildren }) {
  const [open, set] = useState(false), id = useId();
  const press = (e: KeyboardEvent) => { if (e.key === "Escape" && open) { set(false); e.stopPropagation(); } };
  return (
    <>
      <button type="button" class="behind" title={about} aria-expanded={open} aria-controls={open ? id : undefined} onClick={() => set(!open)} onKeyDown={press}>{word}</button>
      {open && <span class="what" id={id}>{children}</span>}
    </>
  );
}
