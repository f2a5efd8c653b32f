"""Small changes of a module: a comparison or a sign flipped, a constant shifted, an operand or a branch left out."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

SOURCES = Path(__file__).resolve().parents[2] / "src"

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
SYMMETRIC = {"same", "min", "max"}
"""Functions that say the same of their first two arguments in either order."""


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
    lines: tuple[int, int] | None
    """First and last line of the statement; None where it runs when the module is loaded."""
    new: ast.AST
    """What stands there now."""

    def tree(self) -> ast.Module:
        """The changed module."""
        path = SOURCES.joinpath(*self.module.split(".")).with_suffix(".py")
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
        case ast.Call(args=[first, second, *others]) if not (
            isinstance(first, ast.Starred | ast.GeneratorExp) or ast.unparse(node.func) in SYMMETRIC
        ):
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
    spans = _spans(original)
    module = ".".join(path.relative_to(SOURCES).with_suffix("").parts)
    found = []
    for place, node in enumerate(code_of(original)):
        for change, new in changes(node):
            line = next(n.lineno for n in ast.walk(node) if hasattr(n, "lineno"))
            found.append(Mutant(module, line, lines[line - 1].strip(), change, place, spans.get(node), new))
    return sorted(found, key=lambda m: m.line)


def _spans(tree: ast.Module) -> dict[ast.AST, tuple[int, int]]:
    """Node -> lines of its statement, or of the head of one with a body; nothing for what no function holds."""
    spans: dict[ast.AST, tuple[int, int]] = {}

    def visit(node: ast.AST, lines: tuple[int, int] | None) -> None:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            for child in node.body:
                visit(child, (child.lineno, child.lineno))
            return
        if lines is not None:
            if isinstance(node, ast.stmt | ast.match_case):
                lines = _head(node)
            spans[node] = lines
        for child in ast.iter_child_nodes(node):
            visit(child, lines)

    visit(tree, None)
    return spans


def _head(node: ast.stmt | ast.match_case) -> tuple[int, int]:
    """First and last line of a statement without its body."""
    first = node.pattern if isinstance(node, ast.match_case) else node
    body: list[ast.stmt] = getattr(node, "body", [])
    last = max(first.lineno, body[0].lineno - 1) if body else first.end_lineno
    return first.lineno, last or first.lineno


def replaced(tree: ast.Module, place: int, new: ast.AST) -> ast.Module:
    """``tree`` with another node in one place."""
    old = list(code_of(tree))[place]

    class Replace(ast.NodeTransformer):
        def visit(self, node: ast.AST) -> ast.AST:
            return ast.copy_location(new, node) if node is old else super().visit(node)

    return ast.fix_missing_locations(Replace().visit(tree))
