"""What nothing explains is looked at again: anew for a new situation, at once where it grows, rarely where it flaps."""

from __future__ import annotations

from homeostat.agents.monitoring.unexplained import Unexplained
from homeostat.domain.diagnosis import FaultState, Hypothesis
from tests.agents.test_monitoring import NOTHING, SETTINGS, Scene

HOT = (Hypothesis((FaultState("hot", 1.0, 30.0),), 0.95), Hypothesis((), 0.05))


def doubtful() -> Scene:
    scene = Scene(lambda at_s: NOTHING)
    scene.watch(30)
    return scene


def looks(scene: Scene, count: int, **values: float) -> list[float]:
    """The times of so many looks, each of which explains nothing."""
    found = []
    for _ in range(count):
        at_s = scene.until_attention(2000, **values)
        assert at_s is not None
        scene.monitoring.diagnose()
        found.append(at_s)
    return found


def test_a_new_symptom_after_harmless_ones_is_looked_at_again_as_soon_as_the_first_one_was() -> None:
    """A day with a few harmless symptoms must not make the next one wait for ten minutes."""
    scene = doubtful()
    looks(scene, 6, x=2.0)
    scene.watch(int(SETTINGS.review_s) + 10)
    first, second = looks(scene, 2, y=2.0)
    assert second - first == SETTINGS.repeat_s


def test_a_symptom_that_joins_begins_the_waits_anew() -> None:
    scene = doubtful()
    looks(scene, 6, x=2.0)
    first, second = looks(scene, 2, x=2.0, y=2.0)
    assert second - first == SETTINGS.repeat_s


def test_a_symptom_that_has_grown_is_looked_at_at_once_and_not_at_every_reading() -> None:
    scene = doubtful()
    looks(scene, 6, x=2.0)
    (grown,) = looks(scene, 1, x=20.0)
    assert grown == scene.at_s and scene.until_attention(int(SETTINGS.review_s) // 2, x=20.0) is None


def test_what_grows_step_by_step_is_looked_at_each_time_that_it_has_doubled() -> None:
    scene = doubtful()
    looks(scene, 6, x=2.0)
    asked = 0
    for k in range(100):
        if scene.watch(1, x=2.0 + 0.3 * k):
            scene.monitoring.diagnose()
            asked += 1
    assert 3 <= asked <= 5


def test_one_that_swings_between_small_and_large_is_looked_at_once_for_it() -> None:
    scene = doubtful()
    looks(scene, 5, x=2.0)
    asked = 0
    for k in range(300):
        if scene.watch(1, x=20.0 if k % 40 < 20 else 2.0):
            scene.monitoring.diagnose()
            asked += 1
    assert asked <= 3


def test_a_symptom_that_flaps_is_looked_at_less_and_less_often() -> None:
    """It comes and goes every half minute for an hour."""
    scene, asked = doubtful(), []
    for k in range(3600):
        if scene.watch(1, x=2.0 if k % 60 < 30 else 0.0):
            asked.append(scene.at_s)
            scene.monitoring.diagnose()
    assert 3 <= len(asked) <= 3600 / SETTINGS.review_s + 6


def test_what_a_fault_explains_is_not_looked_at_again_because_it_grows() -> None:
    scene = Scene(lambda at_s: HOT if at_s > 100.0 else NOTHING)
    scene.watch(30)
    looks(scene, 1, x=2.0)
    scene.watch(70, x=2.0)
    assert scene.until_attention(200, x=2.0) is not None
    assert scene.monitoring.diagnose().faulty
    assert scene.until_attention(int(SETTINGS.review_s) - 20, x=50.0) is None


def test_a_situation_is_forgotten_once_it_has_been_gone_for_as_long_as_would_be_waited() -> None:
    seen = Unexplained(30.0, 600.0)
    seen.take({"A": 1.1}, 0.0)
    assert [seen.left(["A"], at_s) for at_s in (0.0, 30.0, 90.0)] == [30.0, 60.0, 120.0]
    seen.take({}, 100.0)
    seen.take({}, 90.0 + 239.0)
    assert seen.left(["A"], 330.0) == 240.0
    seen.take({}, 330.0 + 480.0)
    seen.take({"A": 1.1}, 811.0)
    assert seen.left(["A"], 811.0) == 30.0


def test_the_first_wait_is_no_longer_than_the_longest() -> None:
    assert Unexplained(30.0, 20.0).left(["A"], 0.0) == 20.0
