"""Cross-check with RTAMT 0.4.10, an implementation of signal temporal logic written by others.

Compared is RTAMT's discrete-time offline monitor over its whole output: arithmetic, comparisons, logic, bounded and
unbounded always, eventually and until, at the end of the trace too. What it cannot do is listed at the end, one test
per reason, so that a release that can will be noticed.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from homeostat.stl.formula import parse
from tests.stl.formula_oracle import COMPARISONS, TEMPORAL, Draw, Tree, text_of

rtamt = pytest.importorskip("rtamt", reason="rtamt's parser runtime imports a module that Python 3.13 removed")
RTAMTException = pytest.importorskip("rtamt.exception.exception").RTAMTException

BATCHES, FORMULAS_PER_BATCH = 8, 250
"""2000 formulas."""
NAMES = {"x": "x", "y": "y", "z.sp": "zsp"}
"""A dot selects a field of an object in RTAMT."""


def rtamt_text(tree: Tree) -> str:
    """The tree as RTAMT reads it: everything in parentheses, no unary minus."""
    kind, *rest = tree
    if kind == "tag":
        return NAMES[rest[0]]
    if kind == "number":
        return str(rest[0])
    if kind in TEMPORAL:
        low, high, *operands = rest
        bounds = "" if high is None else f"[{low},{high}]"
        texts = [f"({rtamt_text(operand)})" for operand in operands]
        return f"{kind}{bounds}{texts[0]}" if len(texts) == 1 else f"{texts[0]} until{bounds} {texts[1]}"
    texts = [f"({rtamt_text(operand)})" for operand in rest]
    if kind == "negate":
        return f"(0.0) - {texts[0]}"
    if kind in ("not", "abs"):
        return f"{kind}{texts[0]}"
    folded = texts[0]
    for text in texts[1:]:
        folded = f"({folded}) {kind} {text}"
    return folded


def rtamt_margins(text: str, signals: dict[str, list[float]]) -> list[float]:
    """RTAMT's robustness at every sample of one member; bounds of ``text`` are in samples."""
    specification = rtamt.StlDiscreteTimeSpecification()
    for name in signals:
        specification.declare_var(name, "float")
    specification.spec = text
    specification.parse()
    length = len(next(iter(signals.values())))
    return [value for _, value in specification.evaluate({"time": list(range(length)), **signals})]


@pytest.mark.parametrize("seed", [0, 1, 2, *(pytest.param(seed, marks=pytest.mark.wide) for seed in range(3, BATCHES))])
def test_margins_agree_with_rtamt(seed: int) -> None:
    draw = Draw(np.random.default_rng([7, seed]), arithmetic=("+", "-", "*", "abs", "negate"), constants=False)
    compared = 0
    for _ in range(FORMULAS_PER_BATCH):
        tree = draw.logic(depth=3)
        length = int(draw.rng.integers(2, 16))
        signals = {tag: draw.rng.normal(size=(1, length)) * 2 for tag in NAMES}
        theirs = rtamt_margins(rtamt_text(tree), {NAMES[tag]: signal[0].tolist() for tag, signal in signals.items()})
        dt_s = float(draw.rng.choice([0.25, 1.0, 60.0]))
        ours = parse(text_of(tree, dt_s)).margins(signals, dt_s)[0]
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9, err_msg=text_of(tree))
        compared += 1
    assert compared == FORMULAS_PER_BATCH


def test_the_compared_formulas_reach_every_shared_operator() -> None:
    draw = Draw(np.random.default_rng([7, 0]), arithmetic=("+", "-", "*", "abs", "negate"), constants=False)
    kinds: set[str] = set()

    def collect(tree: Tree) -> None:
        kinds.add(str(tree[0]))
        for operand in tree[1:]:
            if isinstance(operand, tuple):
                collect(operand)

    for _ in range(FORMULAS_PER_BATCH):
        collect(draw.logic(depth=3))
    assert kinds >= {*COMPARISONS, *TEMPORAL, "not", "and", "or", "implies", "+", "-", "*", "abs", "negate"}


@pytest.mark.parametrize("kind", ["always", "eventually", "until"])
def test_windows_at_the_end_of_the_trace_agree(kind: str) -> None:
    """Clipped and empty windows, and windows that begin and end far beyond the trace."""
    rng = np.random.default_rng(4)
    leaf, goal = ("<=", ("tag", "x"), ("number", 0.5)), (">=", ("tag", "y"), ("number", 0.25))
    operands = (leaf, goal) if kind == "until" else (leaf,)
    for length in range(2, 7):
        for low in range(10):
            for high in range(low, 10):
                signals = {"x": rng.normal(size=length), "y": rng.normal(size=length)}
                tree = (kind, low, high, *operands)
                theirs = rtamt_margins(rtamt_text(tree), {name: signal.tolist() for name, signal in signals.items()})
                assert parse(text_of(tree)).margins(signals, 1.0)[0].tolist() == theirs, text_of(tree)


@pytest.mark.parametrize("text", ["(x / y) <= 1", "(x) / (y) <= 1"])
def test_quotients_agree(text: str) -> None:
    signals = {"x": [1.0, 2.0, -3.0], "y": [0.5, -4.0, 7.0]}
    arrays = {name: np.array(signal) for name, signal in signals.items()}
    assert parse(text).margins(arrays, 1.0)[0].tolist() == rtamt_margins(text, signals)


# What is left out of the comparison, and why.


def test_left_out_rtamt_fails_on_a_single_sample() -> None:
    with pytest.raises(UnboundLocalError):
        rtamt_margins("x <= 1", {"x": [0.0]})
    assert parse("x <= 1").margins({"x": np.array([0.0])}, 1.0).tolist() == [[1.0]]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("min(x, y) <= 1", [0.0, 0.0]),
        ("max(x, y) <= 1", [-1.0, -2.0]),
        ("true", [math.inf, math.inf]),
        ("x - y - 1 <= 0", [2.0, -1.0]),
        ("-x <= 3", [4.0, 6.0]),
    ],
)
def test_left_out_rtamt_cannot_read_it(text: str, expected: list[float]) -> None:
    """No minimum, maximum or constants; unparenthesised sums and unary minus of a signal are syntax errors there."""
    with pytest.raises(RTAMTException):
        rtamt_margins(text, {"x": [1.0, 3.0], "y": [2.0, 1.0]})
    signals = {"x": np.array([1.0, 3.0]), "y": np.array([2.0, 1.0])}
    assert parse(text).margins(signals, 1.0)[0].tolist() == expected


def test_left_out_rtamt_reads_a_quotient_without_spaces_as_a_name() -> None:
    with pytest.raises(KeyError):
        rtamt_margins("x/y <= 1", {"x": [1.0, 3.0], "y": [2.0, 1.0]})
    signals = {"x": np.array([1.0, 3.0]), "y": np.array([2.0, 1.0])}
    assert parse("x/y <= 1").margins(signals, 1.0).tolist() == [[0.5, -2.0]]
