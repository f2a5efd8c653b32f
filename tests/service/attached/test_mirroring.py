"""What the plant's own people see of the guard, and what comes back: alarms, acknowledgements, a recipe that waits."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import pytest

from homeostat.domain.alarm import Alarm, Priority
from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.observation import Settled, Trouble
from homeostat.links.errors import LinkError
from homeostat.service.attached.mirroring import LISTED, LONGEST, OPERATORS, WAITS, Mirror, shown

HOT = Alarm("trip:HOT", "T1 is 314 K, 313 K are allowed", Priority.CRITICAL, 10.0)
LATE = Alarm("link", "no sample came", Priority.HIGH, 12.0)


@dataclass
class List:
    """The plant's side, with a list and a recipe; it may refuse, and it may hang."""

    trouble: str = ""
    connections: int = 1
    text: str = "from before"
    acknowledged: bool = True
    held: bool | None = False
    refuses: bool = False
    lets: threading.Event = field(default_factory=threading.Event)
    written: list[object] = field(default_factory=list)

    def raise_alarm(self, text: str, seen: bool = False) -> None:
        self._take((text, seen))
        self.text, self.acknowledged = text, seen or not text

    def hold(self, on: bool) -> None:
        self._take(on)
        self.held = on if self.held is not None else None

    def _take(self, what: object) -> None:
        self.lets.wait(20.0)
        if self.refuses:
            raise LinkError("BadUserAccessDenied")
        self.written.append(what)


@contextmanager
def mirrored(plant: List, settles_s: float = 0.0) -> Iterator[tuple[Mirror, list[object]]]:
    told: list[object] = []
    plant.lets.set()
    mirror = Mirror(plant, told.append, lists=True, holds=True, settles_s=settles_s)
    try:
        yield mirror, told
    finally:
        mirror.close()


def soon(holds: Callable[[], object]) -> None:
    end = time.monotonic() + 15.0
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_the_most_urgent_come_first_and_who_acknowledges_has_seen_what_fits() -> None:
    many = [replace(LATE, id=f"a{n}", raised_s=float(n)) for n in range(100)]
    made = shown((*many, HOT))
    assert made.text.startswith("critical trip:HOT: T1 is 314 K") and len(made.text) <= LONGEST
    assert made.text.endswith("more") and len(made.alarms) < 20 and ("trip:HOT", 10.0) in made.alarms
    assert not made.seen and shown((replace(HOT, acknowledged_by="Ada"),)).seen
    assert shown((replace(HOT, cause="x" * 900),)).text[: LONGEST + 1] == shown((replace(HOT, cause="x" * 900),)).text
    assert shown(()).text == "" and shown((replace(HOT, id=LISTED),)).text == "", "it does not speak of itself"


@pytest.mark.slow
def test_alarms_stand_there_and_what_is_acknowledged_there_is_ordered_here_once() -> None:
    plant = List()
    with mirrored(plant) as (mirror, told):
        mirror.look((), False, Mode.OBSERVE)
        soon(lambda: plant.text == "")
        mirror.look((HOT,), False, Mode.OBSERVE)
        assert told == [], "what was acknowledged before is no word on this"
        soon(lambda: "trip:HOT" in plant.text)
        mirror.look((HOT,), False, Mode.OBSERVE)
        plant.acknowledged = True
        for _ in range(3):
            mirror.look((HOT, LATE), False, Mode.OBSERVE)
        (order,) = told
        assert isinstance(order, PersonCommand) and order.verb is Verb.ACKNOWLEDGE and order.subject == "trip:HOT"
        assert order.person == OPERATORS and order.role is Role.OPERATOR
        soon(lambda: "link" in plant.text)
        assert not plant.acknowledged, "there is something new"
        mirror.look(
            (replace(HOT, acknowledged_by=OPERATORS), replace(LATE, acknowledged_by="Ada")), False, Mode.OBSERVE
        )
        soon(lambda: plant.acknowledged)
        mirror.look((), False, Mode.OBSERVE)
        soon(lambda: plant.text == "")
        assert len(told) == 1


def test_the_same_alarm_again_is_another_one() -> None:
    plant = List()
    with mirrored(plant) as (mirror, told):
        mirror.look((HOT,), False, Mode.OBSERVE)
        soon(lambda: "trip:HOT" in plant.text)
        mirror.look((HOT,), False, Mode.OBSERVE)
        plant.acknowledged = True
        mirror.look((replace(HOT, raised_s=99.0),), False, Mode.OBSERVE)
        assert told == []
        soon(lambda: not plant.acknowledged)


def test_an_acknowledgement_of_the_text_before_is_no_word_on_this_one() -> None:
    plant = List()
    with mirrored(plant, settles_s=0.3) as (mirror, told):
        mirror.look((HOT,), False, Mode.OBSERVE)
        soon(lambda: "trip:HOT" in plant.text)
        late = [False, True, False]  # the click on what stood there before arrives after our text
        for said in late:
            plant.acknowledged = said
            mirror.look((HOT,), False, Mode.OBSERVE)
        assert told == []
        time.sleep(0.3)
        for said in (False, True):
            plant.acknowledged = said
            mirror.look((HOT,), False, Mode.OBSERVE)
        assert len(told) == 1


@pytest.mark.slow
def test_who_acknowledges_before_the_text_can_be_read_is_asked_again() -> None:
    plant = List()
    with mirrored(plant, settles_s=0.3) as (mirror, told):
        mirror.look((HOT,), False, Mode.OBSERVE)
        for _ in range(3):
            soon(lambda: "trip:HOT" in plant.text and not plant.acknowledged)
            mirror.look((HOT,), False, Mode.OBSERVE)
            plant.acknowledged = True  # with eyes shut
            time.sleep(0.4)
            mirror.look((HOT,), False, Mode.OBSERVE)
        soon(lambda: not plant.acknowledged)
        time.sleep(0.4)
        for said in (False, True):
            plant.acknowledged = said
            mirror.look((HOT,), False, Mode.OBSERVE)
        assert len(told) == 1


def test_a_plant_that_calls_everything_acknowledged_is_asked_again_once() -> None:
    plant = List()
    with mirrored(plant, settles_s=0.3) as (mirror, told):
        mirror.look((HOT,), False, Mode.OBSERVE)
        soon(lambda: "trip:HOT" in plant.text)
        plant.acknowledged = True
        time.sleep(0.4)
        mirror.look((HOT,), False, Mode.OBSERVE)
        soon(lambda: not plant.acknowledged)
        plant.acknowledged = True
        time.sleep(0.4)
        for _ in range(3):
            mirror.look((HOT,), False, Mode.OBSERVE)
            time.sleep(0.1)
        assert told == [] and plant.written.count((plant.text, False)) == 2


@pytest.mark.slow
def test_a_list_that_hangs_or_refuses_holds_no_tick_up_and_is_an_alarm() -> None:
    plant = List(refuses=True)
    with mirrored(plant) as (mirror, told):
        plant.lets.clear()
        begin = time.monotonic()
        for _ in range(200):
            mirror.look((HOT,), True, Mode.OBSERVE)
        assert time.monotonic() - begin < 1.0
        plant.lets.set()
        soon(lambda: {t.name for t in told if isinstance(t, Trouble)} == {LISTED, WAITS})
        plant.refuses = False
        soon(lambda: Settled(LISTED) in told)
        assert len(told) <= 5


def test_what_a_lost_server_forgot_is_told_again() -> None:
    plant = List()
    with mirrored(plant) as (mirror, _):
        mirror.look((HOT,), True, Mode.OBSERVE)
        soon(lambda: "trip:HOT" in plant.text and plant.held)
        plant.trouble, plant.connections, plant.text, plant.held = "lost", 2, "", None
        before = list(plant.written)
        mirror.look((HOT,), True, Mode.OBSERVE)
        time.sleep(1.5)
        assert plant.written == before
        plant.trouble, plant.connections, plant.held = "", 3, False
        mirror.look((HOT,), True, Mode.OBSERVE)
        soon(lambda: "trip:HOT" in plant.text and plant.held)


def test_a_recipe_waits_for_the_latch_in_every_mode_and_goes_on_in_one_that_writes() -> None:
    plant = List()
    with mirrored(plant) as (mirror, told):
        mirror.look((), True, Mode.OBSERVE)
        soon(lambda: plant.held is True)
        for _ in range(3):
            mirror.look((), False, Mode.OBSERVE)
        assert [t.name for t in told if isinstance(t, Trouble)] == [WAITS] and plant.held is True
        mirror.look((), False, Mode.CLOSED_LOOP)
        soon(lambda: plant.held is False)
        mirror.look((), False, Mode.CLOSED_LOOP)
        assert told[-1] == Settled(WAITS) and [w for w in plant.written if isinstance(w, bool)] == [True, False]


def test_a_recipe_that_somebody_else_lets_wait_is_left_alone() -> None:
    plant = List(held=True)
    with mirrored(plant) as (mirror, told):
        for mode in (Mode.OBSERVE, Mode.CLOSED_LOOP):
            mirror.look((), False, mode)
        time.sleep(1.5)
        assert plant.held is True
        assert [(t.name, t.priority) for t in told if isinstance(t, Trouble)] == [(WAITS, Priority.LOW)]


def test_what_the_operators_let_wait_before_a_latch_goes_on_by_them_alone() -> None:
    plant = List(held=True)
    with mirrored(plant) as (mirror, _):
        mirror.look((), True, Mode.OBSERVE)
        for _ in range(3):
            mirror.look((), False, Mode.CLOSED_LOOP)
            time.sleep(0.5)
        assert plant.held is True and not [w for w in plant.written if isinstance(w, bool)]


def test_what_goes_on_at_the_plant_and_is_held_there_again_is_theirs() -> None:
    plant = List()
    with mirrored(plant) as (mirror, _):
        mirror.look((), True, Mode.OBSERVE)
        soon(lambda: plant.held is True)
        plant.held = False
        mirror.look((), False, Mode.OBSERVE)
        plant.held = True
        for _ in range(3):
            mirror.look((), False, Mode.CLOSED_LOOP)
            time.sleep(0.5)
        assert plant.held is True and [w for w in plant.written if isinstance(w, bool)] == [True]


@dataclass
class Deaf(List):
    """A plant that takes every order to wait, and waits for nobody."""

    def hold(self, on: bool) -> None:
        self._take(on)


@pytest.mark.slow
def test_a_recipe_that_goes_on_although_it_was_told_to_wait_is_an_alarm_once() -> None:
    plant = Deaf()
    with mirrored(plant) as (mirror, told):
        deadline = time.monotonic() + 8.0
        while time.monotonic() < deadline:
            mirror.look((), True, Mode.OBSERVE)
            time.sleep(0.1)
        assert [t.name for t in told if isinstance(t, Trouble)] == [WAITS] and plant.written.count(True) > 3


def test_before_the_first_look_nothing_is_written() -> None:
    plant = List()
    with mirrored(plant):
        time.sleep(1.5)
        assert plant.text == "from before" and not plant.written


@pytest.mark.slow
def test_a_plant_that_does_not_show_its_recipe_is_told_once() -> None:
    plant = List(held=None)
    with mirrored(plant) as (mirror, _):
        for _ in range(30):
            mirror.look((), True, Mode.OBSERVE)
            time.sleep(0.1)
        assert plant.written.count(True) == 1
