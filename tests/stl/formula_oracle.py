"""A second, naive reading of the rule language, and seeded random formulas to compare it with.

A formula is a nested tuple here: ``("always", 0, 3, ("<=", ("tag", "x"), ("number", 1.0)))``; bounds are in samples,
None when unbounded. Nothing is shared with the implementation: each value is computed recursively, one sample at a
time, from the definition of quantitative robustness.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

Tree = tuple[Any, ...]
Rows = dict[str, list[float]]
Point = tuple[float, int | None]
"""Margin and the sample that decides it."""

TAGS = ("x", "y", "z.sp")
ARITHMETIC = ("+", "-", "*", "abs", "min", "max", "negate")
COMPARISONS = ("<=", "<", ">=", ">", "==")
LOGIC = ("not", "and", "or", "implies")
TEMPORAL = ("always", "eventually", "until")


def number_of(tree: Tree, rows: Rows, t: int) -> float:
    """Value of an arithmetic tree at sample ``t``."""
    kind, *rest = tree
    if kind == "number":
        return float(rest[0])
    if kind == "tag":
        return rows[rest[0]][t]
    values = [number_of(operand, rows, t) for operand in rest]
    operations: dict[str, Callable[..., float]] = {
        "+": lambda a, b: a + b,
        "-": lambda a, b: a - b,
        "*": lambda a, b: a * b,
        "/": lambda a, b: a / b,
        "abs": abs,
        "min": min,
        "max": max,
        "negate": lambda a: -a,
    }
    return operations[kind](*values)


def margin_of(tree: Tree, rows: Rows, length: int, t: int) -> Point:
    """Margin of a logic tree at sample ``t`` of a trace, and the sample that decides it."""
    kind, *rest = tree
    if kind in ("true", "false"):
        return (math.inf if kind == "true" else -math.inf), None
    if kind in COMPARISONS:
        left, right = (number_of(operand, rows, t) for operand in rest)
        difference = {"<": right - left, ">": left - right, "=": -abs(left - right)}
        return difference[kind[0]], t
    if kind == "not":
        value, at = margin_of(rest[0], rows, length, t)
        return -value, at
    if kind == "implies":
        return margin_of(("or", ("not", rest[0]), rest[1]), rows, length, t)
    if kind in ("and", "or"):
        return _first_best([margin_of(operand, rows, length, t) for operand in rest], kind == "and")
    low, high, *operands = rest
    window = [s for s in range(length) if t + (low or 0) <= s and (high is None or s <= t + high)]
    if kind == "until":
        return _until(operands, rows, length, t, window)
    return _first_best([margin_of(operands[0], rows, length, s) for s in window], kind == "always")


def _until(operands: list[Tree], rows: Rows, length: int, t: int, window: list[int]) -> Point:
    condition, goal = operands
    candidates = []
    for s in window:
        held = [margin_of(condition, rows, length, earlier) for earlier in range(t, s)]
        candidates.append(_first_best([*held, margin_of(goal, rows, length, s)], True))
    return _first_best(candidates, False)


def _first_best(points: list[Point], smallest: bool) -> Point:
    best: Point = (math.inf if smallest else -math.inf, None)
    for index, point in enumerate(points):
        if index == 0 or (point[0] < best[0] if smallest else point[0] > best[0]):
            best = point
    return best


def text_of(tree: Tree, dt_s: float = 1.0) -> str:
    """The tree in the rule language, every operand in parentheses."""
    kind, *rest = tree
    if kind in ("number", "tag"):
        return str(rest[0])
    if kind in ("true", "false"):
        return str(kind)
    if kind in TEMPORAL:
        low, high, *operands = rest
        bounds = "" if high is None else f"[{low * dt_s:g},{high * dt_s:g}]"
        texts = [f"({text_of(operand, dt_s)})" for operand in operands]
        return f"{kind}{bounds}{texts[0]}" if len(texts) == 1 else f"{texts[0]} until{bounds} {texts[1]}"
    texts = [f"({text_of(operand, dt_s)})" for operand in rest]
    if kind in ("abs", "min", "max"):
        return f"{kind}({', '.join(texts)})"
    if kind in ("not", "negate"):
        return f"{'-' if kind == 'negate' else kind} {texts[0]}"
    return f" {kind} ".join(texts)


class Draw:
    """Random trees and signals from one seeded generator."""

    def __init__(self, rng: np.random.Generator, arithmetic: tuple[str, ...] = ARITHMETIC, constants: bool = True):
        self.rng = rng
        self.arithmetic = arithmetic
        self.constants = constants

    def number(self, depth: int) -> Tree:
        """An arithmetic tree of at most this depth."""
        if depth == 0 or self.rng.random() < 0.4:
            if self.rng.random() < 0.7:
                return ("tag", str(self.rng.choice(TAGS)))
            return ("number", float(self.rng.integers(0, 7)) / 2)
        kind = str(self.rng.choice(self.arithmetic))
        count = 1 if kind in ("abs", "negate") else 2
        return (kind, *(self.number(depth - 1) for _ in range(count)))

    def logic(self, depth: int, temporal: bool = True, negated: bool = False) -> Tree:
        """A logic tree of at most this depth; ``negated``: one that stands below a negation, where no ``==`` may."""
        if self.constants and self.rng.random() < 0.03:
            return (str(self.rng.choice(("true", "false"))),)
        if depth == 0 or self.rng.random() < 0.1:
            operators = [o for o in COMPARISONS if not (negated and o == "==")]
            return (str(self.rng.choice(operators)), self.number(2), self.number(2))
        kind = str(self.rng.choice(LOGIC + TEMPORAL if temporal else LOGIC))
        if kind not in TEMPORAL:
            count = {"not": 1, "implies": 2}.get(kind) or int(self.rng.integers(2, 4))
            turned = {"not": [True], "implies": [True, False]}.get(kind, [False] * count)
            return (kind, *(self.logic(depth - 1, temporal, negated != turns) for turns in turned))
        low, span = int(self.rng.integers(0, 5)), int(self.rng.integers(0, 6))
        bounds = (None, None) if self.rng.random() < 0.15 else (low, low + span)
        return (kind, *bounds, *(self.logic(depth - 1, negated=negated) for _ in range(2 if kind == "until" else 1)))

    def signals(self, members: int, length: int) -> dict[str, np.ndarray]:
        """Signals on a coarse grid, so that equal values are common; shape (members, length)."""
        return {tag: self.rng.integers(-6, 7, (members, length)) / 2 for tag in TAGS}
