"""Messages over a TCP connection: magic, lengths, deadlines. See PROTOCOL.md, "Framing".

A signal handler may raise an exception (KeyboardInterrupt) between any two bytecodes. The stream
stays consistent: the C call that moves bytes also records their number (_Moved), and every other
change of state is one assignment. A message stays `next` until its reader calls done().
"""

from __future__ import annotations

import select
import socket
import struct
import time
from typing import Any, Callable, Iterable, List, Optional

import numpy

from . import messages
from .errors import ConnectionFailed, ServerError

MAGIC = b"ENF1"
MAX_MESSAGE = 1 << 28  # bytes; the C++ client accepts as much
MAX_HEADER = 1 << 24
_LENGTHS = struct.Struct("<II")
_BUFFER = 1 << 14  # bytes; longer messages get memory of their own
_ALIGNMENT = 64  # bytes, of attachments


class _Moved:
    """Bytes in transfer: the first sum(counts) of `view` are transferred; those before `start` are
    consumed."""

    __slots__ = ("view", "counts", "start")

    def __init__(self, view: memoryview, count: int = 0, start: int = 0) -> None:
        self.view = view
        self.counts: List[int] = [count]
        self.start = start

    def move(self, call: Any) -> int:
        """Passes the rest to recv_into() or send(). map() and extend() are C: no handler runs between
        the call and the record of its result."""
        self.counts.extend(map(call, (self.view[sum(self.counts):],)))
        return self.counts[-1]


class Received:
    """A message and its attachment, which has no other owner."""

    __slots__ = ("message", "attachment", "source", "end", "marks")

    def __init__(self, message: Any, attachment: memoryview, source: _Moved, end: int) -> None:
        self.message = message
        self.attachment = attachment
        self.source = source
        self.end = end  # start of the next message in `source`
        self.marks: Any = None  # for the reader's use


class Connection:
    """A connection that transfers one message at a time, in both directions. Not thread-safe."""

    def __init__(self, host: str, port: int, timeout: float) -> None:
        self.peer = f"{host}:{port}"
        self.timeout = timeout
        self.broken = ""
        self.fate: Callable[[], str] = lambda: ""  # how the server ended, if known
        self.max_message = 0  # bytes that the server accepts; 0: unknown yet
        try:
            self._socket = socket.create_connection((host, port), timeout)
        except (OSError, OverflowError) as error:
            raise ConnectionFailed(
                f"cannot connect to {self.peer}: {error}; is `enfilade serve` running there, and "
                "is this the port of its ready line?") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._readable = select.poll()
        self._readable.register(self._socket, select.POLLIN)
        self._came = _Moved(memoryview(bytearray(_BUFFER)))
        self._went = _Moved(memoryview(MAGIC))  # sent with the first message
        self._next: Optional[Received] = None
        self._magic_seen = False

    def close(self) -> None:
        self.broken = self.broken or "the client was closed"
        self._socket.close()

    def shutdown_send(self) -> None:
        """Shuts down the sending side if there is data to read, which stays readable."""
        try:
            if self._readable.poll(0):
                self._socket.shutdown(socket.SHUT_WR)
        except OSError:
            pass  # already closed on one side

    def send(self, requests: Iterable[Any]) -> None:
        """Sends all in one write, after the rest of an interrupted one. Raises ValueError and sends
        nothing if one is longer than the server accepts."""
        if self.broken:
            raise ConnectionFailed(f"{self.peer}: {self.broken}")
        parts: List[Any] = [self._went.view[sum(self._went.counts):]]
        for request in requests:
            header = request.SerializeToString()
            if self.max_message and 8 + len(header) > self.max_message:
                raise ValueError(f"a request has {8 + len(header)} bytes; the server accepts "
                                 f"{self.max_message} (limits.max_message): split the request")
            parts += (_LENGTHS.pack(4 + len(header), len(header)), header)
        self._went = went = _Moved(memoryview(b"".join(parts)))
        deadline = time.monotonic() + self.timeout
        try:
            while sum(went.counts) < len(went.view):
                went.move(self._socket.send)
                if time.monotonic() > deadline:
                    raise socket.timeout()
        except socket.timeout as error:
            self.broken = f"the server read nothing for {self.timeout:g} s"
            raise ConnectionFailed(f"{self.peer}: {self.broken}") from error
        except OSError as error:
            # Not closed yet: its final message is still readable.
            self.broken = f"the connection broke: {error}{self._fate()}"
            raise ConnectionFailed(f"{self.peer}: {self.broken}") from error

    def next(self, seconds: Optional[float] = None) -> Optional[Received]:
        """Returns the next message, the same one until done(); None after `seconds` without one.
        Half a message is awaited as long as a reply."""
        if self._next is not None:
            return self._next
        if self._socket.fileno() < 0:
            raise ConnectionFailed(f"{self.peer}: {self.broken}")
        came = self._came
        if came.start == sum(came.counts):  # all consumed: restart at the start of a buffer
            whole = len(came.view) == _BUFFER
            self._came = came = _Moved(came.view if whole else memoryview(bytearray(_BUFFER)))
            if seconds is not None and not self._readable.poll(max(0.0, seconds) * 1000):
                return None
        if not self._magic_seen:
            self._fill(4)
            if bytes(came.view[:4]) != MAGIC:
                raise self._failed("it does not speak this protocol; is it an Enfilade server?")
            came.start = 4
            self._magic_seen = True
        self._next = self._read_one()
        return self._next

    def done(self, received: Received) -> None:
        """Releases `received`. A second call has no effect."""
        received.source.start = received.end
        self._next = None

    # ---- bytes ------------------------------------------------------------------------------

    def _fate(self) -> str:
        return "; " + (self.fate() or "the server ended, was killed, or disconnected this client: its "
                                      "log may give the reason")

    def _failed(self, why: str) -> ConnectionFailed:
        self.broken = self.broken or why
        self._socket.close()
        return ConnectionFailed(f"{self.peer}: {why}")

    def _read_one(self) -> Received:
        self._fill(8)
        total, header_length = _LENGTHS.unpack_from(self._came.view, self._came.start)
        if total > MAX_MESSAGE or header_length > MAX_HEADER or 4 + header_length > total:
            raise self._failed(f"a message claims {total} bytes, {header_length} of them header")
        self._make_room(4 + total, 8 + header_length)
        self._fill(4 + total)
        came = self._came
        header, end = came.start + 8, came.start + 4 + total
        attachment = came.view[header + header_length:end]
        if attachment and len(came.view) == _BUFFER:
            # An array of numpy, not a bytearray, which would be zeroed first.
            own = memoryview(numpy.empty(len(attachment), numpy.uint8))
            own[:] = attachment
            attachment = own
        message = messages.ServerMessage()
        try:
            message.ParseFromString(came.view[header:header + header_length])
        except Exception as error:  # its class differs between protobuf's implementations
            raise self._failed(f"a message does not parse: {error}; do the versions match?") from error
        return Received(message, attachment, came, end)

    def _make_room(self, length: int, before_attachment: int) -> None:
        """Makes space for `length` contiguous bytes from the start on; a long message gets its own."""
        came = self._came
        if came.start + length <= len(came.view):
            return
        start, size = 0, _BUFFER
        if length >= _BUFFER:
            start = -before_attachment % _ALIGNMENT
            size = start + length
        view = memoryview(numpy.empty(size, numpy.uint8))
        rest = came.view[came.start:sum(came.counts)]
        view[start:start + len(rest)] = rest
        self._came = _Moved(view, start + len(rest), start)

    def _fill(self, wanted: int) -> None:
        """Reads until `wanted` unread bytes are there."""
        came = self._came
        if sum(came.counts) - came.start >= wanted:
            return
        deadline = time.monotonic() + self.timeout
        while sum(came.counts) - came.start < wanted:
            try:
                count = came.move(self._socket.recv_into)
            except socket.timeout:
                count = -1
            except OSError as error:
                raise self._failed(f"the connection broke: {error}{self._fate()}") from error
            if count == 0:
                raise self._failed("the connection ended without Bye" + self._fate())
            if count < 0 or time.monotonic() > deadline:
                raise self._failed(f"no reply within {self.timeout:g} s; is the server "
                                   "overloaded? A longer timeout may help")


def server_error(error: Any, fatal: bool = False) -> ServerError:
    return ServerError(error.code, error.message, error.field, fatal)


def raise_refusal(reply: Any) -> None:
    if reply.HasField("error"):
        raise server_error(reply.error)
    if reply.HasField("command") and not reply.command.accepted:
        raise server_error(reply.command.error)
