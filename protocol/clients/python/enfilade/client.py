"""A blocking client of one server."""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Optional

from . import messages, results
from .arguments import UINT32, UINT64, optional_whole, whole
from .avatar import Avatar
from .connection import Connection
from .errors import ConnectionFailed, OrderFailed
from .exchange import MAX_AT_ONCE
from .navigation import Navigation
from .query_messages import Point, vec
from .results import Contact, Replay, Step, World
from .world_queries import WorldQueries

PROTOCOL_VERSION = "1.0.0"
MAX_RUN_TICKS = 36_000  # ticks that run_until_idle() runs before it gives up


def connect(address: str = "127.0.0.1:7878", *, name: str = "enfilade python", token: str = "",
            timeout: float = 30.0, world: str = "main") -> "Client":
    """Connects to HOST:PORT, with a token if the server requires one, and enters a world. Raises
    ConnectionFailed, or ServerError if the server refuses."""
    host, colon, port = address.rpartition(":")
    if not colon or not port.isdigit():
        raise ValueError(f"address: give HOST:PORT, as 127.0.0.1:7878, not {address!r}")
    return Client(host.strip("[]"), int(port), name=name, token=token, timeout=timeout, world=world)


class Client(WorldQueries):
    """One connection. Not thread-safe: open one connection per thread.

    `timeout` (seconds) applies to the connection and to each reply; a step's reply comes after all
    its ticks. Errors of the server are raised as ServerError. Unsolicited messages are kept until
    contacts(), notices(), horizons(), states() or frames() take them. An exception from a signal handler, as
    KeyboardInterrupt, leaves the client usable: the reply to the interrupted request is discarded.
    """

    def __init__(self, host: str, port: int, *, name: str = "enfilade python", token: str = "",
                 timeout: float = 30.0, world: str = "main") -> None:
        self._start(Connection(host, port, timeout))
        hello = messages.Hello(protocol_version=PROTOCOL_VERSION, client_name=name, token=token, world=world)
        try:
            self.welcome = self.request(hello=hello)[0].welcome
        except BaseException:
            self._connection.close()
            raise
        self._connection.max_message = self.limits.max_message
        if self._replay is None and self.welcome.HasField("replay"):
            self._replay = results.replay(self.welcome.replay)

    # ---- time -------------------------------------------------------------------------------

    def step(self, ticks: int = 1, *, avatars: bool = False) -> Step:
        """Runs ticks, in lockstep. `avatars` requests the state of all avatars after the last."""
        count = whole(ticks, "ticks", 1, self.limits.max_ticks_per_step)
        reply, _ = self.request(step=messages.Step(ticks=count, avatars=avatars))
        return results.step(reply.step)

    def run_until_idle(self, max_ticks: int = MAX_RUN_TICKS, *, at_a_time: int = 60) -> Step:
        """Steps until every queue is empty. Raises OrderFailed after `max_ticks` ticks."""
        if at_a_time < 1:
            raise ValueError(f"at_a_time: give at least 1, not {at_a_time}")
        for made in range(0, max_ticks, at_a_time):
            done = self.step(min(at_a_time, max_ticks - made), avatars=True)
            if done.idle:
                return done
        raise OrderFailed(f"the world is not idle after {max_ticks} ticks; is an avatar driven?")

    def lockstep(self) -> None:
        """Only step() runs ticks."""
        self.request(set_clock=messages.SetClock(lockstep=messages.SetClock.Lockstep()))

    def free_run(self, speed: float = 1.0) -> None:
        """Ticks follow wall-clock time, times `speed`."""
        self.request(set_clock=messages.SetClock(free_run=messages.SetClock.FreeRun(speed=speed)))

    def pause(self) -> None:
        self.request(set_clock=messages.SetClock(pause=messages.SetClock.Pause()))

    def restart(self) -> None:
        """Resets the world: tick 0, no avatars, every body at its initial pose."""
        self.request(restart=messages.Restart())
        self._contacts.clear()
        self._notices.clear()
        self._horizons.clear()
        self._states.clear()
        self._frames.clear()

    # ---- recordings -------------------------------------------------------------------------

    @property
    def replay(self) -> Optional[Replay]:
        """The state of the replay, as last reported: at each change, not at each tick. None: the
        world plays no recording."""
        for _ in range(MAX_AT_ONCE):
            if self._connection.broken or not self._await_events(0.0):
                break
        return self._replay

    def seek(self, tick: int) -> Step:
        """Moves to another tick of the recording, replay.first_tick to replay.last_tick, and
        abandons a branch. contacts() includes those that end (reason "seek") and begin by it."""
        reply, _ = self.request(seek=messages.Seek(tick=whole(tick, "tick", high=UINT64)))
        self._horizons.clear()
        return Step(reply.seek.tick, reply.seek.time, reply.seek.state_hash, False)

    def recorded_events(self) -> List[Contact]:
        """Returns the contact events of the recording that a timeline shows: begins, blocked moves,
        entered triggers and the closest moments of near misses."""
        found: List[Contact] = []
        after, last = 0, self.welcome.replay.last_tick
        while True:
            reply, _ = self.request(
                recorded_events=messages.RecordedEventsRequest(after_tick=after))
            page = reply.recorded_events
            found += [results.contact(one) for one in page.contacts]
            if page.complete_to >= last or page.complete_to <= after:
                return found
            after = page.complete_to

    def take_over(self, avatar: str = "") -> Optional[Avatar]:
        """Leaves the recording at the present tick; orders are accepted from now on. `avatar`
        belongs to this client and loses its orders; without one only the world leaves."""
        self.request(take_over=messages.TakeOver(avatar=avatar))
        return Avatar(self, avatar) if avatar else None

    # ---- worlds -----------------------------------------------------------------------------

    @property
    def world(self) -> str:
        """The world of this client, fixed for the connection."""
        return self.welcome.world

    @property
    def scenes(self) -> List[str]:
        """The scenes for create_world(); the first is that of the main world."""
        return list(self.welcome.scenes)

    def worlds(self) -> Dict[str, World]:
        """All worlds of the server, by name."""
        reply, _ = self.request(list_worlds=messages.ListWorlds())
        return {one.name: results.world(one) for one in reply.worlds.worlds}

    def create_world(self, name: str = "", *, scene: str = "",
                     drop_when_empty: bool = False) -> World:
        """Creates a world. Defaults: a name from the server, the scene of this client's world.
        connect(..., world=NAME) enters it. It stays until drop_world(). With `drop_when_empty` it
        also ends when its last client has left, or if no client enters it within a minute."""
        reply, _ = self.request(create_world=messages.CreateWorld(
            name=name, scene=scene, drop_when_empty=drop_when_empty))
        return results.world(reply.create_world.world)

    def drop_world(self, name: str) -> None:
        """Ends a world and disconnects its clients."""
        self.request(drop_world=messages.DropWorld(name=name))

    # ---- avatars and bodies -----------------------------------------------------------------

    def command(self, avatar: str, *, tag: Optional[int] = None, **order: Any) -> int:
        """Queues an order, given as walk=messages.Walk(...). Returns the tag of its notices. Raises
        ServerError if it is refused at once."""
        tag = next(self._tags) if tag is None else whole(tag, "tag", high=UINT64)
        self.request(command=messages.Command(avatar=avatar, tag=tag, **order))
        return tag

    def spawn(self, name: str, at: Point, facing: float = 0.0, **options: Any) -> Avatar:
        """Queues an avatar's entry, feet at `at`, looking `facing` DEGREES about +Y from +X.
        `options` are other fields of Spawn: radius, height, flying, parts, links. The avatar is in
        the world after the next tick. Avatar.enter() runs it, and raises if there is no space."""
        avatar = Avatar(self, name)
        avatar.entry = self.command(name, spawn=messages.Spawn(at=vec(at), facing=facing, **options))
        return avatar

    def body(self, name: str, *, open: bool = False, close: bool = False, stop: bool = False,
             run: bool = False, to: Optional[float] = None, level: Optional[int] = None,
             speed: Optional[float] = None) -> None:
        """Commands a door, a lift or a path body: one of open, close, stop, run, `to` (its
        coordinate) and `level` (a lift's stop)."""
        given = [what for what, on in (("open", open), ("close", close), ("stop", stop), ("run", run))
                 if on]
        given += [what for what, value in (("to", to), ("level", level)) if value is not None]
        if len(given) != 1:
            raise ValueError("body: give one of open=True, close=True, stop=True, run=True, to, "
                             f"level; {given or 'none'} given")
        command = messages.BodyCommand(body=name, to=to, level=optional_whole(level, "level", high=UINT32), speed=speed)
        if to is None and level is None:
            getattr(command, given[0]).SetInParent()
        self.request(body_command=command)

    # ---- paths and places -------------------------------------------------------------------

    def navigation(self, radius: Optional[float] = None, height: Optional[float] = None,
                   step: Optional[float] = None, *, speed: Optional[float] = None, doors: str = "as_they_are",
                   progress: Optional[Callable[[float], None]] = None) -> Navigation:
        """Returns paths and places for an upright avatar of a size in metres (default: as an avatar's).
        `doors`: "as_they_are" at the tick of each query, or "open". The first query builds meshes, and calls
        `progress` with the share that is done, 0 to 1; each restarts the timeout. `step`: that of the world."""
        return Navigation(self, radius, height, speed, doors, progress, step)

    # ---- checkpoints ------------------------------------------------------------------------

    def save(self) -> bytes:
        """Returns the complete state of the world after the last tick, for restore()."""
        _, attachment = self.request(save=messages.SaveWorld())
        return bytes(attachment)

    def _upload(self, data: bytes) -> bool:
        """Sends bytes ahead of a request that they do not fit into; False: they fit."""
        room = self.limits.max_message - 4096  # for the request around them
        for first in range(0, len(data) if len(data) > room else 0, room):
            self.request(upload=messages.Upload(part=data[first:first + room], first=first == 0))
        return len(data) > room

    def restore(self, checkpoint: bytes) -> Step:
        """Continues from a state that save() returned, in any server of the same version with the
        same scene. This client must drive the clock; it owns all avatars of the restored world."""
        sent = self._upload(checkpoint)
        reply, _ = self.request(restore=messages.RestoreWorld(checkpoint=b"" if sent else checkpoint, uploaded=sent))
        self._horizons.clear()
        return Step(reply.restore.tick, reply.restore.time, reply.restore.state_hash, False)

    # ---- the end ----------------------------------------------------------------------------

    def close(self) -> None:
        """Sends Bye and closes; this client's avatars leave."""
        if not self._connection.broken:
            bye = messages.ClientMessage(request_id=next(self._ids), bye=messages.Bye())
            try:
                self._connection.send([bye])
            except ConnectionFailed:
                pass  # it ends either way
        self._connection.close()

    def shutdown_send(self) -> None:
        """Shuts down sending for a server that ends; its final message stays readable."""
        self._connection.shutdown_send()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()
