"""Do the units of a flowsheet agree with each other, and with those that the tables state?"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from homeostat.process.blocks.flowsheet import Flowsheet
from homeostat.process.blocks.parts import Delay, Network, fault, held
from homeostat.process.blocks.term import TICK, Leaf, Term, leaves, nearest, where
from homeostat.process.blocks.units import NONE, NoUnitError, Unit, UnitError, of_term, read

_SHOWN: Final = 4
"""Most units that a message shows: of the symbols that are nearest to what does not agree."""
_SHOWS: Final = " measures"
"""In what is said of a sensor."""


@dataclass(frozen=True, slots=True)
class StatedUnits:
    """Units as the plant's tables state them: symbols such as ``J/(L K)``."""

    parameters: Mapping[str, str]
    """Of each parameter."""
    variables: Mapping[str, str]
    """Of each variable that a tag is bound to."""
    faults: Mapping[str, str]
    """Of each fault's severity."""


@dataclass(frozen=True, slots=True)
class Disagreement:
    """One place of a flowsheet where units do not agree."""

    said: str
    """In a sentence."""
    about: frozenset[Term] = frozenset()
    """Parameters and readings that it is made of, whose unit a table states."""
    apart: Unit | None = None
    """By what unit it is off; None where that is no matter of two units."""
    lacking: bool = False
    """Whether something in it has no unit, which is said elsewhere: no table states it, or its unit cannot be read."""


def disagreements(sheet: Flowsheet, stated: StatedUnits) -> tuple[str, ...]:
    """What does not agree, a sentence each; FlowsheetError where the flowsheet is not complete."""
    return tuple(dict.fromkeys(each.said for each in found_in(sheet, stated)))


def found_in(sheet: Flowsheet, stated: StatedUnits) -> tuple[Disagreement, ...]:
    """Every place of the flowsheet where units do not agree; FlowsheetError where it is not complete."""
    unread: list[str] = []
    units, symbols = _leaves(sheet, stated, unread), _symbols(sheet, stated)
    found = [Disagreement(said) for said in unread]
    for what, of, expected in _expected(sheet, stated):
        try:
            unit, needed = of_term(of, units, {}), _read(expected)
            if not unit.agrees(needed):
                said = f"{what} must be in {expected}, and what it is made of is not{_made_of((of,), symbols)}"
                about = leaves(of) & symbols.keys() | ({held(what.split()[1])} if _SHOWS in what else set())
                found.append(Disagreement(said, frozenset(about), needed.times(unit, -1.0)))
        except UnitError as wrong:
            said, lacking = f"{what}: {wrong}{_made_of(wrong.about, symbols)}", isinstance(wrong, NoUnitError)
            about = leaves(*wrong.about) & symbols.keys()
            found.append(Disagreement(said, frozenset(about), wrong.apart, lacking))
    return tuple(found)


def _made_of(terms: Collection[Term], symbols: Mapping[Term, str]) -> str:
    """The units that are stated of what ``terms`` are made of, for a message: the nearest, parameters first."""
    made = [leaf for leaf in nearest(*terms) if leaf in symbols]
    named = sorted(
        (leaf.op is not Leaf.PARAMETER, str(leaf.value).removesuffix("_now"), symbols[leaf]) for leaf in made[:_SHOWN]
    )
    told = [f"{name} [{symbol}]" for _, name, symbol in named]
    more = f" and {len(made) - _SHOWN} more" if len(made) > _SHOWN else ""
    return f" ({', '.join(told)}{more})" if told else ""


def _symbols(sheet: Flowsheet, stated: StatedUnits) -> dict[Term, str]:
    """The unit of each leaf that has one, as it is written."""
    symbols = {Term(Leaf.PARAMETER, value=name): symbol for name, symbol in stated.parameters.items()}
    symbols |= {held(name): symbol for name, symbol in stated.variables.items()}
    symbols |= {d.now: stated.parameters[d.name] for d in sheet.disturbances.values() if d.name in stated.parameters}
    return symbols | {s.term: s.unit for s in sheet.states.values()}


def _read(symbol: str) -> Unit:
    """The unit ``symbol``, or that per second where it ends so."""
    whole, per, second = symbol.rpartition(" per ")
    return read(whole).times(read(second), -1.0) if per else read(symbol)


def _leaves(sheet: Flowsheet, stated: StatedUnits, found: list[str]) -> dict[Term, Unit]:
    """The unit of each leaf that has one; what cannot be read goes to ``found``."""
    units: dict[Term, Unit] = {TICK: read("s")}

    def note(leaf: Term, symbol: str) -> None:
        try:
            units[leaf] = read(symbol)
        except UnitError as wrong:
            found.append(f"{leaf.value}: {wrong}")

    for name, symbol in stated.parameters.items():
        note(Term(Leaf.PARAMETER, value=name), symbol)
    for name, symbol in stated.faults.items():
        note(fault(name), symbol)
    for name, symbol in stated.variables.items():
        note(Term(Leaf.INPUT, value=name), symbol)
        note(held(name), symbol)
    for s in sheet.states.values():
        note(s.term, s.unit)
    units[sheet.time] = read("s")
    units |= {Term(Leaf.AGE, value=name): read("s") for name in sheet.faults}
    for name in sheet.faults:
        units.setdefault(fault(name), _undeclared(sheet, name))
    for a in sheet.actuators.values():
        units[a.position] = NONE
    for c in sheet.controllers.values():
        units[c.output] = NONE
        units[c.used] = units.get(held(c.measured), NONE)
    for d in sheet.disturbances.values():
        if (mean := Term(Leaf.PARAMETER, value=d.name)) in units:
            units[d.now] = units[mean]
    for name in (*sheet.memories, *sheet.switches):
        units[held(name)] = NONE
    for each in sheet.lags.values():
        if isinstance(each, Network):
            units |= {held(name): read("m") for name in each.junctions}
            units |= {held(branch.name): read("L/s") for branch in each.branches}
            continue
        column = each.oldest if isinstance(each, Delay) else each.name
        try:
            units[held(column)] = of_term(each.of, units, {})
        except UnitError as wrong:
            found.append(f"lag {each.name}: {wrong}")
    return units


def _undeclared(sheet: Flowsheet, name: str) -> Unit:
    """Unit of a fault that no table has, and which is 0 for ever: that of a standard fault, or whatever fits."""
    if name.endswith("_leak"):
        return read("1/s")
    return NONE if is_standard(sheet, name) else Unit((), None, any=True)


def is_standard(sheet: Flowsheet, name: str) -> bool:
    """Whether a fault comes with a vessel or an actuator of the flowsheet: the tables may leave it out."""
    return name.endswith("_leak") or any(name.startswith(f"{actuator}_") for actuator in sheet.actuators)


def _expected(sheet: Flowsheet, stated: StatedUnits) -> Iterator[tuple[str, Term, str]]:
    """What each term is, the term, and the unit that it must have."""
    for name, rate in sheet.complete().items():
        state = sheet.states[name]
        yield f"the rate of {name}", rate, f"{state.unit} per s"
        yield from ((f"the start of {name}", of, state.unit) for of in (state.start, state.usual))
    for a in sheet.actuators.values():
        yield from ((f"a time constant of {a.name}", tau, "s") for tau in a.lags)
        if a.automatic is not None:
            yield f"the command of {a.name}", a.automatic, "1"
        yield f"what is withheld from {a.name}", a.withheld, "1"
    for c in sheet.controllers.values():
        error = c.used
        yield from ((f"the feed-forward of {c.name}", of, "1") for of in (c.forward, c.law.beside))
        yield f"the lowest output of {c.name}", c.law.least, "1"
        if c.law.rests is not None:
            yield f"when {c.name} rests", where(c.law.rests, 1.0, 0.0), "1"
        if c.law.held is not None:
            yield f"when {c.name} is held", where(c.law.held, 1.0, 0.0), "1"
        if c.law.meanwhile is not None:
            yield f"the output of {c.name} while it is held", c.law.meanwhile, "1"
        yield f"Kp_{c.name} times its error", c.gain("Kp") * error, "1"
        yield f"Ki_{c.name} times its error", c.gain("Ki") * error, "1/s"
        if c.setpoint is not None and (unit := stated.variables.get(c.measured)):
            yield f"the setpoint of {c.name}", c.setpoint, unit
    for each in sheet.lags.values():
        if isinstance(each, Network):
            for branch in each.branches:
                yield from ((f"a head of {branch.name}", end, "m") for end in branch.ends)
                yield f"the resistance of {branch.name}", branch.resistance, "m s2/L2"
                yield from zip((f"the pump of {branch.name}",) * 3, branch.pump, ("m", "m s/L", "1"), strict=True)
        if (tau := getattr(each, "tau", None)) is not None:
            yield f"the time constant of {each.name}", tau, "s"
    for d in sheet.disturbances.values():
        if d.sd is not None and (unit := stated.parameters.get(d.name)):
            yield f"the noise of {d.name}", d.sd, unit
        if d.tau is not None:
            yield f"the time constant of {d.name}", d.tau, "s"
    for s in sheet.sensors.values():
        if unit := stated.variables.get(s.name):
            yield f"what {s.name} measures", s.of, unit
            yield f"what faults add to {s.name}", s.off, unit
            yield f"the calibration error of {s.name}", s.bias, "1" if s.relative else unit
            yield f"the noise of {s.name}", s.noise, "1" if s.relative else unit
