"""Messages over a TCP connection: magic, lengths, deadlines. See PROTOCOL.md, "Framing"."""

from __future__ import annotations

import socket
import struct
import time
from typing import Any, Iterable, Optional, Tuple

import numpy

from . import messages
from .errors import ConnectionFailed, ServerError

MAGIC = b"ENF1"
LARGEST_MESSAGE = 1 << 28  # bytes, of what a server may send; the C++ client takes as much
LARGEST_HEADER = 1 << 24
_LENGTHS = struct.Struct("<II")
_BUFFER = 1 << 16  # bytes; what is longer goes right into memory of its own


class Connection:
    """One message at a time, in both directions. Not for use from two threads at once."""

    def __init__(self, host: str, port: int, timeout: float) -> None:
        self.peer = f"{host}:{port}"
        self.timeout = timeout
        self.broken = ""
        try:
            self._socket = socket.create_connection((host, port), timeout)
        except OSError as error:
            raise ConnectionFailed(
                f"cannot connect to {self.peer}: {error}; is `enfilade serve` running there, and "
                "is the port the one of its ready line?") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._buffer = bytearray(_BUFFER)
        self._view = memoryview(self._buffer)
        self._start = self._end = 0  # of what is unread in the buffer
        self._magic_seen = False
        self._to_send = MAGIC  # goes with the first message

    def close(self) -> None:
        self.broken = self.broken or "the client was closed"
        self._socket.close()

    def send(self, requests: Iterable[Any]) -> None:
        """All of them in one write."""
        if self.broken:
            raise ConnectionFailed(f"{self.peer}: {self.broken}")
        parts = [self._to_send]
        for request in requests:
            header = request.SerializeToString()
            parts.append(_LENGTHS.pack(4 + len(header), len(header)))
            parts.append(header)
        self._to_send = b""
        try:
            self._socket.settimeout(self.timeout)
            self._socket.sendall(b"".join(parts))
        except OSError as error:
            # Not closed yet: what it said last may still be read.
            self.broken = f"the connection broke: {error}"
            raise ConnectionFailed(f"{self.peer}: {self.broken}") from error

    def receive(self, timeout: Optional[float] = None) -> Optional[Tuple[Any, memoryview]]:
        """The next message and its attachment, which nobody else holds; None when `timeout`
        seconds passed between messages. Half a message is waited for as long as a reply is."""
        deadline = time.monotonic() + (self.timeout if timeout is None else timeout)
        if not self._fill(8, deadline, at_start=timeout is not None):
            return None
        if not self._magic_seen:
            if bytes(self._view[self._start:self._start + 4]) != MAGIC:
                raise self._failed("it does not speak this protocol; is that an Enfilade server?")
            self._start += 4
            self._magic_seen = True
            return self.receive(timeout)
        total, header_length = _LENGTHS.unpack_from(self._buffer, self._start)
        if total > LARGEST_MESSAGE or header_length > LARGEST_HEADER or 4 + header_length > total:
            raise self._failed(f"a message claims {total} bytes, {header_length} of them header")
        self._start += 8
        deadline = max(deadline, time.monotonic() + self.timeout)
        header = self._take(header_length, deadline)
        attachment = memoryview(b"")
        if total > 4 + header_length:
            attachment = self._take_own(total - 4 - header_length, deadline)
        message = messages.ServerMessage()
        try:
            message.ParseFromString(header)
        except Exception as error:  # its class differs between protobuf's implementations
            raise self._failed(f"a message does not parse: {error}; do the versions fit?") from error
        return message, attachment

    # ---- bytes ------------------------------------------------------------------------------

    def _failed(self, why: str) -> ConnectionFailed:
        self.broken = self.broken or why
        self._socket.close()
        return ConnectionFailed(f"{self.peer}: {why}")

    def _read_into(self, place: memoryview, deadline: float) -> int:
        """Bytes read, at least one; 0 when the deadline passed."""
        left = deadline - time.monotonic()
        try:
            self._socket.settimeout(max(left, 1e-6))
            count = self._socket.recv_into(place)
        except socket.timeout:
            return 0
        except OSError as error:
            raise self._failed(f"the connection broke: {error}") from error
        if count == 0:
            raise self._failed("it closed the connection; its log says why")
        return count

    def _fill(self, wanted: int, deadline: float, at_start: bool = False) -> bool:
        """Has `wanted` bytes in the buffer; False when nothing of them came and that may be."""
        if _BUFFER - self._start < wanted:
            rest = self._end - self._start
            self._view[:rest] = bytes(self._view[self._start:self._end])
            self._start, self._end = 0, rest
        while self._end - self._start < wanted:
            if self._start == self._end:
                self._start = self._end = 0
            count = self._read_into(self._view[self._end:], deadline)
            if count == 0:
                if at_start and self._start == self._end:
                    return False
                if at_start:  # a message has begun: its rest gets the time that a reply has
                    at_start, deadline = False, time.monotonic() + self.timeout
                    continue
                raise self._failed(f"no answer within {self.timeout:g} s; is the server "
                                   "overloaded? A longer timeout may help")
            self._end += count
        return True

    def _take(self, length: int, deadline: float) -> memoryview:
        """Valid until the next call."""
        if length > _BUFFER:
            return self._take_own(length, deadline)
        self._fill(length, deadline)
        self._start += length
        return self._view[self._start - length:self._start]

    def _take_own(self, length: int, deadline: float) -> memoryview:
        # An array of numpy's, not a bytearray: nobody needs it zeroed first.
        own = memoryview(numpy.empty(length, numpy.uint8))
        count = min(length, self._end - self._start)
        own[:count] = self._view[self._start:self._start + count]
        self._start += count
        while count < length:
            read = self._read_into(own[count:], deadline)
            if read == 0:
                raise self._failed(f"half a message, then silence for {self.timeout:g} s")
            count += read
        return own


def server_error(error: Any, fatal: bool = False) -> ServerError:
    return ServerError(error.code, error.message, error.field, fatal)
