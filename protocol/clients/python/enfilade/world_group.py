"""Clients in several worlds over one connection: one message steps all of them."""

from __future__ import annotations

import mmap
import os
import secrets
import socket
import struct
import sys
import weakref
from collections import deque
from typing import Any, Deque, List, Optional, Sequence, Tuple

import numpy as np

from . import messages
from .client import Client
from .connection import Received
from .errors import ConnectionFailed, EnfiladeError, ServerError
from .kept_request import KeptRequest, varint

_ALIGNMENT = 64  # bytes, of attachments in the reply
_NOTHING = memoryview(b"")
_PASSING_SECONDS = 5.0  # the server passes memory before it replies
_CREDENTIALS = struct.Struct("=iII")  # process, user, group


def _key(message: Any, field: str) -> bytes:
    """The key of a message in a message, on the wire."""
    return varint(message.DESCRIPTOR.fields_by_name[field].number << 3 | 2)


_STEP_MANY_KEY = _key(messages.ClientMessage, "step_many")
_WORLDS_KEY = _key(messages.StepMany, "worlds")
_REQUESTS_KEY = _key(messages.StepMany.World, "requests")


class WorldGroup:
    """Clients in several worlds of the server of one client, `members`, in the order of the worlds.

    Requests of members wait until one of them needs a reply; then one StepMany sends those of all
    members, and their worlds work at the same time. So post() to all members first, and take() the
    replies afterwards. Closing the client ends the memberships.

    `shared_memory`: pictures of a server on this machine come in memory that both share, without a
    copy. Their arrays are read-only, and valid until the second round after theirs."""

    def __init__(self, client: Client, worlds: Sequence[str], *, shared_memory: bool = False) -> None:
        self._client = client
        self._memory: Optional[_SharedMemory] = None  # None: pictures come in the replies
        if shared_memory and sys.platform == "linux":
            self._memory = _SharedMemory()
        self._shares = False  # the round under way asks for shared memory
        self._under_way: Optional[Tuple[List[int], List[_MemberConnection]]] = None
        self._connections = [_MemberConnection(self, world) for world in worlds]
        for connection in self._connections:
            connection.is_entering = True
        self._run()
        try:
            self.members = [Member(connection) for connection in self._connections]
        except ServerError:
            self._leave()
            raise

    def _leave(self) -> None:
        """Leaves the worlds, which another group of the client can then enter."""
        self._client.request(step_many=messages.StepMany(worlds=[
            messages.StepMany.World(world=one.world, leave=True) for one in self._connections]))

    def _run(self) -> None:
        """Sends the waiting requests of all members, and takes the replies. An interrupted call
        continues with the next."""
        if self._under_way is None:
            active = [one for one in self._connections
                      if one.kept is not None or one.waiting or one.is_entering]
            if not active:
                raise EnfiladeError("no request awaits a reply")
            # The server overwrites its memory, so a round leaves it alone while pictures are unread.
            self._shares = self._memory is not None and not any(
                one.has_unread_picture() for one in self._connections)
            request = _StepManyRequest(active, self._memory.name if self._shares else "")
            self._under_way = (self._client._post([request]), active)
        posted, active = self._under_way
        reply, attachment = self._client.take(posted)[0]
        if reply.step_many.HasField("memory"):
            attachment = self._memory.attachment(reply.step_many.memory)
        elif self._shares:
            self._memory = None  # the server is on another machine
        many, start = reply.step_many, 0
        steps = PackedSteps(many.steps) if many.HasField("steps") else None
        for i, (connection, world) in enumerate(zip(active, many.worlds)):
            found = WorldReply(world, attachment, start, steps, i)
            start = found.end()
            connection.receive(found)
        self._under_way = None


class _SharedMemory:
    """Memory of the server. It comes over a Unix socket on which this process listens."""

    def __init__(self) -> None:
        self.name = "enfilade-" + secrets.token_hex(16)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind("\0" + self.name)
        self._listener.listen(4)
        self._listener.settimeout(_PASSING_SECONDS)
        weakref.finalize(self, self._listener.close)
        self._number = 0  # of the memory that is mapped
        self._bytes = _NOTHING

    def attachment(self, place: Any) -> memoryview:
        """Returns the memory from the attachment on. Raises ConnectionFailed without it."""
        while self._number != place.number:
            self._accept()
        return self._bytes[place.offset:]

    def _accept(self) -> None:
        """Maps the next memory that waits. Names of sockets are no secrets, so only this user and root
        are believed."""
        try:
            sender, _ = self._listener.accept()
        except socket.timeout:
            raise ConnectionFailed("the server did not pass its shared memory: it has to run as this "
                                   "user or as root") from None
        with sender:
            sender.settimeout(_PASSING_SECONDS)
            peer = sender.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
            if _CREDENTIALS.unpack(peer)[1] not in (os.getuid(), 0):
                return
            number, descriptors, _, _ = socket.recv_fds(sender, 8, 1)
        for one in descriptors:
            with open(one, "rb") as file:
                mapped = mmap.mmap(file.fileno(), 0, mmap.MAP_SHARED, mmap.PROT_READ)
            self._number, self._bytes = int.from_bytes(number, "little"), memoryview(mapped)


class PackedSteps:
    """The message as Python data, of all worlds of a round."""

    def __init__(self, packed: Any) -> None:
        self.ticks, self.hashes = packed.tick[:], packed.state_hash[:]
        self.stopped_by, self.last_stopped = packed.stopped_by_name[:], packed.last_stopped_tick[:]
        self.feet = np.array(packed.feet[:]).reshape(-1, 3)  # rows of NaN: no such avatar
        self.has_avatar = (~np.isnan(self.feet[:, 0])).tolist()


class WorldReply:
    """The reply of one world to StepMany: its messages, and a packed step if it was requested."""

    __slots__ = ("messages", "steps", "_ends", "_attachment", "_start", "_index", "_found")

    def __init__(self, world: Any, attachment: memoryview, start: int, steps: Optional[PackedSteps],
                 index: int) -> None:
        self.messages = world.messages
        self._ends, self._attachment, self._start = world.attachment_ends, attachment, start
        self.steps, self._index = steps, index
        self._found: Optional[List[memoryview]] = None  # None: attachments() has to find them

    def end(self) -> int:
        """Where its last attachment ends in that of the round."""
        return max(self._start, self._ends[-1]) if self._ends else self._start

    def attachments(self) -> List[memoryview]:
        """The attachment of each message."""
        if self._found is not None:
            return self._found
        found: List[memoryview] = []
        start = self._start
        for end in self._ends:
            if end > start:
                start = -(-start // _ALIGNMENT) * _ALIGNMENT
            found.append(self._attachment[start:end])
            start = max(start, end)
        return found

    def take_unsolicited(self) -> List[Tuple[Any, memoryview]]:
        """Removes and returns the messages that reply to nothing."""
        both = list(zip(self.messages, self.attachments()))
        self.messages = [one for one, _ in both if one.reply_to]
        self._found = [attachment for one, attachment in both if one.reply_to]
        return [one for one in both if not one[0].reply_to]

    def packed(self, others: int) -> Optional[Tuple[int, int, np.ndarray, str, int]]:
        """Returns tick, hash, feet, stopped_by_name and last_stopped_tick of the packed step; None if it was
        refused, the avatar is not in the world, or more came with it than `others` replies."""
        steps, i = self.steps, self._index
        if steps is None or not steps.has_avatar[i] or len(self.messages) != others:
            return None
        if others and any(one.HasField("error") for one in self.messages):
            return None
        return steps.ticks[i], steps.hashes[i], steps.feet[i], steps.stopped_by[i], steps.last_stopped[i]

    def unpacked(self, avatar: str) -> List[Any]:
        """Returns the replies to Drive and Step, the first two requests, that are in none of the
        messages."""
        steps, i = self.steps, self._index
        answered = {one.reply_to for one in self.messages}
        found = []
        if 1 not in answered:
            found.append(messages.ServerMessage(
                reply_to=1, command=messages.CommandReply(accepted=True)))
        if steps is not None and steps.ticks[i]:
            made = messages.StepReply(tick=steps.ticks[i], state_hash=steps.hashes[i])
            if steps.has_avatar[i]:
                x, y, z = steps.feet[i].tolist()
                made.avatars.add(name=avatar, feet=messages.Vec3(x=x, y=y, z=z),
                                 last_stopped_tick=steps.last_stopped[i],
                                 move=messages.MoveResult(stopped_by_name=steps.stopped_by[i]))
            found.append(messages.ServerMessage(reply_to=2, step=made))
        return found


class _StepManyRequest:
    """A ClientMessage with the waiting requests of several members, joined from their bytes."""

    def __init__(self, connections: List[_MemberConnection], memory_socket: str) -> None:
        self.request_id = 0
        self._parts = [messages.StepMany(memory_socket=memory_socket).SerializeToString()]
        for one in connections:
            self._parts += one.encoded()

    def SerializeToString(self) -> bytes:
        """Concatenated bytes are merged messages in protobuf."""
        body = b"".join(self._parts)
        head = messages.ClientMessage(request_id=self.request_id).SerializeToString()
        return b"".join((head, _STEP_MANY_KEY, varint(len(body)), body))


class _MemberConnection:
    """The part of a Connection that a Client uses, for one world of a group."""

    def __init__(self, group: WorldGroup, world: str) -> None:
        self.peer = f"{group._client._connection.peer}, world {world}"
        self.timeout = group._client._connection.timeout
        self.max_message = 0
        self.world = world
        self.waiting: List[Any] = []
        self.kept: Optional[KeptRequest] = None  # of Member.post_kept()
        self.raw: Optional[WorldReply] = None  # to `kept`
        self.head = messages.StepMany.World(world=world).SerializeToString()
        self.is_entering = self._is_raw = False
        self._sent: List[int] = []  # ids of the requests in the round under way
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
        self.kept = None  # of an interrupted call
        self.waiting += requests

    def encoded(self) -> List[bytes]:
        """Returns the parts of StepMany with the waiting requests, which are then under way."""
        self.raw = None  # of an interrupted call: its replies are not awaited any more
        if self.kept is not None:
            kept, self.kept, self._is_raw = self.kept, None, True
            return [kept.body]
        parts: List[Any] = [self.head]
        for one in self.waiting:
            body = one.body if isinstance(one, KeptRequest) else one.SerializeToString()
            parts += (_REQUESTS_KEY, varint(len(body)), body)
        self._sent = [one.request_id for one in self.waiting]
        self.waiting, self.is_entering, self._is_raw = [], False, False
        return [_WORLDS_KEY, varint(sum(map(len, parts))), *parts]

    def receive(self, reply: WorldReply) -> None:
        if not self._is_raw:
            return self._append(reply.messages, reply.attachments(), self._sent)
        if reply.messages:
            self._received += [Received(message, attachment, None, 0)
                               for message, attachment in reply.take_unsolicited()]
        self.raw = reply

    def _append(self, found: Any, attachments: Sequence[memoryview], ids: Sequence[int]) -> None:
        """Makes next() return messages; `ids`: of the requests, by number."""
        for message, attachment in zip(found, attachments):
            if message.reply_to:
                message.reply_to = ids[message.reply_to - 1]
            self._received.append(Received(message, attachment, None, 0))

    def unpack(self, ids: Sequence[int], avatar: str = "") -> None:
        """Makes next() return the replies as if the requests had these ids."""
        assert self.raw is not None
        reply, self.raw = self.raw, None
        made = [(one, _NOTHING) for one in reply.unpacked(avatar)]
        both = sorted([*made, *zip(reply.messages, reply.attachments())], key=lambda one: one[0].reply_to)
        self._append([one for one, _ in both], [attachment for _, attachment in both], ids)

    def has_unread_picture(self) -> bool:
        if self.raw is not None:
            return True
        return len(self._received) > 0 and any(len(one.attachment) > 0 for one in self._received)

    def next(self, seconds: Optional[float] = None) -> Optional[Received]:
        """Returns the next message, the same one until done(). None, at once, if nothing waits and
        `seconds` are given: messages come with rounds only."""
        while not self._received:
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
        if not connection._received:  # it has not entered: the reply to any request says why
            self.request(list_worlds=messages.ListWorlds())
        received = connection.next()
        assert received is not None
        if not received.message.HasField("welcome"):
            self._keep(received)
        self.welcome = received.message.welcome
        connection.done(received)

    def kept_step(self, avatar: str, requests: Sequence[KeptRequest]) -> KeptRequest:
        """Joins requests for post_kept(): a Drive of the avatar, a Step, and others."""
        head = messages.StepMany.World(world=self.world, packed_avatar=avatar).SerializeToString()
        world = KeptRequest.joined(head, _REQUESTS_KEY, requests)
        return KeptRequest.joined(b"", _WORLDS_KEY, [world])

    def post_kept(self, kept: KeptRequest) -> None:
        """Posts joined requests; their bytes must not change until reply_to_kept()."""
        connection = self._connection
        if connection._broken:
            raise ConnectionFailed(f"{connection.peer}: {connection.broken}")
        connection.kept = kept

    def reply_to_kept(self) -> WorldReply:
        """The reply without unsolicited messages, which are kept. Call forget_reply() or unpack_reply()
        next."""
        connection = self._connection
        if connection.raw is None:
            connection._group._run()
        while connection._received:
            self._keep(connection._received[0])
        return connection.raw

    def packed_steps(self) -> Optional[PackedSteps]:
        """The packed steps of the round of post_kept(); None if this world sent more than its own and
        events."""
        connection = self._connection
        if connection.raw is None:
            connection._group._run()
        reply = connection.raw
        if reply.packed(0) is None or any(one.message.WhichOneof("body") != "events"
                                          for one in connection._received):
            return None
        return reply.steps

    def is_closed(self) -> bool:
        return self._connection._broken != ""

    def forget_reply(self) -> None:
        self._connection.raw = None

    def unpack_reply(self, avatar: str, requests: int) -> List[int]:
        """Turns the reply into messages. Returns ids of the requests, for take()."""
        ids = [next(self._ids) for _ in range(requests)]
        self._connection.unpack(ids, avatar)
        return ids

    def close(self) -> None:
        """The client leaves the world when the group's connection ends."""
        self._connection.close()
