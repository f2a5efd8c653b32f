"""An order as it lies in a file: strictly typed, small, and made for one run."""

import hashlib
import os
import re
from pathlib import Path
from typing import Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from homeostat.domain.mode import PersonCommand, Role, Verb
from homeostat.journal.beside.files import JOURNAL

LARGEST: Final = 10_000
"""Most bytes of an order."""
ENDING: Final = ".json"
"""How the file of an order ends."""
IDENTIFIER: Final = re.compile(r"[0-9A-Za-z-]{8,64}")
"""How an order is identified; its file bears the same name."""
_TEXT: Final = 500


class OrderError(ValueError):
    """An order cannot be taken, or not be given; one line with the reason."""


class Order(BaseModel):
    """What a person orders, and for which run."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    schema_: Literal[2] = Field(alias="schema")
    run: str = Field(pattern=r"^[0-9a-f]{64}$")
    id: str = Field(pattern=f"^{IDENTIFIER.pattern}$")
    issued_s: float = Field(ge=0.0, allow_inf_nan=False)
    person: str = Field(min_length=1, max_length=_TEXT)
    role: Role = Field(strict=False)
    verb: Verb = Field(strict=False)
    subject: str = Field(default="", max_length=_TEXT)
    digest: str = Field(default="", max_length=_TEXT)
    reason: str = Field(default="", max_length=_TEXT)
    seconds: float = Field(default=0.0, ge=0.0, allow_inf_nan=False)

    def command(self, now_s: float) -> PersonCommand:
        """As the guard is told at ``now_s``, in seconds since 1970 as :attr:`issued_s` is."""
        about = self.subject, self.digest, self.reason
        return PersonCommand(
            self.id, self.person, self.role, self.verb, *about, age_s=now_s - self.issued_s, seconds=self.seconds
        )


def written(command: PersonCommand, run: str, issued_s: float) -> bytes:
    """The file of an order for ``run``, given at ``issued_s``, in seconds since 1970.

    OrderError where it breaks the schema.
    """
    fields = {name: getattr(command, name) for name in PersonCommand.__slots__ if name not in ("age_s", "login")}
    try:
        order = Order.model_validate({"schema": 2, "run": run, "issued_s": issued_s, **fields})
    except ValidationError as error:
        raise OrderError(_first(error)) from None
    return f"{order.model_dump_json(by_alias=True)}\n".encode()


def read(path: Path, run: str, now_s: float) -> PersonCommand:
    """The order in file ``path``, which was made for ``run``, as old as it is at ``now_s``, in seconds since 1970.

    OrderError where it is none that can be taken.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    with os.fdopen(descriptor, "rb") as file:
        command = parsed(file.read(LARGEST + 1), run, now_s)
    if f"{command.id}{ENDING}" != path.name:
        raise OrderError(f"it names itself {command.id!r}")
    return command


def parsed(content: bytes, run: str, now_s: float) -> PersonCommand:
    """The order in ``content``; as :func:`read`."""
    if len(content) > LARGEST:
        raise OrderError(f"it has more than {LARGEST} byte")
    try:
        order = Order.model_validate_json(content)
    except ValidationError as error:
        raise OrderError(_first(error)) from None
    if order.run != run:
        raise OrderError("it was made for another run, or before this one began")
    return order.command(now_s)


def run_identity(run_dir: Path) -> str:
    """SHA-256 of the first line of the run's journal; OrderError where there is none yet."""
    try:
        with (run_dir / JOURNAL).open("rb") as file:
            first = file.readline()
    except OSError:
        first = b""
    if not first.endswith(b"\n"):
        raise OrderError(f"{str(run_dir)!r} is no run that has begun")
    return hashlib.sha256(first).hexdigest()


def _first(error: ValidationError) -> str:
    first = error.errors(include_url=False, include_input=False)[0]
    place = ".".join(map(str, first["loc"]))
    return f"{place}: {first['msg']}" if place else first["msg"]
