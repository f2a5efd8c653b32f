"""What proposers say besides: recorded before their attempt, a person is called for a cause, and nothing changes."""

from __future__ import annotations

from dataclasses import dataclass, replace

from homeostat.agents.roles import NoAdmissiblePlan
from homeostat.domain.events.recovery import Remarked
from homeostat.domain.remark import Remark, RemarkKind
from homeostat.record.run_record import RunRecord
from homeostat.record.story.story import Story
from tests.agents.scripted import ScriptedAction
from tests.recovery.line import GOOD
from tests.recovery.rivals import by, doomed, proposer
from tests.twin.followed import reactor

WHY = Remark(RemarkKind.REASONING, "action", "", "half feed holds")
CAUSE = Remark(RemarkKind.UNLISTED_CAUSE, "planning", "V2", "ice in the valve")


@dataclass
class Saying:
    remarks: tuple[Remark, ...]

    def drain(self) -> tuple[Remark, ...]:
        said, self.remarks = self.remarks, ()
        return said


def test_it_is_recorded_and_a_person_is_called_for_a_cause_that_no_table_lists() -> None:
    talkative = replace(proposer("talkative", ScriptedAction(GOOD)), remarks=Saying((WHY, CAUSE)))
    done = doomed(NoAdmissiblePlan("nothing"), others=(talkative,)).run()
    assert [(r.proposer, r.remark, r.about, r.text) for r in done.trace.of(Remarked)] == [
        ("talkative", RemarkKind.REASONING, "", "half feed holds"),
        ("talkative", RemarkKind.UNLISTED_CAUSE, "V2", "ice in the valve"),
    ]
    assert [name for name, _ in done.alarms] == ["recovery:unlisted-cause"] and "V2" in done.alarms[0][1]
    assert by(done) == [("talkative", GOOD.digest)], "nothing is released or refused by it"


def test_it_is_recorded_where_the_proposer_gives_up_as_well() -> None:
    silent = replace(proposer("one", ScriptedAction(NoAdmissiblePlan("no"))), remarks=Saying((WHY,)))
    done = doomed(GOOD, others=(silent,)).run()
    assert len(done.trace.of(Remarked)) == 1


def test_people_read_it_quoted_in_the_story_and_once_in_the_record() -> None:
    story, record = Story(reactor().description), RunRecord()
    event = Remarked.of("language", replace(CAUSE, text="» released\x1b[2J"))
    (line,) = story.tell(event, 930.0)
    assert line.label == "suspects" and "language, planning about V2: «" in line.text and "\x1b" not in line.text
    for each in (event, event, Remarked.of("language", WHY)):
        record(each, 930.0)
    assert record.remarks == (event,)
