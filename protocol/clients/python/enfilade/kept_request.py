"""Requests that are sent again and again, with a few other numbers each time."""

from __future__ import annotations

import struct
from typing import Any, Sequence, Tuple

from . import messages

_DOUBLE = struct.Struct("<d")
_ID_KEY = bytes((messages.ClientMessage.DESCRIPTOR.fields_by_name["request_id"].number << 3,))
_MARK = 1.2345678901234567e-200  # times 1, 2, ...: finds the places of numbers in the bytes


def varint(number: int) -> bytes:
    """Encodes a number as protobuf does: seven bits per byte, the lowest first."""
    if number < 128:
        return bytes((number,))
    written = bytearray()
    while number > 127:
        written.append(number & 127 | 128)
        number >>= 7
    return bytes((*written, number))


class KeptRequest:
    """A ClientMessage as bytes, in which set() replaces `doubles`: fields of type double, as pairs of
    their message, a part of the request, and their name."""

    __slots__ = ("request_id", "body", "_places")

    def __init__(self, request: Any, *doubles: Tuple[Any, str]) -> None:
        self.request_id = 0
        marks = [_MARK * (number + 1) for number in range(len(doubles))]
        for (message, name), mark in zip(doubles, marks):
            setattr(message, name, mark)
        request.ClearField("request_id")
        self.body = bytearray(request.SerializeToString())
        self._places = [self.body.index(_DOUBLE.pack(mark)) for mark in marks]
        self.set(*[0.0] * len(doubles))

    @classmethod
    def joined(cls, head: bytes, key: bytes, requests: Sequence[KeptRequest]) -> KeptRequest:
        """Returns the requests as fields of another message, which begins with `head`. Its doubles are
        those of all."""
        made = cls.__new__(cls)
        made.request_id = 0
        made.body, made._places = bytearray(head), []
        for one in requests:
            made.body += key + varint(len(one.body))
            made._places += [len(made.body) + place for place in one._places]
            made.body += one.body
        return made

    def set(self, *values: float) -> None:
        for place, value in zip(self._places, values):
            _DOUBLE.pack_into(self.body, place, value)

    def SerializeToString(self) -> bytes:
        """Concatenated bytes are merged messages in protobuf."""
        return b"".join((_ID_KEY, varint(self.request_id), self.body))
