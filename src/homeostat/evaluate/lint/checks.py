"""The checks that run a plant's code, in the order in which they rely on each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias

from homeostat.evaluate.lint.deep.actions import actions
from homeostat.evaluate.lint.deep.answers import Answered, answers
from homeostat.evaluate.lint.deep.balances import balances
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.causes import causes
from homeostat.evaluate.lint.deep.contract import interface, repetition
from homeostat.evaluate.lint.deep.fault_free import fault_free, healthy_symptoms
from homeostat.evaluate.lint.deep.faults import Outlook, faults
from homeostat.evaluate.lint.deep.following import following
from homeostat.evaluate.lint.deep.integration import integration
from homeostat.evaluate.lint.deep.loops import loops
from homeostat.evaluate.lint.deep.numbers import numbers
from homeostat.evaluate.lint.deep.rules import rules
from homeostat.evaluate.lint.deep.safe_states import safe_states
from homeostat.evaluate.lint.finding import Finding
from homeostat.evaluate.lint.fits import fits

Found: TypeAlias = Finding | Outlook | Answered
"""What a check yields."""
CarryOut: TypeAlias = Callable[[Bench], Iterator[Found]]


@dataclass(frozen=True, slots=True)
class Check:
    """One check of a plant on the bench."""

    name: str
    """As findings name it."""
    carry_out: CarryOut
    """Yields what it finds."""
    patient: bool = False
    """Whether it may be silent for longer: equations are compiled, or an answer is searched for."""
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
    "integration",
    "actions",
    "causes",
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
ANSWERS: Final = (*DEEP, "answers")
"""That, and what recovery would do about each fault."""
_EVERY: Final = (
    Check("model", _fits, patient=True, others_rely=True),
    Check("interface", interface, patient=True, others_rely=True),
    Check("repetition", repetition, others_rely=True),
    Check("integration", integration, others_rely=True),
    Check("actions", actions, others_rely=True),
    Check("causes", causes, others_rely=True),
    Check("fault-free", fault_free),
    Check("following", following),
    Check("balances", balances),
    Check("loops", loops, others_rely=True),
    Check("rules", rules),
    Check("fallbacks", safe_states),
    Check("numbers", numbers),
    Check("symptoms", healthy_symptoms),
    Check("faults", faults),
    Check("answers", answers, patient=True),
)
CHECKS: Final[Mapping[str, Check]] = {check.name: check for check in _EVERY}
"""Name -> check."""
