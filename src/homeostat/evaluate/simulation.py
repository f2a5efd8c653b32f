"""A simulated run as a caller from Python wants it: one call, and nothing on disk until it is saved."""

from collections.abc import Sequence
from dataclasses import replace

from homeostat.evaluate import runner
from homeostat.evaluate.operation import Thinking
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.recorded.run import run_started
from homeostat.evaluate.run import Run
from homeostat.evaluate.scenario import Fault, ScenarioError, departing, repaired, scenario_of
from homeostat.journal import MemoryTrace, RunFinished
from homeostat.journal.beside.archive import MemoryArchive
from homeostat.llm.model import LanguageModel
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.truth import NONE
from homeostat.plants.wired.assembly import Language
from homeostat.process.batch import ProcessError


def run(
    plant: Plant | str,
    fault: Fault | str | Sequence[Fault | str] = (),
    *,
    seed: int = 1,
    end_s: float | None = None,
    disturb: Sequence[str] = (),
    mismatch: str = NONE,
    repair_s: float | None = None,
    thinking: Thinking | None = None,
    model: LanguageModel | None = None,
) -> Run:
    """Run ``plant`` from start-up to its end, with faults or without, and score it.

    Args:
        plant: as :func:`homeostat.load_plant` gives it, or what that takes.
        fault: what is truly wrong: one fault or its name, or several of them; nothing by default.
        seed: of the true parameters, the noise and every draw; with declared thinking, equal seeds give equal runs.
        end_s: process time at which the run ends [s]; the plant's usual end where None.
        disturb: what else happens to the true plant, each as ``homeostat run --disturb`` has it:
            ``"T_coolant + 10 from 1500"``.
        mismatch: how the true plant is not the model that its twin has; one of the plant's, none by default.
        repair_s: process time at which every fault ends, because somebody repaired it [s]; never where None.
        thinking: how much process time thinking takes: as measured by default, or ``homeostat.declared(1.0)``.
        model: a language model that proposes before the search does.

    Raises:
        ScenarioError: a fault, severity, onset, seed, end, disturbance or mismatch that the plant does not have.
        PlantError: there is no plant of this name.
    """
    plant = plant if isinstance(plant, Plant) else load_plant(plant)
    texts = (disturb,) if isinstance(disturb, str) else disturb
    chosen = departing(plant, scenario_of(plant, _faults(fault), seed, end_s), texts, mismatch)
    chosen = repaired(chosen, repair_s)
    trace, archive = MemoryTrace(), MemoryArchive()
    thinking = thinking or Thinking()
    if not isinstance(thinking, Thinking):
        raise ScenarioError(f"thinking {thinking!r} says not how long it takes; give homeostat.declared(1.0), or None")
    language = None if model is None else Language(model)
    started = run_started(plant, chosen, thinking, "search" if model is None else model.name, (), language)
    try:
        done = runner.run(plant, chosen, trace, thinking.clock(), Proposing(language), archive=archive, started=started)
    except ProcessError as broke:
        remedy = "disturb it less, or let its equations hold where it came to ('homeostat plant check --deep')"
        raise ScenarioError(f"{broke}: nothing can be simulated from there on; {remedy}") from None
    trace.record(RunFinished(done.outcome.value, done.reason, done.wall_s), chosen.end_s)
    return replace(done, texts=archive)


def _faults(given: Fault | str | Sequence[Fault | str]) -> list[Fault]:
    several = [given] if isinstance(given, Fault | str) else given
    if not isinstance(several, Sequence) or not all(isinstance(one, Fault | str) for one in several):
        raise ScenarioError(f"fault {given!r} is none; give a name, a homeostat.Fault, or several of them")
    return [Fault(one) if isinstance(one, str) else one for one in several]
