"""Are the safety tests worth anything? Every small change to the safety layer must make one of them fail.

``python -m tests.safety.mutate`` makes one mutant after the other of ``homeostat/assurance/*.py`` (a comparison or a
sign flipped, ``min`` for ``max``, ``and`` for ``or``, a statement left out, ...), runs the fast safety tests against
it in a process of its own, and names the mutants that survived. Mutants that change nothing that can be observed
stand in ``EQUIVALENT`` with the reason.
"""

from __future__ import annotations

import ast
import copy
import importlib.abc
import importlib.machinery
import io
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

REPO = Path(__file__).resolve().parents[2]
SAFETY_LAYER = REPO / "src" / "homeostat" / "assurance"
TESTS = ("test_judge.py", "test_gate.py", "test_not_finite.py", "test_fallback.py", "test_boundaries.py")
LIMIT_S = 20.0
"""A mutant that keeps the tests busy for longer is killed, in both senses [s]."""

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.GtE),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr,
}
NAMES = {
    "min": "max",
    "max": "min",
    "argmin": "argmax",
    "all": "any",
    "any": "all",
    "isfinite": "isnan",
    "isinf": "isnan",
}

EQUIVALENT: dict[tuple[str, str], str] = {}
"""(line of source, change) -> why nobody can tell the difference."""


@dataclass(frozen=True)
class Mutant:
    """One changed module."""

    module: str
    """Name of the module."""
    line: int
    """Line of the change."""
    source: str
    """The line as it is."""
    change: str
    """What was changed, ``old -> new``."""
    tree: ast.Module
    """The changed module."""

    def __str__(self) -> str:
        return f"{self.module}:{self.line}: {self.change}    {self.source}"


def changes(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Every small change of one node."""
    match node:
        case ast.Compare(ops=ops):
            for k, operator in enumerate(ops):
                for other in COMPARISONS[type(operator)]:
                    new = copy.deepcopy(node)
                    new.ops[k] = other()
                    yield f"{type(operator).__name__} -> {other.__name__} ({k})", new
        case ast.BoolOp(op=op):
            other_op = ast.Or() if isinstance(op, ast.And) else ast.And()
            yield f"{type(op).__name__} -> {type(other_op).__name__}", ast.BoolOp(other_op, node.values)
        case ast.BinOp(op=op) if type(op) in OPERATORS:
            other_type = OPERATORS[type(op)]
            yield f"{type(op).__name__} -> {other_type.__name__}", ast.BinOp(node.left, other_type(), node.right)
        case ast.UnaryOp(op=ast.USub() | ast.Not()):
            yield f"{type(node.op).__name__} -> nothing", node.operand
        case ast.Name(id=name) if name in NAMES:
            yield f"{name} -> {NAMES[name]}", ast.Name(NAMES[name], node.ctx)
        case ast.Attribute(attr=name) if name in NAMES:
            yield f"{name} -> {NAMES[name]}", ast.Attribute(node.value, NAMES[name], node.ctx)
        case ast.Constant(value=bool() as value):
            yield f"{value} -> {not value}", ast.Constant(not value)
        case ast.Constant(value=int() | float() as value):
            new_value = -value if value else 1 if isinstance(value, int) else 1.0
            yield f"{value!r} -> {new_value!r}", ast.Constant(new_value)
        case ast.Constant(value="inf"):
            yield "inf -> -inf", ast.Constant("-inf")
        case ast.IfExp():
            yield "if -> always", node.body
            yield "if -> never", node.orelse
        case ast.comprehension(ifs=ifs):
            for k in range(len(ifs)):
                yield (
                    f"filter {k} -> none",
                    ast.comprehension(node.target, node.iter, ifs[:k] + ifs[k + 1 :], node.is_async),
                )
        case ast.Raise() | ast.Continue() | ast.AugAssign():
            yield f"{type(node).__name__} -> pass", ast.Pass()
        case ast.Expr(value=ast.Call() | ast.Await()):
            yield "call -> pass", ast.Pass()
        case ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
            yield "assignment -> pass", ast.Pass()
        case ast.match_case(guard=ast.expr()):
            yield "guard -> none", ast.match_case(node.pattern, None, node.body)


def mutants() -> list[Mutant]:
    """Every mutant of the safety layer, in the order of the source."""
    found = []
    for path in sorted(SAFETY_LAYER.glob("*.py")):
        text = path.read_text(encoding="utf-8")
        lines = text.splitlines()
        original = ast.parse(text)
        for index, node in enumerate(ast.walk(original)):
            for change, new in changes(node):
                tree = copy.deepcopy(original)
                place = list(ast.walk(tree))[index]
                line = getattr(node, "lineno", 0) or next(n.lineno for n in ast.walk(node) if hasattr(n, "lineno"))
                changed = ast.fix_missing_locations(Replace(place, new).visit(tree))
                module = f"homeostat.assurance.{path.stem}"
                found.append(Mutant(module, line, lines[line - 1].strip(), change, changed))
    return sorted(found, key=lambda m: (m.module, m.line))


class Replace(ast.NodeTransformer):
    """Puts one node in the place of another."""

    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self._old, self._new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        if node is self._old:
            return ast.copy_location(copy.deepcopy(self._new), node) if hasattr(node, "lineno") else self._new
        return super().visit(node)


class Swap(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports the mutant in the place of its module."""

    def __init__(self, mutant: Mutant) -> None:
        self._mutant = mutant

    def find_spec(self, name: str, path: object, target: object = None) -> importlib.machinery.ModuleSpec | None:
        return importlib.machinery.ModuleSpec(name, self) if name == self._mutant.module else None

    def exec_module(self, module: ModuleType) -> None:
        exec(compile(self._mutant.tree, f"<mutant of {self._mutant.module}>", "exec"), module.__dict__)


def killed(mutant: Mutant | None) -> bool:
    """Whether the safety tests, run in a child process, notice the mutant (the original where None)."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            if mutant is not None:
                sys.meta_path.insert(0, Swap(mutant))
            code = _test()
        finally:
            os._exit(code)
    deadline = time.monotonic() + LIMIT_S
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status) != 0
        if time.monotonic() > deadline:
            os.kill(child, 9)
            os.waitpid(child, 0)
            return True
        time.sleep(0.005)


def _test() -> int:
    """Run the fast safety tests here and now; 0 where all pass."""
    import pytest

    quiet = io.StringIO()
    with redirect_stdout(quiet), redirect_stderr(quiet):
        files = [str(REPO / "tests" / "safety" / name) for name in TESTS]
        options = [
            "-x",
            "-q",
            "-p",
            "no:cacheprovider",
            "-p",
            "no:xdist",
            "-p",
            "no:hypothesispytest",
            "--no-header",
            "--tb=no",
        ]
        return int(pytest.main([*files, *options, "--rootdir", str(REPO), "-c", str(REPO / "pyproject.toml")]))


def warm_up() -> None:
    """Import everything that all children need, except what is mutated."""
    import numpy  # noqa: F401
    import pytest  # noqa: F401

    from homeostat.domain.formula import parse

    parse("T <= 1")  # loads the grammar
    assert not any(name.startswith("homeostat.assurance.") for name in sys.modules)


def main(workers: int = 2) -> int:
    """Print what survived; 0 where nothing did."""
    os.chdir(REPO)
    sys.path[:0] = [str(REPO), str(REPO / "src")]
    started = time.monotonic()
    warm_up()
    if killed(None):
        print("the safety tests fail on the original; nothing can be said about mutants")
        return 2
    every = mutants()
    asked = [m for m in every if (m.source, m.change) not in EQUIVALENT]
    with ThreadPoolExecutor(workers) as pool:
        survived = [m for m, dead in zip(asked, pool.map(killed, asked), strict=True) if not dead]
    excused = {(m.source, m.change) for m in every} & EQUIVALENT.keys()
    stale = EQUIVALENT.keys() - excused
    for mutant in survived:
        print(f"survived: {mutant}")
    for source, change in sorted(stale):
        print(f"EQUIVALENT lists a mutant that no longer exists: {change}    {source}")
    print(
        f"{len(asked) - len(survived)} of {len(asked)} mutants killed, {len(every) - len(asked)} equivalent,"
        f" {time.monotonic() - started:.0f} s"
    )
    return 1 if survived or stale else 0


if __name__ == "__main__":
    sys.exit(main())
