"""Requests that are sent again and again, with a few other numbers each time."""

from __future__ import annotations

import struct
from typing import Any, Callable, List, Sequence, Tuple

from . import messages

_DOUBLE = struct.Struct("<d")
_ID_KEY = bytes((messages.ClientMessage.DESCRIPTOR.fields_by_name["request_id"].number << 3,))
_MARK = 1.2345678901234567e-200  # times 1, 2, ...: finds the places of numbers in the bytes
_WHOLE_MARK = (1 << 63) + 0x5A17_C0DE  # plus 0, 1, ...: finds those of type uint64; its varint has ten bytes


def varint(number: int) -> bytes:
    """Encodes a number as protobuf does: seven bits per byte, the lowest first."""
    if number < 128:
        return bytes((number,))
    written = bytearray()
    while number > 127:
        written.append(number & 127 | 128)
        number >>= 7
    return bytes((*written, number))


def _pack_whole(body: bytearray, place: int, number: int) -> None:
    """Writes the varint of a uint64 in ten bytes, which parsers accept for every number."""
    for i in range(9):
        body[place + i] = number >> 7 * i & 127 | 128
    body[place + 9] = number >> 63


class KeptRequest:
    """A ClientMessage as bytes, in which set() replaces `numbers`: fields of type double or uint64, as
    pairs of their message, a part of the request, and their name."""

    __slots__ = ("request_id", "body", "_places")

    def __init__(self, request: Any, *numbers: Tuple[Any, str]) -> None:
        self.request_id = 0
        marks: List[Tuple[Callable[..., None], bytes]] = []
        for i, (message, name) in enumerate(numbers):
            is_whole = isinstance(getattr(message, name), int)
            mark = _WHOLE_MARK + i if is_whole else _MARK * (i + 1)
            setattr(message, name, mark)
            marks.append((_pack_whole, varint(mark)) if is_whole else (_DOUBLE.pack_into, _DOUBLE.pack(mark)))
        request.ClearField("request_id")
        self.body = bytearray(request.SerializeToString())
        self._places: List[Tuple[Callable[..., None], int]] = [
            (pack, self.body.index(mark)) for pack, mark in marks]
        self.set(*[0] * len(numbers))

    @classmethod
    def joined(cls, head: bytes, key: bytes, requests: Sequence[KeptRequest]) -> KeptRequest:
        """Returns the requests as fields of another message, which begins with `head`. Its numbers are
        those of all."""
        made = cls.__new__(cls)
        made.request_id = 0
        made.body, made._places = bytearray(head), []
        for one in requests:
            made.body += key + varint(len(one.body))
            made._places += [(pack, len(made.body) + place) for pack, place in one._places]
            made.body += one.body
        return made

    def set(self, *values: float) -> None:
        for (pack, place), value in zip(self._places, values):
            pack(self.body, place, value)

    def SerializeToString(self) -> bytes:
        """Concatenated bytes are merged messages in protobuf."""
        return b"".join((_ID_KEY, varint(self.request_id), self.body))
