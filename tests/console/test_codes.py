"""The second factor: a code is taken once, guessing is slow, and whoever must have one and has none stays out."""

from __future__ import annotations

import json
import subprocess
import threading
from pathlib import Path

import pytest

pytest.importorskip("pyotp", reason="the extra 'console' is not installed")

from homeostat.console.people.accounts import Access, Accounts, AccountsError, Asked
from homeostat.console.people.changes import enrolled, required
from homeostat.console.people.codes import DRIFT, STEP_S, Codes, CodesError, fresh
from homeostat.console.people.guesses import Guesses
from homeostat.console.people.people import WRONG_WITH_CODES, People, Unproven
from homeostat.console.people.sessions import Sessions
from homeostat.console.people.tries import FREE
from tests.cli.command import COMMAND, environment, homeostat, refused
from tests.console.served import PASSWORD, accounts, code_of

SECRET = "GEZDGNBVGY3TQOJQGEZDGNBVGY3TQOJQ"
"""The ASCII key 12345678901234567890 of RFC 6238, appendix B."""


class Clock:
    now = 1_111_111_109.0

    def __call__(self) -> float:
        return self.now


class Desk:
    """People of whom Ada has a second factor, and a clock."""

    def __init__(self, folder: Path) -> None:
        self.path = accounts(folder / "people.json", Ada="engineer", Bo="operator", Vi="viewer")
        enrolled(self.path, "Ada", SECRET)
        self.clock, self.said = Clock(), list[str]()
        self.people = self.begun()

    def begun(self) -> People:
        """A console that begins, on the same accounts."""
        codes = Codes(self.path, self.clock)
        return People(Accounts(self.path), Sessions(self.clock), Guesses(self.clock), self.said.append, codes)

    def enter(self, name: str, code: str = "", password: str | None = None) -> str:
        """Sign in; the session's token."""
        return self.people.sign_in(name, password or PASSWORD.format(name), f"from {name}", code)[0]


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path)


@pytest.mark.parametrize(
    ("at_s", "code"),
    [(59, "287082"), (1111111109, "081804"), (1111111111, "050471"), (1234567890, "005924"), (2000000000, "279037"),
     (20000000000, "353130")],
)  # fmt: skip
def test_codes_are_those_of_the_standard(tmp_path: Path, at_s: int, code: str) -> None:
    desk = Desk(tmp_path)
    desk.clock.now = float(at_s)
    assert desk.people.session(desk.enter("Ada", code)) is not None


def test_without_the_code_the_password_is_nothing(desk: Desk) -> None:
    for code in ("", "081805", "81804", "0818040", "8180 4", "०८१८०४"):
        with pytest.raises(Unproven, match="do not belong together") as refusal:
            desk.enter("Ada", code)
        assert str(refusal.value) == WRONG_WITH_CODES
        desk.clock.now += 0.01
        desk.people = desk.begun()
    with pytest.raises(Unproven) as refusal:
        desk.enter("Ada", "081804", "not the password")
    assert str(refusal.value) == WRONG_WITH_CODES, "nobody learns which of the two was wrong"
    assert desk.people.session(desk.enter("Ada", "081 804")) is not None
    assert desk.people.session(desk.enter("Bo")) is not None, "whoever has none needs none"


def test_a_code_is_taken_once_also_after_a_restart_and_by_two_consoles_at_once(desk: Desk) -> None:
    token = desk.enter("Ada", "081804")
    desk.people.sign_out(token)
    for again in (desk.people, desk.begun()):
        with pytest.raises(Unproven, match="do not belong"):
            again.sign_in("Ada", PASSWORD.format("Ada"), "here", "081804")
    assert any("was used" in line for line in desk.said)
    desk.clock.now += STEP_S
    account = Accounts(desk.path).of("Ada")
    assert account is not None
    codes, taken = [Codes(desk.path, desk.clock) for _ in range(8)], list[bool]()
    code = code_of(SECRET, desk.clock.now)
    threads = [threading.Thread(target=lambda c=c: taken.append(c.accept(account, code))) for c in codes]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(taken) == [False] * 7 + [True]


def test_clocks_may_differ_by_a_step_and_no_earlier_code_follows_a_later_one(desk: Desk) -> None:
    account = Accounts(desk.path).of("Ada")
    assert account is not None
    now, codes = desk.clock.now, Codes(desk.path, desk.clock)
    for off in (-DRIFT - 1, DRIFT + 1):
        assert not codes.accept(account, code_of(SECRET, now + off * STEP_S))
    assert codes.accept(account, code_of(SECRET, now - STEP_S)) and codes.accept(account, code_of(SECRET, now + STEP_S))
    assert not codes.accept(account, code_of(SECRET, now)), "a later one was used"


def test_what_is_kept_of_codes_says_nothing_of_the_secret_and_is_its_owners(desk: Desk) -> None:
    desk.enter("Ada", "081804")
    kept = desk.path.with_name("people.json.codes")
    assert kept.stat().st_mode & 0o777 == 0o600 and SECRET not in kept.read_text() and "Ada" not in kept.read_text()
    kept.chmod(0o644)
    desk.clock.now += STEP_S
    with pytest.raises(Unproven, match="codes cannot be checked"):
        desk.enter("Ada", code_of(SECRET, desk.clock.now))
    kept.chmod(0o600)
    for broken in ("", "[]", '{"x": "y"}', "\x00"):
        kept.write_text(broken)
        with pytest.raises(CodesError, match="remove it"):
            desk.begun()


def test_whoever_knows_the_password_guesses_codes_slowly_until_the_password_is_another(desk: Desk) -> None:
    for k in range(FREE + 12):
        account = Accounts(desk.path).of("Ada")
        assert account is not None
        desk.people._codes.accept(account, f"{k:06}")
    with pytest.raises(Unproven, match="too many failed tries") as waits:
        desk.enter("Ada", "081804")
    assert 200.0 < waits.value.wait_s <= 300.0
    assert desk.people.session(desk.enter("Bo")) is not None, "nobody else waits"
    accounts(desk.path, Ada="engineer")
    assert desk.people.session(desk.enter("Ada", "081804")) is not None, "a new password, the same second factor"


def test_a_new_password_is_no_way_around_it_and_a_changed_factor_ends_sessions(desk: Desk) -> None:
    accounts(desk.path, Ada="operator")
    with pytest.raises(Unproven):
        desk.enter("Ada")
    token = desk.enter("Ada", "081804")
    enrolled(desk.path, "ada", None)
    assert desk.people.session(token) is None
    assert desk.people.session(desk.enter("Ada")) is not None


def test_whoever_may_order_can_be_made_to_have_one(desk: Desk) -> None:
    before = desk.enter("Bo")
    required(desk.path, Asked.ORDERING)
    assert desk.people.session(before) is None, "it counts at once"
    with pytest.raises(Unproven, match="'Bo' needs a second factor"):
        desk.enter("Bo")
    with pytest.raises(Unproven, match="do not belong"):
        desk.enter("Bo", password="not the password")
    assert desk.people.session(desk.enter("Vi")) is not None
    required(desk.path, Asked.EVERYBODY)
    with pytest.raises(Unproven, match="'Vi' needs"):
        desk.enter("Vi")
    required(desk.path, Asked.NOBODY)
    assert desk.people.session(desk.enter("Bo")) is not None


def test_files_of_before_are_read_and_files_without_it_say_nothing_of_it(tmp_path: Path) -> None:
    path = accounts(tmp_path / "people.json", Ada="engineer")
    said = json.loads(path.read_text())
    assert set(said) == {"schema", "people"} and set(said["people"][0]) == {"name", "access", "argon2id"}
    account = Accounts(path).of("Ada")
    assert account is not None and account.totp is None and account.access is Access.ENGINEER
    said["people"][0]["totp"] = "short"
    path.write_text(json.dumps(said))
    with pytest.raises(AccountsError, match="totp"):
        Accounts(path)


def test_the_command_enrols_whoever_shows_the_right_code(tmp_path: Path) -> None:
    path = accounts(tmp_path / "people.json", Ada="engineer", Bo="viewer")

    def enrol(*codes: str) -> tuple[subprocess.Popen[str], str]:
        command = [*COMMAND, "people", "enrol", "people.json", "ada", "--title", "Reactor 7"]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        process = subprocess.Popen(command, cwd=tmp_path, env=environment(), text=True, **pipes)  # type: ignore[call-overload]
        for line in process.stdout:
            if line.startswith("by hand: "):
                return process, line.removeprefix("by hand: ").replace(" ", "").strip()
            if line.startswith("otpauth://"):
                assert line.startswith("otpauth://totp/Reactor%207:Ada?secret=")
        raise AssertionError(process.stderr.read())

    process, secret = enrol()
    out, err = process.communicate("000000\n")
    assert process.returncode == 2 and "nothing was changed" in err and err.count("\n") == 1
    assert b"totp" not in path.read_bytes()
    process, secret = enrol()
    code = code_of(secret)
    out, err = process.communicate(f"000000\n{code}\n")
    assert (process.returncode, err) == (0, "") and out.endswith("Ada: enrolled\n")
    with pytest.raises(Unproven):
        People(Accounts(path), log=lambda text: None).sign_in("Ada", PASSWORD.format("Ada"), "here", code)
    assert homeostat("people", "list", "people.json", cwd=tmp_path).out.splitlines() == [
        "engineer  Ada, with a second factor", "viewer    Bo",
    ]  # fmt: skip
    done = homeostat("people", "require", "people.json", "everybody", cwd=tmp_path)
    assert done.out == "a second factor is asked of everybody; not yet enrolled: Bo\n"
    assert "Bo, may not sign in" in homeostat("people", "list", "people.json", cwd=tmp_path).out
    assert homeostat("people", "unenrol", "people.json", "ADA", cwd=tmp_path).status == 0
    assert b"totp" not in path.read_bytes()
    refused(homeostat("people", "enrol", "people.json", "Zoe", cwd=tmp_path), "no account of 'Zoe'")
    refused(homeostat("people", "unenrol", "people.json", "Zoe", cwd=tmp_path), "no account of 'Zoe'")
    refused(homeostat("people", "require", "none.json", "nobody", cwd=tmp_path), "none.json", "people add")


def test_a_secret_is_never_the_same() -> None:
    assert len({fresh() for _ in range(100)}) == 100 and len(fresh()) == 32
