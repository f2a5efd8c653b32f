"""What a process model offers; the simulated plant and the twin use the same one."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from homeostat.process.batch import Kernel
from homeostat.process.types import Cube, Table, Vec


class ProcessModel(Protocol):
    """Equations of one process, for many members at once.

    Variables are the names that the signal table binds tags to. A variable has a reading (what an instrument
    says) and a truth (what is the case); they differ by noise, calibration and instrument faults.
    """

    states: tuple[str, ...]
    """Names of the state columns."""
    parameters: tuple[str, ...]
    """Names of the parameter columns."""
    inputs: tuple[str, ...]
    """Names of the input columns; NaN in a manual output means automatic."""
    faults: tuple[str, ...]
    """Names of the fault columns."""
    variables: tuple[str, ...]
    """Names of everything that a tag may be bound to."""
    shown: Mapping[str, int]
    """Variable -> state column of what its instrument shows."""
    unseen: tuple[str, ...]
    """States that no instrument shows and that others depend on: only the past says where they are."""
    kernel: Kernel
    """Compiled code that advances the states by ticks; it says how long one is."""

    def initial_state(self, parameters: Vec) -> Vec:
        """State in which the plant starts, shape (states,)."""
        ...

    def readings(self, state: Vec, inputs: Vec) -> Mapping[str, float]:
        """Variable -> what the instruments say in this state."""
        ...

    def truth(self, record: Cube, inputs: Cube) -> Mapping[str, NDArray[np.float64]]:
        """Variable -> true values, shape (members, times).

        ``record`` holds every state, shape (members, times, states); ``inputs`` the inputs of the same times.
        """
        ...

    def estimate(self, readings: Mapping[str, float]) -> Vec:
        """A state that agrees with (smoothed) readings, shape (states,).

        What is :attr:`unseen` is where ``readings`` say by its name, or where it usually is.
        """
        ...

    def settle(
        self, states: Table, inputs: Table, parameters: Table, severity: Table, onset_s: Table, at_s: float
    ) -> None:
        """Let what no instrument shows stand where ``inputs`` and faults that began before ``at_s`` put it, in place.

        Shapes (members, inputs), (members, parameters), (members, faults) twice. Where every such state is shown there
        is nothing to do.
        """
        ...

    def correct(self, states: Table, residuals: Mapping[str, Vec]) -> None:
        """Move states in place by what the instruments say beyond the model: variable -> shape (members,).

        An instrument that says nothing, because it is stuck, is left out.
        """
        ...

    def resume(self, states: Table, readings: Mapping[str, Vec], parameters: Table) -> None:
        """Let what the model does not compute from its balances go on from what was read last, in place.

        Controllers: their memory, so that their outputs go on without a bump. Measured disturbances: the parameters
        that stand for them, shape (members, parameters), so that they stay as they were measured lately.

        ``readings`` are the last ones (variable -> shape (n,), n >= 2): a command in row k was computed from row k - 1.
        """
        ...

    def shown_and_true(
        self, states: Table, parameters: Table, severity: Table, onset_s: Table, at_s: float
    ) -> tuple[Mapping[str, Vec], Mapping[str, Vec]]:
        """Variable -> noise-free reading, and variable -> truth, of measured variables, shape (members,) each."""
        ...

    def replay_inputs(self, readings: Mapping[str, Vec], inputs: Table) -> Table:
        """Inputs that make the model follow recorded commands and measured disturbances, shape (times, inputs)."""
        ...


def written_in(model: ProcessModel) -> str:
    """Name of the module in which ``model`` is written down: that of its class, or of the flowsheet it follows from."""
    return str(getattr(model, "home", "")) or type(model).__module__


def column(names: tuple[str, ...], name: str) -> int:
    """Position of ``name`` among ``names``; KeyError names it where it is missing."""
    try:
        return names.index(name)
    except ValueError:
        raise KeyError(f"the process model has no {name!r}; it has {', '.join(names)}") from None
