"""Endings: how recovery ends where nothing is released."""

from homeostat.domain.diagnosis import Recurrence
from homeostat.domain.events.recovery import Concluded, NoActionTaken
from homeostat.domain.observation import Arm, Correction, FallBack, NoAction
from homeostat.domain.verdict import FallbackNeeded, NoActionNeeded, Rollout, Verdict
from homeostat.recovery.arming import TimeLeft
from homeostat.recovery.scene import Scene


def nothing_is_known(scene: Scene, limit_s: float) -> None:
    """The diagnosis took longer than ``limit_s`` [s]: the first fallback of the tables is to act first."""
    scene.send(Arm(()))
    late = f"the diagnosis took longer than {limit_s:g} s; nothing counts as known"
    scene.alarm("diagnosis", late)
    scene.record(Concluded(late))


def take_no_action(
    scene: Scene, verdict: Verdict, idle: Rollout, armed: TimeLeft, late: bool = False, recurs: Recurrence | None = None
) -> NoActionNeeded:
    """Say by which margins the plant does without help; ``idle`` is what was judged.

    ``late``: something better was looked for, and not found in time; ``recurs``: what came and went by itself before.
    """
    worst = min(verdict.findings, key=lambda f: f.margin)
    text = "" if recurs is None else recurs.text
    if recurs is not None:  # what explains the last of it alone has been wrong before: readings count as they are
        scene.send(Correction(()))
    scene.record(NoActionTaken(scene.now.state, worst.margin, verdict.findings, len(idle.weights), late, text))
    stand_down(scene, armed)
    return NoActionNeeded(scene.seen_s, worst.margin, late)


def stand_down(scene: Scene, armed: TimeLeft) -> None:
    """Nothing need act by itself any more: end the time to act by that the guard was told, or that stands in it."""
    if armed.act_by_s is not None or scene.now.act_by_s is not None:
        scene.send(NoAction())


async def fall_back(scene: Scene, reason: str) -> FallbackNeeded:
    """Ask for the fallback; the time that was thought passes first."""
    await scene.look()
    scene.send(FallBack(reason))
    return FallbackNeeded(reason, scene.seen_s)
