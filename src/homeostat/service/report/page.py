"""The report as a page that needs nothing else: no script, no network, light and dark."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Final

from homeostat import __version__
from homeostat.domain.lasting import lasting
from homeostat.plants.page.markup import Markup, element, together
from homeostat.service.report.facts import Facts, Lasting
from homeostat.service.report.residuals import Followed

_STYLE: Final = """
:root{color-scheme:light dark} body{font:15px/1.5 system-ui,sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;width:100%} th,td{text-align:left;padding:.25rem .6rem;border-bottom:1px solid #8886}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums} h2{margin-top:2rem}
"""
_HOUR_S: Final = 3600.0
_ADVICE: Final = (
    "A diagnosis or an alarm that nobody can explain at the plant is a false one: say why, before the mode is raised."
)


def page(facts: Facts, followed: Followed | None = None) -> str:
    """The page of ``facts`` as HTML that is well-formed XML as well; equal facts give equal pages.

    ``followed``: what the twin made of the history; None where there is none.
    """
    title = f"{facts.plant or 'plant'}: {lasting(facts.length_s)} attached"
    head = element("head", element("meta", charset="utf-8"), element("title", title), element("style", Markup(_STYLE)))
    parts = [
        element("h1", title),
        element("p", f"From {facts.from_s:.10g} s to {facts.to_s:.10g} s of process time; homeostat {__version__}."),
        *([element("p", element("strong", f"What came last is missing: {facts.lacking}."))] if facts.lacking else ()),
        *_part("Modes", _modes(facts), "The guard never stood in any."),
        *_part("Alarms", _lasting(facts, facts.alarms, "Alarm"), "There was none."),
        *_part("Readings that were bad", _lasting(facts, facts.bad, "Tag"), "None was."),
        *_part("Readings that were uncertain", _lasting(facts, facts.uncertain, "Tag"), "None was."),
        *_part("Diagnoses", _diagnosed(facts), "Nothing was diagnosed."),
        *_part("Requests", _asked(facts), "Nothing was asked for."),
        *_part("Twin against plant", _followed(followed), "There is no history that the twin could follow."),
        *_part("Processes", _rows(("What", "Times"), ((k, str(n)) for k, n in sorted(facts.counts.items()))), "-"),
        element("p", _ADVICE),
    ]  # fmt: skip
    return f"<!DOCTYPE html>\n{element('html', head, element('body', together(parts)), lang='en')}\n"


def _part(title: str, table: Markup | list[Markup] | None, nothing: str) -> list[Markup]:
    found = [element("p", nothing)] if table is None else table if isinstance(table, list) else [table]
    return [element("h2", title), *found]


def _modes(facts: Facts) -> Markup | None:
    stood = facts.modes | ({"no guard": facts.unguarded} if facts.unguarded.lasted_s > 0.0 else {})
    rows = ((mode, lasting(x.lasted_s), f"{100 * facts.share(x):.1f} %") for mode, x in stood.items())
    return _rows(("Mode", "Time", "Part"), rows)


def _lasting(facts: Facts, group: Mapping[str, Lasting], what: str) -> Markup | None:
    ordered = sorted(group.items(), key=lambda item: (-item[1].lasted_s, item[0]))
    days = max(facts.length_s / (24 * _HOUR_S), 1e-9)
    rows = (
        (
            name, str(x.times), f"{x.times / days:.1f}", lasting(x.lasted_s), f"{100 * facts.share(x):.2f} %",
            lasting(x.longest_s), x.text,
        )
        for name, x in ordered
    )  # fmt: skip
    return _rows((what, "Times", "A day", "Time", "Part", "Longest", "Said last"), rows)


def _diagnosed(facts: Facts) -> Markup | None:
    rows = ((f"{at_s:.10g} s", name, f"{100 * probability:.0f} %") for at_s, name, probability in facts.diagnosed)
    return _rows(("When", "Likeliest", "Probability"), rows)


def _asked(facts: Facts) -> Markup | None:
    def commands(name: str) -> str:
        found = facts.asked[name].commands
        return ", ".join(f"{c.tag} to {'automatic' if c.value is None else f'{c.value:.4g}'}" for c in found)

    rows = (
        (f"{x.at_s:.10g} s", name, x.proposer, x.status, commands(name), x.reason) for name, x in facts.asked.items()
    )
    return _rows(("When", "Request", "By", "Status", "Commands", "Why no further"), rows)


def _followed(followed: Followed | None) -> list[Markup] | None:
    """A table of residuals by tag; None where there are none."""
    if followed is None or not followed.residuals:
        return None
    head = ("Tag", "Unit", "Plant less twin", "Of its scale", "Between stretches", "Within", "Drift a day")
    rows = _rows(
        head,
        (
            (r.tag, r.unit, f"{r.mean:+.3g}", f"{100 * r.of_scale:+.0f} %", f"{r.spread:.2g}", f"{r.within:.2g}",
             "-" if math.isnan(r.drift) else f"{r.drift:+.2g}")
            for r in followed.residuals
        ),
    )  # fmt: skip
    assert rows is not None, "there are residuals"
    text = f"The twin followed {followed.stretches} stretches in open loop; {followed.left_out} were left out."
    return [element("p", text), rows]


def _rows(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> Markup | None:
    """A table; None where it has no rows."""
    body = [element("tr", [element("td", cell) for cell in row]) for row in rows]
    if not body:
        return None
    first = element("tr", [element("th", name, scope="col") for name in head])
    return element("table", element("thead", first), element("tbody", list(body)))
