"""The Mixing Module as a :class:`~homeostat.process.model.ProcessModel`."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from homeostat.plants.mixing_module.instruments import measure_line, measure_tanks
from homeostat.plants.mixing_module.kernel import advance
from homeostat.plants.mixing_module.layout import TANKS, VALVES, F, FaultSlot, Input, P, Parameter, S, StateSlot, U
from homeostat.process.batch import Kernel
from homeostat.process.stated import stated_values
from homeostat.process.types import Cube, Table, Vec

_AT = S._asdict()
_TANKS = ("B201", "B202", "B203", "B204")
_STATED = stated_values(Path(__file__).parent)
AREA = _STATED["area"]
"""Cross-section of every tank, for turning a level into a volume [L/m]."""
KPA_PER_M = _STATED["density"] * 9.80665 / 1000.0
"""Hydrostatic pressure of a metre of liquid [kPa/m]."""
STANDING = 0.02
"""Speed that a transmitter shows at most of a pump that stands still, four times its noise [1]."""
_READ = {
    **{f"L_{tank}": S.LT1 + i for i, tank in enumerate(_TANKS)},
    **{f"P_{tank}": S.PT1 + i for i, tank in enumerate(_TANKS)},
    **{f"LSL_{tank}": S.LSL1 + i for i, tank in enumerate(_TANKS)},
    **{f"LSM_{tank}": S.LSM1 + i for i, tank in enumerate(_TANKS)},
    **{f"LSH_{tank}": S.LSH1 + i for i, tank in enumerate(_TANKS)},
    **{"P_main": S.PT5, "P_header": S.PT6, "flow": S.FT, "speed_P101": S.ST1, "speed_P102": S.ST2},
    **{"idle_P101": S.idle1, "idle_P102": S.idle2},
}
"""Variable -> column of what the instruments show."""
_TRUE = _READ | {
    **{f"L_{tank}": S.L1 + i for i, tank in enumerate(_TANKS)},
    **{f"P_{tank}": S.P1 + i for i, tank in enumerate(_TANKS)},
    **{"P_main": S.P5, "P_header": S.P6, "flow": S.q_transfer, "speed_P101": S.N1, "speed_P102": S.N2},
    **{"idle_P101": S.no_flow1, "idle_P102": S.no_flow2},
    **{name: _AT[name] for name in ("delivered", "spilled", "overflowed", "supplied", "dry_s", "dead_head_s")},
    **{"leak": S.q_leak, "drain": S.q_drain, "flow_P101": S.q_main, "flow_P102": S.q_bypass},
}
"""Variable -> column of the truth."""
_HIDDEN = ("delivered", "spilled", "overflowed")
"""Variables that a tag may be bound to although no instrument shows them: NaN in every reading."""


class MixingModel:
    """Three feed tanks, a collecting tank, a main and a bypass pump; equations in ``kernel``."""

    states: tuple[str, ...] = StateSlot._fields
    parameters: tuple[str, ...] = Parameter._fields
    inputs: tuple[str, ...] = tuple(f"cmd_{name}" for name in Input._fields)
    faults: tuple[str, ...] = FaultSlot._fields
    variables: tuple[str, ...] = (*_READ, *(f"cmd_{name}" for name in Input._fields), *_HIDDEN)
    shown: Mapping[str, int] = _READ
    unseen: tuple[str, ...] = ()
    kernel: Kernel = advance

    def initial_state(self, parameters: Vec) -> Vec:
        """Every tank at 10 % of its height, everything closed and still."""
        x = np.zeros(len(S))
        for i in range(TANKS):
            height = parameters[P.height_B204] if i == TANKS - 1 else parameters[P.height_feed]
            x[S.V1 + i] = parameters[P.area] * 0.1 * height
        none = np.zeros(len(self.faults)), np.full(len(self.faults), np.inf)
        measure_tanks(x, parameters, *none, 0.0, 0, 0.0)
        measure_line(x, parameters, *none, 0.0, 0, 0.0)
        return x

    def readings(self, state: Vec, inputs: Vec) -> Mapping[str, float]:
        """Variable -> what the instruments say."""
        values = state.tolist()
        read = {name: values[i] for name, i in _READ.items()}
        read.update(zip(self.inputs, inputs.tolist(), strict=True))
        read.update(dict.fromkeys(_HIDDEN, float("nan")))
        return read

    def truth(self, record: Cube, inputs: Cube) -> Mapping[str, NDArray[np.float64]]:
        """Variable -> true values."""
        values = {name: record[:, :, i] for name, i in _TRUE.items()}
        for i, tank in enumerate(_TANKS):
            height = _STATED["height_B204" if i == TANKS - 1 else "height_feed"]
            for what, share in (("LSL", 0.1), ("LSM", 0.5), ("LSH", 0.9)):
                values[f"{what}_{tank}"] = np.where(record[:, :, S.L1 + i] >= share * height, 1.0, 0.0)
        for k, name in enumerate(self.inputs):
            values[name] = np.broadcast_to(inputs[:, :, k], record.shape[:2])
        return values

    def estimate(self, readings: Mapping[str, float]) -> Vec:
        """Levels by their hydrostatic pressures, valves where they are commanded to, pumps as fast as they are shown.

        A pump that is not to run and shows no more than noise stands still: the lines of one that runs ever so slowly
        are under pressure.
        """
        x = np.zeros(len(S))
        for name, i in _READ.items():
            x[i] = readings[name]
        for i, tank in enumerate(_TANKS):
            x[S.L1 + i] = max(readings[f"P_{tank}"] / KPA_PER_M, 0.0)
            x[S.V1 + i] = AREA * x[S.L1 + i]
        for k in range(VALVES):
            x[S.VI1_pos + k] = readings[self.inputs[k]]
        for k, pump in enumerate(("P101", "P102")):
            speed, runs = readings[f"speed_{pump}"], readings[self.inputs[U.P1 + k]] > 0.0
            x[S.N1 + k] = speed if runs or speed > STANDING else 0.0
        return x

    def settle(
        self, states: Table, inputs: Table, parameters: Table, severity: Table, onset_s: Table, at_s: float
    ) -> None:
        """Valves, whose positions nobody measures, stand where they are commanded to, or where they were stuck."""
        position = np.clip(inputs[:, U.VI1 : U.VI1 + VALVES], 0.0, 1.0)
        for first, share in ((F.stuck_closed_VI201, 0.0), (F.stuck_open_VI201, 1.0)):
            size = severity[:, first : first + VALVES]
            stuck = (size > 0.0) & (onset_s[:, first : first + VALVES] < at_s)
            position = np.where(stuck, share * size, position)
        states[:, S.VI1_pos : S.VI1_pos + VALVES] = position

    def correct(self, states: Table, residuals: Mapping[str, Vec]) -> None:
        """Shift levels by what the hydrostatic pressures say beyond the model: level transmitters may lie."""
        for i, tank in enumerate(_TANKS):
            if f"P_{tank}" not in residuals:  # it is stuck
                continue
            shift = residuals[f"P_{tank}"] / KPA_PER_M
            states[:, S.V1 + i] = np.maximum(states[:, S.V1 + i] + AREA * shift, 0.0)
            states[:, S.L1 + i] = states[:, S.V1 + i] / AREA

    def resume(self, states: Table, readings: Mapping[str, Vec], parameters: Table) -> None:
        """Set what the instruments show and count totals from now on; there are no controllers with a memory."""
        for name, i in _READ.items():
            states[:, i] = readings[name][-1]
        states[:, S.no_flow1], states[:, S.no_flow2] = states[:, S.idle1], states[:, S.idle2]
        states[:, S.supplied :] = 0.0

    def shown_and_true(
        self, states: Table, parameters: Table, severity: Table, onset_s: Table, at_s: float
    ) -> tuple[Mapping[str, Vec], Mapping[str, Vec]]:
        """Noise-free readings of levels and flow next to the truth."""
        seen = states.copy()
        for member in range(len(seen)):
            row = seen[member], parameters[member], severity[member], onset_s[member]
            measure_tanks(*row, at_s, 0, 0.0)
            measure_line(*row, at_s, 0, 0.0)
        names = ("L_B201", "L_B202", "L_B203", "L_B204", "flow")
        return {n: seen[:, _READ[n]] for n in names}, {n: states[:, _TRUE[n]] for n in names}

    def replay_inputs(self, readings: Mapping[str, Vec], inputs: Table) -> Table:
        """Recorded commands are all that drives the module."""
        return inputs.copy()
