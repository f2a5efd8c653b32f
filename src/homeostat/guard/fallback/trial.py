"""Trial: what a journal says of how the fallbacks have fared, so that a death gives none of them more time or turns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from homeostat.domain.events.writes import Cause
from homeostat.guard.writing.flight import PUT_RIGHT

_TRIP = "trip:"


@dataclass(frozen=True, slots=True)
class Passed:
    """How far the time has come in which a strategy must help one limit."""

    at_s: float
    """When this was so [s]."""
    passed_s: float
    """How much of the time was over [s]."""
    sums: tuple[float, ...]
    """What was seen of the margin, as `EffectFollowed` has it."""


@dataclass(frozen=True, slots=True)
class Trial:
    """Where the fallbacks and the limits that they act against stood when the journal ends."""

    ranked: tuple[str, ...] = ()
    """Names of the strategies in the order in which they act; empty where nobody has ranked them."""
    named: bool = False
    """Whether recovery wants the one in front first whatever trips."""
    acted: str = ""
    """Strategy that acted last; empty where none has since the last reset."""
    stands: bool = False
    """Whether the journal says that it stands."""
    tried: frozenset[str] = frozenset()
    """Strategies that had their turn in the present round."""
    violated: frozenset[str] = frozenset()
    """Limits that were violated at last."""
    unseen: frozenset[str] = frozenset()
    """Those of them that nothing has shown to be violated: they cannot be judged."""
    answered: frozenset[str] = frozenset()
    """Limits against which a strategy was chosen, and that have not come back since."""
    returned: frozenset[str] = frozenset()
    """Limits that have come back under the strategy that stands."""
    effects: Mapping[str, Passed] = field(default_factory=dict)
    """Violated limit -> how far its time has come under the strategy that stands."""
    lifting: Mapping[str, float] = field(default_factory=dict)
    """Limit whose trip is being lifted -> until when at most [s]."""
    lifted: Mapping[str, float] = field(default_factory=dict)
    """Limit -> for how long its trip had been lifted when that ended last [s]."""
    jumped: Mapping[str, float] = field(default_factory=dict)
    """Tag -> what its reading has jumped by without a reason in the process, in the tag's unit."""

    def fold(self, kind: str, fields: Mapping[str, Any]) -> Trial:
        """The same after one more event."""
        fold = _FOLDS.get(kind)
        return self if fold is None else fold(self, fields)

    def lifted_s(self, limit: str, longest_s: float, now_s: float) -> float:
        """For how long the trip of ``limit``, at most ``longest_s``, has been lifted by ``now_s`` [s].

        Where the journal does not say that it ended, it has gone on ever since.
        """
        used_s = self.lifted.get(limit, 0.0)
        if limit in self.lifting:
            used_s = max(used_s, longest_s - max(self.lifting[limit] - now_s, 0.0))
        return min(used_s, longest_s)


def _turn(trial: Trial, name: str) -> frozenset[str]:
    """Who had a turn, now that ``name`` has; whoever has one again begins another round."""
    again = name in trial.tried and name != trial.acted
    return frozenset({name}) if again else trial.tried | {name}


def _acts(trial: Trial, name: str) -> Trial:
    """``name`` is being sent: it answers everything where it is the first; nothing is known of what it brings."""
    answered = trial.answered if trial.acted else trial.violated
    return replace(
        trial, acted=name, tried=_turn(trial, name), answered=answered, stands=False, returned=frozenset(), effects={}
    )


def _intended(trial: Trial, fields: Mapping[str, Any]) -> Trial:
    ours = Cause[fields["cause"]] is Cause.FALLBACK and fields["source"] != PUT_RIGHT
    return _acts(trial, str(fields["source"])) if ours else trial


def _fell_back(trial: Trial, fields: Mapping[str, Any]) -> Trial:
    trial = _acts(trial, str(fields["strategy"]))
    return replace(trial, answered=trial.answered | frozenset(fields.get("answers", trial.violated)))


def _returned(trial: Trial, fields: Mapping[str, Any]) -> Trial:
    alarm = str(fields["alarm"])
    if not alarm.startswith(_TRIP):
        return trial
    name = alarm.removeprefix(_TRIP)
    returned = trial.returned | {name} if trial.stands else trial.returned
    trial = replace(
        trial,
        violated=trial.violated - {name},
        unseen=trial.unseen - {name},
        answered=trial.answered - {name},
        returned=returned,
    )
    return _without_effect(trial, {"limit": name})


def _tripped(trial: Trial, fields: Mapping[str, Any]) -> Trial:
    name = str(fields["limit"])
    unseen = trial.unseen - {name} if fields.get("seen", True) else trial.unseen | {name}
    return replace(trial, violated=trial.violated | {name}, unseen=unseen)


def _without_effect(trial: Trial, fields: Mapping[str, Any]) -> Trial:
    return replace(trial, effects={name: e for name, e in trial.effects.items() if name != fields["limit"]})


def _followed(trial: Trial, fields: Mapping[str, Any]) -> Trial:
    passed = Passed(float(fields["judged_s"]), float(fields["passed_s"]), tuple(map(float, fields["sums"])))
    return replace(trial, effects={**trial.effects, str(fields["limit"]): passed})


def _lift_ended(trial: Trial, fields: Mapping[str, Any]) -> Trial:
    name = str(fields["limit"])
    lifting = {limit: until_s for limit, until_s in trial.lifting.items() if limit != name}
    return replace(trial, lifting=lifting, lifted={**trial.lifted, name: float(fields["used_s"])})


_FOLDS: Mapping[str, Any] = {
    "armed": lambda t, f: replace(t, ranked=tuple(map(str, f["strategies"])), named=bool(f.get("named", True))),
    "tripped": _tripped,
    "alarm-returned": _returned,
    "write-intended": _intended,
    "fallback-activated": _fell_back,
    "fallback-skipped": lambda t, f: replace(t, tried=_turn(t, str(f["strategy"]))),
    "fallback-stands": lambda t, f: replace(t, stands=t.stands or f["strategy"] == t.acted),
    "fallback-ineffective": lambda t, f: _without_effect(t, f) if f["acted"] else t,
    "effect-followed": _followed,
    "lease-lost": lambda t, f: replace(t, returned=frozenset(), effects={}),
    "shed": lambda t, f: replace(t, stands=False, tried=frozenset(), returned=frozenset(), effects={}),
    "latched": lambda t, f: t if t.acted else replace(t, answered=t.violated),
    "latch-reset": lambda t, f: Trial(violated=t.violated, unseen=t.unseen, lifting=t.lifting, lifted=t.lifted),
    "reading-jumped": lambda t, f: replace(t, jumped={**t.jumped, str(f["tag"]): float(f["by"])}),
    "start-up-ended": lambda t, f: replace(t, jumped={}),
    "trip-lifted": lambda t, f: replace(t, lifting={**t.lifting, str(f["limit"]): float(f["until_s"])}),
    "trip-lift-ended": _lift_ended,
}
OF_TRIALS: Final = frozenset(_FOLDS)
"""Kinds of the events that it is made of."""
