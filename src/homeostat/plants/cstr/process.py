"""The reactor as a :class:`~homeostat.process.model.ProcessModel`."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from homeostat.plants.cstr.kernel import NORMAL, advance, measure
from homeostat.plants.cstr.layout import FaultSlot, Input, P, Parameter, S, StateSlot, U
from homeostat.process.batch import Kernel
from homeostat.process.equipment import pid_integral, pid_tracking
from homeostat.process.types import Cube, Table, Vec

_AT = S._asdict()
_LOOPS = ("V1", "P1", "V2")
_FLOWS = ("F1", "F2", "F3", "T2", "T3")
_CMD, _POS, _RATE = ([f"{name}_{what}" for name in _LOOPS] for what in ("cmd", "pos", "rate"))
_ZT, _WAY = ([f"{name}_{what}" for name in _LOOPS] for what in ("zt", "travel"))
_TRUE = (
    {"T1": S.T, "L1": S.V, **{name: _AT[f"{name}_true"] for name in _FLOWS}}
    | {shown: _AT[true] for shown, true in zip(_ZT, _POS, strict=True)}
    | {
        name: _AT[name]
        for name in (*_CMD, "leak", "overflow", "UA", "product", "phase", "CA", "CB", "CC", "CD", *_RATE)
    }
)
_READ = {name: _AT[name] for name in ("T1", "L1", *_FLOWS, *_ZT, *_CMD, *_WAY, *_RATE)}
_DERIVED = ("T1_err", "L1_err", "V1_rate", "P1_rate", "V2_rate")
MEASURED_S = 120
"""Seconds of readings whose mean says how warm feed and cooling water are."""
_TRAVEL = {"V1": S.V1_travel, "P1": S.P1_travel, "V2": S.V2_travel}


class CstrModel:
    """Continuous stirred-tank reactor with jacket, three loops and nine faults; equations in ``kernel``."""

    states: tuple[str, ...] = StateSlot._fields
    parameters: tuple[str, ...] = Parameter._fields
    inputs: tuple[str, ...] = Input._fields
    faults: tuple[str, ...] = FaultSlot._fields
    variables: tuple[str, ...] = (*_READ, *Input._fields, *_DERIVED)
    shown: Mapping[str, int] = _READ
    kernel: Kernel = advance

    def initial_state(self, parameters: Vec) -> Vec:
        """Empty vessel at feed temperature, feed isolation valve open."""
        x = np.zeros(len(S))
        x[S.T] = x[S.T1] = x[S.T1_ideal] = x[S.T2] = x[S.T2_true] = parameters[P.T_feed]
        x[S.T3] = x[S.T3_true] = parameters[P.T_coolant]
        x[S.UA] = parameters[P.UA]
        x[S.XV1_pos] = 1.0
        return x

    def readings(self, state: Vec, inputs: Vec) -> Mapping[str, float]:
        """Variable -> what the instruments say."""
        values = state.tolist()
        read = {name: values[i] for name, i in _READ.items()}
        read.update(zip(self.inputs, inputs.tolist(), strict=True))
        read["T1_err"] = read["T1"] - read["T1_sp"]
        read["L1_err"] = read["L1"] - read["L1_sp"]
        return read

    def truth(self, record: Cube, inputs: Cube) -> Mapping[str, NDArray[np.float64]]:
        """Variable -> true values; deviations as the loops see them, travel from the first sample on."""
        values = {name: record[:, :, i] for name, i in _TRUE.items()}
        for k, name in enumerate(self.inputs):
            values[name] = np.broadcast_to(inputs[:, :, k], values["T1"].shape)
        values["T1_err"] = record[:, :, S.T1_ideal] - values["T1_sp"]
        values["L1_err"] = record[:, :, S.L1_ideal] - values["L1_sp"]
        for name, i in _TRAVEL.items():
            values[f"{name}_travel"] = record[:, :, i] - record[:, :1, i]
        return values

    def estimate(self, readings: Mapping[str, float]) -> Vec:
        """A state in NORMAL phase that agrees with smoothed readings; concentrations at their design values."""
        x = np.zeros(len(S))
        for name, i in _READ.items():
            x[i] = readings[name]
        for name, i in _TRUE.items():
            if name in readings:
                x[i] = readings[name]
        x[S.V] = max(x[S.V], 0.0)
        x[[S.V1_pos, S.P1_pos, S.V2_pos]] = np.clip(x[[S.V1_pos, S.P1_pos, S.V2_pos]], 0.0, 1.0)
        x[S.XV1_pos] = readings["XV1_cmd"]
        x[S.CA], x[S.CB], x[S.CC], x[S.CD] = 0.0187, 0.0009, 0.0804, 0.0491
        x[S.phase] = NORMAL
        return x

    def settle(
        self, states: Table, inputs: Table, parameters: Table, severity: Table, onset_s: Table, at_s: float
    ) -> None:
        """Nothing: every position is measured."""

    def correct(self, states: Table, residuals: Mapping[str, Vec]) -> None:
        """Shift temperature and volume by what their instruments say beyond the model."""
        states[:, S.T] += residuals["T1"]
        states[:, S.V] = np.maximum(states[:, S.V] + residuals["L1"], 0.0)

    def resume(self, states: Table, readings: Mapping[str, Vec], parameters: Table) -> None:
        """Integral terms behind the present commands, I = output - Kp e (level: minus the feed-forward).

        Where a command is at its limit it does not tell the integral; it is followed from where it last did. Feed and
        cooling water stay as warm as they were measured on the mean of the last minutes.
        """
        p, r = parameters[0], readings
        for name, i in _READ.items():
            if not name.endswith("_travel"):
                states[:, i] = r[name][-1]
        feed, level, hot = (
            r["F1_sp"][:-1] - r["F1"][:-1],
            r["L1"][:-1] - r["L1_sp"][:-1],
            r["T1"][:-1] - r["T1_sp"][:-1],
        )
        pump, cooling = r["P1_cmd"][1:], r["V2_cmd"][1:]
        states[:, S.flow_integral] = r["V1_cmd"][-1] - p[P.Kp_flow] * feed[-1] + p[P.Ki_flow] * feed[-1]
        forward = np.clip(r["F1"][:-1] / p[P.feedforward_P1], 0.0, 1.0)
        tuning = p[P.Kp_level], p[P.Ki_level], p[P.trim_low]
        states[:, S.level_integral] = _follow_integral(level, pump - forward, _free(pump), r["P1_man"][1:], tuning)
        tuning = p[P.Kp_temperature], p[P.Ki_temperature], 0.0
        states[:, S.temperature_integral] = _follow_integral(hot, cooling, _free(cooling), r["V2_man"][1:], tuning)
        parameters[:, P.T_feed] = np.mean(r["T2"][-MEASURED_S:]) - parameters[:, P.bias_T2]
        parameters[:, P.T_coolant] = np.mean(r["T3"][-MEASURED_S:]) - parameters[:, P.bias_T3]
        fed = r["T2"][-1] - parameters[:, P.bias_T2] - parameters[:, P.T_feed]
        states[:, S.feed_T] = fed / np.where(parameters[:, P.sd_T_feed] > 0.0, parameters[:, P.sd_T_feed], np.inf)

    def shown_and_true(
        self, states: Table, parameters: Table, severity: Table, onset_s: Table, at_s: float
    ) -> tuple[Mapping[str, Vec], Mapping[str, Vec]]:
        """Noise-free readings of the instruments next to the truth."""
        seen = states.copy()
        for member in range(len(seen)):
            measure(seen[member], parameters[member], severity[member], onset_s[member], at_s, 0, 0.0)
        names = [name for name in _TRUE if name in _READ and _TRUE[name] != _READ[name]]
        return {n: seen[:, _READ[n]] for n in names}, {n: states[:, _TRUE[n]] for n in names}

    def replay_inputs(self, readings: Mapping[str, Vec], inputs: Table) -> Table:
        """Recorded commands as manual outputs; the measured temperatures of feed and cooling water as theirs."""
        replay = inputs.copy()
        replay[:, U.V1_man] = readings["V1_cmd"]
        replay[:, U.P1_man] = readings["P1_cmd"]
        replay[:, U.V2_man] = readings["V2_cmd"]
        replay[:, U.T2_in] = readings["T2"]
        replay[:, U.T3_in] = readings["T3"]
        return replay


def _free(command: Vec) -> NDArray[np.bool_]:
    """Rows in which a command is inside its limits."""
    return np.asarray((command > 0.0) & (command < 1.0))


def _follow_integral(
    error: Vec, output: Vec, known: NDArray[np.bool_], manual: Vec, tuning: tuple[float, float, float]
) -> float:
    """The integral term after the last row; ``tuning`` is Kp, Ki and the lower limit of Kp e + I (the upper is 1).

    It is followed from the last row in which the output told it: where the loop was free, or on manual.
    """
    gain, reset, low = tuning
    by_hand = ~np.isnan(manual)
    told = np.flatnonzero(known | by_hand)
    first = int(told[-1]) if told.size else 0
    integral = float(pid_tracking(float(error[first]), float(output[first]), gain))
    if by_hand[-1]:
        return integral
    if not told.size:
        integral = min(max(integral, low), 1.0)
    for e in error[first + int(by_hand[first]) :].tolist():
        integral = float(pid_integral(e, integral, gain, reset, low, 1.0, 1.0))
    return min(max(integral, low), 1.0)
