"""Clients in several worlds over one connection: one message steps all of them."""

from __future__ import annotations

import mmap
from collections import deque
from typing import Any, Deque, List, Optional, Sequence, Tuple

from . import messages
from .client import Client
from .connection import Received
from .errors import ConnectionFailed, EnfiladeError

_ALIGNMENT = 64  # bytes, of attachments in the reply


class WorldGroup:
    """Clients in several worlds of the server of one client, `members`, in the order of the worlds.

    Requests of members wait until one of them needs a reply; then one StepMany sends those of all
    members, and their worlds work at the same time. So post() to all members first, and take() the
    replies afterwards. Closing the client ends the memberships.

    `shared_memory`: pictures of a server on this machine come in memory that both share, without a
    copy. Their arrays are read-only, and valid until the second round after theirs."""

    def __init__(self, client: Client, worlds: Sequence[str], *, shared_memory: bool = False) -> None:
        self._client = client
        self._is_shared = shared_memory
        self._memory: Tuple[Any, memoryview] = (None, memoryview(b""))  # the last one, and its bytes
        self._under_way: Optional[Tuple[List[int], List[_MemberConnection]]] = None
        self._connections = [_MemberConnection(self, world) for world in worlds]
        for connection in self._connections:
            connection.is_entering = True
        self._run()
        self.members = [Member(connection) for connection in self._connections]

    def _run(self) -> None:
        """Sends the waiting requests of all members, and takes the replies. An interrupted call
        continues with the next."""
        if self._under_way is None:
            active = [one for one in self._connections if one.waiting or one.is_entering]
            if not active:
                raise EnfiladeError("no request awaits a reply")
            # The server overwrites its memory, so a round leaves it alone while pictures are unread.
            is_unread = any(one.has_unread_picture() for one in self._connections)
            step = messages.StepMany(shared_memory=self._is_shared and not is_unread)
            for connection in active:
                world = step.worlds.add(world=connection.world, requests=connection.waiting)
                world.leave = connection.is_leaving
            self._under_way = (self._client.post([{"step_many": step}]), active)
        posted, active = self._under_way
        reply, attachment = self._client.take(posted)[0]
        if reply.step_many.HasField("memory"):
            attachment = self._shared(reply.step_many.memory)
        start = 0
        for connection, world in zip(active, reply.step_many.worlds):
            start = connection.receive(world, attachment, start)
        self._under_way = None

    def _shared(self, place: Any) -> memoryview:
        """Returns the server's memory from the attachment on. If this process cannot read it, the
        group does without from now on."""
        key = (place.process, place.file, place.bytes)
        if self._memory[0] != key:
            try:
                with open(f"/proc/{place.process}/fd/{place.file}", "rb") as file:
                    mapped = mmap.mmap(file.fileno(), place.bytes, mmap.MAP_SHARED, mmap.PROT_READ)
            except OSError:
                self._is_shared = False
                return memoryview(b"")  # the first round, which has no pictures
            self._memory = (key, memoryview(mapped))
        return self._memory[1][place.offset:]


class _MemberConnection:
    """What a Client needs of a Connection, for one world of a group."""

    def __init__(self, group: WorldGroup, world: str) -> None:
        self.peer = f"{group._client._connection.peer}, world {world}"
        self.timeout = group._client._connection.timeout
        self.max_message = 0
        self.world = world
        self.waiting: List[Any] = []
        self.is_entering = self.is_leaving = False
        self._group = group
        self._received: Deque[Received] = deque()
        self._broken = ""

    @property
    def broken(self) -> str:
        return self._broken or self._group._client._connection.broken

    @broken.setter
    def broken(self, why: str) -> None:
        self._broken = self._broken or why

    def send(self, requests: Any) -> None:
        if self.broken:
            raise ConnectionFailed(f"{self.peer}: {self.broken}")
        self.waiting += requests

    def receive(self, world: Any, attachment: memoryview, start: int) -> int:
        """Keeps the messages of a reply. Returns the end of the last attachment."""
        ids = [one.request_id for one in self.waiting]
        for message, end in zip(world.messages, world.attachment_ends):
            if message.reply_to:
                message.reply_to = ids[message.reply_to - 1]
            if end > start:
                start = -(-start // _ALIGNMENT) * _ALIGNMENT
            self._received.append(Received(message, attachment[start:end], None, 0))
            start = max(start, end)
        self.waiting = []
        self.is_entering = False
        return start

    def has_unread_picture(self) -> bool:
        return any(len(one.attachment) > 0 for one in self._received)

    def next(self, seconds: Optional[float] = None) -> Optional[Received]:
        """Returns the next message, the same one until done(). None, at once, if nothing waits and
        `seconds` are given: messages come with rounds only."""
        if not self._received:
            if seconds is not None and not self.waiting:
                return None
            if self.broken:
                raise ConnectionFailed(f"{self.peer}: {self.broken}")
            self._group._run()
        return self._received[0]

    def done(self, received: Received) -> None:
        if self._received and self._received[0] is received:
            self._received.popleft()

    def close(self) -> None:
        self.broken = "the client was closed"

    def shutdown_send(self) -> None:
        pass

    def _failed(self, why: str) -> ConnectionFailed:
        self.broken = why
        return ConnectionFailed(f"{self.peer}: {why}")


class Member(Client):
    """A client in one world of a group. It has no unsolicited messages between rounds."""

    def __init__(self, connection: _MemberConnection) -> None:
        self._start(connection)
        received = connection.next()
        assert received is not None
        if not received.message.HasField("welcome"):
            self._keep(received)
        self.welcome = received.message.welcome
        connection.done(received)

    def close(self) -> None:
        """Leaves the world with the group's next round, or with its connection."""
        self._connection.close()
