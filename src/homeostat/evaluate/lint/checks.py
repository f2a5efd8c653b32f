"""The checks that run a plant's code, in the order in which they rely on each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias

from homeostat.evaluate.lint.deep.balances import balances
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.contract import interface, repetition
from homeostat.evaluate.lint.deep.fault_free import fault_free, healthy_symptoms
from homeostat.evaluate.lint.deep.faults import Outlook, faults
from homeostat.evaluate.lint.deep.following import following
from homeostat.evaluate.lint.deep.loops import loops
from homeostat.evaluate.lint.deep.numbers import numbers
from homeostat.evaluate.lint.deep.rules import rules
from homeostat.evaluate.lint.deep.safe_states import safe_states
from homeostat.evaluate.lint.finding import Finding
from homeostat.evaluate.lint.fits import fits

CarryOut: TypeAlias = Callable[[Bench], Iterator[Finding | Outlook]]


@dataclass(frozen=True, slots=True)
class Check:
    """One check of a plant on the bench."""

    name: str
    """As findings name it."""
    carry_out: CarryOut
    """Yields what it finds."""
    compiles: bool = False
    """Whether the plant's equations may be compiled in it, which takes its time."""
    others_rely: bool = False
    """Whether nothing that comes after it makes sense once it finds an error."""


def _fits(bench: Bench) -> Iterator[Finding]:
    return fits(bench.folder)


LOADING: Final = ("model",)
"""What loading a plant checks with its code."""
DEEP: Final = (
    *LOADING,
    "interface",
    "repetition",
    "fault-free",
    "following",
    "balances",
    "loops",
    "rules",
    "fallbacks",
    "numbers",
    "symptoms",
    "faults",
)
"""That, and what a simulation shows."""
_EVERY: Final = (
    Check("model", _fits, compiles=True, others_rely=True),
    Check("interface", interface, compiles=True, others_rely=True),
    Check("repetition", repetition, others_rely=True),
    Check("fault-free", fault_free),
    Check("following", following),
    Check("balances", balances),
    Check("loops", loops),
    Check("rules", rules),
    Check("fallbacks", safe_states),
    Check("numbers", numbers),
    Check("symptoms", healthy_symptoms),
    Check("faults", faults),
)
CHECKS: Final[Mapping[str, Check]] = {check.name: check for check in _EVERY}
"""Name -> check."""
