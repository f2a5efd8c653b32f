"""Who proposes, and what is known from before, as somebody chose it: it is handed on to the process that thinks.

Nothing is loaded for it, and no key is in it: keys are in the environment of whoever asks.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final, Self

from homeostat.journal import Setting

SEARCH: Final = "search"
"""Proposer that is always there, and asks no model."""
ROUTE: Final = "route"
"""Protocol in which a plant is operated: whole recoveries are asked for."""
BUDGET_S: Final = 30.0
"""Longest thinking of one recovery unless somebody says otherwise [s]."""


@dataclass(frozen=True, slots=True)
class Consulted:
    """Who is asked; by default the search alone, which knows nothing from before."""

    proposer: str = SEARCH
    """``search``, or the name of a language model that proposes beside it."""
    local_only: bool = False
    """Whether models that are not on this machine are refused."""
    allow_hosts: tuple[str, ...] = ()
    """Hosts that are allowed beside it."""
    temperature: float = 0.0
    """Temperature of the model's sampling [1]."""
    model_seed: int | None = None
    """Seed of its own sampling, if it has one."""
    notes: tuple[str, ...] = ()
    """What operators wrote to it."""
    record: str | None = None
    """File that every call of it is added to; None for none."""
    grounding: str = "graph"
    """What it is shown of the plant."""
    answer_s: float | None = None
    """Longest time for one answer, wall-clock [s]; None for as long as usual."""
    attempts: int | None = None
    """Most proposals of it in one recovery; None for as many as usual."""
    budget_s: float = BUDGET_S
    """Longest thinking of one recovery, in process time [s]."""
    protocol: str = ROUTE
    """When proposers are asked."""
    playbook: str | None = None
    """File with what helped before; None for none."""

    @property
    def asks_a_model(self) -> bool:
        """Whether somebody besides the search proposes."""
        return self.proposer != SEARCH

    @property
    def usual(self) -> bool:
        """Whether nothing in it can be wrong, as nobody and no file is named."""
        return replace(self, budget_s=BUDGET_S) == Consulted()

    def settings(self, playbook: str = "") -> tuple[Setting, ...]:
        """As the journal has it; ``playbook`` is the digest of that file, empty for none.

        All of them, always: where a plant is attached again without something, its journal says so.
        """
        return (
            Setting("proposer", self.proposer),
            Setting("protocol", self.protocol),
            Setting("grounding", self.grounding if self.asks_a_model else ""),
            Setting("budget_s", self.budget_s),
            Setting("playbook", playbook),
        )

    def elsewhere(self) -> Self:
        """The same with files as a process in another folder understands them."""
        return replace(self, record=_absolute(self.record), playbook=_absolute(self.playbook))

    def to_text(self) -> str:
        """One line, as it is handed on."""
        return json.dumps(asdict(self))

    @classmethod
    def from_text(cls, text: str) -> Self:
        """What :meth:`to_text` wrote; ValueError or TypeError for anything else."""
        given: dict[str, Any] = json.loads(text)
        return cls(**{**given, **{name: tuple(given[name]) for name in ("allow_hosts", "notes")}})


def _absolute(path: str | None) -> str | None:
    return None if path is None else str(Path(path).absolute())
