"""The end of a run in a few lines for the operator."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import FaultState
from homeostat.domain.events.recovery import Remarked, Waited
from homeostat.domain.outcome import Outcome
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.quotation import printable, quote, quoted
from homeostat.record.directory import FIGURE
from homeostat.record.probes import ProbeMade
from homeostat.record.result import Result, StepScores
from homeostat.record.story.story import Story
from homeostat.record.story.wording import commands, probabilities, quantity

HEADLINES: Final = {
    Outcome.LIMIT_VIOLATED: "Limit violated: a hard limit was not kept that could have been, or is not at the end.",
    Outcome.FALLBACK: "Fallback: the plant is in its safe state, and the operator must act.",
    Outcome.NOT_DETECTED: "Not detected: a fault violated a limit and nothing was detected.",
    Outcome.NEEDLESS_ACTION: "Needless action: left alone, the plant keeps its limits and costs no more.",
    Outcome.RECOVERED: "Recovered: the plant produces inside its hard limits.",
    Outcome.NO_ACTION: "No action: nothing was released.",
    Outcome.HELD: "Held: the plant is safe, but at the end it produces next to nothing.",
}


def summary(result: Result, story: Story, plant: PlantDescription, run_dir: Path) -> Iterator[str]:
    """The lines, the headline first. ``story`` has been told to its end; the run is kept in ``run_dir``."""
    yield HEADLINES[result.outcome]
    yield _row("Fault", "; ".join(_injected(fault, plant) for fault in story.record.faults) or "none")
    if result.disturbances:
        yield _row("Disturbed", "; ".join(result.disturbances))
    if result.mismatch != "none":
        yield _row("Mismatch", f"{result.mismatch}: the plant is not the twin's model")
    yield _row("Detected", _detected(result, plant))
    for probe in result.probes:
        yield _row("Probed", _probed(probe))
    for waited in story.record.waits:
        yield _row("Waited", _waited(*waited))
    yield _row("Done", _done(result, story.record.acted_s, plant))
    if reason := story.record.reason:
        yield _row("Why", reason)
    for remark in story.record.remarks:
        yield _row("Remark", _remarked(remark))
    yield _row("Limits", _outside(result, plant))
    if result.production_loss is not None:
        since = "the onset" if result.onset_s is not None else "the start"
        yield _row("Production", f"{_lost(result.production_loss)} since {since}")
    if result.cost is not None:
        yield _row("Cost", _cost(result.cost, result.currency))
    if result.cost_alone is not None:
        yield _row("Left alone", _alone(result.cost_alone, result.currency, plant))
    if result.nominal_s is not None:
        yield _row("Batch", _batch(result, plant))
    if result.steps is not None:
        yield _row("Steps", _steps(result.steps))
    yield _row("Thinking", f"{result.thinking_s:.1f} s, {result.attempts} {_plural('attempt', result.attempts)}")
    yield _row("Trace", str(run_dir))
    yield _row("Figure", str(run_dir / FIGURE))


def _row(name: str, text: str) -> str:
    return f"  {name:<11} {printable(text)}"


def _lost(share: float) -> str:
    """What is lost of the production [1]; less than nothing is more than the plant makes without the fault."""
    told = f"{abs(100 * share):.1f} %"
    return f"{told} lost" if share >= 0.0 or told == "0.0 %" else f"{told} more"


def _signed(seconds: float, plant: PlantDescription) -> str:
    return f"{'-' if seconds < 0.0 else '+'}{plant.timing.told(abs(seconds))}"


def _injected(injected: FaultState, plant: PlantDescription) -> str:
    fault = plant.fault(injected.fault)
    return (
        f"{fault.label} ({fault.name} {quantity(injected.severity, fault.severity_unit)}) from {injected.onset_s:g} s"
    )


def _detected(result: Result, plant: PlantDescription) -> str:
    if result.detected_s is None:
        return "nothing"
    text = f"at {plant.timing.told(result.detected_s)} s"
    if result.onset_s is not None:
        text += f", {plant.timing.told(result.detected_s - result.onset_s)} s after the onset"
    return f"{text}; diagnosed {probabilities(result.hypotheses, plant)}"


def _probed(probe: ProbeMade) -> str:
    """A test move or a wait, and what came of it."""
    what = probe.state or "a wait"
    ended = "and nobody looked" if probe.likeliest is None else f"after which {probe.likeliest} was the likeliest"
    sure = "" if probe.probability is None else f" with {100 * probe.probability:.0f} %"
    return f"{what} at {probe.at_s:.10g} s to tell {' from '.join(probe.apart)}, {ended}{sure}"


def _waited(at_s: float, wait: Waited) -> str:
    """A wait, and the permissives and guards that were a nuisance."""
    named = f"; a nuisance: {', '.join(wait.nuisance)}" if wait.nuisance else ""
    return f"{wait.seconds:g} s at {at_s:.10g} s, by {wait.proposer}{named}"


def _remarked(said: Remarked) -> str:
    """What a proposer said for people to read, quoted."""
    about = f" about {quoted(said.about)}" if said.about else ""
    return f"{said.remark.value} of {said.proposer}{about}: {quote(said.text, 200)}"


def _done(result: Result, acted_s: float | None, plant: PlantDescription) -> str:
    """The last commands that were released, or a fallback's; they were written at ``acted_s`` [s]."""
    if not result.actions:
        return "nothing"
    who = {"fallback": "the fallback", "search": "the search", "language": "the language model"}
    text = f"by {who.get(result.actor, result.actor)}: {commands(result.actions, plant)}"
    if acted_s is None:
        return text
    first = ""
    if result.released_s is not None and result.released_s < acted_s:
        first = f"; the first release was at {plant.timing.told(result.released_s)} s"
    return f"{text} (at {plant.timing.told(acted_s)} s{first})"


def _batch(result: Result, plant: PlantDescription) -> str:
    assert result.nominal_s is not None
    if result.complete_s is None:
        text = f"not complete, ended in state {plant.machine.state(result.state).label!r}"
    else:
        late_s = result.complete_s - result.nominal_s
        text = f"complete at {plant.timing.told(result.complete_s)} s, {_signed(late_s, plant)} s against nominal"
    return ", ".join((text, *(f"{name.replace('_', ' ')} {value:.3g}" for name, value in result.totals.items())))


def _steps(steps: StepScores) -> str:
    parts = [f"{steps.plans_right} of {steps.plans} plans right", f"{steps.actions_right} of {steps.actions} actions"]
    if steps.precision is not None and steps.recall is not None:
        parts.append(f"actuators: precision {100 * steps.precision:.0f} %, recall {100 * steps.recall:.0f} %")
    return ", ".join(parts)


def _cost(cost: Cost, currency: str) -> str:
    """All of it, and the items that are most of it."""
    items = sorted((item for item in cost.items if item.amount > 0.0), key=lambda item: -item.amount)
    most = ", ".join(f"{item.name} {item.amount:.1f}" for item in items[:4])
    share = f" ({100 * cost.share:.1f} % of what is made by design)" if cost.worth > 0.0 else ""
    return f"{cost.total:.1f} {currency}{share}: {most or 'nothing'}"


def _alone(cost: Cost, currency: str, plant: PlantDescription) -> str:
    """What it would have cost had nobody acted, and which hard limits would not have been kept."""
    missed = {item.name for item in cost.items if item.amount > 0.0} & {limit.name for limit in plant.limits.hard}
    kept = f"not kept: {', '.join(sorted(missed))}" if missed else "every hard limit kept"
    return f"{_cost(cost, currency)}; {kept}"


def _outside(result: Result, plant: PlantDescription) -> str:
    hard = {limit.name for limit in plant.limits.hard}
    parts = [
        f"{e.limit}{'' if e.limit in hard else ', which is not hard,'} violated for {e.total_s:g} s, "
        f"{e.from_detection_s:g} s of them after the fault was detected"
        for e in result.limit_exposure_s
        if e.total_s > 0.0
    ]
    return "; ".join(parts) or "all kept, 0 s outside"


def _plural(word: str, count: int) -> str:
    return word if count == 1 else f"{word}s"
