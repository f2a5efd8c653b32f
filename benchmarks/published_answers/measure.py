"""Say the published models' answers again to this project's loop: ``python -m benchmarks.published_answers.measure``.

Every complete run is one run of ours: the mixing module step by step with the label given, the fault there from the
start; the reactor for whole routes with the default onset. Nobody else proposes anything. A run succeeds where
everything that was released is the model's, and the batch is complete or the reactor recovered. About 3 s per batch
and 8 s per run of the reactor.

The published reactor's model was not told the fault: ``--monitoring`` asks when our monitoring reports it. With the
label given, a fault that does harm only later is told at its onset, when nothing needs to be done, and not again.
*Released first*: ours asks again where a fault grows; the published loop acted once, so that nothing is left to say.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.cstr_results import table
from benchmarks.mixing_batches import module
from benchmarks.mixing_calls import FOLDER
from benchmarks.mixing_language import published_scenario
from benchmarks.published_answers.__main__ import converted
from benchmarks.published_answers.mixing import CASE
from benchmarks.published_answers.runs import PublishedRun
from homeostat.agents.roles import AskingProtocol
from homeostat.domain.events.recovery import Attempted, GaveUp, ReleasedActions
from homeostat.domain.outcome import Outcome
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import MemoryTrace
from homeostat.journal.calls import ModelCalled
from homeostat.links.clock import DeclaredClock
from homeostat.llm.model import Failure
from homeostat.llm.replay import SUPPLIED, SituatedReplay
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import Language, model_alone

LANGUAGE = "language"


@dataclass(frozen=True)
class Replayed:
    """One published run on this project's plant."""

    run: PublishedRun
    """What was said."""
    success: bool
    """Whether it did without anybody else."""
    first: str
    """Who proposed what was released first; empty where nothing was."""
    actor: str
    """Who acted last."""
    outcome: str
    """How the run ended."""
    state: str
    """Where it ended."""
    said: int
    """Answers of the model that were said again."""
    refused: tuple[str, ...]
    """Proposals that were refused until the model gave up: the first states, the violated checks, how often."""
    gave_up: str
    """Why the model's proposals came to an end; empty where they did not."""
    min_margin: float | None
    """Least margin of what was approved first."""

    @property
    def recorded(self) -> int:
        """Answers of the model in the record."""
        return sum(call.served != SUPPLIED for call in self.run.calls)

    @property
    def why(self) -> str:
        """Why it did not succeed; empty where it did."""
        if self.success:
            return ""
        if not self.gave_up and not self.refused:
            return f"the model was not asked ({self.outcome} in {self.state})"
        ended = self.gave_up.replace(str(self.run.path), "the record")
        return "; ".join((*self.refused, ended or f"ended {self.outcome} in {self.state}"))


def replayed(published: PublishedRun, label_given: bool = True) -> Replayed:
    """Run it; the number of the run is the seed."""
    batch = published.case == CASE
    plant = module() if batch else load_plant(published.case)
    chosen = published_scenario(published.scenario, published.number) if batch else scenario(
        plant, published.scenario, published.number
    )  # fmt: skip
    protocol = AskingProtocol.PER_STEP if batch else AskingProtocol.ROUTE
    trace, model = MemoryTrace(), SituatedReplay(str(published.path), published.calls)
    proposing = Proposing(Language(model), Conditions(protocol, label_given), model_alone)
    result = run(plant, chosen, trace, DeclaredClock(1.0), proposing)
    return _replayed(published, result, trace)


def _replayed(published: PublishedRun, result: Run, trace: MemoryTrace) -> Replayed:
    released = [r.proposer for r in trace.of(ReleasedActions)]
    done = result.complete_s is not None if published.case == CASE else result.outcome is Outcome.RECOVERED
    calls = [c for c in trace.of(ModelCalled) if c.failure != Failure.EXHAUSTED.name and c.served != SUPPLIED]
    refused, gave_up = _until_given_up(trace)
    return Replayed(
        published, done and set(released) == {LANGUAGE}, released[0] if released else "", result.actor,
        result.outcome.value, result.state, len(calls), refused, gave_up, result.min_margin,
    )  # fmt: skip


def _until_given_up(trace: MemoryTrace) -> tuple[tuple[str, ...], str]:
    """The model's refused proposals until it gave up first, alike ones counted, and why it gave up."""
    found: Counter[str] = Counter()
    reason = ""
    for event in (entry.event for entry in trace.entries):
        if isinstance(event, GaveUp) and event.proposer == LANGUAGE:
            reason = event.reason
            break
        if isinstance(event, Attempted) and event.proposer == LANGUAGE and not event.approved:
            names = sorted({f.criterion for f in event.findings if not f.satisfied})
            found[f"{' > '.join(event.path[:2]) or 'no path'}: {' + '.join(names)}"] += 1
    return tuple(f"{what} ({n})" for what, n in found.items()), reason


def rows(runs: Sequence[Replayed]) -> list[list[str]]:
    """One line per study, model and fault.

    Successes there and here, runs in which the model's proposal was the first that was released, answers said again.
    """
    groups: dict[tuple[str, str, str, str], list[Replayed]] = {}
    for r in runs:
        groups.setdefault((r.run.campaign, r.run.model, r.run.case, r.run.scenario), []).append(r)
    return [
        [
            *key, f"{sum(r.run.success for r in mine)}/{len(mine)}", f"{sum(r.success for r in mine)}/{len(mine)}",
            str(sum(r.first == LANGUAGE for r in mine)), f"{sum(r.said for r in mine)}/{sum(r.recorded for r in mine)}",
        ]
        for key, mine in groups.items()
    ]  # fmt: skip


HEAD = ["campaign", "model", "case", "fault", "published", "ours", "released first", "answers said again"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, and print the table and why runs failed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.published_answers.measure")
    parser.add_argument("--records", type=Path, default=FOLDER, help="folder with the recorded studies")
    parser.add_argument("--case", help="only this plant")
    parser.add_argument("--as-said", action="store_true", help="keep setpoints that are no whole increments")
    parser.add_argument("--monitoring", action="store_true", help="do not tell which fault is there")
    given = parser.parse_args(arguments)
    runs = [r for r in converted(given.records, given.as_said) if r.complete and given.case in (None, r.case)]
    done = []
    for published in runs:
        done.append(replayed(published, not given.monitoring))
        print(published.path, "success" if done[-1].success else done[-1].why, file=sys.stderr, flush=True)
    print(table(HEAD, rows(done)))
    failures = Counter(f"{r.run.campaign}/{r.run.model}/{r.run.scenario}: {r.why}" for r in done if not r.success)
    print("".join(f"\n- {why} [{n} runs]" for why, n in failures.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
