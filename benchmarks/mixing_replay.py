"""Recorded answers said again on our Mixing Module: ``python -m benchmarks.mixing_replay`` prints the table.

The whole loop runs under the published protocol: agents are asked in every state, with the label of the fault given. A
script answers by the published key until the plant is where the record says; there the recorded answer is said, and
what becomes of it is read from the trace.
"""

from __future__ import annotations

import contextlib
import json
import re
import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from benchmarks.cstr_results import table
from benchmarks.mixing_batches import module
from benchmarks.mixing_calls import FAULTS, Answer, answers, route
from homeostat.agents.language.scripts import reasonable
from homeostat.agents.roles import AskingProtocol
from homeostat.domain.events.recovery import Attempted
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.llm.model import Question
from homeostat.llm.scripted import ScriptedModel
from homeostat.plants.wired.assembly import Language, model_alone

CONDITIONS = Conditions(AskingProtocol.PER_STEP, label_given=True)
SEED = 3
END_S = 400.0
_STATE = re.compile(r"^State (\S+) \(", re.MULTILINE)


@dataclass(frozen=True)
class Judgement:
    """What became of an answer."""

    accepted: bool
    """Whether a route that begins with it was approved."""
    asked: bool
    """Whether it was asked for: actuators of a state that planning cannot name are not."""
    causes: tuple[str, ...]
    """Kinds of checks that refused it: ``schema``, ``state`` (what the state admits), ``permissive``, ``rollout``."""
    findings: tuple[str, ...]
    """Names of the violated checks."""


class _Seen(BaseException):
    """The recorded answer was judged. No error: whatever else a model raises is taken for a failure of the model."""


class _Speaker:
    """Answers by the published key, but once what was recorded."""

    def __init__(self, answer: Answer, trace: MemoryTrace) -> None:
        self._answer, self._trace = answer, trace
        self.before: int | None = None
        """Attempts before the recorded answer was said; None until it is."""

    def __call__(self, question: Question) -> str:
        state = _found(_STATE, question.prompt)
        if self.before is not None:
            if question.agent == "action" and self._answer.agent == "planning" and self._unjudged:
                return reasonable(question)  # a plan is judged with actuators that are right
            raise _Seen
        if question.agent == self._answer.agent and state == self._answer.state:
            self.before = len(self._trace.of(Attempted))
            return json.dumps({"reasoning": "", **self._said(question)})
        return self._by_key(question, state)

    @property
    def _unjudged(self) -> bool:
        return len(self._trace.of(Attempted)) == self.before

    def _said(self, question: Question) -> dict[str, Any]:
        if self._answer.agent == "planning":
            return {"path": self._answer.target}
        schema: Any = question.schema
        tags = schema["properties"]["commands"]["properties"]
        return {"commands": {tag: float(tag in self._answer.on) for tag in tags}}

    def _by_key(self, question: Question, state: str) -> str:
        if question.agent != "planning":
            return reasonable(question)
        states = route(self._answer.fault)
        named = self._answer.target if state == self._answer.state else states[states.index(state) + 1]
        schema: Any = question.schema
        if named not in schema["properties"]["path"]["enum"]:
            raise _Seen
        return json.dumps({"reasoning": "", "path": named})


def judged(answer: Answer) -> Judgement:
    """Say ``answer`` where it was said, and see what becomes of it."""
    trace = MemoryTrace()
    fault, severity = FAULTS[answer.fault]
    chosen = scenario(module(), fault, SEED, None if fault == "none" else 0.0, severity, END_S)
    speaker = _Speaker(answer, trace)
    with contextlib.suppress(_Seen):
        proposing = Proposing(Language(ScriptedModel("recorded", speaker)), CONDITIONS, model_alone)
        run(module(), chosen, trace, DeclaredClock(1.0), proposing)
    if speaker.before is None:
        return Judgement(False, False, ("schema",), ())
    attempts = [a for a in trace.of(Attempted)[speaker.before :] if a.proposer == "language"]
    tried = [a for a in attempts if not a.path or a.path[0] == answer.state]
    if any(a.approved for a in tried):
        return Judgement(True, True, (), ())
    names = tuple(sorted({f.criterion for a in tried for f in a.findings if not f.satisfied}))
    return Judgement(False, True, tuple(sorted({_kind(name) for name in names})), names)


def rows(counted: Iterable[tuple[Answer, int, Judgement]]) -> list[tuple[object, ...]]:
    """Who, right or wrong by the published key, what; answers, accepted, refused by which kinds of checks."""
    groups: dict[tuple[str, bool, str], list[tuple[int, Judgement]]] = {}
    for answer, count, judgement in counted:
        groups.setdefault((answer.agent, answer.correct, _what(answer)), []).append((count, judgement))
    lines: list[tuple[object, ...]] = []
    for (agent, correct, what), group in sorted(groups.items(), key=lambda g: (g[0][0], not g[0][1], g[0][2])):
        causes = Counter[str]()
        for count, judgement in group:
            if not judgement.accepted:
                causes[" + ".join(judgement.causes)] += count
        lines.append((
            agent, "right" if correct else "wrong", what, sum(n for n, _ in group),
            sum(n for n, j in group if j.accepted), "; ".join(f"{k} ({n})" for k, n in causes.most_common()) or "-",
        ))  # fmt: skip
    return lines


def replay_table(counted: Iterable[tuple[Answer, int, Judgement]]) -> str:
    """The rows as a table."""
    head = ["agent", "published key", "answer", "answers", "accepted", "refused by"]
    return table(head, [[str(cell) for cell in row] for row in rows(counted)])


def main() -> int:
    """Judge every distinct answer and print the table."""
    print(replay_table([(a, n, judged(a)) for a, n in sorted(answers().items())]))
    return 0


def _what(answer: Answer) -> str:
    """Right answers are one group; wrong ones are told apart."""
    if answer.correct:
        return "all" if answer.on_the_way else "right actuators of a state that was named wrongly"
    if answer.agent == "planning":
        return f"{answer.target} in {answer.state} ({answer.fault})"
    return f"{', '.join(tag.removesuffix('.cmd') for tag in answer.on)} on in {answer.target}"


def _kind(name: str) -> str:
    if name == "CHK-ANSWER":
        return "schema"
    if name.startswith("PRM-"):
        return "permissive"
    return "state" if name.startswith("CHK-") else "rollout"


def _found(pattern: re.Pattern[str], text: str) -> str:
    found = pattern.search(text)
    assert found is not None
    return found[1]


if __name__ == "__main__":
    sys.exit(main())
