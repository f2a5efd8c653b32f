"""A long straight body as functions: what numba does with one function grows faster than the function does."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator, Sequence
from typing import Final, NamedTuple

MOST: Final = 120
"""Lines of a function; a kernel with two thousand in one took twice as long to compile."""


class Names(NamedTuple):
    """Variables of some lines."""

    read: frozenset[str]
    written: frozenset[str]


class _Piece(NamedTuple):
    """Lines that stay together."""

    lines: tuple[str, ...]
    names: Names
    leaves: bool
    """Whether they may leave a loop around them, and so have to stay in it."""


def cut(
    name: str, body: Sequence[str], known: Collection[str], wanted: Collection[str] = (), most: int = MOST
) -> tuple[list[str], list[str]]:
    """Functions ``name_0``, ``name_1`` and so on, and the lines that call them in place of ``body``.

    Each takes what it reads of the variables that there are before it, and returns those that are read after it. Arrays
    are changed in place. What breaks off a loop around the body stays there, and a body of ``most`` lines as it is.

    ``known``: variables that there are before the body, whatever else is read and never written being global;
    ``wanted``: those that are read after it.
    """
    if len(body) <= most:
        return [], list(body)
    pieces = list(_pieces(body, most))
    functions: list[str] = []
    calls: list[str] = []
    there = set(known)
    for i, piece in enumerate(pieces):
        later = frozenset(wanted).union(*(each.names.read for each in pieces[i + 1 :]))
        if piece.leaves or len(piece.lines) == 1:
            calls += piece.lines
        else:
            gives = sorted(piece.names.written & later)
            takes = sorted((piece.names.read | set(gives)) & there)  # a branch may write it, or leave it as it was
            call = f"{name}_{i}({', '.join(takes)})"
            functions += [f"def {call}:", *(f"    {line}" for line in piece.lines)]
            functions += [f"    return ({', '.join(gives)},)", ""] if gives else [""]
            calls.append(f"{', '.join(gives)}, = {call}" if gives else call)
        there |= piece.names.written
    return functions, calls


def _pieces(body: Sequence[str], most: int) -> Iterator[_Piece]:
    """``body`` in its order, cut between two statements."""
    lines: list[str] = []
    read: set[str] = set()
    written: set[str] = set()
    for statement in ast.parse("\n".join(body)).body:
        own = body[statement.lineno - 1 : statement.end_lineno]
        leaves = any(isinstance(each, ast.Break | ast.Continue) for each in ast.walk(statement))
        if lines and (leaves or len(lines) + len(own) > most):
            yield _Piece(tuple(lines), Names(frozenset(read), frozenset(written)), leaves=False)
            lines, read, written = [], set(), set()
        names = names_of(statement)
        if leaves:
            yield _Piece(tuple(own), names, leaves=True)
            continue
        lines += own
        read |= names.read
        written |= names.written
    if lines:
        yield _Piece(tuple(lines), Names(frozenset(read), frozenset(written)), leaves=False)


def names_of(statement: ast.stmt) -> Names:
    """Variables that a statement reads and writes; what it adds to is both."""
    found = [each for each in ast.walk(statement) if isinstance(each, ast.Name)]
    added = {each.target.id for each in ast.walk(statement)
             if isinstance(each, ast.AugAssign) and isinstance(each.target, ast.Name)}  # fmt: skip
    read = {each.id for each in found if isinstance(each.ctx, ast.Load)} | added
    return Names(frozenset(read), frozenset(each.id for each in found if isinstance(each.ctx, ast.Store)))
