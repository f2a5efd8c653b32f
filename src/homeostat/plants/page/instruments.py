"""What the plant is made of, what is measured and commanded, and the constants: tables of the page."""

from homeostat.domain.plant.description import PlantDescription, Relation, Signal
from homeostat.domain.plant.tag import Role
from homeostat.plants.described import DescribedPlant
from homeostat.plants.page.markup import Markup, element
from homeostat.plants.page.tables import NOTHING, code, number, quantity, span, table

_RELATIONS = {
    Relation.MEASURES: "measured by",
    Relation.DRIVES: "drives",
    Relation.REPORTS: "reported by",
    Relation.SETS: "setpoint of",
    Relation.OVERRIDES: "overrides",
}


def equipment(plant: PlantDescription) -> Markup:
    """What is a part of what, as nested lists."""
    tops = [c.name for c in plant.components if c.part_of is None]
    return element("ul", [_part(name, plant) for name in tops], class_="equipment")


def tags(plant: DescribedPlant) -> Markup:
    """Every tag."""
    columns = ("Tag", "What it is", "Role", "Range", "Noise", "Where", "Who writes it", "Rate, increment", "Reading")
    rows = [
        (
            element("code", s.tag.name, id=f"tag-{at}"),
            s.tag.description or NOTHING,
            s.tag.role.value,
            span(s.tag.range.low, s.tag.range.high, s.tag.unit),
            _noise(s, plant),
            f"{_RELATIONS[s.relation]} {s.component}",
            _written(s, plant.description),
            _rates(s, plant.description),
            _reading(s, plant.description),
        )
        for at, s in enumerate(plant.description.signals)
    ]
    note = (
        "Role: PV is measured, SP a setpoint, MV a command, STATUS reported by equipment. Noise is the standard "
        "deviation of one reading. Reading: how old it may be, after how long without a change it is frozen, and the "
        "fastest change that the process can make; what is older, frozen or faster is not believed."
    )
    return table("tags", "Tags", columns, rows, note)


def loops(plant: PlantDescription) -> Markup:
    """Every control loop."""
    columns = ("Loop", "What it is", "Controller", "Holds", "At", "By", "Gain", "Integral gain")
    rows = [
        (x.name, x.label, x.controller, x.process_variable, x.setpoint, x.manipulated_variable, x.gain, x.reset)
        for x in plant.loops
    ]
    return table("loops", "Control loops", columns, rows)


def parameters(plant: PlantDescription) -> Markup:
    """Every parameter of the process model."""
    columns = ("Symbol", "What it is", "Value", "Standard deviation", "Belongs to")
    rows = [
        (code(p.symbol), p.description or NOTHING, quantity(p.value, p.unit), quantity(p.sd, p.unit), p.component)
        for p in plant.parameters
    ]
    note = "The true plant of a simulated run, and every member of an ensemble, is drawn from these uncertainties."
    return table("parameters", "Parameters", columns, rows, note)


def equations(plant: PlantDescription) -> Markup:
    """Every equation."""
    columns = ("Equation", "What it is", "Of", "")
    rows = [(e.name, e.label, e.operator, code(f"{e.result} = {e.expression.text}")) for e in plant.equations]
    return table("equations", "Equations", columns, rows, "They are for readers; the process model has its own.")


def _part(name: str, plant: PlantDescription) -> Markup:
    component = next(c for c in plant.components if c.name == name)
    own = [s.tag.name for s in plant.signals if s.component == name]
    inner = [_part(c.name, plant) for c in plant.components if c.part_of == name]
    shown = [element("strong", name), element("span", f" {component.label}")]
    shown += [element("span", f" · {', '.join(own)}", class_="quiet")] if own else []
    return element("li", shown, [element("ul", inner)] if inner else [])


def _noise(signal: Signal, plant: DescribedPlant) -> str:
    if signal.tag.name not in plant.noise:
        return NOTHING
    value, unit = plant.noise[signal.tag.name]
    return f"{number(100 * value)} % of reading" if unit == "1" != signal.tag.unit else quantity(value, unit)


def _written(signal: Signal, plant: PlantDescription) -> str | list[str]:
    name = signal.tag.name
    held = [f"{loop.controller}, and nobody from outside" for loop in plant.loops if loop.manipulated_variable == name]
    rule = plant.writables.get(name)
    if rule is None:
        silent = signal.tag.role in (Role.PV, Role.STATUS)
        return held or (NOTHING if silent else "nobody from outside")
    told = [f"guard; ramped by the {rule.ramped_by.value}; ±{quantity(rule.tolerance, signal.tag.unit)} accepted"]
    return [*held, *told, *(["may be handed back to automatic"] if rule.automatic else [])]


def _rates(signal: Signal, plant: PlantDescription) -> list[str]:
    tag, rule = signal.tag, plant.writables.get(signal.tag.name)
    told = [f"{quantity(tag.rate_limit, tag.unit, '/s')}"] if tag.rate_limit is not None else []
    if rule is not None and rule.fastest is not None:
        told.append(f"fallback {quantity(rule.fastest, tag.unit, '/s')}")
    return told + ([f"in steps of {quantity(tag.increment, tag.unit)}"] if tag.increment is not None else [])


def _reading(signal: Signal, plant: PlantDescription) -> list[str]:
    rule = plant.qualities.get(signal.tag.name)
    if rule is None:
        return []
    told = [f"{number(rule.stale_s)} s old"]
    told += [f"a sample every {number(rule.every_s)} s"] if rule.every_s is not None else []
    told += [f"frozen after {number(rule.frozen_s)} s"] if rule.frozen_s is not None else []
    fastest = quantity(rule.fastest, signal.tag.unit, "/s")
    return told + ([f"at most {fastest}"] if rule.fastest is not None else [])
