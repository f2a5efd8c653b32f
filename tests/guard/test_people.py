"""People: roles, four eyes, replays, modes, tags in service, approvals, resets and starts; and alarms."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.alarm import Priority
from homeostat.domain.events.guard import SequenceLoaded
from homeostat.domain.events.people import AlarmAcknowledged, AlarmRaised, ModeEntered, PersonHeard
from homeostat.domain.events.trips import FallbackStands, LatchReset
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.mode import Mode, PersonCommand, Role, Side, Verb
from homeostat.domain.observation import Arm, Correction, FallBack, StandBack, Withdraw
from homeostat.domain.recovery import Command
from homeostat.guard.settings import GuardSettings
from homeostat.guard.watch.alarms import Alarms
from tests.guard.vessel import ADJUSTED, CLOSE, DRAIN, RULES, Vessel, World, finding, running, statuses

NUMBER = itertools.count()


def tell(world: World, verb: Any, subject: Any = "", **rest: Any) -> PersonHeard:
    """Order something and let a tick pass; what the guard said of it."""
    fields: dict[str, Any] = {"id": f"order-{next(NUMBER)}", "person": "Ada", "role": Role.ENGINEER} | rest
    world.guard.mailbox.put(PersonCommand(verb=verb, subject=subject, **fields))
    world.tick()
    heard = world.journal.of(PersonHeard)[-1]
    assert isinstance(heard, PersonHeard)
    return heard


def latched() -> World:
    world = running()
    world.tick(4, L=14.0)
    assert world.journal.of(FallbackStands)
    world.vessel.values["L"] = 8.0
    world.tick(3)
    return world


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"role": Role.OPERATOR}, "only an engineer may order 'reset'"),
        ({"reason": " "}, "needs a reason"),
        ({"person": "  "}, "the name of a person"),
        ({"id": ""}, "an identifier"),
        ({"person": 7}, "the person of an order is a plain text"),
        ({"id": "x" * 201}, "at most 200 characters"),
        ({"reason": "x" * 501}, "a reason of at most 500"),
        ({"role": "engineer"}, "there is no order"),
        ({"verb": "reset"}, "there is no order"),
        ({"verb": Verb.MODE, "subject": "manual"}, "there is no mode 'manual'; there are observe,"),
        ({"verb": Verb.MODE, "subject": "aprove"}, "there is no mode 'aprove'; did you mean 'approve', 'advise'?"),
        ({"verb": Verb.ACKNOWLEDGE, "subject": "latchd"}, "there is no alarm 'latchd'; did you mean 'latched'?"),
        ({"verb": Verb.FALL_BACK, "reason": "now"}, "a fallback has acted already"),
        ({"verb": Verb.MODE, "subject": "closed-loop"}, "a fallback is latched; reset it first"),
        ({"verb": Verb.IN_SERVICE, "subject": "T"}, "'T' is not writable"),
        ({"verb": Verb.IN_SERVICE, "subject": "T.spp"}, "there is no tag 'T.spp'; did you mean 'T.sp'"),
        ({"verb": Verb.IN_SERVICE, "subject": "T.sp"}, "'T.sp' is in service already"),
        ({"verb": Verb.APPROVE, "subject": "r1"}, "no request 'r1' waits for a person; none does"),
        ({"verb": Verb.REJECT, "subject": "r1"}, "no request 'r1' waits"),
        ({"verb": Verb.START, "subject": "restart"}, "a fallback is latched; reset it first"),
    ],
)
def test_an_order_that_is_not_carried_out_says_why(changed: dict[str, Any], why: str) -> None:
    world = latched()
    heard = tell(world, **({"verb": Verb.RESET, "reason": "seen"} | changed))
    assert not heard.done and why in heard.reason
    assert world.guard.latched is not None


def test_an_order_is_carried_out_once() -> None:
    world = running()
    assert tell(world, Verb.OUT_OF_SERVICE, "T.sp", id="one", reason="repair").done
    assert tell(world, Verb.IN_SERVICE, "T.sp", id="two").done
    heard = tell(world, Verb.OUT_OF_SERVICE, "T.sp", id="one", reason="repair")
    assert not heard.done and "was answered already" in heard.reason
    assert world.guard.out_of_service == frozenset()


def test_a_reset_needs_a_confirmed_fallback_names_the_state_and_stands_in_observe() -> None:
    world = running()
    world.vessel.ignores = True
    world.tick(3, L=14.0)
    heard = tell(world, Verb.RESET, reason="in a hurry")
    assert not heard.done and "not confirmed by the plant yet" in heard.reason
    world = latched()
    assert tell(world, Verb.RESET, reason="valve repaired").done
    reset = world.journal.of(LatchReset)[0]
    assert (reset.persons, reset.reason, reset.state) == (("Ada",), "valve repaired", "shut")
    assert world.guard.latched is None and world.guard.mode is Mode.OBSERVE
    assert world.vessel.given_back == 1 and "latched" not in world.alarms
    world.vessel.wire.clear()
    world.ask()
    world.tick(5)
    assert world.sent == []
    assert not tell(world, Verb.RESET, reason="again").done


def test_a_reset_after_a_shed_is_possible() -> None:
    world = running()
    world.vessel.ignores = True
    world.tick(40, L=14.0)
    assert "shed" in world.alarms
    assert tell(world, Verb.RESET, reason="by hand").done
    assert "shed" not in world.alarms


def test_two_people_agree_within_their_time_and_one_person_is_one() -> None:
    world = running(settings=GuardSettings(persons=2, person_s=20.0, sync_s=5.0))
    world.tick(6, L=14.0)
    heard = tell(world, Verb.RESET, reason="seen", person="Ada")
    assert (heard.done, heard.missing) == (False, 1)
    assert heard.reason == "1 of 2 people; another person must order it too"
    again = tell(world, Verb.RESET, reason="seen", person=" ADA ")
    assert (again.done, again.missing) == (False, 1)
    assert not tell(world, Verb.RESET, reason="seen", person="Ａda").done
    world.tick(25)
    assert not tell(world, Verb.RESET, reason="seen", person="Bo").done  # Ada's word is old
    last = tell(world, Verb.RESET, reason="seen", person="Ada")
    assert (last.done, last.missing) == (True, 0)
    assert set(world.journal.of(LatchReset)[0].persons) == {"Bo", "Ada"}


def test_a_login_that_types_two_names_is_one_person() -> None:
    world = running(settings=GuardSettings(persons=2, person_s=600.0, sync_s=5.0))
    world.tick(6, L=14.0)

    def order(person: str, login: str) -> PersonHeard:
        name = f"order-{person}-{login}"
        world.guard.mailbox.put(PersonCommand(name, person, Role.ENGINEER, Verb.RESET, reason="seen", login=login))
        world.tick()
        return world.journal.of(PersonHeard)[-1]

    for person in ("Ada (login ops)", "Bo (login ops)", "ops", "Cem (login ops)"):
        heard = order(person, "ops")
        assert (heard.done, heard.missing) == (False, 1), person
        assert heard.reason == (
            "1 of 2 people; another person must order it too; all who order as login 'ops' are one person"
        )
    assert order("Bo (login eng)", "eng").done
    assert len(world.journal.of(LatchReset)[0].persons) == 2


def test_a_login_is_no_name() -> None:
    world = running(settings=GuardSettings(persons=2, person_s=600.0, sync_s=5.0))
    world.tick(6, L=14.0)
    for number, (person, login) in enumerate((("login ops", ""), ("x", "ops"))):
        world.guard.mailbox.put(
            PersonCommand(f"o-{number}", person, Role.ENGINEER, Verb.RESET, reason="r", login=login)
        )
        world.tick()
    assert world.journal.of(PersonHeard)[-1].done, "two people, and neither is taken for the other"


def test_the_way_back_is_a_start_by_an_engineer_under_every_check() -> None:
    world = latched()
    assert tell(world, Verb.RESET, reason="repaired").done
    assert tell(world, Verb.START, "restart").reason == "a start needs a mode that writes; this one is 'observe'"
    assert tell(world, Verb.MODE, "closed-loop").done
    why = tell(world, Verb.START, "adjust").reason
    assert why == "'adjust' does not leave state 'shut', but 'running'; from here lead restart"
    why = tell(world, Verb.START, "restrt").reason
    assert why == "there is no transition 'restrt'; did you mean 'restart'?"
    world.vessel.values["T"] = 312.0
    world.tick(8)
    assert "'T <= 311' does not hold" in tell(world, Verb.START, "restart").reason
    world.vessel.values["T"] = 305.0
    world.tick(8)
    tell(world, Verb.OUT_OF_SERVICE, "F.sp", reason="hand")
    assert "'F.sp' is out of service" in tell(world, Verb.START, "restart").reason
    tell(world, Verb.IN_SERVICE, "F.sp")
    world.vessel.wire.clear()
    world.vessel.values["L"] = 1.0
    world.tick(1)
    assert "only an engineer" in tell(world, Verb.START, "restart", role=Role.OPERATOR).reason
    assert tell(world, Verb.START, "restart").done
    world.tick(2)
    assert world.sent[0] == (
        Command("T.sp", 310.0, 0.5), Command("F.sp", 0.0, 0.005), Command("X.cmd", 1.0, None),
        Command("V.man", None, None),
    )  # fmt: skip
    assert world.seen[-1].state == "waiting"
    assert world.journal.of(WriteIntended)[-1].cause.value == "person"
    world.tick(3, L=8.0)
    assert world.seen[-1].state == "running"


def test_a_start_that_the_plant_does_not_take_leaves_the_state() -> None:
    world = latched()
    tell(world, Verb.RESET, reason="repaired")
    tell(world, Verb.MODE, "closed-loop")
    world.vessel.raises = True
    loads = len(world.journal.of(SequenceLoaded))
    assert tell(world, Verb.START, "restart").done
    world.tick(6)
    assert world.seen[-1].state == "shut" and len(world.journal.of(SequenceLoaded)) == loads
    assert "write:person" in world.alarms


def test_in_approve_a_request_waits_for_a_yes_that_is_bound_to_its_digest() -> None:
    world = running(mode=Mode.APPROVE)
    asked = world.ask()
    world.tick(2)
    assert statuses(world) == ["authorised", "offered"] and world.guard.offered == (asked,)
    assert "digest is not that" in tell(world, Verb.APPROVE, "r1", digest="0" * 64).reason
    assert world.sent == []
    heard = tell(world, Verb.APPROVE, "r1", digest=asked.actions.digest, role=Role.OPERATOR)
    assert heard.done
    world.tick()
    assert world.sent == [ADJUSTED.commands] and statuses(world)[-1] == "confirmed"
    assert "no request 'r1' waits" in tell(world, Verb.APPROVE, "r1", digest=asked.actions.digest).reason


def test_what_was_approved_is_verified_again() -> None:
    world = running(mode=Mode.APPROVE)
    asked = world.ask()
    world.tick()
    world.vessel.values["L"] = 11.5
    heard = tell(world, Verb.APPROVE, "r1", digest=asked.actions.digest)
    assert (world.sent == [] and finding(world) == "PRM-FEED" and "no request 'r1'" in heard.reason) or heard.done


def test_no_is_an_answer() -> None:
    world = running(mode=Mode.APPROVE)
    world.ask()
    world.tick()
    assert tell(world, Verb.REJECT, "r1", reason="not now", role=Role.OPERATOR).done
    assert finding(world) == "CHK-PERSON" and "Ada: not now" in world.seen[-1].answers[-1].reason


def test_an_offer_expires() -> None:
    world = running(mode=Mode.APPROVE)
    world.ask()
    world.tick(32)
    assert statuses(world)[-1] == "refused" and finding(world) == "CHK-EXPIRY" and world.guard.offered == ()


def test_a_mode_change_withdraws_what_was_asked_and_takes_or_gives_back_the_lease() -> None:
    world = running(mode=Mode.APPROVE)
    world.ask()
    world.tick()
    assert tell(world, Verb.MODE, "observe").done
    assert statuses(world)[-1] == "withdrawn" and world.vessel.given_back == 1
    beats = len(world.vessel.beats)
    world.tick(3)
    assert len(world.vessel.beats) == beats
    assert tell(world, Verb.MODE, "closed-loop", reason="go").done
    assert world.vessel.leases == 2
    entered = world.journal.of(ModeEntered)[-1]
    assert (entered.mode, entered.person, entered.reason) == ("closed-loop", "Ada", "go")


def test_a_plant_that_is_only_observed_enters_no_mode_that_writes() -> None:
    world = World(mode=Mode.OBSERVE, lease=None)
    world.tick(2)
    assert "only observed" in tell(world, Verb.MODE, "approve").reason and world.guard.mode is Mode.OBSERVE
    world = World(lease=None)
    world.tick(2)
    assert world.guard.mode is Mode.OBSERVE and "mode" in world.alarms


def test_in_advise_a_request_is_shown_and_nothing_is_written() -> None:
    world = running(mode=Mode.ADVISE, rules=replace(RULES, recipe=Side.PLANT))
    world.ask()
    world.tick(2)
    assert statuses(world) == ["authorised", "advised"] and world.sent == [] and world.vessel.leases == 0


def test_a_fallback_is_sent_until_it_stands_though_a_person_changes_the_mode() -> None:
    world = running()
    world.vessel.ignores = True
    world.tick(2, L=14.0)
    assert tell(world, Verb.MODE, "observe").done
    world.tick(2)
    assert world.vessel.given_back == 0
    world.vessel.ignores = False
    world.tick(8)
    assert len(world.journal.of(FallbackStands)) == 1 and world.vessel.given_back == 1


def test_a_person_may_order_the_fallback() -> None:
    world = running()
    world.ask(name="late", actions=ADJUSTED)
    assert tell(world, Verb.FALL_BACK, reason="smoke", role=Role.OPERATOR).done
    assert world.sent == [DRAIN.actions.commands] and world.guard.latched == "ordered by Ada: smoke"
    assert statuses(world, "late")[-1] == "withdrawn"
    world = running(mode=Mode.ADVISE)
    assert "nobody writes" in tell(world, Verb.FALL_BACK, reason="smoke").reason


def test_recovery_may_ask_for_the_fallback_and_rank_it() -> None:
    world = running()
    world.guard.mailbox.put(Arm(("close", "nonsense")))
    world.tick()
    assert [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == "arming"] == [
        "there is no fallback 'nonsense'"
    ]
    world.guard.mailbox.put(FallBack("nothing to release"))
    world.tick()
    assert world.sent == [CLOSE.actions.commands]
    world.guard.mailbox.put(Arm(("drain",)))
    world.guard.mailbox.put(FallBack("once more"))
    world.tick(3)
    assert len(world.sent) == 1


def test_a_fallback_acts_at_its_time_unless_a_request_was_confirmed() -> None:
    world = running()
    world.guard.mailbox.put(Arm((), 8.0))
    world.tick(3)
    assert world.sent == []
    world.tick()
    assert world.sent == [DRAIN.actions.commands]
    world = running()
    world.guard.mailbox.put(Arm((), 8.0))
    world.ask()
    world.tick(8)
    assert world.sent == [ADJUSTED.commands] and world.guard.latched is None
    world = running()
    world.guard.mailbox.put(Arm((), 6.0))
    world.vessel.ignores = True
    world.ask()
    world.tick(12)
    assert world.guard.latched == "recovery has not acted in the time that physics leaves"


@pytest.mark.parametrize(
    "message", [7, None, "stop", Correction(3), Arm(("drain",), float("nan")), Arm(3), Withdraw("r9", "")]
)  # type: ignore[arg-type]
def test_a_message_may_be_anything(message: Any) -> None:
    world = running()
    world.guard.mailbox.put(message)
    world.ask()
    world.tick(2)
    assert statuses(world)[-1] == "confirmed"
    said = [e for e in world.journal.of(AlarmRaised) if e.alarm == "mailbox"]
    assert len(said) == (0 if isinstance(message, Withdraw) else 1)


def test_an_issuer_may_give_up() -> None:
    world = running(mode=Mode.APPROVE)
    world.ask()
    world.tick()
    world.guard.mailbox.put(Withdraw("r1", "something better was found"))
    world.tick()
    assert statuses(world)[-1] == "withdrawn" and "something better" in world.seen[-1].answers[-1].reason


def test_a_moved_tag_comes_back_by_a_command_only() -> None:
    world = running()
    world.vessel.accepted["V.man"] = 0.4
    world.tick(5)
    assert world.guard.out_of_service == {"V.man"}
    cause = next(a.cause for a in world.guard.alarms if a.id == "moved:V.man")
    assert cause == "somebody changed 'V.man' from automatic to 0.4"
    assert tell(world, Verb.IN_SERVICE, "V.man", role=Role.OPERATOR).done
    world.tick(3)
    assert world.guard.out_of_service == frozenset() and "moved:V.man" not in world.alarms


def test_what_the_plants_own_control_does_after_a_shed_is_nobodys_move() -> None:
    class Sheds(Vessel):
        def give_back(self) -> None:
            super().give_back()
            self.accepted.update({"F.sp": 0.03, "V.man": None})

    world = running(vessel=Sheds())
    world.vessel.ignores = True
    world.tick(20, L=14.0)
    assert "shed" in world.alarms and world.guard.out_of_service == frozenset()
    world.vessel.ignores = False
    world.tick(20)
    assert world.vessel.accepted["F.sp"] == 0.0 and world.guard._latch.standing


def test_an_alarm_is_raised_acknowledged_and_returned() -> None:
    noted: list[Any] = []
    alarms = Alarms(lambda event, at_s: noted.append(event.kind))
    alarms.raise_("a", "cause", Priority.HIGH, 1.0)
    alarms.raise_("a", "another", Priority.LOW, 2.0)
    assert noted == ["alarm-raised"] and alarms.lasts("a") and alarms.standing[0].cause == "cause"
    assert alarms.acknowledge("a", "Ada", 3.0) and alarms.standing[0].acknowledged_by == "Ada"
    alarms.return_("a", 4.0)
    alarms.return_("a", 5.0)
    assert alarms.standing == () and noted[-1] == "alarm-returned" and noted.count("alarm-returned") == 1
    alarms.say("b", "over", Priority.LOW, 6.0)
    assert not alarms.lasts("b") and alarms.standing[0].returned_s == 6.0
    alarms.return_("b", 6.5)
    assert noted.count("alarm-returned") == 2 and alarms.standing[0].returned_s == 6.0
    alarms.raise_("b", "again", Priority.LOW, 7.0)
    assert alarms.lasts("b") and alarms.standing[0].raised_s == 7.0
    alarms.return_("b", 8.0)
    assert alarms.acknowledge("b", "Ada", 9.0) and alarms.standing == ()
    assert not alarms.acknowledge("b", "Ada", 10.0)


def test_a_person_acknowledges_by_an_order() -> None:
    world = latched()
    assert tell(world, Verb.ACKNOWLEDGE, "latched", role=Role.OPERATOR).done
    assert world.journal.of(AlarmAcknowledged)[-1].person == "Ada"


def test_a_reset_needs_a_plant_that_answers() -> None:
    world = running()
    world.tick(5, L=14.0)
    world.silent(20)
    world.order(Verb.RESET, reason="all is well")
    world.silent()
    assert world.guard.latched is not None


def test_of_three_people_everybody_is_told_how_many_are_missing() -> None:
    world = running(settings=GuardSettings(persons=3, person_s=60.0, sync_s=5.0))
    world.tick(6, L=14.0)
    said = [tell(world, Verb.RESET, reason="seen", person=person) for person in ("Ada", "Bo", "Cem")]
    assert [(h.done, h.missing) for h in said] == [(False, 2), (False, 1), (True, 0)]
    assert said[0].reason == "1 of 3 people; 2 other people must order it too"
    assert said[1].reason == "2 of 3 people; another person must order it too"


def test_closed_loop_needs_as_many_people_as_a_reset_and_less_needs_one() -> None:
    world = running(mode=Mode.OBSERVE, settings=GuardSettings(persons=2, person_s=20.0, sync_s=5.0))
    assert tell(world, Verb.MODE, "approve").done and world.guard.mode is Mode.APPROVE
    first = tell(world, Verb.MODE, "closed-loop", reason="quiet", person="Ada")
    assert (first.done, first.missing) == (False, 1) and world.guard.mode is Mode.APPROVE
    assert first.reason == "1 of 2 people; another person must order it too"
    assert not tell(world, Verb.MODE, "closed-loop", person="ada ").done
    world.tick(25)
    assert not tell(world, Verb.MODE, "closed-loop", person="Bo").done  # Ada's word is old
    last = tell(world, Verb.MODE, "closed-loop", reason="go", person="Ada")
    assert (last.done, last.missing) == (True, 0) and world.guard.mode is Mode.CLOSED_LOOP
    assert world.journal.of(ModeEntered)[-1].person == "Bo and Ada"
    assert tell(world, Verb.MODE, "observe").done and world.guard.mode is Mode.OBSERVE


def test_who_agreed_to_closed_loop_before_another_mode_or_a_reset_has_not_agreed_after_it() -> None:
    settings = GuardSettings(persons=2, person_s=600.0, sync_s=5.0)
    world = running(mode=Mode.APPROVE, settings=settings)
    assert tell(world, Verb.MODE, "closed-loop", person="Ada").missing == 1
    assert tell(world, Verb.MODE, "advise", person="Cem").done
    assert tell(world, Verb.MODE, "closed-loop", person="Bo").missing == 1
    world.guard.mailbox.put(StandBack("the connection was lost"))
    world.tick()
    assert tell(world, Verb.MODE, "approve", person="Bo").done
    assert tell(world, Verb.MODE, "closed-loop", person="Ada").missing == 1
    world.tick(6, L=14.0)
    assert tell(world, Verb.MODE, "closed-loop", person="Bo").reason == "a fallback is latched; reset it first"
    assert tell(world, Verb.RESET, reason="seen", person="Ada").missing == 1
    assert tell(world, Verb.RESET, reason="seen", person="Bo").done
    assert tell(world, Verb.MODE, "closed-loop", person="Bo").missing == 1


def test_an_agreement_to_a_reset_is_none_to_closed_loop() -> None:
    world = running(settings=GuardSettings(persons=2, person_s=600.0, sync_s=5.0))
    world.tick(6, L=14.0)
    assert tell(world, Verb.RESET, reason="seen", person="Ada").missing == 1
    assert tell(world, Verb.RESET, reason="seen", person="Bo").done
    assert tell(world, Verb.MODE, "closed-loop", person="Bo").missing == 1
    assert tell(world, Verb.MODE, "closed-loop", person="Ada").done


def test_a_note_is_shown_to_proposers_for_an_hour_and_decides_nothing() -> None:
    world = running()
    assert tell(world, Verb.NOTE).reason == "'note' needs a reason"
    for text in ("one", "two", "three", "four"):
        assert tell(world, Verb.NOTE, reason=text).done
    seen = world.tick()
    assert seen.notes == ("four", "three", "two") and seen.mode is Mode.CLOSED_LOOP and seen.answers == ()
    assert not tell(world, Verb.NOTE, reason="x" * 10_000).done
    world.tick(3600)
    assert world.tick().notes == ()
