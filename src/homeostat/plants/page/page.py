"""A plant on one page: summary, flowsheet, state machine, and every table."""

from importlib.resources import files
from typing import Final

from homeostat import __version__
from homeostat.plants.described import DescribedPlant
from homeostat.plants.files.folder import SIGNATURE
from homeostat.plants.files.signature import signer
from homeostat.plants.page import faults, instruments, rules
from homeostat.plants.page.figure import Direction
from homeostat.plants.page.flowsheet import flowsheet_drawing
from homeostat.plants.page.machine import machine_drawing
from homeostat.plants.page.markup import Markup, element, together
from homeostat.plants.page.tables import code, quantity

_PARTS: Final = (
    ("flowsheet-part", "Flowsheet"),
    ("states-part", "State machine"),
    ("limits-part", "Limits and criteria"),
    ("fallbacks-part", "Fallbacks and prices"),
    ("faults-part", "Faults and symptoms"),
    ("tags-part", "Instruments and commands"),
    ("parameters-part", "Parameters and equations"),
)


def page(plant: DescribedPlant) -> str:
    """The page as HTML that is well-formed XML as well; equal plants give equal pages."""
    known = plant.description
    parts = {
        "flowsheet-part": [
            _drawing(flowsheet_drawing(plant), _FLOWS, Direction.RIGHT),
            element("h3", "Equipment"),
            instruments.equipment(known),
            instruments.loops(known),
        ],
        "states-part": [
            _drawing(machine_drawing(known), _WAYS, Direction.DOWN),
            rules.states(plant),
            rules.transitions(plant),
        ],
        "limits-part": [rules.limits(known), rules.criteria(known)],
        "fallbacks-part": [rules.fallbacks(known), rules.prices(plant)],
        "faults-part": [faults.faults(known), faults.symptoms(known)],
        "tags-part": [instruments.tags(plant)],
        "parameters-part": [instruments.parameters(known), instruments.equations(known)],
    }
    sections = [element("section", element("h2", title), together(parts[name]), id=name) for name, title in _PARTS]
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", name="color-scheme", content="light dark"),
        element("title", plant.settings.title),
        element("style", Markup(files(__package__).joinpath("page.css").read_text("utf-8"))),
    )
    body = element("body", _top(plant), element("main", together(sections)))
    return f"<!DOCTYPE html>\n{element('html', head, body, lang='en')}\n"


def _top(plant: DescribedPlant) -> Markup:
    facts = element("dl", [_fact(term, said) for term, said in _facts(plant)])
    links = [element("a", title, href=f"#{name}") for name, title in _PARTS]
    return element("header", element("h1", plant.settings.title), facts, element("nav", together(links)))


def _facts(plant: DescribedPlant) -> list[tuple[str, str]]:
    known, settings = plant.description, plant.settings
    production, used = plant.prices.production, {flow for o in plant.flowsheet.operators for flow in o.inputs}
    made = [f for f in plant.flowsheet.flows if f.name not in used and f.kind.value == "Product"]
    throughput = known.tag(production.throughput)
    rate = quantity(production.design_rate, throughput.unit)
    time = "" if production.per_s == 1.0 else f" in {production.per_s:g} s"
    count = {
        "tags": len(known.tags),
        "limits": len(known.limits.limits),
        "hard ones": len(known.limits.hard),
        "faults": len(known.faults),
        "states": len(known.machine.states),
        "transitions": len(known.machine.transitions),
    }
    return [
        ("Plant", f"{plant.name}: {known.label}"),
        ("Makes", ", ".join(flow.label or flow.name for flow in made) or "nothing that leaves it"),
        ("By design", f"{rate}{time}, measured as {throughput.name} ({throughput.description})"),
        ("Worth", f"{plant.prices.product:g} {plant.prices.currency} for one unit of it"),
        ("Recipe run by", f"the {settings.recipe}, in modes that write"),
        ("Has", ", ".join(f"{number} {what}" for what, number in count.items())),
        ("Configuration", code(plant.configuration)),
        ("Signature", _signature(plant)),
        ("Page made by", f"Homeostat {__version__}, from tables and settings"),
    ]


def _signature(plant: DescribedPlant) -> str:
    folder = plant.files.folder
    return signer(folder, plant.configuration) if (folder / SIGNATURE).exists() else "nobody has signed it"


def _fact(term: str, said: str) -> Markup:
    return element("div", element("dt", term), element("dd", said))


def _drawing(svg: Markup, legend: list[tuple[str, str]], direction: Direction) -> Markup:
    """A drawing that can be moved where the screen is small, with what its lines and boxes mean."""
    meant = [element("li", element("span", "", class_=f"key {kind}"), element("span", text)) for kind, text in legend]
    framed = element("div", svg, class_="scroll", tabindex="0", role="region", aria_label="Drawing")
    caption = element("figcaption", element("ul", meant, class_="legend"))
    return element("figure", framed, caption, class_=direction.value)


_FLOWS: Final = [
    ("product", "product"),
    ("energy", "energy"),
    ("information", "information: what a controller reads and commands"),
]
_WAYS: Final = [
    ("automatic", "taken by itself, as soon as its guard holds"),
    ("decision", "taken by decision"),
    ("fallback", "taken by a fallback, which ends in a safe state"),
    ("abnormal", "a state that the plant does not come to by itself"),
]
