"""Disturbances: what happens to a true plant that no table, no twin and no fault list knows; one line of text each."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Self, TypeAlias


class DisturbanceError(ValueError):
    """A text says no disturbance, or none that the plant can have; one line with what it can be."""


class Effect(StrEnum):
    """What a disturbance does, as its text has it."""

    PLUS = "+"
    """Is added to a parameter or to a target that is commanded, in its unit."""
    TIMES = "*"
    """Multiplies it [1]."""
    READS_PLUS = "reads +"
    """Is added to what an instrument shows, in its unit."""
    READS_TIMES = "reads *"
    """Multiplies what an instrument shows [1]."""
    FROZEN = "frozen"
    """The instrument keeps what it showed last."""
    NOISE = "noise *"
    """Multiplies the instrument's noise [1]."""
    STICTION = "stiction"
    """The actuator does not move before it is told to by more than this share of its travel [1]."""
    SLOW = "slow"
    """The actuator follows its command with one more lag [s]."""


class Shape(StrEnum):
    """What course chance gives its size; its text has the word behind the size."""

    STATED = ""
    """None: it is there in full or, with a period, follows a sine."""
    WANDERING = "wandering"
    """From 0 to one random share of it after the other, -1 to 1, with no slope at any."""
    BURSTING = "bursting"
    """Again and again from 0 to all of it with the square of the time, and back."""


Course: TypeAlias = Callable[[float], float]
"""Time since a disturbance began [s] -> the share of its size that chance gives it then, -1 to 1 [1]."""
SHORTEST_S: Final = 1.0
"""Least time from one random value to the next [s]."""
USAGE: Final = (
    "say NAME + 10, NAME * 0.5, TAG reads + 2, TAG reads * 0.8, TAG frozen, TAG noise * 5, ACTUATOR stiction 0.06 or "
    "ACTUATOR slow 25, and where wanted wandering or bursting, from S, to S, over S, every S, every S..S, back S"
)
_NUMBER: Final = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_TEXT: Final = re.compile(
    r"\s*(?P<name>[A-Za-z_][\w.]*)\s*"
    rf"(?:(?P<reads>(?<=\s)reads\s*)?(?P<sign>[-+*])\s*(?P<size>{_NUMBER})"
    rf"|(?<=\s)(?:(?P<frozen>frozen)|(?P<word>noise\s*\*|stiction|slow)\s*(?P<much>{_NUMBER})))"
    r"(?:\s+(?P<shape>wandering|bursting))?"
    rf"(?P<when>(?:\s+(?:(?:from|to|over|back)\s+{_NUMBER}|every\s+{_NUMBER}(?:\.\.{_NUMBER})?))*)\s*"
)
_WHEN: Final = re.compile(rf"(from|to|over|every|back)\s+({_NUMBER})(?:\.\.({_NUMBER}))?(?=\s|$)")


@dataclass(frozen=True, slots=True)
class Disturbance:
    """One thing that happens to a true plant."""

    name: str
    """Parameter, tag or actuator."""
    effect: Effect
    """What happens to it."""
    size: float
    """How much, in the unit that the effect says; 0 for a frozen instrument."""
    from_s: float = 0.0
    """Process time from which it acts [s]."""
    to_s: float = math.inf
    """Process time from which it acts no more [s]."""
    over_s: float = 0.0
    """Time in which it grows to its size [s]; 0 for a step."""
    every_s: float = 0.0
    """Period of the sine that it follows, or least time from one random value to the next [s]; 0 for none."""
    shape: Shape = Shape.STATED
    """What course chance gives it."""
    longest_s: float = 0.0
    """Longest time from one random value to the next [s]; 0 where each takes ``every_s``."""
    back_s: float = 0.0
    """Time in which a burst goes back [s]; 0 for at once."""

    @classmethod
    def parse(cls, text: str) -> Self:
        """The disturbance that ``text`` says; DisturbanceError with the grammar where it says none."""
        if not isinstance(text, str):
            raise DisturbanceError(f"disturbance {text!r} is no text; {USAGE}")
        found = _TEXT.fullmatch(text)
        if found is None:
            raise DisturbanceError(f"disturbance {text!r} cannot be understood; {USAGE}")
        times: dict[str, float] = {}
        for word, number, longest in _WHEN.findall(found["when"]):
            if word in times:
                raise DisturbanceError(f"disturbance {text!r} says {word!r} twice; say it once")
            times[word] = float(number)
            times |= {"longest": float(longest)} if longest else {}
        effect, size = _effect(found)
        fields = {f"{word}_s": number for word, number in times.items()}
        made = cls(found["name"], effect, size, shape=Shape(found["shape"] or ""), **fields)
        if problem := made._problem(times):
            raise DisturbanceError(f"disturbance {text!r}: {problem}")
        return made

    def _problem(self, times: dict[str, float]) -> str:
        """What is wrong with the numbers; empty where they are possible."""
        if not math.isfinite(self.size) or not all(math.isfinite(number) for number in times.values()):
            return "every number must be finite"
        if self.from_s < 0.0:
            return f"from {self.from_s:g} s must be 0 s or later"
        if self.to_s <= self.from_s:
            return f"to {self.to_s:g} s must be later than from {self.from_s:g} s"
        for word in ("over", "every", "back"):
            if word in times and times[word] <= 0.0:
                return f"{word} {times[word]:g} s must be more than 0 s"
        if self.effect is Effect.FROZEN and (self.shape or "over" in times or "every" in times):
            return "what is frozen has no size that could change; leave 'over', 'every' and the course out"
        if problem := self._random_problem(times):
            return problem
        if self.effect in (Effect.STICTION, Effect.SLOW, Effect.NOISE) and self.size < 0.0:
            return f"{self.effect.value} {self.size:g} must be 0 or more"
        if self.effect is Effect.STICTION and self.size > 1.0:
            return f"stiction {self.size:g} must be a share of the travel, 0 to 1"
        return ""

    def _random_problem(self, times: dict[str, float]) -> str:
        """What is wrong with the course that chance is to give it, or with having one."""
        if "back" in times and self.shape is not Shape.BURSTING:
            return "back is for what comes in bursts; say 'bursting', or leave it out"
        if self.shape is Shape.STATED:
            return "a sine has one period; say one, or 'wandering' or 'bursting'" if "longest" in times else ""
        if "every" not in times:
            return f"{self.shape} needs 'every S' or 'every S..S', the time from one random value to the next"
        if self.every_s < SHORTEST_S:
            return f"every {self.every_s:g} s must be {SHORTEST_S:g} s or more where it is {self.shape}"
        if "longest" in times and self.longest_s <= self.every_s:
            return f"every {self.every_s:g}..{self.longest_s:g} s must go from a shorter time to a longer one"
        return ""

    def share(self, at_s: float, course: Course | None = None) -> float:
        """How much of its size it has at ``at_s`` [s]: 0 while it does not act, 1 in full, -1 to 1 along its course.

        ``course``: what chance gives it; where there is none, what is random counts in full.
        """
        if not self.from_s <= at_s < self.to_s:
            return 0.0
        since_s = at_s - self.from_s
        grown = min(since_s / self.over_s, 1.0) if self.over_s > 0.0 else 1.0
        if course is not None:
            return grown * course(since_s)
        if self.shape is Shape.STATED and self.every_s > 0.0:
            return grown * math.sin(2.0 * math.pi * since_s / self.every_s)
        return grown

    def applied(self, value: float, at_s: float) -> float:
        """What ``value`` becomes of it at ``at_s`` [s]; a factor is approached from 1, a size from 0."""
        return self.changed(value, self.share(at_s))

    def changed(self, value: float, share: float) -> float:
        """What ``value`` becomes of this ``share`` of it."""
        if self.effect in (Effect.TIMES, Effect.READS_TIMES, Effect.NOISE):
            return value * (1.0 + (self.size - 1.0) * share)
        if self.effect is Effect.FROZEN:
            return max(value, share)
        return value + self.size * share

    @property
    def what(self) -> str:
        """The text without its times."""
        sign, size = ("-", -self.size) if self.effect.endswith("+") and self.size < 0.0 else ("", self.size)
        said = f"{self.effect.value[:-1]}{sign}" if sign else self.effect.value
        much = [] if self.effect is Effect.FROZEN else [_written(size)]
        return " ".join((self.name, said, *much, *([self.shape] if self.shape else [])))

    def __str__(self) -> str:
        """The text that :meth:`parse` reads."""
        times = {"from": self.from_s, "to": self.to_s, "over": self.over_s, "every": self.every_s, "back": self.back_s}
        longest = f"..{_written(self.longest_s)}" if self.longest_s else ""
        when = [
            f"{word} {_written(number)}{longest if word == 'every' else ''}"
            for word, number in times.items()
            if number not in (0.0, math.inf)
        ]
        return " ".join((self.what, *when))


def _written(number: float) -> str:
    return repr(number).removesuffix(".0")


def _effect(found: re.Match[str]) -> tuple[Effect, float]:
    """What happens, and how much of it."""
    if found["frozen"]:
        return Effect.FROZEN, 0.0
    if found["word"]:
        return Effect(re.sub(r"\s*\*", " *", found["word"])), float(found["much"])
    sign, size = found["sign"], float(found["size"])
    if sign == "-":
        sign, size = "+", -size
    return Effect(f"reads {sign}" if found["reads"] else sign), size
