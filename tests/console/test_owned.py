"""What is kept by name in a file of its owner's: read as a whole, or refused in one line."""

from __future__ import annotations

import fcntl
import os
import threading
from pathlib import Path

import pytest

from homeostat.console.people import owned
from homeostat.console.people.owned import NotOwned, changing, mapping, replace


def kept(tmp_path: Path, content: bytes, mode: int = 0o600) -> Path:
    path = tmp_path / "kept"
    path.write_bytes(content)
    path.chmod(mode)
    return path


def test_what_is_kept_is_read_and_no_file_keeps_nothing(tmp_path: Path) -> None:
    assert mapping(kept(tmp_path, b'{"Ada": 3}'), int, "which") == {"Ada": 3}
    assert mapping(tmp_path / "none", int, "which") == {}


@pytest.mark.parametrize("content", [b"[]", b'{"Ada": "3"}', b'{"Ada": 3', b"\xff", b"", b"null", 5000 * b"["])
def test_what_says_something_else_is_refused_with_what_it_should_say(tmp_path: Path, content: bytes) -> None:
    with pytest.raises(NotOwned, match=r"kept. does not say which codes were used; remove it$"):
        mapping(kept(tmp_path, content), int, "which codes were used; remove it")


@pytest.mark.parametrize("link", [True, False])
def test_what_others_may_use_is_refused(tmp_path: Path, link: bool) -> None:
    path = kept(tmp_path, b"{}", 0o600 if link else 0o644)
    if link:
        path = tmp_path / "link"
        path.symlink_to(tmp_path / "kept")
    with pytest.raises(NotOwned) as refused:
        mapping(path, int, "which")
    assert "\n" not in str(refused.value) and path.name in str(refused.value)


def test_what_a_killed_process_left_is_in_nobodys_way(tmp_path: Path) -> None:
    """In a container the next process has the same number."""
    path, target = kept(tmp_path, b'{"Ada": 1}'), tmp_path / "target"
    target.write_bytes(b"of somebody else")
    left = tmp_path / f".kept.{os.getpid()}.partial"
    for leave in (lambda: left.write_bytes(b'{"Ada'), lambda: left.symlink_to(target)):
        leave()
        with changing(path):
            replace(path, b'{"Ada": 2}')
        assert mapping(path, int, "which") == {"Ada": 2} and not left.exists()
    assert target.read_bytes() == b"of somebody else"


def test_a_folder_that_somebody_keeps_locked_is_waited_for_and_not_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(owned, "LOCKED_S", 0.2)
    descriptor, said = os.open(tmp_path, os.O_RDONLY), list[OSError]()
    fcntl.flock(descriptor, fcntl.LOCK_SH)  # whoever may read the folder can do that

    def change() -> None:
        try:
            with changing(tmp_path / "kept"):
                replace(tmp_path / "kept", b"{}")
        except OSError as error:
            said.append(error)

    first = threading.Thread(target=change, daemon=True)
    first.start()
    first.join(20.0)
    assert not first.is_alive() and [str(error.strerror) for error in said] == [
        "another process has kept its folder locked for 0.2 s"
    ]
    os.close(descriptor)
    change()
    assert len(said) == 1 and mapping(tmp_path / "kept", int, "which") == {}
