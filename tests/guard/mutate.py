"""Are the guard's tests worth anything? Every small change to the guard must make one of them fail.

``python -m tests.guard.mutate`` makes one mutant after the other of ``homeostat/guard/*.py`` (a comparison or a sign
flipped, a constant shifted or doubled, an operand dropped, arguments swapped, a branch or a statement left out), runs
the fast tests of the guard against each in a process of its own, and names the mutants that survived. The tests are
collected once; a child process gives the functions of the guard the mutant's code and runs the tests until one fails,
those of the mutant's own module first. ``--sample`` takes so many of the mutants at random. ``--area supervisor`` does
the same with the supervisor and the tests of recovery.
"""

from __future__ import annotations

import argparse
import ast
import functools
import importlib
import os
import random
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType, ModuleType

import pytest
from _pytest.runner import runtestprotocol

from tests.guard.equivalent import EQUIVALENT

REPO = Path(__file__).resolve().parents[2]
SOURCES = REPO / "src" / "homeostat"
SAFETY_LAYER = SOURCES / "guard"


@dataclass(frozen=True)
class Area:
    """Modules that are mutated together, and the tests that must notice."""

    package: str
    """Name of the package below ``homeostat``."""
    modules: tuple[str, ...]
    """Names of the modules."""
    tests: tuple[str, ...]
    """Their fast tests, below ``tests``."""


SLOW = {"kills", "mutants", "on_links", "random_requests"}
"""Tests of the guard that take too long to be run for every mutant."""
AREAS = {
    "guard": Area(
        "guard",
        tuple(sorted(p.stem for p in SAFETY_LAYER.glob("[!_]*.py"))),
        tuple(
            f"guard/{p.name}"
            for p in sorted((REPO / "tests" / "guard").glob("test_*.py"))
            if p.stem.removeprefix("test_") not in SLOW
        ),
    ),
    "supervisor": Area(
        "recovery",
        ("supervisor", "agenda", "prospect"),
        tuple(
            f"recovery/test_{name}.py"
            for name in (
                "supervisor",
                "agenda",
                "prospect",
                "recovery",
                "departure",
                "thinking",
                "deadline",
                "proposers",
            )
        ),
    ),
}
NEAREST = {
    "lane": "blocking_links", "bounded": "blocking_links", "authority": "orders",
    "persons": "orders", "verification": "refusals", "seal": "verification", "mailbox": "sizes", "texts": "sizes",
    "modes": "people", "response": "effect",
}  # fmt: skip
"""Module of the guard -> the tests that look at it most closely, where they do not have its name."""
LIMIT_S = 60.0
"""A mutant that keeps the tests busy for longer counts as noticed [s]."""

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
    place: int
    """Position of the changed node among those of `code_of`."""
    new: ast.AST
    """What stands there now."""

    def tree(self) -> ast.Module:
        """The changed module."""
        path = SOURCES.parent.joinpath(*self.module.split(".")).with_suffix(".py")
        tree = ast.parse(path.read_text(encoding="utf-8"))
        return replaced(tree, self.place, self.new)

    def __str__(self) -> str:
        return f"{self.module}:{self.line}: {self.change}    {self.source}"


def changes(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Every small change of one node."""
    match node:
        case ast.Compare(ops=ops):
            for k, operator in enumerate(ops):
                for other in COMPARISONS[type(operator)]:
                    flipped = [*ops[:k], other(), *ops[k + 1 :]]
                    yield (
                        f"{type(operator).__name__} -> {other.__name__} ({k})",
                        ast.Compare(node.left, flipped, node.comparators),
                    )
        case ast.BoolOp(op=op):
            new_op = ast.Or() if isinstance(op, ast.And) else ast.And()
            yield f"{type(op).__name__} -> {type(new_op).__name__}", ast.BoolOp(new_op, node.values)
            for k in range(len(node.values)):
                rest = node.values[:k] + node.values[k + 1 :]
                yield f"operand {k} -> nothing", rest[0] if len(rest) == 1 else ast.BoolOp(op, rest)
        case ast.BinOp(op=op) if type(op) in OPERATORS:
            other_type = OPERATORS[type(op)]
            yield f"{type(op).__name__} -> {other_type.__name__}", ast.BinOp(node.left, other_type(), node.right)
            if isinstance(op, ast.Add | ast.Sub):
                yield "right operand -> nothing", node.left
                yield "left operand -> nothing", node.right
        case ast.UnaryOp(op=ast.USub() | ast.Not()):
            yield f"{type(node.op).__name__} -> nothing", node.operand
        case ast.Name(id=name) if name in NAMES:
            yield f"{name} -> {NAMES[name]}", ast.Name(NAMES[name], node.ctx)
        case ast.Attribute(attr=name) if name in NAMES:
            yield f"{name} -> {NAMES[name]}", ast.Attribute(node.value, NAMES[name], node.ctx)
        case ast.Constant(value=bool() as truth):
            yield f"{truth} -> {not truth}", ast.Constant(not truth)
        case ast.Constant(value=int() | float() as number):
            yield f"{number!r} -> {-number or 1!r}", ast.Constant(-number or type(number)(1))
            for shifted in sorted({number + 1, number - 1, number * 2} - {number, -number, number or 1}):
                yield f"{number!r} -> {shifted!r}", ast.Constant(shifted)
        case ast.If():
            yield "branch -> pass", ast.If(node.test, [ast.Pass()], node.orelse)
            if node.orelse:
                yield "else -> nothing", ast.If(node.test, node.body, [])
        case ast.Call(args=[first, second, *others]) if not isinstance(first, ast.Starred | ast.GeneratorExp):
            yield "arguments -> swapped", ast.Call(node.func, [second, first, *others], node.keywords)
        case ast.IfExp():
            yield "if -> always", node.body
            yield "if -> never", node.orelse
        case ast.comprehension(ifs=ifs):
            for k in range(len(ifs)):
                rest = ifs[:k] + ifs[k + 1 :]
                yield f"filter {k} -> none", ast.comprehension(node.target, node.iter, rest, node.is_async)
        case ast.Raise() | ast.Continue() | ast.AugAssign():
            yield f"{type(node).__name__} -> pass", ast.Pass()
        case ast.Expr(value=ast.Call() | ast.Await()):
            yield "call -> pass", ast.Pass()
        case ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
            yield "assignment -> pass", ast.Pass()
        case ast.match_case(guard=ast.expr()):
            yield "guard -> none", ast.match_case(node.pattern, None, node.body)


def code_of(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes that run when a function is called: no annotations, no decorators."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from code_of(child)


def mutants(path: Path) -> list[Mutant]:
    """Every mutant of one module, in the order of the source."""
    text = path.read_text(encoding="utf-8")
    lines, original = text.splitlines(), ast.parse(text)
    found = []
    for place, node in enumerate(code_of(original)):
        for change, new in changes(node):
            line = next(n.lineno for n in ast.walk(node) if hasattr(n, "lineno"))
            module = f"homeostat.{path.parent.name}.{path.stem}"
            found.append(Mutant(module, line, lines[line - 1].strip(), change, place, new))
    return sorted(found, key=lambda m: m.line)


@functools.cache
def everywhere() -> frozenset[tuple[str, str]]:
    """(line of source, change) of every mutant of every area."""
    paths = [SOURCES / area.package / f"{name}.py" for area in AREAS.values() for name in area.modules]
    return frozenset((m.source, m.change) for path in paths for m in mutants(path))


def replaced(tree: ast.Module, place: int, new: ast.AST) -> ast.Module:
    """``tree`` with another node in one place."""
    old = list(code_of(tree))[place]

    class Replace(ast.NodeTransformer):
        def visit(self, node: ast.AST) -> ast.AST:
            return ast.copy_location(new, node) if node is old else super().visit(node)

    return ast.fix_missing_locations(Replace().visit(tree))


def infect(mutant: Mutant) -> None:
    """Give the functions of the loaded module the mutant's code; whoever holds one of them runs it from now on."""
    changed = ModuleType(mutant.module)
    sys.modules[mutant.module], module = changed, sys.modules[mutant.module]
    exec(compile(mutant.tree(), f"<mutant of {mutant.module}>", "exec"), changed.__dict__)
    sys.modules[mutant.module] = module
    _spread(module, changed)
    theirs = dict(functions(changed))
    for name, function in functions(module):
        function.__code__, function.__defaults__ = theirs[name].__code__, theirs[name].__defaults__


def _spread(module: ModuleType, changed: ModuleType) -> None:
    """Give everybody who holds a constant of ``module`` that of the ``changed`` one."""
    for name, value in vars(changed).items():
        old = vars(module).get(name)
        if name.startswith("__") or not isinstance(value, int | float | frozenset | tuple | dict) or old == value:
            continue
        package = module.__name__.rpartition(".")[0]
        for other in [m for n, m in sys.modules.items() if n.startswith(package)]:
            if vars(other).get(name) is old:
                vars(other)[name] = value


def functions(owner: ModuleType | type) -> Iterator[tuple[str, FunctionType]]:
    """Every function of a module and of its classes, properties included, by name."""
    module = owner.__name__ if isinstance(owner, ModuleType) else owner.__module__
    for value in vars(owner).values():
        function = value.fget if isinstance(value, property) else getattr(value, "__func__", value)
        if isinstance(function, FunctionType) and function.__module__ == module:
            yield function.__qualname__, function
        elif isinstance(function, type) and function.__module__ == module:
            yield from functions(function)


class Trial:
    """A pytest plugin that runs the collected tests once as they are and once per mutant."""

    def __init__(self, modules: tuple[Path, ...], workers: int, sample: int = 0, seed: int = 0) -> None:
        self._modules, self._workers = modules, workers
        self._sample, self._seed = sample, seed
        self.report = "no test was collected"
        self.good = False

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        started = time.monotonic()
        every = [m for path in self._modules for m in mutants(path)]
        asked = [m for m in every if (m.source, m.change) not in EQUIVALENT]
        if self._sample:
            asked = random.Random(self._seed).sample(asked, min(self._sample, len(asked)))
        if not session.items or session.testsfailed or not _passes(session):
            self.report = "the safety tests fail on the original; nothing can be said about mutants"
            return True
        infections = [(m.module.rpartition(".")[2], functools.partial(infect, m)) for m in asked]
        dead = noticed(infections, session, self._workers)
        alive = [m for m, is_dead in zip(asked, dead, strict=True) if not is_dead]
        stale = [key for key in EQUIVALENT if key not in everywhere()]
        lines = [f"survived: {m}" for m in alive]
        lines += [f"EQUIVALENT names a mutant that there is not: {change}    {source}" for source, change in stale]
        seconds = time.monotonic() - started
        lines.append(f"{sum(dead)} of {len(asked)} mutants noticed (there are {len(every)}), {seconds:.0f} s")
        self.report, self.good = "\n".join(lines), bool(asked) and not alive and not stale
        return True


def _passes(session: pytest.Session, attempts: int = 3) -> bool:
    """Whether the original passes its tests; on a busy machine one that looks at the clock may need another attempt."""
    return any(noticed([("", lambda: None)], session, 1) == [False] for _ in range(attempts))


def noticed(infections: Sequence[tuple[str, Callable[[], None]]], session: pytest.Session, workers: int) -> list[bool]:
    """For each infection of a module, whether a test fails in a child process that has it."""
    results = [False] * len(infections)
    waiting = list(enumerate(infections))[::-1]
    running: dict[int, tuple[int, float]] = {}
    while waiting or running:
        while waiting and len(running) < workers:
            index, (module, infection) = waiting.pop()
            running[_tested(module, infection, session)] = index, time.monotonic() + LIMIT_S
        for child, (index, deadline) in list(running.items()):
            if time.monotonic() > deadline:
                os.kill(child, signal.SIGKILL)
            ended, status = os.waitpid(child, os.WNOHANG)
            if ended:
                results[index] = os.waitstatus_to_exitcode(status) != 0
                del running[child]
        time.sleep(0.002)
    return results


def _tested(module: str, infection: Callable[[], None], session: pytest.Session) -> int:
    """Start a child process that runs the tests until one fails; its exit status is 0 where none does."""
    child = os.fork()
    if child:
        return child
    failed = True
    try:
        infection()
        near = f"test_{NEAREST.get(module, module)}.py"
        failed = any(_fails(item) for item in sorted(session.items, key=lambda i: i.path.name != near))
    finally:
        os._exit(failed)


def _fails(item: pytest.Item) -> bool:
    return any(report.failed for report in runtestprotocol(item, log=False, nextitem=None))


def main(arguments: list[str] | None = None) -> int:
    """Print what survived; 0 where nothing did."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--area", choices=sorted(AREAS), default="guard")
    parser.add_argument("--modules", nargs="+", help="only these modules of the area")
    parser.add_argument("--tests", nargs="+", help="these tests instead of the area's")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--sample", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args(arguments)
    area = AREAS[chosen.area]
    os.chdir(REPO)
    modules, tests = chosen.modules or area.modules, chosen.tests or area.tests
    for module in modules:
        importlib.import_module(f"homeostat.{area.package}.{module}")
    paths = tuple(SOURCES / area.package / f"{module}.py" for module in modules)
    trial = Trial(paths, chosen.workers, chosen.sample, chosen.seed)
    options = ["-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:terminal"]
    pytest.main([*options, *(str(REPO / "tests" / name) for name in tests)], plugins=[trial])
    print(trial.report)
    return 0 if trial.good else 1


if __name__ == "__main__":
    sys.path[:0] = [str(REPO / "src")]
    sys.exit(main())
