"""Monitoring: when it asks for attention, what it believes, and when it keeps quiet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import pytest

from homeostat.agents.monitoring.clearing import LOOKS_S
from homeostat.agents.monitoring.monitoring import TwinMonitoring
from homeostat.agents.monitoring.settings import MonitoringSettings
from homeostat.domain.diagnosis import Direction, FaultState, Feature, Hypothesis, SymptomRule
from homeostat.domain.plant.baseline import Baseline
from homeostat.domain.plant.rules import QualityRule
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import FallbackNeeded, NoActionNeeded, Released
from homeostat.stl.formula import parse, parse_expression
from homeostat.twin.isolation.ended import Ended
from tests.agents.scripted import NoGraph
from tests.twin.followed import reactor

SETTINGS = MonitoringSettings(
    settle_s=5.0, centre_s=20.0, sure=0.75, evidence_s=6.0, transient_s=40.0, review_s=200.0, repeat_s=15.0
)
RELEASED = ActionSet((), "reduced")
SURE = (Hypothesis((FaultState("hot", 1.0, 30.0),), 0.9),)
UNSURE = (Hypothesis((FaultState("hot", 1.0, 30.0),), 0.5), Hypothesis((FaultState("wet", 1.0, 30.0),), 0.5))
NOTHING = (Hypothesis((), 0.9), Hypothesis((FaultState("hot", 1.0, 30.0),), 0.1))


@dataclass
class ScriptedTwin:
    """What monitoring asks a twin: explanations come from the script."""

    answer: Callable[[float], tuple[Hypothesis, ...]]
    at_s: float = 0.0
    asked: list[tuple[tuple[str, ...], tuple[FaultState, ...]]] = field(default_factory=list)
    learned: list[tuple[float, int]] = field(default_factory=list)
    sharpened: list[tuple[float, int, tuple[Hypothesis, ...]]] = field(default_factory=list)
    over: Ended | None = None
    checked: list[float] = field(default_factory=list)
    believed: list[tuple[float, tuple[FaultState, ...]]] = field(default_factory=list)

    def observe(self, snapshot: Snapshot) -> None:
        self.at_s = snapshot.at_s

    def frozen(self) -> ScriptedTwin:
        return self

    def explain(
        self,
        candidates: Sequence[str],
        known: Sequence[FaultState],
        dense: bool = False,
        since_s: float = 0.0,
        before: tuple[Hypothesis, ...] = (),
        news: bool = True,
        from_s: float = 0.0,
    ) -> tuple[Hypothesis, ...]:
        self.asked.append((tuple(candidates), tuple(known)))
        return self.answer(self.at_s)

    def ended(self, known: Sequence[tuple[FaultState, ...]], from_s: float) -> Ended | None:
        self.checked.append(self.at_s)
        return self.over

    def stuck(self) -> dict[str, float]:
        return {}

    def calibrate(self, seconds: int) -> None:
        self.learned.append((self.at_s, seconds))

    def recalibrate(self, seconds: int, hypotheses: Sequence[Hypothesis]) -> None:
        self.sharpened.append((self.at_s, seconds, tuple(hypotheses)))

    def believe(self, known: tuple[FaultState, ...], over_s: float) -> None:
        self.believed.append((self.at_s, known))


class OneSymptomEach(NoGraph):
    """A graph in which S-X indicates ``hot`` and ``wet``, S-Y indicates ``wet``."""

    def candidate_faults(self, symptoms: Sequence[str]) -> tuple[str, ...]:
        assert symptoms
        return ("hot", "wet") if "S-X" in symptoms else ("wet",)


class Scene:
    """A plant with two signals, watched second by second."""

    def __init__(
        self, answer: Callable[[float], tuple[Hypothesis, ...]] = lambda at_s: SURE,
        settings: MonitoringSettings = SETTINGS, raised_by: str = "",
    ) -> None:  # fmt: skip
        features = tuple(Feature(f"F-{n.upper()}", parse_expression(n), None, 0.0, 0.0, "K", "C") for n in ("x", "y"))
        faults = (raised_by,) if raised_by else ()
        rules = tuple(SymptomRule(f"S-{n}", f"F-{n}", Direction.HIGH, 5.0, 0.5, 2.0, faults, "") for n in ("X", "Y"))
        baselines = {f"F-{n}": Baseline(f"F-{n}", 0.0, 0.1, 0.1, 0, 0, 0, 0, 0) for n in ("X", "Y")}
        description = replace(reactor().description, features=features, symptom_rules=rules)
        self.twin = ScriptedTwin(answer)
        self.monitoring = TwinMonitoring(
            self.twin,
            OneSymptomEach(),
            description,
            baselines,
            parse("on >= 1"),
            settings,  # type: ignore[arg-type]
        )
        self.at_s = 0.0

    def watch(self, seconds: int, x: float = 0.0, y: float = 0.0, on: float = 1.0) -> list[float]:
        """The times at which monitoring asks for attention."""
        asked = []
        for _ in range(seconds):
            self.at_s += 1.0
            if self.monitoring.notices(Snapshot(self.at_s, {"x": x, "y": y, "on": on})):
                asked.append(self.at_s)
        return asked

    def until_attention(self, seconds: int, **values: float) -> float | None:
        for _ in range(seconds):
            if asked := self.watch(1, **values):
                return asked[0]
        return None


def healthy() -> Scene:
    scene = Scene()
    assert scene.watch(30) == []
    return scene


def test_a_healthy_plant_needs_no_attention() -> None:
    scene = healthy()
    assert scene.watch(1000) == [] and scene.twin.asked == [] and scene.monitoring.symptoms == ()


def test_nothing_is_judged_before_the_plant_has_started_and_settled() -> None:
    scene = Scene()
    assert scene.watch(50, x=9.0, on=0.0) == []
    assert scene.watch(5, x=9.0) == [] and scene.monitoring.symptoms == ()
    assert scene.until_attention(10, x=9.0) == 50.0 + 1.0 + 5.0 + 2.0, "started, settled, on-delay"


def test_a_symptom_asks_for_attention_and_names_itself() -> None:
    scene = healthy()
    assert scene.until_attention(10, x=2.0) == 33.0
    assert [s.rule for s in scene.monitoring.symptoms] == ["S-X"]


def test_a_diagnosis_says_what_was_seen_and_what_explains_it() -> None:
    scene = healthy()
    scene.until_attention(10, x=2.0)
    diagnosis = scene.monitoring.diagnose()
    assert diagnosis.faulty and diagnosis.at_s == 33.0 and diagnosis.hypotheses == SURE
    assert [s.rule for s in diagnosis.symptoms] == ["S-X"]
    assert scene.twin.asked == [(("hot", "wet"), ())]


def test_the_healthy_stretch_is_learned_once() -> None:
    scene = healthy()
    scene.watch(500)
    assert scene.twin.learned == [(25.0, 20)], "five seconds to settle (from second 1 on), then twenty"


FOLLOWING = replace(SETTINGS, adapt_s=100.0)


def test_a_plant_that_stays_healthy_is_learned_again_and_again() -> None:
    scene = Scene(settings=FOLLOWING)
    scene.watch(330)
    assert scene.twin.learned == [(25.0, 20), (125.0, 20), (225.0, 20), (325.0, 20)]


def test_a_slow_change_is_followed_and_raises_no_symptom() -> None:
    """Up to twice 0.1, by which healthy plants differ: beyond that it is a symptom, however slowly it comes."""
    assert Scene(settings=FOLLOWING).watch(30) == []
    for last, noticed in ((0.65, False), (0.75, True)):
        scene = Scene(settings=FOLLOWING)
        scene.watch(30)
        found = [scene.watch(1, x=last * k / 1000.0) for k in range(1001)]
        found += [scene.watch(200, x=last)]
        assert any(found) is noticed


def test_what_is_known_to_be_wrong_is_not_followed() -> None:
    scene = Scene(settings=FOLLOWING)
    scene.watch(30)
    scene.until_attention(10, x=2.0)
    assert scene.monitoring.diagnose().faulty
    scene.watch(1000, x=0.65)
    assert scene.monitoring.symptoms, "it would have been followed by now"
    assert scene.twin.learned == [(25.0, 20)]


def test_a_faulty_stretch_is_not_learned() -> None:
    scene = Scene()
    scene.watch(10)
    scene.watch(300, x=2.0)
    assert scene.twin.learned == []


def test_unsure_evidence_is_gathered_for_a_while_and_then_used() -> None:
    scene = Scene(lambda at_s: UNSURE)
    scene.watch(30)
    first = scene.until_attention(10, x=2.0)
    assert first is not None and not scene.monitoring.diagnose().faulty
    again = scene.until_attention(20, x=2.0)
    assert again == first + SETTINGS.evidence_s
    assert scene.monitoring.diagnose().hypotheses == UNSURE


def test_unsure_evidence_may_be_looked_at_in_between() -> None:
    scene = Scene(lambda at_s: UNSURE, replace(SETTINGS, again_s=2.0))
    scene.watch(30)
    first = scene.until_attention(10, x=2.0)
    assert first is not None and not scene.monitoring.diagnose().faulty
    assert scene.until_attention(20, x=2.0) == first + 2.0
    assert not scene.monitoring.diagnose().faulty, "still gathering"


def test_a_deviation_is_explained_by_any_fault_and_waits_for_nothing() -> None:
    scene = Scene(lambda at_s: UNSURE)
    scene.watch(30)
    assert scene.monitoring.diagnose(deviates=True).hypotheses == UNSURE
    ((candidates, _),) = scene.twin.asked
    assert set(candidates) == {fault.name for fault in reactor().description.faults}


def test_a_deviation_that_nothing_explains_silences_no_symptom() -> None:
    scene = Scene(lambda at_s: NOTHING)
    scene.watch(30)
    assert not scene.monitoring.diagnose(deviates=True).faulty
    assert scene.until_attention(10, x=2.0) == 33.0


def test_nothing_as_the_best_explanation_is_not_a_fault() -> None:
    scene = Scene(lambda at_s: NOTHING)
    scene.watch(30)
    first = scene.until_attention(10, x=2.0)
    assert first is not None
    found = scene.monitoring.diagnose()
    assert not found.faulty and [s.rule for s in found.symptoms] == ["S-X"]
    assert scene.until_attention(60, x=2.0) == first + SETTINGS.repeat_s, "what nothing explains is looked at again"


def test_what_nothing_explains_is_looked_at_less_and_less_often() -> None:
    scene = Scene(lambda at_s: NOTHING)
    scene.watch(30)
    looked = [scene.until_attention(10, x=2.0) or 0.0]
    for _ in range(4):
        scene.monitoring.diagnose()
        looked.append(scene.until_attention(2000, x=2.0) or 0.0)
    between = [after - before for before, after in pairwise(looked)]
    assert between == [min(SETTINGS.repeat_s * 2**k, SETTINGS.review_s) for k in range(4)]


def test_what_nothing_explains_may_last_for_ever() -> None:
    """More looks than a doubled wait could be written for."""
    scene = Scene(lambda at_s: NOTHING)
    scene.watch(30)
    assert scene.until_attention(10, x=2.0) is not None
    for _ in range(1100):
        found = scene.monitoring.diagnose()
    assert not found.faulty and found.symptoms


def test_another_symptom_ends_the_wait_of_one_that_nothing_explains() -> None:
    scene = Scene(lambda at_s: NOTHING)
    scene.watch(30)
    for _ in range(3):
        assert scene.until_attention(2000, x=2.0) is not None
        scene.monitoring.diagnose()
    last = scene.twin.at_s
    assert (scene.until_attention(10, x=2.0, y=2.0) or 1e9) < last + 10.0


def test_a_symptom_that_was_diagnosed_is_not_reported_again() -> None:
    scene = healthy()
    scene.until_attention(10, x=2.0)
    scene.monitoring.diagnose()
    assert scene.until_attention(int(SETTINGS.review_s) - 5, x=2.0) is None


def test_another_symptom_is_news() -> None:
    scene = healthy()
    scene.until_attention(10, x=2.0)
    scene.monitoring.diagnose()
    assert scene.until_attention(10, x=2.0, y=2.0) is not None
    scene.monitoring.diagnose()
    candidates, known = scene.twin.asked[-1]
    assert set(candidates) == {"hot", "wet"} and known == SURE[0].faults


def recovered() -> tuple[Scene, float]:
    scene = healthy()
    at_s = scene.until_attention(10, x=2.0)
    assert at_s is not None
    scene.monitoring.diagnose()
    scene.monitoring.follow(Released(RELEASED, at_s))
    return scene, at_s


def named(fault: str) -> tuple[Hypothesis, ...]:
    return (Hypothesis((FaultState(fault, 0.01, 30.0),), 0.9),)


def test_a_symptom_that_what_is_likeliest_does_not_raise_is_looked_at_again() -> None:
    """Less and less often; as long as the same is said of it that is no news."""
    scene = Scene(lambda at_s: named("leak"), raised_by="level_bias")
    scene.watch(30)
    scene.until_attention(10, x=2.0)
    first = scene.at_s
    assert scene.monitoring.diagnose().news
    scene.monitoring.follow(NoActionNeeded(first, 1.0))
    for wait_s in (15.0, 30.0, 60.0):
        first += wait_s
        assert scene.until_attention(100, x=2.0) == first
        assert not scene.monitoring.diagnose().news


@pytest.mark.parametrize(("raised_by", "fault"), [("leak", "leak"), ("", "leak"), ("leak", "L1_reads_low")])
def test_a_symptom_that_it_may_raise_is_not(raised_by: str, fault: str) -> None:
    scene = Scene(lambda at_s: named(fault), raised_by=raised_by)
    scene.watch(30)
    scene.until_attention(10, x=2.0)
    scene.monitoring.diagnose()
    assert scene.watch(150, x=2.0) == []


def test_another_fault_behind_such_a_symptom_is_news() -> None:
    scene = Scene(lambda at_s: named("leak" if at_s < 40.0 else "level_bias"), raised_by="level_bias")
    scene.watch(30)
    scene.until_attention(10, x=2.0)
    scene.monitoring.diagnose()
    assert scene.until_attention(100, x=2.0) is not None
    assert scene.monitoring.diagnose().news


def test_the_transient_after_a_release_is_expected() -> None:
    scene, released_s = recovered()
    assert scene.until_attention(int(SETTINGS.transient_s) - 1, x=2.0, y=2.0) is None
    assert scene.until_attention(5, x=2.0, y=2.0) == released_s + SETTINGS.transient_s


@pytest.mark.parametrize(("fault", "onset_s", "after_s"), [
    ("T1_drifts_up", -17.0, 50.0), ("T1_drifts_up", 30.0, 15.0), ("T1_drifts_up", -900.0, 200.0), ("hot", -17.0, 200.0),
])  # fmt: skip
def test_what_grows_is_looked_at_again_by_the_time_that_its_forecast_has_an_end(
    fault: str, onset_s: float, after_s: float
) -> None:
    """It has grown for so long at 33 s, and is forecast to do so for as long again."""
    scene = Scene(lambda at_s: (Hypothesis((FaultState(fault, 1.0, onset_s),), 0.9),))
    scene.watch(30)
    assert scene.until_attention(10, x=2.0) == 33.0
    scene.monitoring.diagnose()
    scene.monitoring.follow(NoActionNeeded(33.0, 0.1))
    assert scene.until_attention(250, x=2.0) == 33.0 + after_s


def test_where_nothing_was_found_in_time_it_is_looked_for_again_soon() -> None:
    scene = Scene(lambda at_s: named("hot"))
    scene.watch(30)
    assert scene.until_attention(10, x=2.0) == 33.0
    scene.monitoring.diagnose()
    scene.monitoring.follow(NoActionNeeded(33.0, 0.1, late=True))
    assert scene.until_attention(250, x=2.0) == 33.0 + SETTINGS.repeat_s < 33.0 + SETTINGS.review_s


def test_a_release_is_reviewed_even_if_all_is_quiet() -> None:
    scene, released_s = recovered()
    reviews = [released_s + SETTINGS.review_s * k for k in (1, 2, 3)]
    cleared_s = released_s + SETTINGS.transient_s
    assert scene.watch(650) == sorted([*reviews, *(cleared_s + after_s for after_s in LOOKS_S)])


def reviewed() -> tuple[Scene, float]:
    """A recovered plant that shows nothing any more, when it is reviewed."""
    scene, released_s = recovered()
    while scene.at_s < released_s + SETTINGS.review_s:
        assert scene.until_attention(250) is not None
    return scene, released_s


def test_a_review_asks_about_what_was_believed() -> None:
    scene, _ = reviewed()
    diagnosis = scene.monitoring.diagnose()
    assert scene.twin.asked[-1] == (("hot",), SURE[0].faults)
    assert diagnosis.faulty and [s.rule for s in diagnosis.symptoms] == ["S-X"], "the last symptoms are remembered"


def test_a_review_sharpens_the_twin_only_where_one_explanation_is_left() -> None:
    scene, released_s = reviewed()
    scene.monitoring.diagnose()
    minute = 60
    learned = int(SETTINGS.review_s) - minute
    assert scene.twin.sharpened == [(released_s + SETTINGS.review_s, learned, SURE)]
    assert sharpened_by(UNSURE) == []


def sharpened_by(hypotheses: tuple[Hypothesis, ...]) -> list[tuple[Hypothesis, ...]]:
    """What the twin is sharpened by where these explain what is seen at the first review after a release."""
    scene = Scene(lambda at_s: hypotheses)
    scene.watch(30)
    scene.monitoring.follow(Released(RELEASED, 30.0))
    scene.watch(int(SETTINGS.review_s) - 1, x=2.0)
    scene.until_attention(250, x=2.0)
    scene.monitoring.diagnose()
    return [learned for _, _, learned in scene.twin.sharpened]


@pytest.mark.parametrize("between", [(0.5, 0.7), None])
def test_one_fault_of_several_sizes_is_one_explanation_where_it_is_known_between_what_it_lies(
    between: tuple[float, float] | None,
) -> None:
    sizes = tuple(Hypothesis((FaultState("hot", size, 1.0),), 0.5, between) for size in (0.6, 0.62))
    assert sharpened_by(sizes) == ([sizes] if between is not None else [])


def test_what_was_left_alone_is_reviewed() -> None:
    scene = healthy()
    at_s = scene.until_attention(10, x=2.0)
    assert at_s is not None
    scene.monitoring.diagnose()
    scene.monitoring.follow(NoActionNeeded(at_s, 1.0))
    assert scene.until_attention(250, x=2.0) == at_s + SETTINGS.review_s


def test_after_a_hand_over_there_is_nothing_to_ask_for() -> None:
    scene, _ = recovered()
    scene.monitoring.follow(FallbackNeeded("no plan", scene.at_s))
    assert scene.watch(500, x=9.0, y=9.0) == []
    assert {s.rule for s in scene.monitoring.symptoms} == {"S-X", "S-Y"}, "it still sees"


def test_the_twin_sees_every_snapshot() -> None:
    scene = healthy()
    assert scene.twin.at_s == 30.0
    scene.watch(1, on=0.0)
    assert scene.twin.at_s == 31.0


@pytest.mark.parametrize("probability", [0.5, 0.51])
def test_nothing_must_be_more_likely_than_not(probability: float) -> None:
    fault = Hypothesis((FaultState("hot", 1.0, 30.0),), 1.0 - probability)
    scene = Scene(lambda at_s: (Hypothesis((), probability), fault))
    scene.watch(30)
    scene.until_attention(10, x=2.0)
    assert not scene.monitoring.diagnose().faulty, "evidence is gathered first"
    scene.until_attention(20, x=2.0)
    assert scene.monitoring.diagnose().faulty is (probability <= 0.5)


def test_a_picture_that_repeats_to_the_last_digit_says_nothing_and_one_reading_that_does_says_something() -> None:
    scene = healthy()
    qualities = {n: QualityRule(n, 5.0, noise=0.1, frozen_s=10.0) for n in ("x", "y")}
    description = replace(reactor().description, features=(), symptom_rules=(), qualities=qualities)
    monitoring = TwinMonitoring(scene.twin, NoGraph(), description, {}, parse("on >= 1"), SETTINGS)  # type: ignore[arg-type]
    seen = []
    for at_s, x, y in ((1.0, 0.1, 0.2), (2.0, 0.1, 0.3), (3.0, 0.1, 0.3), (4.0, 0.1, 0.3), (5.0, 0.2, 0.3)):
        monitoring.notices(Snapshot(at_s, {"x": x, "y": y, "on": 1.0}))
        seen.append(scene.twin.at_s)
    assert seen == [1.0, 2.0, 2.0, 2.0, 5.0]


# --- what is over ---------------------------------------------------------------------------------------------------


def cleared() -> Scene:
    """A plant whose fault was found, when it is looked at because its symptom has gone."""
    scene = healthy()
    scene.until_attention(10, x=2.0)
    scene.monitoring.diagnose()
    assert scene.until_attention(100) is not None
    return scene


def test_after_a_symptom_has_gone_it_is_only_seen_whether_its_cause_is_over() -> None:
    scene = cleared()
    asked = len(scene.twin.asked)
    found = scene.monitoring.diagnose()
    assert found.hypotheses == SURE and not found.news and found.ended_s is None
    assert len(scene.twin.asked) == asked and scene.twin.checked == [scene.at_s]


def test_what_is_over_is_said_once_and_forgotten() -> None:
    scene = cleared()
    scene.twin.over = Ended(scene.at_s - 5.0, fits=True)
    found = scene.monitoring.diagnose()
    assert not found.faulty and found.ended == SURE[0].faults and found.ended_s == scene.at_s - 5.0
    assert scene.watch(1000) == [], "there is nothing to review"
    assert scene.monitoring.diagnose().hypotheses == (), "and after the time of a review it is not doubted any more"
    assert scene.until_attention(10, x=2.0) is not None
    scene.monitoring.diagnose()
    assert scene.twin.asked[-1] == (("hot", "wet"), ()), "what comes then is new"


def test_what_has_ended_by_itself_may_come_back_and_that_is_told_for_a_while() -> None:
    scene = cleared()
    scene.twin.over = Ended(scene.at_s - 5.0, fits=True)
    ended = scene.monitoring.diagnose()
    nothing, *others = ended.hypotheses
    assert ended.doubts and not ended.faulty and not nothing.faults and nothing.probability > 0.5
    assert {h.name for h in others} == {h.name for h in SURE if h.faults}
    assert sum(h.probability for h in ended.hypotheses) == pytest.approx(1.0)
    scene.watch(60)
    assert scene.monitoring.diagnose().hypotheses == ended.hypotheses


def test_where_something_else_is_wrong_then_it_is_looked_for() -> None:
    scene = healthy()
    scene.until_attention(10, x=2.0)
    scene.monitoring.diagnose()
    scene.twin.over = Ended(40.0, fits=False)
    assert scene.until_attention(100, y=2.0) is not None
    found = scene.monitoring.diagnose()
    assert found.faulty and scene.twin.asked[-1] == (("wet",), ())


def test_nothing_as_the_best_explanation_ends_what_was_known() -> None:
    answers = iter([SURE, NOTHING])
    scene = Scene(lambda at_s: next(answers))
    scene.watch(30)
    scene.until_attention(10, x=2.0)
    scene.monitoring.diagnose()
    assert scene.until_attention(10, x=2.0, y=2.0) is not None
    found = scene.monitoring.diagnose()
    assert found.ended == SURE[0].faults and found.ended_s == scene.at_s and not found.symptoms


def test_doubts_are_told_and_outlast_their_symptom() -> None:
    """That something may be wrong although nothing is likelier is said, acted on by nobody, and not forgotten."""
    doubts = (Hypothesis((), 0.6), Hypothesis((FaultState("hot", 1.0, 30.0),), 0.4))
    scene = Scene(lambda at_s: doubts)
    scene.watch(30)
    scene.until_attention(10, x=2.0)
    assert not scene.monitoring.diagnose().hypotheses, "evidence is gathered first"
    scene.until_attention(20, x=2.0)
    told = scene.monitoring.diagnose()
    assert told.hypotheses == doubts and told.symptoms and not told.faulty
    scene.watch(60)
    later = scene.monitoring.diagnose()
    assert later.hypotheses == doubts and not later.symptoms and not later.faulty
