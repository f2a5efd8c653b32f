"""Trust (S5, S14, S15, S16): requests that are not what they say, altered configurations, forged journals."""

from __future__ import annotations

import pytest

from tests.safety.attacks.past import Past
from tests.safety.attacks.plant import HALF, Ask, Attack, Bad
from tests.safety.attacks.present import Present

REQUESTS = {
    "out of range": (Ask(50.0, (("F.sp", 0.5, 0.005),)), "admitted are"),
    "too fast": (Ask(50.0, (("F.sp", HALF, 5.0),)), "limit 0.005"),
    "a step where the rate is limited": (Ask(50.0, (("F.sp", HALF, None),)), "limit 0.005"),
    "not writable": (Ask(50.0, (("T", 300.0, None),)), "not a tag that may be written"),
    "no such tag": (Ask(50.0, (("Q.sp", 1.0, None),)), "not a tag that may be written"),
    "not a number": (Ask(50.0, (("F.sp", float("nan"), 0.005),)), "must be finite"),
    "infinite": (Ask(50.0, (("F.sp", float("inf"), 0.005),)), "must be finite"),
    "self-made": (Ask(50.0, forged="self-made"), "the seal"),
    "old": (Ask(50.0, forged="old"), "old; 0 to"),
    "from the future": (Ask(50.0, forged="future"), "old; 0 to"),
    "no time": (Ask(50.0, forged="nan"), ""),
    "altered": (Ask(50.0, forged="altered"), "the seal"),
    "another configuration": (Ask(50.0, forged="configuration"), "configuration"),
}
UNCHECKED = (
    "out of range", "too fast", "a step where the rate is limited", "not writable", "no such tag", "self-made", "old",
    "from the future", "no time", "another configuration",
)  # fmt: skip
"""What 170fbcd wrote when the twin said yes."""


def asking(name: str) -> Attack:
    """The attack with one bad request."""
    return Attack(start=300.0, heating=0.0, end_s=80.0, asks=(REQUESTS[name][0],))


@pytest.mark.parametrize("name", REQUESTS)
def test_s5_a_bad_request_is_refused_with_its_reason(present: Present, name: str) -> None:
    report = present.request(asking(name))
    assert report.wire == [] and len(report.refused) == 1 and REQUESTS[name][1] in report.refused[0]


@pytest.mark.parametrize("name", UNCHECKED)
def test_s5_past_it_was_written(past: Past, name: str) -> None:
    report = past.request(asking(name))
    assert len(report.wire) == 1 and report.refused == []


def test_s5_a_seal_is_used_once(present: Present) -> None:
    report = present.request(Attack(start=300.0, heating=0.0, end_s=80.0, asks=(Ask(50.0, forged="replayed"),)))
    assert len(report.wire) == 1 and "used once" in report.refused[0]


def test_s5_what_is_altered_while_it_is_written_is_not_what_is_sent_again(present: Present) -> None:
    """Whoever asked keeps the request in hand, and changes it between two attempts."""
    ask = Ask(50.0, forged="altered-later")
    report = present.request(
        Attack(start=300.0, heating=0.0, end_s=80.0, asks=(ask,), bad=(Bad("ignore", 50.0, 51.0),))
    )
    assert [commands for _, commands, _ in report.wire] == [[["F.sp", HALF]]] * 2


def test_s5_past_an_approval_was_used_as_often_as_one_liked(past: Past) -> None:
    report = past.request(Attack(start=300.0, heating=0.0, end_s=80.0, asks=(Ask(50.0, forged="replayed"),)))
    assert len(report.wire) == 2 and report.refused == []


ALTERED = {
    "a limit in the graph": ("plant.ttl", '"T1 <= 313"', '"T1 <= 353"', "altered"),
    "a permissive in the graph": ("plant.ttl", "or T1 <= 300", "or T1 <= 350", "altered"),
    "a description in the graph": ("plant.ttl", "Highest reactor temperature", "Highest reactor pressure", "altered"),
    "a mean value": ("baseline.csv", "F-COOLING,0.50", "F-COOLING,99990.50", "altered"),
    "a limit in the tables": ("engineering/limits.csv", "T1 <= 313", "T1 <= 312", "made again: plant.ttl"),
    "a fallback reversed in the tables": (
        "engineering/fallbacks.csv", "drain|isolate,,V2.man,1,0.5", "drain|isolate,,V2.man,0,0.5", "",
    ),
}  # fmt: skip
"""File, text, what it is replaced by, what the present says."""


@pytest.mark.parametrize("name", ALTERED)
def test_s14_an_altered_file_is_refused_and_a_stale_one_made_again(present: Present, name: str) -> None:
    file, before, after, says = ALTERED[name]
    said = present.loads("cstr", file, before, after)
    assert said and says in said


@pytest.mark.parametrize("name", list(ALTERED)[:-1])
def test_s14_past_it_was_loaded_as_it_was(past: Past, name: str) -> None:
    file, before, after, _ = ALTERED[name]
    assert past.loads("cstr", file, before, after) == ""


SETTINGS = {
    "judged_draws": ("judged_draws = 12", "judged_draws = -1"),
    "horizon_s": ("horizon_s = 900", "horizon_s = 1e8"),
    "gain_error": ("gain_error = 0.1", "gain_error = nan"),
    "stride": ("stride = 5", "stride = 0"),
    "sure": ("sure = 0.95", "sure = 7.0"),
    "design_rate": ("design_rate = 0.0333333333333333", "design_rate = -1.0"),
    "replay_s": ("replay_s = 640", "replay_s = inf"),
    "model": ("homeostat.plants.cstr.process:REACTOR", "os:getcwd"),
}
"""Setting -> text, an absurd one."""


@pytest.mark.parametrize("name", SETTINGS)
def test_s15_an_absurd_setting_is_refused_by_its_name(present: Present, name: str) -> None:
    said = present.loads("cstr", "case.toml", *SETTINGS[name])
    assert name in said and "\n" not in said


@pytest.mark.parametrize("name", ["judged_draws", "horizon_s", "gain_error", "sure"])
def test_s15_past_it_was_loaded(past: Past, name: str) -> None:
    assert past.loads("cstr", "case.toml", *SETTINGS[name]) == ""


def test_s15_past_any_code_was_run_as_a_model(past: Past) -> None:
    """What ``os.getcwd`` gave was taken for a model, whose module had another name then."""
    model, other = SETTINGS["model"]
    former = model.replace(".plants.", ".cases.").replace("REACTOR", "CstrModel")
    assert "'str' object" in past.loads("cstr", "case.toml", former, other)


@pytest.mark.parametrize("forgery", ["state", "digest", "times"])
def test_s16_a_journal_that_was_made_anew_is_not_vouched_for(present: Present, forgery: str) -> None:
    assert not present.verifies(forgery)


@pytest.mark.parametrize("forgery", ["state", "digest", "times"])
def test_s16_past_it_verified(past: Past, forgery: str) -> None:
    assert past.verifies(forgery)
