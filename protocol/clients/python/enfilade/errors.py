"""The exceptions of this package."""

from __future__ import annotations

from typing import Any

from . import messages

# Remedies by code, for codes with one remedy for all causes. For the others the server's message
# has the remedy.
_REMEDIES = {
    "ERROR_VERSION": "use the client of the server's release",
    "ERROR_UNKNOWN_AVATAR": "spawn the avatar, and step until it has entered",
    "ERROR_INTERNAL": "read the server's log, and report the error",
    "ERROR_TOO_SLOW": "read events as they arrive, or subscribe to less",
    "ERROR_TICK_GONE": "ask before the next step, or without a tick",
    "ERROR_TIMEOUT": "send whole messages without long pauses",
    "ERROR_UNSUPPORTED": "use a server that offers it; see Client.capabilities",
    "ERROR_UNAUTHENTICATED": "pass the token to connect() as token=",
    "ERROR_REPLAY_ENDED": "seek() to another tick, or take_over() from here",
    "ERROR_UNKNOWN_ENTITY": "give the id, name or path of an entity that is in the world",
    "ERROR_TOO_COMPLEX": "ask for fewer pairs, or for smaller pieces",
}
# By code and field, where a field has a remedy of its own.
_FIELD_REMEDIES = {
    ("ERROR_TICK_GONE", "frame.flow_from"): "give a tick that the world has completed, one of the last 32",
}


class EnfiladeError(Exception):
    """Base class of all errors of this package."""


class ConnectionFailed(EnfiladeError):
    """The connection could not be made, broke or timed out. The client is unusable."""


class ServerError(EnfiladeError):
    """An error that the server reported. `fatal`: the connection ended with it."""

    def __init__(self, number: int, message: str, field: str = "", fatal: bool = False) -> None:
        self._number = number
        value = messages.ErrorCode.values_by_number.get(number)
        self.code: str = value.name if value else f"ERROR_{number}"
        self.message = message
        self.field = field
        self.fatal = fatal
        self.remedy: str = _FIELD_REMEDIES.get((self.code, field), _REMEDIES.get(self.code, ""))
        text = f"{self.code}: {message}"
        if field:
            text += f" (field: {field})"
        if self.remedy:
            text += f"; {self.remedy}"
        super().__init__(text)

    def __reduce__(self) -> Any:  # restored from its parts, not from its text
        return (type(self), (self._number, self.message, self.field, self.fatal))


class OrderFailed(EnfiladeError):
    """An order was accepted but failed: a spawn without space, a blocked walk."""


class EpisodeNotFound(EnfiladeError):
    """No start and goal with a path of the asked length were drawn."""


class StartFailed(EnfiladeError):
    """A server process did not start; the text has the end of its log."""
