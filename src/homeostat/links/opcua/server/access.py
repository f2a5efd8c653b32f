"""Who may do what at a served plant: trusted certificates write, names and passwords where asked, the rest reads."""

import hmac
from collections.abc import Awaitable, Callable
from typing import Any, Final, TypeAlias

from asyncua import ua
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.address_space import AddressSpace, AttributeService
from asyncua.ua.attribute_ids import AttributeIds
from asyncua.ua.status_codes import StatusCodes

READER: Final = "reader"
"""Name of a user without encryption, who never writes."""
WRITER: Final = "writer"
"""Name of a user over an encrypted channel with a trusted certificate."""


class Users:
    """Lets in who has a trusted certificate, or anybody to read where the server was started insecure."""

    def __init__(self, login: tuple[str, str] | None) -> None:
        """``login``: name and password that everybody needs; None for none."""
        self._login = login

    def get_user(
        self, iserver: object, username: str | None = None, password: str | None = None, certificate: Any = None
    ) -> User | None:
        """The user, None for nobody; the certificate was checked when the session was made."""
        if self._login is not None:
            given = (username or "").encode(), (password or "").encode()
            name, secret = (text.encode() for text in self._login)
            if not (hmac.compare_digest(given[0], name) and hmac.compare_digest(given[1], secret)):
                return None
        return User(UserRole.User, WRITER if certificate else READER)


Write: TypeAlias = Callable[[list[tuple[ua.NodeId, Any]]], Awaitable[list[str]]]
"""Takes node and value of each item of a call; gives the name of each status."""
_SERVER = User(role=UserRole.Admin)


class Attributes(AttributeService):
    """The attribute service of a served plant: what clients write goes to its control system, in one call."""

    def __init__(self, aspace: AddressSpace, own: int, write: Write) -> None:
        """``own``: index of the plant's namespace; ``write`` takes the items of a call, and gives the statuses."""
        super().__init__(aspace)
        self._own, self._write, self._space = own, write, aspace

    async def write(self, params: ua.WriteParameters, user: User = _SERVER) -> list[ua.StatusCode]:
        """The status of each item; nothing is written by who only reads, and no type is converted."""
        if user.role is UserRole.Admin:
            return await super().write(params, user)
        refused = [self._refusal(item, user) for item in params.NodesToWrite]
        if any(refused):
            return [ua.StatusCode(ua.UInt32(code or StatusCodes.BadUserAccessDenied)) for code in refused]
        items = [(item.NodeId, item.Value.Value.Value) for item in params.NodesToWrite]
        return [ua.StatusCode(getattr(StatusCodes, name)) for name in await self._write(items)]

    def _refusal(self, item: ua.WriteValue, user: User) -> int:
        """Why ``item`` cannot be written; 0 where it can."""
        codes = StatusCodes
        if user.name != WRITER:
            return codes.BadUserAccessDenied
        if item.NodeId.NamespaceIndex != self._own or item.AttributeId != AttributeIds.Value:
            return codes.BadNotWritable
        if item.Value.SourceTimestamp is not None or item.Value.ServerTimestamp is not None:
            return codes.BadWriteNotSupported
        present = self._space.read_attribute_value(item.NodeId, AttributeIds.Value).Value
        if present is None:
            return codes.BadNodeIdUnknown
        if item.Value.Value is None or item.Value.Value.VariantType is not present.VariantType:
            return codes.BadTypeMismatch
        return 0
