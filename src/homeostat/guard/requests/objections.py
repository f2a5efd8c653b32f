"""Objections: what is said to a person whose order names something that is not there, or is not so."""

from collections.abc import Iterable

from homeostat.domain.mode import Mode
from homeostat.domain.plant.rules import GuardRules
from homeostat.guard.sequence.service import Service
from homeostat.stl.spelling import near_matches


def no_mode(name: str) -> str:
    """There is no mode called ``name``."""
    known = [mode.value for mode in Mode]
    return f"there is no mode {name!r}{near_matches(name, known)}; there are {', '.join(known)}"


def no_alarm(name: str, standing: Iterable[str]) -> str:
    """No alarm called ``name`` is among the ``standing`` ones."""
    known = tuple(standing)
    return f"there is no alarm {name!r}{near_matches(name, known) if known else '; none stands'}"


def no_request(name: str, offered: Iterable[str]) -> str:
    """No request called ``name`` is among the ``offered`` ones."""
    known = tuple(offered)
    return f"no request {name!r} waits for a person{near_matches(name, known) if known else '; none does'}"


def unchanged_service(tag: str, rules: GuardRules, service: Service) -> str:
    """Why ``tag`` can be neither brought back nor taken out: it is no tag, nobody writes it, or it is so already."""
    if tag not in rules.tags:
        return f"there is no tag {tag!r}{near_matches(tag, rules.writables)}"
    if tag not in rules.writables:
        return f"{tag!r} is not writable: it has no service to be taken out of"
    return f"{tag!r} is {'out of' if tag in service.out else 'in'} service already"


def no_start(name: str, rules: GuardRules, state: str) -> str:
    """Why nobody can order transition ``name`` in ``state``, and what can be ordered there."""
    transitions = rules.machine.transitions
    found = next((t for t in transitions if t.name == name), None)
    if found is None:
        return f"there is no transition {name!r}{near_matches(name, [t.name for t in transitions if t.on_decision])}"
    if found.source == state:
        return f"{name!r} is taken by itself once its guard holds: {str(found.guard)!r}"
    open_ = [t.name for t in transitions if t.source == state and t.on_decision]
    return f"{name!r} does not leave state {state!r}, but {found.source!r}; from here lead {', '.join(open_) or 'none'}"
