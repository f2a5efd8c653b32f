"""The safety tests are tested: every mutant of the safety layer must be noticed. See `tests.safety.mutate`."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import Counter

import pytest

from tests.safety.mutate import REPO, SAFETY_LAYER, changes, code_of, mutants, replaced

LIMIT_S = 240


def mutate(*arguments: str) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, "-m", "tests.safety.mutate", *arguments]
    return subprocess.run(words, cwd=REPO, capture_output=True, text=True, timeout=LIMIT_S, check=False)


def test_no_mutant_of_the_safety_layer_survives() -> None:
    done = mutate()
    assert done.returncode == 0, done.stdout + done.stderr
    noticed, every = (int(word) for word in done.stdout.split()[:3:2])
    assert noticed == every > 100


def test_mutants_survive_tests_that_test_something_else() -> None:
    done = mutate("--modules", "fallback", "--tests", "test_gate.py")
    assert done.returncode == 1
    assert "survived: homeostat.recovery.arming:" in done.stdout and "\n0 of " in done.stdout


def test_nothing_is_said_where_no_test_runs() -> None:
    done = mutate("--modules", "fallback", "--tests", "world.py")
    assert done.returncode == 1 and "nothing can be said" in done.stdout


def test_every_module_of_the_safety_layer_has_mutants() -> None:
    found = {path.stem: len(mutants(path)) for path in SAFETY_LAYER.glob("[!_]*.py")}
    assert {"sequencer", "fallback", "guard", "writer"} <= set(found) and min(found.values()) > 0


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("a < b", ["a <= b", "a > b"]),
        ("a <= b < c", ["a < b < c", "a >= b < c", "a <= b <= c", "a <= b > c"]),
        ("a == b", ["a != b"]),
        ("a is not None", ["a is None"]),
        ("a not in b", ["a in b"]),
        ("a and b", ["a or b"]),
        ("a or b", ["a and b"]),
        ("not a", ["a"]),
        ("-a", ["a"]),
        ("a - b", ["a + b"]),
        ("a * b", ["a / b"]),
        ("x = max(a, b)", ["x = min(a, b)"]),
        ("x = np.argmin(a)", ["x = np.argmax(a)"]),
        ("x = any(a)", ["x = all(a)"]),
        ("True", ["False"]),
        ("2.5", ["-2.5"]),
        ("0", ["1"]),
        ("[a for a in b if a]", ["[a for a in b]"]),
        ("a if b else c", ["a", "c"]),
        ("raise a", ["pass"]),
        ("a.b = c", ["pass"]),
        ("f()", ["pass"]),
        ("def f(a: b | c) -> d | e: ...", []),
    ],
)
def test_the_changes_are_the_ones_that_matter(source: str, expected: list[str]) -> None:
    found = []
    for place, node in enumerate(code_of(ast.parse(source))):
        for _, new in changes(node):
            found.append(ast.unparse(replaced(ast.parse(source), place, new)))
    assert Counter(found) == Counter(expected)
