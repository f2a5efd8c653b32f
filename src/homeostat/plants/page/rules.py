"""How the plant is run and what must hold: tables of states, transitions, limits, criteria, fallbacks and prices."""

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Limit
from homeostat.domain.plant.state_machine import State
from homeostat.domain.recovery import Command, FallbackStrategy
from homeostat.plants.described import DescribedPlant
from homeostat.plants.page.machine import AUTOMATIC, DECISION, FALLBACK, from_start, kind_of
from homeostat.plants.page.markup import Markup, element
from homeostat.plants.page.tables import NOTHING, Cell, code, joined, number, quantity, severe, span, table

_TAKEN = {AUTOMATIC: "by itself", DECISION: "by decision", FALLBACK: "by a fallback"}


def states(plant: DescribedPlant) -> Markup:
    """Every state."""
    columns = ("State", "What it is", "Risk", "Settled when", "Needs", "May be commanded")
    rows = [
        (
            [state.name, *_marks(state, plant.description)],
            [state.label, plant.remarks.get(state.name, "")],
            str(state.risk),
            code(state.settled_when.text),
            joined(sorted(state.requires)),
            _commanded(state, plant.description),
        )
        for state in from_start(plant.description.machine)
    ]
    note = (
        "Risk is a rank; 0 is normal operation. What may be commanded has its range, and in brackets its design value."
    )
    return table("states", "States", columns, rows, note)


def transitions(plant: DescribedPlant) -> Markup:
    """Every transition."""
    columns = ("Transition", "From", "To", "Event", "Guard", "Taken", "What for")
    rows = [
        (
            t.name,
            t.source,
            t.target,
            t.event,
            code(t.guard.text),
            _TAKEN[kind_of(t, plant.description)],
            plant.remarks.get(t.name, NOTHING),
        )
        for state in from_start(plant.description.machine)
        for t in plant.description.machine.transitions
        if t.source == state.name
    ]
    note = "By itself: as soon as the guard holds. By decision: somebody releases it, and the guard must hold then."
    return table("transitions", "Transitions", columns, rows, note)


def limits(plant: PlantDescription) -> Markup:
    """Every limit."""
    columns = ("Limit", "What it protects", "Kind", "What must hold", "How it trips", "Brought back by", "Source")
    rows = [
        (
            x.name,
            x.description or NOTHING,
            [severe(f"hard {x.kind.value}") if x.hard else x.kind.value],
            _formulas(x, plant),
            _trip(x, plant),
            _served(x, plant),
            x.source,
        )
        for x in sorted(plant.limits.limits, key=lambda x: not x.hard)
    ]
    note = (
        "A hard limit latches the fallback. It trips once its violation, added up over time, reaches a threshold; "
        "without one at the first violation."
    )
    return table("limits", "Limits", columns, rows, note)


def criteria(plant: PlantDescription) -> Markup:
    """Every acceptance criterion."""
    columns = ("Criterion", "What it asks for", "Kind", "What must hold after a release", "Cured by", "Source")
    rows = [
        (
            c.name,
            c.description or NOTHING,
            [severe("hard") if c.hard else "has a price"],
            code(c.formula.text),
            c.owner.value,
            c.source,
        )
        for c in plant.limits.criteria
    ]
    return table("criteria", "Acceptance criteria", columns, rows, "Nothing is released that violates a hard one.")


def fallbacks(plant: PlantDescription) -> Markup:
    """Every fallback strategy, step by step."""
    if not plant.fallback_strategies:
        return table("fallbacks", "Fallbacks", (), ())
    parts = [_fallback(at, strategy, plant) for at, strategy in enumerate(plant.fallback_strategies)]
    return element("div", parts, id="fallbacks")


def prices(plant: DescribedPlant) -> Markup:
    """What everything that does not forbid costs."""
    known = plant.prices
    rows: list[tuple[Cell, ...]] = [
        ("product", "one unit of what is made", number(known.product)),
        ("release", "one set of commands", number(known.release)),
        *((name, "one hour in the state", number(price)) for name, price in known.states.items() if price),
        *((name, "one hour at one scale outside", number(price)) for name, price in known.outside.items()),
        *((name, "one violation", number(price)) for name, price in known.violation.items()),
    ]
    note = "What no table states follows from the product. States that cost nothing are left out."
    return table("prices", "Prices", ("What", "Per", f"Price [{known.currency}]"), rows, note)


def _marks(state: State, plant: PlantDescription) -> list[Markup]:
    longest = plant.start_up.longest_s.get(state.name)
    told = ["the plant starts here"] if state.initial else []
    told += ["a recovery may end here"] if state.recovery_target else []
    told += [f"start-up, at most {number(longest)} s"] if longest is not None else []
    return [element("span", text, class_="quiet") for text in told]


def _commanded(state: State, plant: PlantDescription) -> list[str]:
    """What a state leaves a choice about, line by line, and what it does not."""
    units = {tag.name: tag.unit for tag in plant.tags}
    told, fixed = [], []
    for x in state.setpoints:
        unit = units.get(x.tag, "1")
        if x.low == x.high:
            fixed.append(f"{x.tag} = {'automatic' if x.design is None else quantity(x.low, unit)}")
        else:
            design = "automatic" if x.design is None else number(x.design)
            told.append(f"{x.tag} {span(x.low, x.high, unit)} ({design})")
    return [*told, ", ".join(fixed)] if fixed else told


def _formulas(limit: Limit, plant: PlantDescription) -> list[str]:
    found: list[str] = [code(limit.formula.text)]
    other = plant.start_up.limits.get(limit.name)
    if other is not None:
        found.append(element("span", "during start-up ", code(other.formula.text)))
    return found


def _trip(limit: Limit, plant: PlantDescription) -> list[str]:
    rule = plant.trips.get(limit.name)
    if rule is None:
        return []
    unit = limit.formula.unit
    told: list[str] = [f"after {quantity(rule.cusum, unit, ' s')} of violation" if rule.cusum else "at once"]
    told += [f"{quantity(limit.lead, unit)} before the limit"] if limit.lead else []
    told += [f"after {number(rule.grace_s)} s undecided" if rule.grace_s else "at once when undecided"]
    if rule.carrier is not None:
        told.append(element("span", "carried meanwhile by ", code(rule.carrier.text)))
    if rule.fastest is not None:
        told.append(element("span", "not at once where it falls faster than ", code(rule.fastest.text)))
    if rule.fallen is not None:
        told.append(element("span", "carried then by ", code(rule.fallen.text)))
    if rule.lift:
        told.append(f"may be lifted by {quantity(rule.lift, unit)} for {number(rule.lift_s)} s")
    return told


def _served(limit: Limit, plant: PlantDescription) -> list[str]:
    told = []
    for strategy in plant.fallback_strategies:
        if (effect := strategy.serves.get(limit.name)) is not None:
            rest = f", to within {quantity(effect.rest, limit.formula.unit)}" if effect.rest else ""
            told.append(f"{strategy.name} in {number(effect.acts_within_s)} s{rest}")
    return told


def _fallback(at: int, strategy: FallbackStrategy, plant: PlantDescription) -> Markup:
    rows = [
        (str(step), c.tag, _value(c, plant), _rate(c, plant), "yes" if c.tag in strategy.forced else "no")
        for step, c in enumerate(strategy.actions.commands, start=1)
    ]
    columns = ("Step", "Tag", "To", "At most", "Even out of service")
    label = plant.machine.state(strategy.actions.target).label
    told = [f"It leads to {label} ({strategy.actions.target}).", f"It brings back {joined(strategy.serves)}."]
    told += [f"It sets {name} aside: {reason}." for name, reason in strategy.waived.items()]
    return table(f"fallback-{at}", f"Fallback {strategy.name}", columns, rows, " ".join(told))


def _value(command: Command, plant: PlantDescription) -> str:
    return "automatic" if command.value is None else quantity(command.value, plant.tag(command.tag).unit)


def _rate(command: Command, plant: PlantDescription) -> str:
    return "a step" if command.rate is None else quantity(command.rate, plant.tag(command.tag).unit, "/s")
