"""A guard that is killed at random instants over both simulated plants: what must hold of what followed."""

from __future__ import annotations

import math
import random
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.guard.life import KEY, Death, Life
from benchmarks.guard.store import FAST, Sizes
from benchmarks.guard.verdict import Judged, verdict
from homeostat.domain.mode import PersonCommand, Role, Verb
from homeostat.domain.observation import FallBack
from homeostat.domain.recovery import ActionSet
from homeostat.domain.request import Request, Seal
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import scenario
from homeostat.guard.requests.seal import Sealer
from homeostat.guard.sequence.sequencer import nominal_commands, what_follows
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import guard_rules

Act = Callable[[Life, float], None]


@dataclass(frozen=True)
class Scene:
    """What happens on a plant while guards live and die beside it."""

    name: str
    act: Act
    end_s: float
    fault: str = "none"
    onset_s: float | None = None
    severity: float | None = None


def nothing(life: Life, now_s: float) -> None:
    """Nobody does anything."""


def asking(transition: str, at_s: float) -> Act:
    """Recovery asks for a transition, again every five seconds until it is written or no longer open."""

    def act(life: Life, now_s: float) -> None:
        if now_s >= at_s and now_s % 5.0 == 0.0:
            found = next(t for t in life.rules.machine.transitions if t.name == transition)
            if life.guard._parts.sequencer.state == found.source:
                life.guard.mailbox.put(_request(life, transition, now_s))

    return act


def handled(tag: str, value: float, at_s: float) -> Act:
    """Somebody moves a tag at the plant; recovery asks for the fallback; a person resets, and starts again."""

    def act(life: Life, now_s: float) -> None:
        guard, since_s = life.guard, now_s - at_s
        if since_s == 0.0:
            life.link.operate(tag, value)
        if since_s in (20.0, 30.0, 40.0) and guard.latched is None:
            guard.mailbox.put(FallBack("recovery has nothing to release"))
        if since_s in (60.0, 80.0) and guard.latched is not None:
            guard.mailbox.put(_order(now_s, Verb.RESET))
        if since_s in (100.0, 110.0) and guard.latched is None:
            guard.mailbox.put(_order(now_s, Verb.MODE, "closed-loop"))
        if since_s in (120.0, 125.0, 130.0) and guard.out_of_service:
            guard.mailbox.put(_order(now_s, Verb.IN_SERVICE, min(guard.out_of_service)))

    return act


SCENES: dict[str, tuple[Scene, ...]] = {
    "cstr": (
        Scene("start-up", nothing, 900.0),
        Scene("request", asking("t_compensate", 700.0), 900.0),
        Scene("trip", nothing, 1300.0, "cool_stuck_closed", 650.0),
        Scene("people", handled("L1.sp", 9.0, 650.0), 900.0),
    ),
    "mixing_module": (
        Scene("batch", nothing, 600.0),
        Scene("request", asking("t_to_bypass_B201", 1.0), 600.0),
        Scene("trip", nothing, 300.0, "stuck_open_VI202", 20.0),
        Scene("people", handled("VI203.cmd", 1.0, 150.0), 400.0),
    ),
}


@cache
def the_case(plant: str) -> Plant:
    """The plant, loaded once per process."""
    return load_plant(plant)


def measure(plant: str, sizes: Sizes) -> dict[str, Any]:
    """Half of all deaths, on ``plant``."""
    wrong: list[str] = []
    places: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    for seed in range(sizes.kills // 2):
        found = kill(plant, seed)
        wrong += [f"{plant}, seed {seed}, {found.scene}, {', '.join(found.places)}: {w}" for w in found.wrong]
        places.update(found.places)
        kinds.update([found.scene, *found.kinds])
    return {
        "plant": plant, "lives": sizes.kills // 2, "deaths": sum(places.values()), "wrong": wrong,
        "places": dict(places.most_common()), "kinds": dict(kinds),
    }  # fmt: skip


@dataclass(frozen=True)
class Life1:
    """One life, judged."""

    scene: str
    places: list[str]
    wrong: list[str]
    kinds: list[str]


def kill(plant: str, seed: int) -> Life1:
    """One life whose guard dies once, and in two of five cases again soon after it has started."""
    draw = random.Random(f"{plant} {seed}")
    index = draw.randrange(len(SCENES[plant]))
    quiet = undisturbed(plant, index)
    early = quiet.instants[: int(0.92 * len(quiet.instants))]  # whoever comes after needs time to put things right
    instants = [k + 1 for k, place in enumerate(early) if not _idle(place)]
    if draw.random() < 0.3:  # most instants are those of ticks in which nothing happens
        instants = [k + 1 for k, place in enumerate(early) if _idle(place)]
    deaths = [Death(draw.choice(instants))]
    if draw.random() < 0.4:
        deaths.append(Death(draw.randint(1, 40)))
    judged = _live(plant, index, deaths, draw)
    wrong = [*judged.wrong]
    if not judged.fell_back and quiet.fell_back:
        wrong.append("no fallback, although there is one without a death")
    ends = {quiet.state, *([undisturbed(plant, 0).state] if SCENES[plant][index].name == "request" else [])}
    if not judged.fell_back and not quiet.fell_back and judged.state not in ends:
        wrong.append(f"in {judged.state!r} at the end instead of {quiet.state!r}")
    kinds = ["fallback that the gap called for"] if judged.fell_back and not quiet.fell_back else []
    return Life1(SCENES[plant][index].name, judged.places, wrong, kinds)


@cache
def undisturbed(plant: str, index: int) -> Judged:
    """The scene with a guard that nobody kills."""
    judged = _live(plant, index, [Death()], random.Random(0))
    assert not judged.wrong, judged.wrong
    return judged


def _live(plant: str, index: int, deaths: list[Death], draw: random.Random) -> Judged:
    case, scene = the_case(plant), SCENES[plant][index]
    asked = scenario(case, scene.fault, 3, scene.onset_s, scene.severity, scene.end_s)
    process = open_process(case, asked)
    with tempfile.TemporaryDirectory(dir=FAST) as folder:
        life = Life(guard_rules(case), SimulatedLink(process), Path(folder), draw)
        life.run(scene.act, deaths)
        return verdict(life, process, deaths[0].places)


def _idle(place: str) -> bool:
    return place in ("between ticks", "before the heartbeat")


def _order(now_s: float, verb: Verb, subject: str = "") -> PersonCommand:
    return PersonCommand(f"o{now_s:g}", "Ada", Role.ENGINEER, verb, subject, reason="seen")


def _request(life: Life, transition: str, now_s: float) -> Request:
    """A sealed request for ``transition`` and what follows by itself, with the design commands of each state."""
    rules = life.rules
    decided = next(t for t in rules.machine.transitions if t.name == transition)
    by_state = nominal_commands(rules)
    then = what_follows(rules.machine, decided.target, by_state)
    commands = tuple(c for c in by_state[decided.target] if c.value is not None and not math.isnan(c.value))
    commands = tuple(replace(c, value=308.0) if c.tag == "T1.sp" else c for c in commands)
    plain = Request(
        f"r{now_s:g}", "search", decided.source, ActionSet(commands, decided.target, then),
        (transition, *(s.transition.name for s in then)), "d1", rules.configuration, Seal("", 0.0, 0.0, "", ""),
    )  # fmt: skip
    return Sealer("check", KEY).seal(plain, now_s)
