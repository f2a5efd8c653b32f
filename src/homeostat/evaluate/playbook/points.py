"""What a playbook is built over: faults, severities, and the states that the nominal recipe leads through."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from homeostat.domain.plant.state_machine import StateMachine
from homeostat.evaluate.reference.unsupervised import fault_free
from homeostat.evaluate.scenario import scenario
from homeostat.plants.plant import Plant
from homeostat.record.playbook import PlaybookError
from homeostat.stl.spelling import near_matches

SHORTEST_S = 5.0
"""A state in which the recipe stays for less, by the reference, is none in which anything can be asked [s]."""


@dataclass(frozen=True, slots=True)
class Question:
    """One situation to which an answer is looked for."""

    fault: str
    """What is wrong, and known to be."""
    severity: float
    """How severe, in the fault's unit."""
    state: str
    """State in which it begins."""
    onset_s: float
    """Process time at which it does [s]."""
    seed: int
    """Seed of the plant."""

    @property
    def source(self) -> str:
        """What the entry says it is from; a playbook that has it has the answer."""
        return f"built: {self.fault} {self.severity:g} in {self.state}, seed {self.seed}"


def questions(
    plant: Plant, faults: Sequence[str] = (), severities: int = 3, states: Sequence[str] = (), seed: int = 1
) -> list[Question]:
    """Every fault in every state at so many ``severities``; all faults and states where none are named.

    One severity is the nominal one; several are the middles of as many equal parts of the fault's range. PlaybookError
    where the plant does not have what is named.
    """
    onsets = _onsets(plant, seed)
    modes = {mode.name: mode for mode in plant.description.faults}
    asked = []
    for state in _chosen("state that its recipe leads through and in which anything can be decided", states, onsets):
        for name in _chosen("fault", faults, modes):
            severity_range, nominal = modes[name].severity_range, modes[name].severity_nominal
            parts = [severity_range.low + (k + 0.5) / severities * severity_range.span for k in range(severities)]
            for size in [nominal] if severities == 1 else parts:
                if abs(size) > 1e-9 * severity_range.span:  # in the middle of a range about zero nothing is wrong
                    asked.append(Question(name, size, state, onsets[state], seed))
    return asked


def _onsets(plant: Plant, seed: int) -> dict[str, float]:
    """State in which a recovery can be decided on -> when a fault begins there [s].

    That is the plant's usual onset where the recipe is in this state then, and the middle of its stay elsewhere.
    """
    nominal, machine = scenario(plant, "none", seed), plant.description.machine
    entered = fault_free(plant, nominal).states
    found, shortest_s = dict[str, float](), plant.description.timing.time_s(SHORTEST_S)
    for (state, from_s), to_s in zip(entered, [*(at_s for _, at_s in entered[1:]), nominal.end_s], strict=True):
        if to_s - from_s >= shortest_s and state not in found and _decided(machine, state):
            found[state] = plant.onset_s if from_s < plant.onset_s < to_s else 0.5 * (from_s + to_s)
    return found


def _decided(machine: StateMachine, state: str) -> bool:
    return any(t.on_decision and t.source == state and t.event == machine.recovery_event for t in machine.transitions)


def _chosen(what: str, named: Sequence[str], there: Iterable[str]) -> list[str]:
    """Those that are ``named``, all that are ``there`` where none is."""
    known = list(there)
    for name in named:
        if name not in known:
            raise PlaybookError(
                f"the plant has no {what}, {name!r}{near_matches(name, known)}; it has {', '.join(known)}"
            )
    return list(dict.fromkeys(named)) or known
