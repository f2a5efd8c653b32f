"""What proposers say besides: recorded before their attempt, a person is called for a cause, and nothing changes."""

from __future__ import annotations

from dataclasses import dataclass, replace

from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.events.recovery import Remarked
from homeostat.domain.observation import Trouble
from homeostat.domain.remark import Remark, RemarkKind
from homeostat.guard.watch.alarms import Alarms, Troubles
from homeostat.record.run_record import RunRecord
from homeostat.record.story.story import Story
from tests.agents.scripted import ScriptedAction, ScriptedReprompting
from tests.recovery.line import BAD, GOOD
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
    assert [name for name, _ in done.alarms] == ["recovery:unlisted-cause:V2"] and "V2" in done.alarms[0][1]
    assert by(done) == [("talkative", GOOD.digest)], "nothing is released or refused by it"


def test_a_person_who_has_seen_one_cause_is_called_for_another_and_not_for_the_same() -> None:
    alarms = Alarms(lambda event, at_s: None)
    troubles, said = Troubles(alarms), (CAUSE, replace(CAUSE, about="J1"), CAUSE)
    talkative = replace(proposer("talkative", ScriptedAction(GOOD)), remarks=Saying(said))
    done = doomed(NoAdmissiblePlan("nothing"), others=(talkative,)).run()
    called = [trouble for _, trouble in done.sent(Trouble)]
    assert [t.name for t in called] == [f"recovery:unlisted-cause:{item}" for item in ("V2", "J1", "V2")]
    for trouble in called:
        troubles.begin(trouble, 1.0)
        alarms.acknowledge(trouble.name, "Ada", 2.0)
    assert [a.id for a in alarms.standing] == ["recovery:unlisted-cause:V2", "recovery:unlisted-cause:J1"]


def test_what_reprompting_says_is_recorded_with_the_attempt_that_it_is_about() -> None:
    remarks = Saying(())

    class Talking(ScriptedReprompting):
        async def advise(self, situation: Situation, attempt: Attempt, advice: Advice) -> Advice:
            remarks.remarks = (replace(WHY, agent="reprompting"),)
            return await super().advise(situation, attempt, advice)

    one = replace(proposer("one", ScriptedAction(BAD), attempts=1, reprompting=Talking()), remarks=remarks)
    done = doomed(NoAdmissiblePlan("nothing"), others=(one,)).run()
    assert [e.agent for e in done.trace.of(Remarked)] == ["reprompting"] and not remarks.remarks


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
