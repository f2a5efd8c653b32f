"""Who may look and order: accounts, passwords, sessions, tries; each as an attacker would use it."""

from __future__ import annotations

import contextlib
import json
import os
import threading
from pathlib import Path

import pytest

pytest.importorskip("argon2", reason="the extra 'console' is not installed")

from homeostat.console.people.accounts import Access, Account, Accounts, AccountsError, check_name
from homeostat.console.people.changes import added, removed
from homeostat.console.people.guesses import AT_ONCE, HOMES, HOURLY, SPACED_S, Guess, Guesses
from homeostat.console.people.passwords import hashed, is_right
from homeostat.console.people.people import People, Unproven
from homeostat.console.people.sessions import IDLE_S, LONGEST_S, MOST, Sessions
from homeostat.console.people.tries import FREE, Tries
from homeostat.console.people.tries import MOST as NAMES
from tests.cli.command import COMMAND, environment, homeostat, refused
from tests.console.served import PASSWORD, accounts

ADA = Account(name="Ada", access=Access.ENGINEER, argon2id="$argon2id$v=19$none")


class Clock:
    now = 1000.0

    def __call__(self) -> float:
        return self.now


def test_accounts_are_for_their_owner_alone_and_keep_no_password(tmp_path: Path) -> None:
    path = accounts(tmp_path / "people.json", Ada="engineer", Bo="operator")
    assert path.stat().st_mode & 0o777 == 0o600 and b"correct horse" not in path.read_bytes()
    assert {a.name: a.access for a in Accounts(path).all().values()} == {"Ada": "engineer", "Bo": "operator"}
    hashes = [person["argon2id"] for person in json.loads(path.read_text())["people"]]
    assert all(h.startswith("$argon2id$") for h in hashes) and len(set(hashes)) == 2
    assert not list(tmp_path.glob(".*")), "nothing is left beside it"
    path.chmod(0o640)
    with pytest.raises(AccountsError, match="chmod 600"):
        Accounts(path)


def test_a_link_in_the_place_of_the_file_is_not_followed(tmp_path: Path) -> None:
    real = accounts(tmp_path / "real.json", Ada="engineer")
    (tmp_path / "people.json").symlink_to(real)
    with pytest.raises(AccountsError, match="cannot be used"):
        Accounts(tmp_path / "people.json")


@pytest.mark.parametrize(
    "content",
    [b"", b"{}", b"[]", b'{"schema":2,"people":[]}', b'{"schema":1,"people":[{"name":"A"}]}', b"\xff", b"[" * 10_000,
     b'{"schema":1,"people":[{"name":"A","access":"root","argon2id":"$argon2id$"}]}',
     b'{"schema":1,"people":[{"name":"A","access":"viewer","argon2id":"plain"}]}'],
)  # fmt: skip
def test_a_file_that_is_none_lets_nobody_in(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "people.json"
    path.write_bytes(content)
    path.chmod(0o600)
    with pytest.raises(AccountsError, match=r"is no file of accounts: \w") as refusal:
        Accounts(path)
    assert ": :" not in str(refusal.value)


def test_names_that_look_the_same_are_the_same(tmp_path: Path) -> None:
    path = tmp_path / "people.json"
    assert not added(path, ADA) and added(path, ADA.model_copy(update={"name": "ＡDA "}))
    assert len(Accounts(path).all()) == 1
    removed(path, "ada")
    with pytest.raises(AccountsError, match="has no account of 'ada'; it has nobody"):
        removed(path, "ada")


@pytest.mark.parametrize("name", ["", "  ", "a\u200bb", "a\nb\x00", "\u202eada", "x" * 61])
def test_a_name_is_seen_as_it_is(name: str) -> None:
    with pytest.raises(AccountsError, match="is no name"):
        check_name(name)


def test_many_who_add_at_once_are_all_added(tmp_path: Path) -> None:
    path = tmp_path / "people.json"
    names = [f"person {k}" for k in range(12)]
    threads = [threading.Thread(target=added, args=(path, ADA.model_copy(update={"name": n}))) for n in names]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {a.name for a in Accounts(path).all().values()} == set(names)


@pytest.mark.parametrize(
    "password", ["", "short", "x" * 129, "ada" * 4, "Ada Ada Ada Ada", "aaaaaaaaaaaa", "ababababababab"]
)
def test_a_password_that_is_guessed_first_is_refused(password: str) -> None:
    with pytest.raises(AccountsError):
        hashed(password, "Ada")


def test_only_the_password_is_the_password() -> None:
    kept = hashed("a long enough phrase ✓", "Ada")
    assert is_right("a long enough phrase ✓", kept)
    wrong = ("a long enough phrase", "", "A long enough phrase ✓", "x" * 10_000)
    assert not any(is_right(guess, kept) for guess in wrong)
    assert not is_right("a long enough phrase ✓", None) and not is_right("a password that nobody has", None)
    assert not is_right("a long enough phrase ✓", "$argon2id$v=19$broken")


def test_a_session_ends_by_itself_and_cannot_be_named_from_memory() -> None:
    clock = Clock()
    sessions = Sessions(clock)
    token, session = sessions.begin(ADA)
    assert sessions.of(token) is session and token not in str(vars(sessions)) and session.csrf != token
    clock.now += IDLE_S - 1.0
    assert sessions.of(token) is session
    clock.now += IDLE_S + 1.0
    assert sessions.of(token) is None
    token, _ = sessions.begin(ADA)
    for _ in range(int(LONGEST_S / 1000.0) + 1):
        clock.now += 1000.0
        last = sessions.of(token)
    assert last is None, "a session that is used all the time ends with the shift"


def test_many_sign_ins_of_one_person_end_sessions_of_nobody_else() -> None:
    clock = Clock()
    sessions, bo = Sessions(clock), ADA.model_copy(update={"name": "Bo"})
    others = sessions.begin(bo)[0]
    clock.now += 1.0
    tokens = []
    for name in ("Ada", "ADA ", "ＡDA") * 2 * MOST:
        tokens.append(sessions.begin(ADA.model_copy(update={"name": name}))[0])
        clock.now += 1.0
    assert [t for t in tokens if sessions.of(t)] == tokens[-MOST:], "the latest of her own, however she writes her name"
    assert sessions.of(others) is not None
    clock.now += LONGEST_S + 1.0
    sessions.begin(bo)
    assert len(vars(sessions)["_open"]) == 1, "those that are over are not kept"


def test_sessions_and_guesses_are_safe_from_many_threads() -> None:
    clock, said = Clock(), list[BaseException]()
    sessions, guesses, through = Sessions(clock), Guesses(clock), list[object]()

    def use(k: int) -> None:
        try:
            for n in range(60):
                token, session = sessions.begin(ADA.model_copy(update={"name": f"person {k} {n % 7}"}))
                assert sessions.of(token) is session and sessions.showing(session.csrf) is session
                if n % 2:
                    sessions.end(token)
                taken = guesses.take(Guess("Ada", f"198.51.100.{n}"))
                through.extend([taken] if taken else [])
        except BaseException as error:
            said.append(error)

    threads = [threading.Thread(target=use, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not said and len(through) == AT_ONCE, "nobody slips through beside another"


def test_after_some_failures_each_try_waits_longer_and_none_forever() -> None:
    clock = Clock()
    tries = Tries(clock, 40.0)
    waits = []
    for _ in range(20):
        waits.append(tries.wait_s("name ada", "address 1"))
        tries.failed("name ada", "address 1")
    assert waits[:FREE] == [0.0] * FREE and waits[FREE] == 1.0 and max(waits) == 40.0 == waits[-1]
    assert tries.wait_s("name bo", "address 1") == 40.0 and tries.wait_s("name bo", "address 2") == 0.0
    clock.now += 40.0
    assert tries.wait_s("name ada") == 0.0
    tries.succeeded("name ada")
    tries.failed("name ada")
    assert tries.wait_s("name ada") == 0.0
    for _ in range(15_000):
        tries.failed("name ada")
    assert tries.wait_s("name ada") == 40.0


@pytest.mark.parametrize("rest_s", [0.0, 60.0, 900.0, 1800.0])
def test_an_hour_has_room_for_a_hundred_guesses_at_one_account_and_of_others_for_all(rest_s: float) -> None:
    clock, made = Clock(), list[float]()
    guesses = Guesses(clock)
    home = Guess("Ada", "192.0.2.1")
    known = guesses.take(home)
    assert known is not None
    guesses.succeeded(known)
    attackers = [Guess("ADA ", f"198.51.100.{k}") for k in range(12)]
    attackers += [home, Guess("ada", home.address, signed_in=True)]
    asleep = dict.fromkeys(attackers, 0.0)
    while clock.now < 1000.0 + 3 * 3600.0:  # everybody at once, at the first moment that is allowed, or after rests
        for guess in attackers:
            while clock.now >= asleep[guess] and guesses.take(guess):
                made.append(clock.now)
            if guesses.wait_s(guess) > 30.0 and asleep[guess] <= clock.now:
                asleep[guess] = clock.now + rest_s
        clock.now += 10.0
    most = max(sum(at <= other < at + 3600.0 for other in made) for at in made[:: max(1, len(made) // 200)])
    assert most <= 100 and (rest_s > 0.0 or most >= 80)
    for another in (Guess("Bo", home.address, signed_in=True), Guess("Bo", "203.0.113.9")):
        assert guesses.wait_s(another) == 0.0


def fail(guesses: Guesses, name: str, address: str, times: int, signed_in: bool = False) -> None:
    for _ in range(times):
        assert guesses.take(Guess(name, address, signed_in)) is not None


def succeed(guesses: Guesses, name: str, address: str, signed_in: bool = False) -> None:
    taken = guesses.take(Guess(name, address, signed_in))
    assert taken is not None
    guesses.succeeded(taken)


def test_guessing_one_name_from_many_places_is_slowed_and_its_person_is_let_in_where_they_were_before() -> None:
    clock = Clock()
    guesses, home = Guesses(clock), Guess("Ada", "192.0.2.1")
    succeed(guesses, "Ada", home.address)
    through, asked = list[float](), 0
    while clock.now < 1000.0 + 3600.0:
        for k in range(40):
            asked += 1
            through.extend([clock.now] if guesses.take(Guess("ada", f"198.51.100.{k}")) else [])
        assert guesses.wait_s(home) == 0.0 and guesses.wait_s(Guess("Ada", "192.0.2.2")) <= SPACED_S
        clock.now += 15.0
    assert asked == 240 * 40 and len(through) == HOURLY
    assert [later - at for at, later in zip(through[AT_ONCE - 1 :], through[AT_ONCE:], strict=False)] == [SPACED_S] * 7


def test_who_is_right_forgives_only_what_is_their_own_and_from_where_they_are() -> None:
    clock = Clock()
    guesses = Guesses(clock)
    fail(guesses, "Bo", "192.0.2.1", FREE - 1)
    succeed(guesses, "Eve", "192.0.2.1")  # who has an account wins no more guesses at others
    succeed(guesses, "Bo", "192.0.2.9")
    assert guesses.take(Guess("Bo", "192.0.2.1")) and guesses.wait_s(Guess("Cem", "192.0.2.1")) > 0.0
    assert guesses.wait_s(Guess("Bo", "192.0.2.9")) == 0.0
    clock.now += 600.0
    succeed(guesses, "Bo", "192.0.2.1")
    assert guesses.wait_s(Guess("Cem", "192.0.2.1")) == 0.0, "what Bo mistyped there is forgiven"
    fail(guesses, "Bo", "192.0.2.1", FREE, signed_in=True)
    clock.now += 600.0
    succeed(guesses, "Bo", "192.0.2.9", signed_in=True)
    fail(guesses, "Bo", "192.0.2.9", 1, signed_in=True)
    assert guesses.wait_s(Guess("Bo", "192.0.2.9", signed_in=True)) > 0.0, "a session elsewhere forgives nothing here"


def test_a_success_takes_away_its_own_try_and_no_other() -> None:
    clock = Clock()
    guesses = Guesses(clock)
    right = guesses.take(Guess("Ada", "192.0.2.1"))
    clock.now += 100.0
    fail(guesses, "Ada", "198.51.100.1", FREE)
    for k in range(2, 6):
        fail(guesses, "Ada", f"198.51.100.{k}", FREE - 1)
    fail(guesses, "Ada", "198.51.100.6", AT_ONCE - 2 - FREE - 4 * (FREE - 1))
    assert right is not None
    guesses.succeeded(right)  # checking takes a while; others failed meanwhile
    guesses.succeeded(right)
    fail(guesses, "Ada", "198.51.100.7", 2)
    assert guesses.wait_s(Guess("Ada", "198.51.100.8")) == SPACED_S, "the others were counted, at their own times"


def test_places_of_one_person_take_no_room_from_another() -> None:
    guesses = Guesses(Clock())
    succeed(guesses, "Bo", "192.0.2.1")
    for k in range(300):
        succeed(guesses, "Ada", f"2001:db8:{k:x}::1")
    for k in range(5):
        fail(guesses, "bo", f"198.51.100.{k}", FREE)
    assert guesses.wait_s(Guess("Bo", "203.0.113.1")) > 0.0 == guesses.wait_s(Guess("Bo", "192.0.2.1"))
    assert max(map(len, vars(guesses)["_homes"].values())) == HOMES


def test_made_up_names_do_not_drive_the_failures_of_an_account_out_of_memory() -> None:
    guesses, places = Guesses(Clock()), (f"2001:db8:0:{k:x}::1" for k in range(1000))
    assert sum(guesses.take(Guess("Ada", place, known=True)) is not None for place in places) == AT_ONCE
    before_s = guesses.wait_s(Guess("Ada", "192.0.2.1", known=True))
    for number in range(NAMES + 1):
        assert guesses.take(Guess(f"nobody {number}", f"2001:db8:1:{number:x}::1"))
    assert guesses.wait_s(Guess("Ada", "192.0.2.1", known=True)) == before_s == SPACED_S
    assert len(vars(guesses)["_made_up"]) == NAMES


def test_of_whom_there_is_an_account_the_guesses_are_told(tmp_path: Path) -> None:
    guesses = Guesses(Clock())
    people = People(Accounts(accounts(tmp_path / "people.json", Ada="viewer")), guesses=guesses, log=lambda text: None)
    for name in ("ADA", "Nobody"):
        with pytest.raises(Unproven):
            people.sign_in(name, "wrong", "192.0.2.1")
    kept = vars(guesses)
    assert [*kept["_hours"]] == [("ada", False)] and [*kept["_made_up"]] == [("nobody", False)]


@pytest.mark.slow
def test_who_guesses_without_a_session_keeps_nobody_from_the_plant(tmp_path: Path) -> None:
    clock = Clock()
    known = Accounts(accounts(tmp_path / "people.json", Bo="operator"))
    people = People(known, Sessions(clock), Guesses(clock), log=lambda text: None)
    bo, right, guessed = people.sign_in("Bo", PASSWORD.format("Bo"), "192.0.2.1")[1], PASSWORD.format("Bo"), 0
    for second in range(300):
        for _ in range(3):  # an outsider at one other address
            with pytest.raises(Unproven) as refusal:
                people.sign_in("bo", "a wrong password", "198.51.100.7")
            guessed += refusal.value.wait_s == 0.0
        if second % 60 == 59:
            assert people.confirm(bo, right, "192.0.2.1").name == "Bo"
            for address in ("192.0.2.1", "203.0.113.9"):  # where he was, and where he never was
                assert people.sign_in("Bo", right, address)[1].person.name == "Bo"
        clock.now += 1.0
    assert 10 <= guessed <= 14
    for k in range(24):  # many others
        with pytest.raises(Unproven):
            people.sign_in("bo", "a wrong password", f"198.51.100.{k}")
    assert people.confirm(bo, right, "198.51.100.7").name == "Bo", "also from the address of who guesses"
    assert people.sign_in("Bo", right, "192.0.2.1")[1].person.name == "Bo"
    with pytest.raises(Unproven, match="too many failed tries"):
        people.sign_in("Bo", right, "203.0.113.10")
    for _ in range(FREE):
        with pytest.raises(Unproven, match="do not belong"):
            people.confirm(bo, "a wrong password", "192.0.2.1")
    with pytest.raises(Unproven, match="too many failed tries"):
        people.confirm(bo, right, "192.0.2.1")


def test_who_guesses_waits_also_with_the_right_password_and_also_for_nobody(tmp_path: Path) -> None:
    clock, said = Clock(), list[str]()
    known = Accounts(accounts(tmp_path / "people.json", Ada="operator"))
    people = People(known, Sessions(clock), Guesses(clock), said.append)
    for name in ("Ada", "nobody"):
        for _ in range(FREE):
            with pytest.raises(Unproven, match="do not belong together"):
                people.sign_in(name, "a wrong password", f"from {name}")
        with pytest.raises(Unproven, match="too many failed tries") as waits:
            people.sign_in(name, PASSWORD.format("Ada"), f"from {name}")
        assert waits.value.wait_s > 0.0
    assert len(said) == 2 * FREE and not any("wrong password" in line for line in said)
    clock.now += 60.0
    token, session = people.sign_in("ada", PASSWORD.format("Ada"), "here")
    assert session.person.name == "Ada" and people.session(token) is session


def test_whoever_is_changed_or_removed_is_out_at_once(tmp_path: Path) -> None:
    path = accounts(tmp_path / "people.json", Ada="engineer", Bo="operator")
    people = People(Accounts(path), log=lambda text: None)
    tokens = [people.sign_in(name, PASSWORD.format(name), "here")[0] for name in ("Ada", "Bo")]
    removed(path, "Bo")
    assert people.session(tokens[1]) is None and people.session(tokens[0]) is not None
    accounts(path, Ada="viewer")
    assert people.session(tokens[0]) is None
    token, _ = people.sign_in("Ada", PASSWORD.format("Ada"), "here")
    path.chmod(0o644)
    os.utime(path)
    assert people.session(token) is None, "a file that others can write lets nobody in"


def test_the_command_adds_lists_and_removes(tmp_path: Path) -> None:
    import subprocess

    def add(*arguments: str, password: str) -> subprocess.CompletedProcess[str]:
        command = [*COMMAND, "people", "add", "people.json", *arguments, "--password-stdin"]
        return subprocess.run(command, cwd=tmp_path, env=environment(), input=password, capture_output=True, text=True)

    done = add("Ada Lovelace", "--role", "engineer", password="correct horse battery\n")
    assert (done.returncode, done.stdout) == (0, "Ada Lovelace, engineer: added\n")
    done = add("Bo", "--role", "viewer", password="short\n")
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "12 to 128 characters" in done.stderr
    shown = homeostat("people", "list", "people.json", cwd=tmp_path)
    assert shown.out == "engineer  Ada Lovelace\n"
    assert homeostat("people", "remove", "people.json", "ada lovelace", cwd=tmp_path).status == 0
    refused(homeostat("people", "remove", "people.json", "Ada", cwd=tmp_path), "no account of 'Ada'")
    refused(homeostat("people", "list", "none.json", cwd=tmp_path), "none.json", "people add")


def test_a_log_that_takes_nothing_keeps_nobody_out(tmp_path: Path) -> None:
    path = accounts(tmp_path / "people.json", Ada="operator")
    with Path("/dev/full").open("w", encoding="ascii") as full, contextlib.suppress(OSError):
        with contextlib.redirect_stderr(full):
            _, session = People(Accounts(path)).sign_in("Ada", PASSWORD.format("Ada"), "192.0.2.1")
        assert session.person.name == "Ada"
        full.close()  # what was not written is lost, and said so
    assert full.closed
