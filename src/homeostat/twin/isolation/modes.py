"""Fault modes that no table need name: of every transmitter, actuator, balance and uncertain parameter of the plant.

A transmitter that reads high or low, drifts, is stuck or noisy, and an actuator that stands still, are causes that have
a name. What disturbs a balance, or
changes a characteristic, is not: such a mode says where it is and how large, and is called unknown.
"""

from collections.abc import Collection, Iterator, Sequence

from homeostat.domain.diagnosis import SIZELESS, SOMETHING_ELSE, Effect, EffectKind, FaultMode
from homeostat.domain.plant.description import PlantDescription, Relation, Signal
from homeostat.domain.plant.parameter import ModelParameter
from homeostat.domain.plant.tag import Range, Role
from homeostat.twin.settings import Balance, TwinSettings

RELATIVE_LARGE = 0.3
"""A large error of a transmitter whose calibration is relative to its reading [1]."""
SHARE_LARGE = 0.1
"""A large error of another one, as a share of its range [1]."""
POSITION_LARGE = 0.2
"""A large error of an actuator's position, as a share of its range [1]."""
PARAMETER_LARGE = 25.0
"""A large change of a parameter in standard deviations of what it may be: what hardly differs hardly changes [1]."""
SEVERAL = 3.0
"""How many times what is large may occur [1]."""
PRIOR = 0.05
"""Relative frequency of a generated fault mode [1]."""


def generated_modes(plant: PlantDescription, twin: TwinSettings) -> tuple[FaultMode, ...]:
    """The fault modes of ``plant`` that follow from its instruments, actuators, loops, balances and parameters.

    Those that the twin cannot see, because it compares no reading with them, are left out. Severities of what is
    ``unknown`` have a sign, but for what can only be lost; those of transmitters are sizes, with the direction in their
    name.
    """
    measured = [s for s in plant.signals if s.relation is Relation.MEASURES and s.tag.role is not Role.SP]
    modes = [_of_nothing_listed(plant)]
    modes += [mode for signal in measured for mode in _of_transmitter(signal, plant.parameters, twin)]
    modes += [_of_controller(loop.name, loop.controller) for loop in plant.loops]
    modes += [mode for balance in twin.balances for mode in _of_balance(balance, twin.replay_s)]
    modes += [mode for signal in plant.signals for mode in _of_actuator(signal, plant, twin.replay_s)]
    sensors = {s.component for s in measured}
    actuators = dict.fromkeys(s.component for s in plant.signals if s.relation is Relation.DRIVES)
    for p in plant.parameters:
        mine = next((b for b in twin.balances if _is_in(p, b, plant)), None)
        modes += _of_parameter(p, mine, sensors, twin.replay_s)
    modes += [mode for component in actuators for mode in _of_lag(component, plant.parameters)]
    names = {fault.name for fault in plant.faults}
    return tuple(mode for mode in modes if mode.name not in names)


def _of_transmitter(signal: Signal, parameters: Sequence[ModelParameter], twin: TwinSettings) -> Iterator[FaultMode]:
    """Bias and drift in both directions where the twin compares the reading; stuck and noisy in any case."""
    tag, component = signal.tag, signal.component
    calibration = next((p for p in parameters if p.component == component and p.sd > 0.0), None)
    if calibration is not None or signal.variable in twin.errors:
        relative = calibration is not None and calibration.unit != tag.unit
        unit = calibration.unit if calibration is not None else tag.unit
        large = RELATIVE_LARGE if relative else SHARE_LARGE * tag.range.span
        kind = EffectKind.READING if calibration is None else EffectKind.PARAMETER
        quantity = signal.variable if calibration is None else calibration.symbol
        for sign, reads, drifts in ((1.0, "reads_high", "drifts_up"), (-1.0, "reads_low", "drifts_down")):
            words = f"{tag.description or tag.name}: {reads.replace('_', ' ')}"
            effect = Effect(kind, quantity, sign)
            yield _mode(f"{tag.name}_{reads}", words, component, unit, Range(0.0, SEVERAL * large), effect)
            rate, words = large / twin.replay_s, f"{tag.description or tag.name}: {drifts.replace('_', ' ')}"
            effect = Effect(kind, quantity, sign, grows=True)
            yield _mode(f"{tag.name}_{drifts}", words, component, f"{unit}/s", Range(0.0, SEVERAL * rate), effect)
        if signal.variable in twin.errors:  # another one is believed as it is: what it swings by, the plant may
            words, effect = f"{tag.description or tag.name}: swings", Effect(kind, quantity, swings=True)
            yield _mode(f"{tag.name}_swings", words, component, unit, Range(-SEVERAL * large, SEVERAL * large), effect)
    frozen = Effect(EffectKind.FROZEN, signal.variable)
    yield _mode(f"{tag.name}_frozen", f"{tag.description}: stuck", component, "1", Range(0.0, 1.0), frozen)
    noisy = Effect(EffectKind.UNSEEN, signal.variable)
    yield _mode(f"{tag.name}_noisy", f"{tag.description}: noisy", component, "1", Range(1.0, 1000.0), noisy)


def _of_controller(loop: str, controller: str) -> FaultMode:
    effect = Effect(EffectKind.UNSEEN, loop)
    words = f"{controller} does not compute what its settings say"
    return _mode(f"{controller}_wrong_law", words, controller, "1", Range(0.0, 1.0), effect)


def _of_balance(balance: Balance, horizon_s: float) -> Iterator[FaultMode]:
    name, where = f"unknown_{balance.quantity}_{balance.component}", balance.component
    lost = balance.only_lost
    both = Range(0.0 if lost else -SEVERAL * balance.large, SEVERAL * balance.large)
    sign, words = (-1.0, f"unknown loss of {balance.quantity}") if lost else (1.0, f"unknown {balance.quantity}")
    effect = Effect(EffectKind.BALANCE, balance.state, sign, capacity=balance.capacity, most=balance.most)
    words = f"{words} in {where}"
    yield _mode(name, words, where, balance.unit, both, effect, unknown=True)
    both = Range(both.low / horizon_s, both.high / horizon_s)
    effect = Effect(EffectKind.BALANCE, balance.state, sign, grows=True, capacity=balance.capacity)
    yield _mode(f"{name}_growing", f"{words}, growing", where, f"{balance.unit}/s", both, effect, unknown=True)
    if not lost:
        both = Range(-SEVERAL * balance.large, SEVERAL * balance.large)
        effect = Effect(EffectKind.BALANCE, balance.state, swings=True, capacity=balance.capacity, most=balance.most)
        yield _mode(f"{name}_swinging", f"{words}, swinging", where, balance.unit, both, effect, unknown=True)


def _of_actuator(signal: Signal, plant: PlantDescription, horizon_s: float) -> Iterator[FaultMode]:
    """An actuator need not stand where its command says: what the model takes is the command that overrides others."""
    manual = plant.automatic
    drives = signal.relation is Relation.DRIVES and signal.variable not in manual.values()
    if not (drives or signal.variable in manual):
        return
    tag, name = signal.tag, f"unknown_position_{signal.component}"
    large, words = POSITION_LARGE * tag.range.span, f"unknown offset of the position of {signal.component}"
    both, effect = Range(-SEVERAL * large, SEVERAL * large), Effect(EffectKind.POSITION, signal.variable)
    yield _mode(name, words, signal.component, tag.unit, both, effect, unknown=True)
    effect = Effect(EffectKind.POSITION, signal.variable, swings=True)
    yield _mode(f"{name}_swinging", f"{words}, swinging", signal.component, tag.unit, both, effect, unknown=True)
    both = Range(both.low / horizon_s, both.high / horizon_s)
    effect = Effect(EffectKind.POSITION, signal.variable, grows=True)
    yield _mode(f"{name}_growing", f"{words}, growing", signal.component, f"{tag.unit}/s", both, effect, unknown=True)


def _is_in(p: ModelParameter, balance: Balance, plant: PlantDescription) -> bool:
    """Whether the tables have the parameter in the equation of the balance's state."""
    rate = f"d{balance.state}/dt"
    return any(p.symbol in equation.expression.tags for equation in plant.equations if equation.result == rate)


def _of_parameter(
    p: ModelParameter, balance: Balance | None, sensors: Collection[str], horizon_s: float
) -> Iterator[FaultMode]:
    """An uncertain parameter may change: unlike what is certain, nobody has said what it must be.

    One of a ``balance`` is a disturbance of that balance which goes with what the parameter is multiplied by.
    """
    if p.sd <= 0.0 or p.component in sensors:
        return
    large = PARAMETER_LARGE * p.sd
    where = balance.component if balance is not None else p.component
    place = f"{balance.quantity}_{where}" if balance is not None else where
    name, both = f"unknown_{place}_{p.symbol}", Range(-SEVERAL * large, SEVERAL * large)
    words = f"unknown change of {p.symbol} ({p.component})"
    effect = Effect(EffectKind.PARAMETER, p.symbol)
    yield _mode(name, words, where, p.unit, both, effect, unknown=True)
    effect = Effect(EffectKind.PARAMETER, p.symbol, swings=True)
    yield _mode(f"{name}_swinging", f"{words}, swinging", where, p.unit, both, effect, unknown=True)
    both = Range(both.low / horizon_s, both.high / horizon_s)
    effect = Effect(EffectKind.PARAMETER, p.symbol, grows=True)
    yield _mode(f"{name}_growing", f"{words}, growing", where, f"{p.unit}/s", both, effect, unknown=True)


def _of_lag(actuator: str, parameters: Sequence[ModelParameter]) -> Iterator[FaultMode]:
    """An actuator with an uncertain lag may stand still; none where that may be another time of it."""
    times = [p for p in parameters if p.component == actuator and p.unit == "s" and p.sd > 0.0]
    if len(times) == 1:
        words, effect = f"{actuator} stands still whatever it is told", Effect(EffectKind.STUCK, times[0].symbol)
        yield _mode(f"{actuator}_stuck", words, actuator, "1", Range(0.0, 1.0), effect)


def _of_nothing_listed(plant: PlantDescription) -> FaultMode:
    """What is wrong where nothing fits of all that could be."""
    words = "unknown cause: nothing that is known or estimated fits"
    return _mode(SOMETHING_ELSE, words, plant.name, "1", Range(0.0, 1.0), Effect(EffectKind.UNSEEN, ""), unknown=True)


def _mode(
    name: str, words: str, component: str, unit: str, sizes: Range, effect: Effect, *, unknown: bool = False
) -> FaultMode:
    estimated = effect.kind not in SIZELESS
    return FaultMode(
        name=name,
        label=words,
        component=component,
        disables=None if unknown else component,
        severity_range=sizes,
        severity_nominal=sizes.high / SEVERAL if estimated else sizes.high,
        severity_unit=unit,
        prior=PRIOR,
        description="Size of the change" if unknown else "Size of the error",
        effect=effect,
        unknown=unknown,
    )
