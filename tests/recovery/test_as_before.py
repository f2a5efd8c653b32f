"""What comes and goes by itself is left alone, whatever explains the last of it; readings count as they are."""

from __future__ import annotations

from dataclasses import replace

from homeostat.domain.diagnosis import Diagnosis, Recurrence
from homeostat.domain.events.recovery import NoActionTaken
from homeostat.domain.observation import Arm, Correction, FallBack, NoAction
from tests.recovery.desk import diagnosis as faulty
from tests.recovery.desk import watching
from tests.recovery.line import GOOD
from tests.recovery.rivals import by, doomed

SWING = Recurrence(("S-HOT",), 3, 40.0)


def swinging(at_s: float) -> Diagnosis:
    return replace(faulty(at_s), recurs=SWING)


def test_what_would_be_acted_on_is_left_alone_where_it_has_come_and_gone_before() -> None:
    acted = doomed(GOOD).run()
    assert by(acted), "the same diagnosis without its past is acted on"
    done = doomed(GOOD, monitoring=watching(10.0, answer=swinging)).run()
    (left,) = done.trace.of(NoActionTaken)
    assert not by(done) and left.recurs == SWING.text and left.min_margin < 0.0


def test_the_time_to_act_by_ends_and_no_reading_is_corrected() -> None:
    done = doomed(GOOD, monitoring=watching(10.0, answer=swinging)).run()
    sent = [message for _, message in done.desk.sent]
    kinds = [type(m) for m in sent if isinstance(m, Arm | NoAction)]
    assert kinds == [Arm, NoAction]
    assert [m for m in sent if isinstance(m, Correction)][-1] == Correction(())
    assert not any(isinstance(m, FallBack) for m in sent)
