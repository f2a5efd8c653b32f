"""What else would have come of a run: a fallback or the first release at detection, on the true plant.

Each alternative meets the very faults, parameters and noise of the run; no agent may see any of them.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise, product

from homeostat.agents.search.candidates import design_commands
from homeostat.domain.events.recovery import Attempted
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.reference.unsupervised import Unsupervised, once, open_process, watch
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.evaluate.score.scoring import kept_until, outside_after, worse
from homeostat.guard.sequence.sequencer import nominal_route
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import fallbacks, new_sequencer
from homeostat.process.batch import ProcessError
from homeostat.record.releases import Release


def avoidable(
    plant: Plant,
    scenario: Scenario,
    truth: Trajectory,
    force: LimitsInForce,
    detected_s: float,
    released: ActionSet | None,
) -> bool:
    """Whether ``truth`` violates a hard limit after ``detected_s`` that a fallback or ``released`` would have kept.

    What is outside when start-up ends has to come back as what is outside at detection has.
    """
    outside = outside_after(truth, force, detected_s)
    if not outside:
        return False
    tried = [(strategy.actions, True) for strategy in fallbacks(plant)]
    for actions, aborting in tried if released is None else [*tried, (released, False)]:
        other = diverted(plant, scenario, detected_s, actions, aborting)
        if other is None:
            continue
        own = outside_after(other, force, detected_s)
        until = kept_until(own, other, force.settled_s(detected_s), plant.description.timing)
        if until is not None and worse(outside, until):
            return True
    return False


def as_usual(plant: Plant, states: Sequence[str]) -> bool:
    """Whether ``states``, in the order in which they were entered, are those of the nominal route."""
    machine, tags = plant.description.machine, plant.description.tags_by_name
    route = nominal_route(machine, {state.name: design_commands(state, tags) for state in machine.states})
    return list(states) == [step.target for step in route][: len(states)]


def diverted(
    plant: Plant, scenario: Scenario, at_s: float, actions: ActionSet, aborting: bool = False
) -> Trajectory | None:
    """True values where ``actions`` are commanded at ``at_s`` [s]; None where the plant leaves the physical world."""
    run = diverted_run(plant, scenario, at_s, actions, aborting)
    return None if run is None else run.truth


def diverted_run(
    plant: Plant, scenario: Scenario, at_s: float, actions: ActionSet, aborting: bool = False
) -> Unsupervised | None:
    """The same with the states of the machine."""
    sequencer, process = new_sequencer(plant), open_process(plant, scenario)

    def take_over(now_s: float) -> tuple[Command, ...]:
        sequencer.stop()
        sequencer.load(actions, now_s, aborting=aborting)
        return actions.commands

    try:
        watch(process, once(sequencer, at_s, take_over))
    except ProcessError:
        return None
    return Unsupervised(process.truth(), tuple(sequencer.drain()))


def released_set(plant: Plant, released: Release, attempts: Sequence[Attempted]) -> ActionSet | None:
    """The action set that was released, with its later steps; None where the record does not tell them.

    The record has the digest of the set and the states on the way; where the steps between these with what their states
    are commanded by design, or as was chosen at first, have that digest, they are the ones.
    """
    path = next((a.path for a in attempts if a.digest == released.digest), ())
    machine, chosen = plant.description.machine, {c.tag: c for c in released.commands}
    for k, now in enumerate(path):
        for steps in product(*_between(plant, machine, path[k:], chosen)):
            actions = ActionSet(released.commands, now, steps)
            if actions.digest == released.digest:
                return actions
    return None


def _between(
    plant: Plant, machine: StateMachine, states: Sequence[str], chosen: dict[str, Command]
) -> Iterator[tuple[Step, ...]]:
    """The steps that may lead from each of ``states`` to the next."""
    for here, there in pairwise(states):
        state = machine.state(there)
        opened = {r.tag for r in state.open_setpoints}
        designed = design_commands(state, plant.description.tags_by_name)
        commands = tuple(chosen.get(c.tag, c) if c.tag in opened else c for c in designed)
        ways = [t for t in machine.transitions if (t.source, t.target) == (here, there) and not t.on_decision]
        yield tuple(Step(t, commands) for t in ways)
