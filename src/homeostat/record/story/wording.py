"""How quantities, probabilities and commands are put to the operator."""

import math
from collections.abc import Iterable, Iterator, Mapping

from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.cost import KNOWING
from homeostat.domain.diagnosis import SOMETHING_ELSE, FaultMode, FaultProbability, FaultState
from homeostat.domain.events.recovery import Attempted, Compared
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.recovery import Command
from homeostat.domain.verdict import Finding

_LEAST = 0.005
"""Faults below this probability are not named [1]."""
_ROUNDED = 1e-9
"""What rounding may make of a probability [1]."""


def quantity(value: float, unit: str) -> str:
    """A value with its unit; a fraction has none."""
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"


def severities(fault_set: FaultProbability, plant: PlantDescription) -> str:
    """The faults of a set with their sizes; what is unknown by where it is, with a sign; the interval of the size."""
    if fault_set.faults and fault_set.faults[0].fault == SOMETHING_ELSE:
        return "something else"
    told = named(fault_set.faults, plant) or "nothing is wrong"
    if fault_set.between is None:
        return told
    low, high = fault_set.between
    return f"{told} ({low:.3g} to {high:.3g})"


def named(faults: Iterable[FaultState], plant: PlantDescription) -> str:
    """Faults with their sizes."""
    return " + ".join(_sized(f, plant.fault_mode(f.fault)) for f in faults)


def _sized(state: FaultState, mode: FaultMode) -> str:
    if mode.sizeless:
        return mode.name
    size = quantity(state.severity, mode.severity_unit) + every(state)
    return (
        f"{mode.label} {'+' if state.severity > 0.0 > mode.severity_range.low else ''}{size}"
        if mode.unknown
        else f"{mode.name} {size}"
    )


def every(state: FaultState) -> str:
    """How often what swings does; nothing of everything else."""
    return f" every {state.period_s:.0f} s" if state.period_s else ""


def probabilities(held: Iterable[FaultProbability], plant: PlantDescription) -> str:
    """Every set of faults that matters with its probability, most probable first."""
    named = [b for b in held if b.probability >= _LEAST]
    return "; ".join(f"{100 * b.probability:.0f} % {severities(b, plant)}" for b in named) or "no explanation"


def percent(probability: float) -> str:
    """A probability [1] in whole percent, and never none or all of it where it is not.

    >>> percent(0.3), percent(0.002), percent(0.998), percent(1.0)
    ('30', 'less than 1', 'more than 99', '100')
    """
    whole = round(100 * probability)
    if whole == 0 and probability > _ROUNDED:
        return "less than 1"
    return "more than 99" if whole == 100 and probability < 1.0 - _ROUNDED else f"{whole}"


def command(order: Command, plant: PlantDescription) -> str:
    """One command."""
    if order.value is None:
        return f"{order.tag} to automatic"
    unit = plant.tag(order.tag).unit
    return f"{order.tag} to {quantity(order.value, unit)}"


def commands(orders: Iterable[Command], plant: PlantDescription) -> str:
    """Commands in their order."""
    return ", ".join(command(order, plant) for order in orders) or "no command"


def compared(event: Compared) -> Iterator[str]:
    """What could be done, the cheapest first, with cost and certificate, and why some of it may not be done."""
    for alternative in event.alternatives:
        chosen = bool(event.chosen) and alternative.digest == event.chosen
        yield _alternative(alternative, event.currency) + ", chosen" * chosen


def _alternative(alternative: Alternative, currency: str) -> str:
    what, by = alternative.kind.value, who(alternative.proposer or "fallback", alternative.polished)
    end, seconds = alternative.name.rpartition(" > ")[2], f"{alternative.seconds:g} s"
    if alternative.kind is AlternativeKind.WAIT:
        what = f"wait {seconds} by {by}, then {end}"
    elif alternative.kind in (AlternativeKind.HOLD, AlternativeKind.TEST):
        what = f"{alternative.kind.value} {end} for {seconds} by {by}"
    elif alternative.kind is not AlternativeKind.LEAVE:
        what = f"{end} by {by}"
    text = f"{what}, {alternative.cost.total:.1f} {currency}"
    knowing = -sum(item.amount for item in alternative.cost.items if item.name == KNOWING)
    if knowing:
        text = f"{text} with {knowing:.1f} {currency} taken off for knowing more"
    if (certificate := alternative.certificate) is not None:
        text = f"{text}, risk at most {certificate.percent} %{' of doing worse than the fallback' * certificate.beside}"
    return text if alternative.admitted else f"{text}; not admitted: {alternative.refused}"


def lasting(event: Attempted) -> str:
    """A wait, a hold or a test with its length; empty for what is to last."""
    if event.what is AlternativeKind.RELEASE:
        return ""
    return " ".join((event.what.value, " > ".join(event.path), f"for {event.seconds:g} s")).replace("  ", " ")


def who(proposer: str, polished: bool) -> str:
    """Who proposed something, and whether the search bettered the numbers."""
    return f"{proposer} and search" if polished else proposer


def worst(findings: Iterable[Finding], scales: Mapping[str, float]) -> str:
    """The finding that is nearest to its limit, or furthest beyond, in terms of what counts in its unit.

    A check that refuses whatever the margins are is told in its own words.
    """
    found = min(findings, key=lambda f: f.margin / scales.get(f.unit, 1.0), default=None)
    if found is None:
        return "nothing was checked"
    if not math.isfinite(found.margin):  # a check that no margin can satisfy
        named = f"({found.criterion})"
        return found.message if named in found.message else f"{found.message} {named}"
    margin, unit = (
        (found.margin, found.unit) if found.deciding is None else (found.deciding.margin, found.deciding.unit)
    )
    whose = "" if found.violating is None else f" in {found.violating}"
    return f"worst margin {margin:+.3g}{'' if unit in ('1', '') else f' {unit}'}{whose} ({found.criterion})"
