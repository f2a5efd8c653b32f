"""What a fallback is told to do faster is what the limit minds, and no other command that is on its way."""

from __future__ import annotations

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.safe_states import _asked, _course, _ramps
from homeostat.plants.wired.assembly import fallbacks
from tests.evaluate.two_tanks import TANKS


def test_a_temperature_that_is_ramped_is_no_remedy_for_a_level() -> None:
    bench = Bench(TANKS)
    stop = next(each for each in fallbacks(bench.plant) if each.name == "stop")
    asked = next(e for e in _asked(bench) if e.fault.name == "P1_stuck_closed" and e.limit.name == "LIM-L1-HIGH")
    course = _course(bench, asked, stop.actions, stop.serves["LIM-L1-HIGH"].acts_within_s)
    told = _ramps(bench, asked, stop, course)
    assert "'F1.sp' takes 40 s at its rate" in told and "T2.sp" not in told
