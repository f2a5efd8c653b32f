"""What came out, in sentences that are computed from the rows."""

from collections.abc import Sequence
from itertools import groupby
from typing import Final

from homeostat.evaluate.report.groups import (
    Group,
    Origin,
    arms,
    in_order,
    overall,
    plants,
    scenarios,
    succeeded,
    violated,
)
from homeostat.evaluate.report.measures import Comparison, References, comparisons
from homeostat.evaluate.report.statistics import Rate, rate
from homeostat.record.row import Row

_CLEAR: Final = 0.05
"""Adjusted probability below which a difference is called clear [1]."""


def what_was_run(rows: Sequence[Row], unmade: int = 0) -> list[tuple[str, str]]:
    """What the study consists of: a name and the words to it; ``unmade`` runs have no row."""
    ordered = in_order(rows)
    facts = [("Runs", f"{len(ordered)}")]
    if unmade:
        lacking = f"{unmade} could not be carried out and {'is' if unmade == 1 else 'are'} in no figure and no table"
        facts = [("Runs", f"{len(ordered)} of {len(ordered) + unmade}; {lacking}")]
    for plant in plants(ordered):
        own = [row for row in ordered if row.case == plant]
        facts.append((f"Plant {plant}", f"{len(own)} runs; scenarios: {', '.join(scenarios(own))}"))
    facts.append(("Proposers", ", ".join(_named(ordered))))
    facts.append(("Seeds", spans(sorted({row.seed for row in ordered}))))
    return facts


def summary(rows: Sequence[Row], reference: str | None = None) -> list[tuple[str, list[str]]]:
    """Per plant: one sentence for each proposer, and what the comparison with the reference says."""
    ordered = in_order(rows)
    known = References.among(ordered)
    compared = {(c.group.case, c.group.name): c for c in comparisons(ordered, reference)}
    told = []
    for plant, groups in groupby(overall(ordered), key=lambda group: group.case):
        sentences = []
        for group in groups:
            missed = known.missed(group.rows) if group.source is not Origin.REFERENCE else None
            sentences.append(_sentence(group, missed, compared.get((plant, group.name))))
        told.append((plant, sentences))
    return told


def spans(seeds: Sequence[int]) -> str:
    """Rising whole numbers in few words: ``1–10, 12``."""
    runs: list[list[int]] = []
    for seed in seeds:
        if runs and runs[-1][1] == seed - 1:
            runs[-1][1] = seed
        else:
            runs.append([seed, seed])
    return ", ".join(f"{first}" if first == last else f"{first}–{last}" for first, last in runs)


def seconds(value: float) -> str:
    """Whole seconds, and parts of the first one: a limit that was violated for a tick was not violated for 0 s."""
    return f"{value:.1g}" if 0.0 < value < 0.5 else f"{value:.0f}"


def _named(rows: Sequence[Row]) -> list[str]:
    """Proposers, and how those answered that were no model asked there and then."""
    sources = {group.name: group.source for group in overall(rows)}
    return [n if sources[n] is Origin.MEASURED else f"{n} ({sources[n].value})" for n in arms(rows)]


def _sentence(group: Group, missed: Rate | None, compared: Comparison | None) -> str:
    good = rate([succeeded(row) for row in group.rows])
    assert good is not None
    origin = "" if group.source is Origin.MEASURED else f" ({group.source.value})"
    words = f"{group.name}{origin}: {good.count} of {good.of} runs succeeded{_interval(good)}"
    outside = [row.exposure_s for row in group.rows if violated(row)]
    if outside:
        runs = "1 run" if len(outside) == 1 else f"{len(outside)} runs"
        words += f"; {runs} violated a hard limit, for {seconds(max(outside))} s at most"
    else:
        words += "; none violated a hard limit"
    if missed is not None:
        words += f"; {missed.count} of the {missed.of} successes that hindsight shows possible were missed"
    return words + (f"; {_against(compared)}." if compared is not None else ".")


def _against(one: Comparison) -> str:
    more, less, pairs = one.ended(True, False), one.ended(False, True), len(one.pairs)
    if more == less:
        return f"beside {one.reference}, as many successes on the same {pairs} plants"
    clear = "a clear difference" if one.p_adjusted < _CLEAR else "no clear difference"
    difference = f"{abs(more - less)} {'more' if more > less else 'fewer'}"
    successes = "success" if abs(more - less) == 1 else "successes"
    p = "p < 0.001" if one.p_adjusted < 0.001 else f"p = {one.p_adjusted:.3f}"
    return f"beside {one.reference}, {difference} {successes} on the same {pairs} plants: {clear} (adjusted {p})"


def _interval(good: Rate) -> str:
    ends = good.interval
    return "" if ends is None else f" (95 % interval {100.0 * ends.low:.0f} to {100.0 * ends.high:.0f} %)"
