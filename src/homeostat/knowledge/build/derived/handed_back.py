"""What follows for manual outputs that one state commands by hand and another one says nothing of."""

from collections.abc import Collection, Iterable, Iterator

from homeostat.knowledge.build.derived.draft import Draft, Line, number
from homeostat.knowledge.build.derived.loops import driven_by_loops


def add_handed_back(draft: Draft) -> None:
    """Add rows that hand manual outputs back to automatic; what follows from loops and states must be there already.

    A state that says nothing of an output has one where the plant comes to it from a state in which the output may be
    by hand, unless its silence may mean that the output stays: see `_stays`.
    """
    states = [line["id"] for line in draft.lines("states")]
    stated, commanded = _by_tag(draft.lines("setpoints")), _by_tag(draft.lines("fallbacks"))
    for output in _with_automatic(draft):
        rows = stated.get(output["tag"], [])
        sent = [line for line in commanded.get(output["tag"], ()) if line["value"]]
        fixed, chosen = [line for line in rows if line["design"]], [line for line in rows if _is_a_choice(line)]
        if not (fixed or chosen or sent):
            continue
        spoken = {line["state"] for line in rows}
        silent = [state for state in states if state not in spoken]
        stays = _stays(draft, silent, {line["state"] for line in fixed} | {line["target"] for line in sent})
        left = stays | {line["state"] for line in chosen}
        reached = {line["target"] for line in draft.lines("transitions") if line["source"] in left}
        for state in silent:
            if state in reached - stays:
                own = {"state": state, "tag": output["tag"], "low": output["low"], "high": output["low"]}
                draft.add("setpoints", (*fixed, *chosen, *sent)[0].follows, own)


def _stays(draft: Draft, silent: Collection[str], design: set[str]) -> set[str]:
    """States in which an output is by hand by ``design``, with the ``silent`` ones in which it may be meant to stay so.

    Where a fallback led to nothing is undone; it may have come from anywhere. And of states that follow on each other
    without a decision, as phases of a batch do, nobody can tell whether a silent one goes on with the others.
    """
    found = design | draft.column("fallbacks", "target") & set(silent)
    awaited = [(line["source"], line["target"]) for line in draft.lines("transitions") if line["decision"] == "no"]
    ways = [*awaited, *((target, source) for source, target in awaited)]
    while more := {there for here, there in ways if here in found and there in silent} - found:
        found |= more
    return found


def _with_automatic(draft: Draft) -> Iterator[Line]:
    """Manual outputs that may be handed back: as the table of writable tags says, or else where a loop drives them."""
    driven = driven_by_loops(draft)
    for line in draft.lines("signals"):
        if line["relation"] == "overrides":
            row = draft.find("writables", line["tag"])
            said = "" if row is None else row["automatic"]
            if said == "yes" or (not said and line["component"] in driven):
                yield line


def _by_tag(lines: Iterable[Line]) -> dict[str, list[Line]]:
    found: dict[str, list[Line]] = {}
    for line in lines:
        found.setdefault(line["tag"], []).append(line)
    return found


def _is_a_choice(line: Line) -> bool:
    """Whether a state admits more than one value."""
    low, high = number(line["low"]), number(line["high"])
    return low is not None and high is not None and low < high
