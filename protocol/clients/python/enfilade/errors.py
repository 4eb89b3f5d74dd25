"""What can go wrong, as exceptions."""

from __future__ import annotations

from typing import Any

from . import messages

# What helps, by the code, where it helps whatever was wrong: of other codes only the server's own
# sentence can know.
_REMEDIES = {
    "ERROR_VERSION": "use the client of the server's release",
    "ERROR_UNKNOWN_AVATAR": "spawn the avatar, and step until it has entered",
    "ERROR_INTERNAL": "look into the server's log, and report it",
    "ERROR_TOO_SLOW": "read events as they come, or subscribe to less",
    "ERROR_TICK_GONE": "ask before the next step, or without a tick",
    "ERROR_TIMEOUT": "send whole messages without long pauses",
    "ERROR_UNSUPPORTED": "use a server that offers it; see Client.capabilities",
    "ERROR_UNAUTHENTICATED": "in Python the token is connect()'s token=",
    "ERROR_REPLAY_ENDED": "seek() goes elsewhere, take_over() goes on from here",
    "ERROR_UNKNOWN_ENTITY": "give an id, a name or a path of what is in the world now",
    "ERROR_TOO_COMPLEX": "ask for fewer pairs, or for smaller pieces",
}
# Of these, where the error names a field.
_BY_FIELD = ("ERROR_BAD_MESSAGE", "ERROR_REFUSED_COMMAND", "ERROR_BAD_CAMERA", "ERROR_BAD_RAYS")


def _remedy(code: str, field: str) -> str:
    if code in _BY_FIELD and field:
        return "change the field that is named"
    return _REMEDIES.get(code, "")


class EnfiladeError(Exception):
    """All errors of this package."""


class ConnectionFailed(EnfiladeError):
    """The connection could not be made, broke or fell silent. The client is of no more use."""


class ServerError(EnfiladeError):
    """The server's own words. `fatal` ones came with the end of the connection."""

    def __init__(self, number: int, message: str, field: str = "", fatal: bool = False) -> None:
        self._number = number
        value = messages.ErrorCode.values_by_number.get(number)
        self.code: str = value.name if value else f"ERROR_{number}"
        self.message = message
        self.field = field
        self.fatal = fatal
        self.remedy: str = _remedy(self.code, field)
        text = f"{self.code}: {message}"
        if field:
            text += f" (field: {field})"
        if self.remedy:
            text += f"; {self.remedy}"
        super().__init__(text)

    def __reduce__(self) -> Any:  # made again of its parts, not of its text
        return (type(self), (self._number, self.message, self.field, self.fatal))


class OrderFailed(EnfiladeError):
    """An order was taken, and could not be done: a spawn without room, a walk that is blocked."""


class StartFailed(EnfiladeError):
    """A server process did not come up; the text has its last words."""
