"""Terms as lines of source code: what is the same is worked out once, and as seldom as it changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, final

from homeostat.process.blocks.term import STAGE, Leaf, Term

_CODE: Final[Mapping[str, str]] = {
    "add": "{} + {}", "sub": "{} - {}", "mul": "{} * {}", "div": "{} / {}", "pow": "math.pow({}, {})", "abs": "abs({})",
    "exp": "math.exp({})", "log": "math.log({})", "sqrt": "math.sqrt(max({}, 0.0))", "min": "min({}, {})",
    "max": "max({}, {})", "unit": "{}", "lt": "{} < {}", "le": "{} <= {}", "where": "{1} if {0} else {2}",
    "and": "{} and {}", "or": "{} or {}",
}  # fmt: skip


@final
class Scope:
    """Lines of source, and the names of what they have worked out; what changes more seldom goes to ``outer``."""

    def __init__(self, leaves: Mapping[Term, str], often: int, prefix: str, outer: Scope | None = None) -> None:
        """``leaves``: what a leaf is called here; ``often``: how often the lines run; names begin with ``prefix``."""
        self.lines: list[str] = []
        self._known = dict(leaves)
        self._often, self._prefix, self._outer = often, prefix, outer
        self._count = 0

    def name(self, term: Term) -> str:
        """What ``term`` is called: lines for it are added where there are none yet. A number stands for itself."""
        if term in self._known:
            return self._known[term]
        if term.op == "number":
            return repr(float(term.value))
        if self._outer is not None and term.often < self._often:
            return self._outer.name(term)
        assert not isinstance(term.op, Leaf), f"{term!r} is not known here"
        args = [self.name(each) for each in term.args]
        return self.keep(term, _CODE[term.op].format(*args))

    def keep(self, term: Term, code: str) -> str:
        """A new name for ``term``, which is ``code``."""
        name = self._known[term] = f"{self._prefix}{self._count}"
        self._count += 1
        self.lines.append(f"{name} = {code}")
        return name

    def kept(self, term: Term, code: str) -> str:
        """What ``term`` is called, which is ``code`` where it is not known yet."""
        return self._known.get(term) or self.keep(term, code)

    def say(self, *lines: str) -> None:
        """Add ``lines`` as they are."""
        self.lines.extend(lines)

    @property
    def named(self) -> list[str]:
        """Names of everything that was worked out in this scope."""
        return [f"{self._prefix}{i}" for i in range(self._count)]

    def taken(self) -> list[str]:
        """The lines so far, which are now somewhere else."""
        lines, self.lines = self.lines, []
        return lines

    def forget(self) -> Scope:
        """The same for what follows lines that changed columns: nothing that was worked out before is used again."""
        fresh = Scope({}, self._often, self._prefix, self._outer)
        fresh._known = {term: name for term, name in self._known.items() if isinstance(term.op, Leaf)}
        fresh._count, fresh.lines = self._count, self.lines
        return fresh


def function(
    name: str, states: Sequence[Term], outputs: Sequence[Term], room: int | None = None
) -> tuple[list[str], tuple[Term, ...]]:
    """Source of a function of the states, and of terms that do not change within a tick: its lines, and these terms.

    It takes ``y0``, ``y1`` and so on for ``states`` and ``h0``, ``h1`` and so on for the other terms, and returns a
    tuple of ``outputs``. With ``room`` it takes an array in place of the states, which has them from ``room`` on and
    gets the outputs after them: hundreds of variables that are set again and again take numba minutes.
    """
    given: dict[Term, str] = {}
    seen: set[int] = set()
    for each in outputs:
        _frontier(each, given, seen)
    names = [f"y{i}" if room is None else f"work[{room + i}]" for i in range(len(states))]
    known = dict(zip(states, names, strict=True)) | given
    inside = Scope(known, STAGE, "v")
    results = [inside.name(each) for each in outputs]
    takes = [*(names if room is None else ["work"]), *given.values()]
    end = [f"return ({', '.join(results)},)"]
    if room is not None:
        end = [f"work[{room + len(states) + i}] = {result}" for i, result in enumerate(results)]
    body = [*inside.lines, *end]
    return [f"def {name}({', '.join(takes)}):", *(f"    {line}" for line in body)], tuple(given)


def _frontier(term: Term, given: dict[Term, str], seen: set[int]) -> None:
    """Collect the largest parts of ``term`` that do not change within a tick; ``seen``: those that were looked at."""
    if term.op == "number" or id(term) in seen:
        return
    seen.add(id(term))
    if term.often < STAGE:
        given.setdefault(term, f"h{len(given)}")
        return
    for each in term.args:
        _frontier(each, given, seen)
