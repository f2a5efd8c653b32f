"""The guard's tests are tested: mutants of the guard must be noticed. See `tests.guard.mutate`."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import Counter

import pytest

from benchmarks.guard.mutation import LINE
from tests.guard.mutants import changes, code_of, mutants, replaced
from tests.guard.mutate import REPO, SAFETY_LAYER

pytestmark = pytest.mark.timeout(600)

LIMIT_S = 540


def mutate(*arguments: str) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, "-m", "tests.guard.mutate", *arguments]
    return subprocess.run(words, cwd=REPO, capture_output=True, text=True, timeout=LIMIT_S, check=False)


@pytest.mark.slow
@pytest.mark.parametrize(("sample", "least"), [(30, 27), pytest.param(100, 95, marks=pytest.mark.wide)])
def test_mutants_of_the_trips_are_noticed_by_the_tests_of_the_trips(sample: int, least: int) -> None:
    names = ("trips", "trip_edges", "trip_leads", "trip_times", "trial", "jumps", "disputes", "falls", "unseen")
    modules, tests = ("watch.trips", "watch.watched"), [f"guard/test_{name}.py" for name in names]
    done = mutate("--modules", *modules, "--sample", str(sample), "--seed", "1", "--tests", *tests)
    noticed, asked = (int(word) for word in done.stdout.splitlines()[-1].split()[:3:2])
    assert asked == sample and noticed >= least, done.stdout + done.stderr


def test_mutants_survive_tests_that_test_something_else() -> None:
    done = mutate("--modules", "requests.authority", "--tests", "guard/test_quality.py", "--sample", "3")
    assert done.returncode == 1
    assert "survived: homeostat.guard.requests.authority:" in done.stdout and "\n0 of 3 " in done.stdout
    ((module, dead, asked, _),) = LINE.findall(done.stdout)
    assert (module, dead, asked) == ("homeostat.guard.requests.authority", "0", "3"), "the page of results reads this"


def test_nothing_is_said_where_no_test_runs() -> None:
    done = mutate("--modules", "fallback.fallback", "--tests", "guard/vessel.py")
    assert done.returncode == 1 and "nothing can be said" in done.stdout


def test_a_module_that_there_is_not_is_named() -> None:
    done = mutate("--modules", "watch.trips", "watch.tripps")
    assert done.returncode == 2 and done.stderr.splitlines()[-1].partition("error: ")[2].startswith(
        "area 'guard' has no module 'watch.tripps'; it has fallback.effect, "
    )


def test_every_module_that_decides_has_mutants() -> None:
    found = {path.stem: len(mutants(path)) for path in SAFETY_LAYER.rglob("[!_]*.py")}
    assert {"trips", "writer", "latch", "verification", "memory"} <= set(found) and sum(found.values()) > 1000


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("a < b", ["a <= b", "a > b"]),
        ("a <= b < c", ["a < b < c", "a >= b < c", "a <= b <= c", "a <= b > c"]),
        ("a == b", ["a != b"]),
        ("a is not None", ["a is None"]),
        ("a not in b", ["a in b"]),
        ("a and b", ["a or b", "a", "b"]),
        ("a or b or c", ["a and b and c", "b or c", "a or c", "a or b"]),
        ("not a", ["a"]),
        ("-a", ["a"]),
        ("a - b", ["a + b", "a", "b"]),
        ("a * b", ["a / b"]),
        ("x = max(a, b)", ["x = min(a, b)"]),
        ("x = np.argmin(a)", ["x = np.argmax(a)"]),
        ("x = any(a)", ["x = all(a)"]),
        ("True", ["False"]),
        ("2.5", ["-2.5", "1.5", "3.5", "5.0"]),
        ("0", ["1", "-1"]),
        ("x = f(a, b, c)", ["x = f(b, a, c)"]),
        ("if a:\n    b\nelse:\n    c", ["if a:\n    pass\nelse:\n    c", "if a:\n    b"]),
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
