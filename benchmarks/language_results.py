"""Measure the language agents and write ``docs/results/language.md``: ``python -m benchmarks.language_results``.

No model of a provider is asked: the models here are scripts, a transformer with random weights behind a real server, a
server that misbehaves on purpose, and a model that obeys whatever it reads. Runs that were measured before are read
back from the cache folder, so an interrupted measurement goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from statistics import median

from benchmarks.cstr_results import table
from benchmarks.host import kept, measured_on
from benchmarks.language_runs import LanguageRun, reactor, run_with
from benchmarks.prompt_tokens import PUBLISHED, Count, counts
from homeostat.agents.language.scripts import SCRIPTS
from homeostat.domain.events.recovery import FallbackArmed
from homeostat.domain.events.trips import FallbackActivated
from homeostat.links.clock import ThinkingClock
from homeostat.llm.address import parse_address
from homeostat.llm.network import AddressPolicy
from homeostat.llm.providers import ProviderModel, Sampling
from homeostat.llm.retry import RetryingModel
from homeostat.llm.scripted import ScriptedModel
from homeostat.recovery.bounds import Budget
from tests.llm.hostile.behaviours import BEHAVIOURS
from tests.llm.servers import hostile, random_model
from tests.safety.injections import CORPUS
from tests.safety.obedient import obedient
from tests.safety.poisoned_plant import poisoned

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "results" / "language.md"
MAIN = ("fouling", "pump_degrade", "cool_stuck_closed")
END_S = {"fouling": 6000.0}
"""Fouling needs nothing to be done for the first half hour."""
SEEDS = 20
RANDOM = (*MAIN, "cool_stuck_open", "outlet_block", "inlet_stuck_open", "temp_bias", "level_bias", "leak",
          "cool_stuck_closed+pump_degrade")  # fmt: skip
WEIGHTS = (7, 11, 13, 17, 19)
"""Seeds of the random weights: each set has its own prejudices."""
FLAT = 2.0
"""Temperature at which random weights are asked: the highest that providers allow, so that they say many things."""
HANGING = ("hang", "slow_drip")
"""Servers that use up any budget."""
SPENT = Budget(latency_s=2.0, last_s=0.0)
"""Nothing is kept for the search, so the fallback acts when the time is used up."""
HURRIED = Budget(latency_s=10.0, last_s=4.0)
"""For models that hang: what is measured is that they cost no more than this."""


def end_s(fault: str) -> float:
    """When a run with ``fault`` ends [s]."""
    return END_S.get(fault, 3000.0)


def scripted(job: tuple[str, str, int]) -> LanguageRun:
    """One run with a script."""
    script, fault, seed = job
    return run_with(ScriptedModel(script, SCRIPTS[script]), fault, seed, end_s=end_s(fault))[0]


def asked_at(url: str, name: str, seed: int, temperature: float = 1.0) -> RetryingModel:
    """The model ``name`` of the server at ``url``, asked as a user's would be."""
    address = parse_address(f"{url}#{name}")
    return RetryingModel(ProviderModel(address, AddressPolicy(local_only=True), Sampling(temperature, seed)))


def random_weights(job: tuple[str, str, int, tuple[str, ...]]) -> LanguageRun:
    """One run with random weights; the address is not part of the row, because the port is another one each time."""
    _, fault, seed, urls = job
    model = asked_at(urls[seed % len(urls)], "random", seed, FLAT)
    row, _ = run_with(model, fault, seed, end_s=end_s(fault))
    return LanguageRun(**{**asdict(row), "model": "random weights"})


def misbehaving(job: tuple[str, str, int, str]) -> LanguageRun:
    """One run with a server that misbehaves; the plant runs on while it does."""
    name, fault, seed, url = job
    row, _ = run_with(asked_at(url, name, seed), fault, seed, clock=ThinkingClock(), budget=HURRIED)
    return LanguageRun(**{**asdict(row), "model": name})


def exhausted(url: str) -> list[tuple[str, int, float, float]]:
    """Server, seed, whole budget and how late the fallback was [s of process time], where nobody answers in time."""
    rows = []
    for name in HANGING:
        for seed in (1, 2):
            _, trace = run_with(
                asked_at(url, name, seed), "cool_stuck_closed", seed, end_s=2300.0, clock=ThinkingClock(), budget=SPENT
            )
            armed, deadline_s = next(
                (e.at_s, e.event.deadline_s) for e in trace.entries if isinstance(e.event, FallbackArmed)
            )
            fell_s = next(e.at_s for e in trace.entries if isinstance(e.event, FallbackActivated))
            rows.append((name, seed, deadline_s, max(fell_s - armed - deadline_s, 0.0)))
    return rows


def injected(job: tuple[str, str, int]) -> LanguageRun:
    """One run of the obedient model on a plant whose every text is one of the corpus."""
    name, fault, seed = job
    text = next(i.text for i in CORPUS if i.name == name)
    model = ScriptedModel(name, obedient)
    return run_with(model, fault, seed, poisoned(reactor(), text), (text,), end_s=2700.0)[0]


def measure(
    name: str, work: Callable[[tuple[str, str, int]], LanguageRun], jobs: Sequence[tuple[str, str, int]],
    workers: int, *more: object,
) -> list[LanguageRun]:  # fmt: skip
    """Rows of every job; those in the cache are not measured again. ``more`` is handed to every job."""
    folder = kept("language")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.jsonl"
    done = {}
    for line in path.read_text().splitlines() if path.exists() else ():
        row = LanguageRun(**json.loads(line))
        done[row.model, row.fault, row.seed] = row
    todo = [(*job, *more) for job in jobs if job not in done]
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool, path.open("a") as file:
        for row in pool.map(work, todo):  # type: ignore[arg-type]
            done[row.model, row.fault, row.seed] = row
            file.write(json.dumps(asdict(row)) + "\n")
            file.flush()
            print(name, row.model, row.fault, row.seed, row.outcome, row.first, row.attempts, row.unsafe, flush=True)
    return [done[job] for job in jobs]


def script_rows(rows: Sequence[LanguageRun]) -> list[Sequence[object]]:
    """One line per script and fault."""
    lines = []
    for model, fault in dict.fromkeys((r.model, r.fault) for r in rows):
        group = [r for r in rows if (r.model, r.fault) == (model, fault)]
        n = len(group)
        lines.append((
            model, fault, f"{sum(r.outcome == 'recovered' for r in group)}/{n}",
            f"{sum(r.first == 'language' for r in group)}/{n}",
            f"{sum(r.first == 'language' and r.by_language <= 3 for r in group)}/{n}",
            f"{median(r.by_language for r in group):g} ({max(r.by_language for r in group)})",
            f"{sum(r.first == 'search' for r in group)}/{n}", f"{max(r.outside_s for r in group):.0f}",
        ))  # fmt: skip
    return lines


def random_rows(rows: Sequence[LanguageRun]) -> list[Sequence[object]]:
    """One line per fault."""
    lines = []
    for fault in dict.fromkeys(r.fault for r in rows):
        group = [r for r in rows if r.fault == fault]
        first = Counter(r.first for r in group)
        lines.append((
            fault, len(group), sum(r.calls for r in group), sum(r.by_language for r in group),
            *(first[who] for who in ("language", "search", "fallback", "none")),
            sum(r.releases for r in group), sum(bool(r.unsafe) for r in group),
        ))  # fmt: skip
    return lines


def misbehaving_rows(rows: Sequence[LanguageRun]) -> list[Sequence[object]]:
    """One line per behaviour."""
    return [
        (
            r.model, ", ".join(f"{kind} {count}" for kind, count in sorted(r.failures.items())) or "answered",
            r.by_language, r.first, r.outcome, r.unsafe or "nothing",
        )
        for r in rows
    ]  # fmt: skip


def injected_rows(rows: Sequence[LanguageRun]) -> list[Sequence[object]]:
    """One line per technique."""
    technique = {i.name: i.technique for i in CORPUS}
    lines = []
    for name in dict.fromkeys(technique.values()):
        group = [r for r in rows if technique[r.model] == name]
        first = Counter(r.first for r in group)
        lines.append((
            name, len(group), sum(r.by_language for r in group), first["language"], first["search"],
            first["fallback"], sum(bool(r.unsafe) for r in group),
        ))  # fmt: skip
    return lines


def token_rows(rows: Sequence[Count]) -> list[Sequence[object]]:
    """One line per question."""
    return [
        (c.fault, c.agent, c.number, c.system, c.prompt, c.shown, c.schema, f"{c.estimated:.2f}")
        for c in rows
    ]  # fmt: skip


def page(
    tokens: Sequence[Count], scripts: Sequence[LanguageRun], weights: Sequence[LanguageRun],
    servers: Sequence[LanguageRun], spent: Sequence[tuple[str, int, float, float]], texts: Sequence[LanguageRun],
) -> str:  # fmt: skip
    """The page."""
    first = [c for c in tokens if c.agent == "action" and c.number == 1]
    unsafe = [r for r in (*weights, *servers, *texts) if r.unsafe]
    template = (Path(__file__).parent / "language_results.md").read_text("utf-8")
    return template.format(
        measured=measured_on(), seeds=SEEDS, published=PUBLISHED,
        longest=max(c.shown for c in first), longest_schema=max(c.shown + c.schema for c in first),
        tokens=table(("fault", "agent", "question", "system", "prompt", "shown", "schema", "estimate / count"),
                     token_rows(tokens)),
        scripts=table(("script", "fault", "recovered", "first release by language", "within 3 attempts",
                       "attempts, median (max)", "first release by search", "longest true exposure [s]"),
                      script_rows(scripts)),
        runs=len(weights), sets=len(WEIGHTS), temperature=FLAT, calls=sum(r.calls for r in weights),
        weights=table(("fault", "runs", "questions", "proposals judged", "first action: language", "search", "fallback",
                       "none", "releases", "unsafe releases"), random_rows(weights)),
        servers=table(("server", "failures", "proposals judged", "first action", "outcome", "unsafe"),
                      misbehaving_rows(servers)),
        spent=table(("server", "seed", "budget [s]", "fallback released after it [s]"), spent),
        spent_s=max(row[-1] for row in spent), latency=SPENT.latency_s,
        texts=table(("technique", "texts", "proposals judged", "first action: language", "search", "fallback",
                     "unsafe releases"), injected_rows(texts)),
        unsafe=len(unsafe), all=len(weights) + len(servers) + len(texts),
    )  # fmt: skip


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=2, metavar="N", help="processes (default: 2)")
    workers = parser.parse_args().workers
    with ExitStack() as stack:
        urls = tuple(stack.enter_context(random_model(seed)) for seed in WEIGHTS)
        jobs = [("random weights", fault, seed) for fault in RANDOM for seed in range(1, SEEDS + 1)]
        weights = measure("random", random_weights, jobs, workers, urls)  # type: ignore[arg-type]
    main_jobs = [(script, fault, seed) for script in SCRIPTS for fault in MAIN for seed in range(1, SEEDS + 1)]
    scripts = measure("scripts", scripted, main_jobs, workers)
    with hostile() as url:
        jobs = [(name, "cool_stuck_closed", 1) for name in BEHAVIOURS]
        servers = measure("hostile", misbehaving, jobs, 1, url)  # type: ignore[arg-type]
        spent = exhausted(url)
    texts = measure("injected", injected, [(i.name, "cool_stuck_closed", 1) for i in CORPUS], workers)
    PAGE.write_text(page(tuple(counts()), scripts, weights, servers, spent, texts), "utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
