"""A blocking client of one server."""

from __future__ import annotations

import contextlib
import itertools
import operator
import time
import warnings
from collections import deque
from typing import Any, Deque, Dict, Iterable, Iterator, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import messages, results
from .avatar import Avatar
from .connection import Connection, Received, raise_refusal, server_error
from .errors import ConnectionFailed, EnfiladeError, OrderFailed, ServerError
from .questions import Point, cannot_touch_query, entity, frame_request, points, vec
from .results import (Apart, Contact, Frame, Hits, Notice, Pair, Replay, Scan, State,
                      Step, Touching, World)

PROTOCOL_VERSION = "1.0.0"
KEPT_FRAMES = 16  # of watches, until frames() takes them; older ones go first
LONGEST_RUN = 36_000  # ticks that run_until_idle() makes before it gives up
MOST_AT_ONCE = 10_000  # messages that are taken without waiting, before what they told is given

Entity = Union[int, str, Avatar]  # an id, a name or a path
Reply = Tuple[Any, memoryview]  # a message and its attachment


def connect(address: str = "127.0.0.1:7878", *, name: str = "enfilade python", token: str = "",
            timeout: float = 30.0, world: str = "main") -> "Client":
    """Connects to HOST:PORT, with a token where the server wants one, and enters a world. Raises
    ConnectionFailed, or ServerError when it is refused."""
    host, colon, port = address.rpartition(":")
    if not colon or not port.isdigit():
        raise ValueError(f"address: give HOST:PORT, as 127.0.0.1:7878, not {address!r}")
    return Client(host.strip("[]"), int(port), name=name, token=token,
                  timeout=timeout, world=world)


class Client:
    """One connection. Not for use from two threads at once; open one connection each.

    `timeout` (seconds) is for connecting and for each reply: a step's reply comes after all its
    ticks. Errors of the server are raised as ServerError; what it sends unasked is kept until
    contacts(), notices(), states() or frames() take it. An exception out of a signal's handler, as
    KeyboardInterrupt, leaves the client usable: the reply to what was interrupted is left aside.
    """

    def __init__(self, host: str, port: int, *, name: str = "enfilade python", token: str = "",
                 timeout: float = 30.0, world: str = "main") -> None:
        self._connection = Connection(host, port, timeout)
        self._ids = itertools.count(1)
        self._tags = itertools.count(1)
        self._contacts: Deque[Contact] = deque()
        self._notices: Deque[Notice] = deque()
        self._states: Deque[State] = deque(maxlen=1)
        self._frames: Deque[Frame] = deque(maxlen=KEPT_FRAMES)
        self._replay: Optional[Replay] = None  # as the server told it last
        self._subscribed: Any = messages.Subscribe()
        self._sequence = 0  # of the events that came last
        self._answered = 0  # the request whose reply was taken last
        hello = messages.Hello(protocol_version=PROTOCOL_VERSION, client_name=name, token=token,
                               world=world)
        try:
            self.welcome: Any = self.request(hello=hello)[0].welcome
        except BaseException:
            self._connection.close()
            raise
        self._connection.max_message = self.limits.max_message
        if self._replay is None and self.welcome.HasField("replay"):
            self._replay = results.replay(self.welcome.replay)

    # ---- what the server is -----------------------------------------------------------------

    @property
    def tick_seconds(self) -> float:
        return self.welcome.policies.tick

    @property
    def limits(self) -> Any:
        return self.welcome.limits

    @property
    def capabilities(self) -> List[str]:
        return list(self.welcome.capabilities)

    @property
    def renderer(self) -> str:
        """Who draws; empty when the server cannot."""
        return self.welcome.renderer

    @property
    def bodies(self) -> Dict[str, Any]:
        """Doors, lifts and all else that moves, by name."""
        return {body.name: body for body in self.welcome.scene.bodies}

    # ---- requests ---------------------------------------------------------------------------

    def pipeline(self, requests: Iterable[Dict[str, Any]]) -> List[Reply]:
        """Sends several requests in one write and takes their replies, in order; each is given as
        {"step": messages.Step(ticks=1)}. The first that failed is raised when all were answered."""
        return self.take(self.post(requests))

    def post(self, requests: Iterable[Dict[str, Any]]) -> List[int]:
        """The first half of pipeline(): sends, and does not wait."""
        asked = [messages.ClientMessage(request_id=next(self._ids), **body) for body in requests]
        self._send(asked)
        for one in asked:
            if one.HasField("subscribe"):
                self._subscribed = one.subscribe
        return [one.request_id for one in asked]

    def _send(self, asked: List[Any]) -> None:
        try:
            self._connection.send(asked)
        except ConnectionFailed:
            self._raise_last_words()
            raise

    def take(self, posted: List[int]) -> List[Reply]:
        """The second half: the replies to what was posted, in the order in which it was. The first
        that is a refusal is raised when all were taken."""
        replies = self.replies(posted)
        for reply, _ in replies:
            raise_refusal(reply)
        return replies

    def replies(self, posted: List[int]) -> List[Reply]:
        """As take(), but refusals are not raised: see raise_refusal()."""
        return [self._reply_to(one) for one in posted]

    def request(self, **body: Any) -> Reply:
        """The reply to one request, given as step=messages.Step(ticks=1), and its attachment."""
        return self.pipeline([body])[0]

    def _raise_last_words(self) -> None:
        """What the server said before it closed is worth more than a broken pipe."""
        try:
            while self._await_events(0.0):
                pass
        except ConnectionFailed:
            pass

    def _reply_to(self, request_id: int) -> Reply:
        if request_id <= self._answered:
            raise EnfiladeError(f"the reply to request {request_id} was left aside: a later one was "
                                "taken first")
        while True:
            received = self._connection.next()
            assert received is not None  # only with a time limit None is returned
            if received.message.reply_to == request_id:
                self._answered = request_id
                self._connection.done(received)
                return received.message, received.attachment
            self._keep(received, request_id)

    def _keep(self, received: Received, awaited: int = 0) -> None:
        """What is no reply to `awaited`. An interrupted one is done again for the same message."""
        message = received.message
        body = message.WhichOneof("body")
        if message.reply_to != 0:
            # Replies come in order: an earlier one is of a request that was interrupted.
            if awaited and message.reply_to > awaited:
                raise self._connection._failed(f"it answers request {message.reply_to}, which is not "
                                               "the one that waits")
        elif body == "events":
            self._keep_events(received)
        elif body == "state":
            self._states.append(results.state(message.state))
        elif body == "replay":
            self._replay = results.replay(message.replay)
        elif body == "frame":
            if not self._frames or self._frames[-1].message != message.frame:
                self._frames.append(results.frame(message.frame, received.attachment))
        elif body == "error":
            self._connection.broken = message.error.message
            self._connection.done(received)
            raise server_error(message.error, fatal=True)
        elif body == "bye":
            self._connection.broken = f"it said goodbye: {message.bye.reason}"
            self._connection.done(received)
            raise ServerError(message.bye.code, message.bye.reason, fatal=True)
        self._connection.done(received)

    def _keep_events(self, received: Received) -> None:
        events = received.message.events
        if received.marks is None:
            received.marks = (self._sequence + 1, len(self._contacts), len(self._notices))
        sequence, contacts, notices = received.marks
        if events.sequence != sequence:
            raise self._connection._failed(
                f"events {events.sequence} came in the place of {sequence}")
        for kept, length in ((self._contacts, contacts), (self._notices, notices)):
            while len(kept) > length:  # of an attempt that was interrupted
                kept.pop()
        self._contacts.extend([results.contact(one) for one in events.contacts])
        self._notices.extend([results.notice(one) for one in events.notices])
        self._sequence = sequence

    def _await_events(self, seconds: float) -> bool:
        """Takes one message that comes unasked; False when none came in time."""
        received = self._connection.next(seconds)
        if received is not None:
            self._keep(received)
        return received is not None

    # ---- time -------------------------------------------------------------------------------

    def step(self, ticks: int = 1, *, avatars: bool = False) -> Step:
        """Makes ticks, in lockstep. `avatars` asks where everyone is after the last."""
        reply, _ = self.request(step=messages.Step(ticks=operator.index(ticks), avatars=avatars))
        return results.step(reply.step)

    def run_until_idle(self, most: int = LONGEST_RUN, *, at_a_time: int = 60) -> Step:
        """Steps until every queue is empty. Raises OrderFailed after `most` ticks."""
        if at_a_time < 1:
            raise ValueError(f"at_a_time: give at least 1, not {at_a_time}")
        for made in range(0, most, at_a_time):
            done = self.step(min(at_a_time, most - made), avatars=True)
            if done.idle:
                return done
        raise OrderFailed(f"the world is not idle after {most} ticks; is somebody driven?")

    def lockstep(self) -> None:
        """Ticks are made by step()."""
        self.request(set_clock=messages.SetClock(lockstep=messages.SetClock.Lockstep()))

    def free_run(self, speed: float = 1.0) -> None:
        """Ticks follow wall-clock time, times `speed`."""
        self.request(set_clock=messages.SetClock(free_run=messages.SetClock.FreeRun(speed=speed)))

    def pause(self) -> None:
        self.request(set_clock=messages.SetClock(pause=messages.SetClock.Pause()))

    def restart(self) -> None:
        """The world as it was at first: tick 0, nobody in it, every body at its place."""
        self.request(restart=messages.Restart())
        self._contacts.clear()
        self._notices.clear()
        self._states.clear()
        self._frames.clear()

    # ---- recordings -------------------------------------------------------------------------

    @property
    def replay(self) -> Optional[Replay]:
        """How the recording stands that this world plays, as far as the server told it: at each
        change, which is not each tick. None: the world plays none."""
        for _ in range(MOST_AT_ONCE):
            if self._connection.broken or not self._await_events(0.0):
                break
        return self._replay

    def seek(self, tick: int) -> Step:
        """Goes on from another tick of the recording, replay.first_tick to replay.last_tick; a branch
        is given up. Contacts that end by it (reason "seek") and begin by it are among contacts()."""
        reply, _ = self.request(seek=messages.Seek(tick=tick))
        return Step(reply.seek.tick, reply.seek.time, reply.seek.state_hash, False)

    def take_over(self, avatar: str = "") -> Optional[Avatar]:
        """Leaves the recording and goes on from here: from now on orders are taken. `avatar` becomes
        this client's and forgets what it was told; without one the world alone leaves."""
        self.request(take_over=messages.TakeOver(avatar=avatar))
        return Avatar(self, avatar) if avatar else None

    # ---- worlds -----------------------------------------------------------------------------

    @property
    def world(self) -> str:
        """The one that this client is in, from its beginning to its end."""
        return self.welcome.world

    @property
    def scenes(self) -> List[str]:
        """What worlds can be made of; the first is that of the main world."""
        return list(self.welcome.scenes)

    def worlds(self) -> Dict[str, World]:
        """All of the server, by name."""
        reply, _ = self.request(list_worlds=messages.ListWorlds())
        return {one.name: results.world(one) for one in reply.worlds.worlds}

    def create_world(self, name: str = "", *, scene: str = "",
                     drop_when_empty: bool = False) -> World:
        """Makes a world, for which the server finds a name where none is given; of the scene of this
        client's own world where none is given. connect(..., world=NAME) enters it. It stays until
        drop_world(), or, with `drop_when_empty`, until its last client has left, or nobody entered it
        within a minute."""
        reply, _ = self.request(create_world=messages.CreateWorld(
            name=name, scene=scene, drop_when_empty=drop_when_empty))
        return results.world(reply.create_world.world)

    def drop_world(self, name: str) -> None:
        """Ends a world; whoever is in it is disconnected."""
        self.request(drop_world=messages.DropWorld(name=name))

    # ---- avatars and bodies -----------------------------------------------------------------

    def command(self, avatar: str, *, tag: Optional[int] = None, **order: Any) -> int:
        """Queues an order, given as walk=messages.Walk(...); the tag that its notices will carry.
        Raises ServerError when it is refused at once."""
        tag = next(self._tags) if tag is None else tag
        self.request(command=messages.Command(avatar=avatar, tag=tag, **order))
        return tag

    def spawn(self, name: str, at: Point, facing: float = 0.0, **options: Any) -> Avatar:
        """Queues an avatar's entry, feet at `at`, looking `facing` DEGREES about +Y from +X.
        `options` are other fields of Spawn: radius, height, flying, parts, links. It is in the world
        after the next tick; Avatar.enter() makes it, and raises when there is no room."""
        avatar = Avatar(self, name)
        avatar.entry = self.command(name, spawn=messages.Spawn(at=vec(at), facing=facing, **options))
        return avatar

    def body(self, name: str, *, open: bool = False, close: bool = False, stop: bool = False,
             run: bool = False, to: Optional[float] = None, level: Optional[int] = None,
             speed: Optional[float] = None) -> None:
        """Commands a door, a lift or something on a path. One of open, close, stop, run, `to` (its
        coordinate) and `level` (a lift's stop)."""
        told = [what for what, on in (("open", open), ("close", close), ("stop", stop), ("run", run))
                if on]
        told += [what for what, value in (("to", to), ("level", level)) if value is not None]
        if len(told) != 1:
            raise ValueError("body: give one of open=True, close=True, stop=True, run=True, to, "
                             f"level; {told or 'none'} given")
        command = messages.BodyCommand(body=name, to=to, level=level, speed=speed)
        if to is None and level is None:
            getattr(command, told[0]).SetInParent()
        self.request(body_command=command)

    # ---- what happens -----------------------------------------------------------------------

    def subscribe(self, *, contacts: bool = False, near_misses: bool = False, notices: bool = False,
                  state: bool = False, state_rate: float = 0.0,
                  persists: bool = False) -> List[Contact]:
        """Says what the server sends unasked, in the place of what it sent before. Returns the
        contacts that live now, as they began (with contacts=True). Contacts and notices are kept until
        they are taken, however many they become. With `persists` each contact that goes on is among
        contacts() in every tick between its beginning and its end, as it is then."""
        if near_misses and self.welcome.policies.near_miss <= 0:
            warnings.warn("subscribe: this server tells no near misses; start it with --near-miss "
                          "METRES", stacklevel=2)
        if persists and "persists" not in self.welcome.capabilities:
            warnings.warn("subscribe: this server does not tell that contacts persist; start a newer "
                          "one", stacklevel=2)
        wanted = messages.Subscribe(contacts=contacts, near_misses=near_misses, notices=notices,
                                    state=state, state_rate=state_rate, persists=persists)
        reply, _ = self.request(subscribe=wanted)
        return [results.contact(one) for one in reply.subscribe.live]

    @contextlib.contextmanager
    def _hearing_notices(self) -> Iterator[None]:
        """As if notices were subscribed; those that come meanwhile are forgotten where they were not."""
        before = self._subscribed
        if before.notices:
            yield
            return
        kept = len(self._notices)
        for_now = messages.Subscribe()
        for_now.CopyFrom(before)
        for_now.notices = True
        try:
            self.request(subscribe=for_now)
            yield
        finally:
            if not self._connection.broken:
                self.request(subscribe=before)
            while len(self._notices) > kept:
                self._notices.pop()

    def contacts(self, seconds: float = 0.0) -> Iterator[Contact]:
        """The contact events that have come, in order. With `seconds` it waits so long for each next
        one, as is needed when the clock runs freely; subscribe(contacts=True) first."""
        return self._taken(self._contacts, seconds)

    def notices(self, seconds: float = 0.0) -> Iterator[Notice]:
        """How orders went, in order. subscribe(notices=True) first."""
        return self._taken(self._notices, seconds)

    def states(self, seconds: float = 0.0) -> Iterator[State]:
        """Where everyone is: of what has come only the latest. subscribe(state=True) first."""
        return self._taken(self._states, seconds)

    def _taken(self, kept: Deque[Any], seconds: float) -> Iterator[Any]:
        while True:
            for _ in range(MOST_AT_ONCE):
                if not self._await_events(0.0):
                    break
            if not kept and not self._waited_for(kept, seconds):
                return
            while kept:
                yield kept.popleft()
            if seconds <= 0:
                return

    def _waited_for(self, kept: Deque[Any], seconds: float) -> bool:
        deadline = time.monotonic() + seconds
        while not kept:
            left = deadline - time.monotonic()
            if left <= 0 or not self._await_events(left):
                return False
        return True

    def _kept_contacts(self) -> List[Contact]:
        """Those that came with replies: enough in lockstep."""
        return [self._contacts.popleft() for _ in range(len(self._contacts))]

    # ---- pictures and questions -------------------------------------------------------------

    def frame(self, avatar: str = "", *, eye: Optional[Point] = None,
              target: Optional[Point] = None, forward: Optional[Point] = None,
              up: Optional[Point] = None, width: int = 640, height: int = 480,
              fov_y: Optional[float] = None, intrinsics: Optional[Sequence[float]] = None,
              height_y: Optional[float] = None, near: Optional[float] = None,
              far: Optional[float] = None, channels: Sequence[str] = ("rgb",), glass: str = "",
              renderer: str = "", shadows: bool = False,
              tick: Optional[int] = None) -> Frame:
        """A picture of the last tick: from the eyes of `avatar` (looking along `forward` where that is
        given), or from `eye` towards `target` or along `forward`, and then without `avatar` in it.
        `up` (with an eye) must not lie along the gaze: straight down needs one. The lens: `fov_y`
        radians, or `intrinsics` (fx, fy, cx, cy) in pixels from the top left corner, or, with an eye,
        `height_y` metres of an orthographic picture. `channels` are of "rgb", "depth", "ids",
        "normals", "range"; `glass` is "clear" or "solid", `renderer` "gl" or "rays"; `shadows`
        are the sun's, in the colour."""
        asked = frame_request(avatar, eye=eye, target=target, forward=forward, up=up, width=width,
                              height=height, fov_y=fov_y, intrinsics=intrinsics, height_y=height_y,
                              near=near, far=far, channels=channels, glass=glass,
                              renderer=renderer, shadows=shadows, tick=tick)
        if shadows and "shadows" not in self.welcome.capabilities:
            warnings.warn("frame: this server draws no shadows; start a newer one", stacklevel=2)
        reply, attachment = self.request(frame=asked)
        return results.frame(reply.frame, attachment)

    def watch(self, number: int = 1, avatar: str = "", *, rate: float = 0.0, **view: Any) -> None:
        """Has pictures sent unasked: one at once, then as ticks are made, at most `rate` a second of
        simulated time (0: one a tick). `view` is as of frame(); frames() gives them, the latest only."""
        self.request(watch_frames=messages.WatchFrames(
            watch=number, rate=rate, frame=frame_request(avatar, **view)))

    def unwatch(self, number: int = 1) -> None:
        self.request(watch_frames=messages.WatchFrames(watch=number))

    def frames(self, seconds: float = 0.0) -> Iterator[Frame]:
        """The pictures of watches that came: Frame.message.watch and .dropped tell of which, and how
        many were left out."""
        return self._taken(self._frames, seconds)

    def rays(self, origins: Any, directions: Any, *, reach: float = 0.0, through_avatar: str = "",
             through_glass: bool = False) -> Hits:
        """What each ray meets first, within `reach` metres (0: without end); N x 3 numbers each.
        As many requests as limits.max_rays makes it."""
        origins, directions = points(origins, "origins"), points(directions, "directions")
        if len(origins) != len(directions):
            raise ValueError(f"rays: {len(origins)} origins and {len(directions)} directions")
        page = min(self.limits.max_rays, (self.limits.max_message - 512) // results.RAY_BYTES)
        packed = "packed_rays" in self.welcome.capabilities
        replies: List[Hits] = []
        for start in range(0, max(1, len(origins)), page):
            options = messages.RayQuery(through_avatar=through_avatar, through_glass=through_glass,
                                        packed=packed)
            asked = results.RayRequest(next(self._ids), origins[start:start + page],
                                       directions[start:start + page], reach, options)
            self._send([asked])
            reply, attachment = self.take([asked.request_id])[0]
            replies.append(results.packed_hits(reply.rays, attachment) if packed else
                           results.hits(reply.rays))
        if replies[0].tick != replies[-1].tick:
            raise EnfiladeError(f"rays: the clock went on between them, from tick {replies[0].tick} "
                                f"to {replies[-1].tick}: pause() first, or ask at most {page}")
        return results.joined(replies)

    def sees(self, origin: Point, target: Point, *, through_avatar: str = "") -> bool:
        """Whether nothing stands between two points (x, y, z), in metres of the scene's frame: neither
        an avatar, also one's own that is not `through_avatar`. From an avatar's eyes: origin =
        AvatarState.eyes. It has no angle of view: it may lie behind who looks."""
        direction = [t - o for o, t in zip(origin, target)]
        reach = sum(d * d for d in direction) ** 0.5
        ray = messages.Ray(origin=vec(origin), direction=vec(direction), reach=reach)
        reply, _ = self.request(rays=messages.RayQuery(
            rays=[ray], only_blocked=True, through_avatar=through_avatar))
        return not reply.rays.hits[0].met

    def scan(self, avatar: str = "", *, at: Optional[Point] = None, forward: Optional[Point] = None,
             up: Optional[Point] = None, width: float = 6.283185307179586, height: float = 0.0,
             columns: int = 360, rows: int = 1, reach: float = 0.0, through_avatar: str = "",
             through_glass: bool = False) -> Scan:
        """A range scan over `width` x `height` radians, from an avatar's eyes along its gaze or from
        `at` along +X, or along `forward`, which is the angle 0 of both. Column c has the angle
        -width/2 + c * width / (columns - 1), from left to right; in a full turn, the default, -pi +
        c * 2 pi / columns, so that column 0 looks backwards and column columns/2 ahead. Row r has
        height/2 - r * height / (rows - 1), from above. Angles are about `up` (default +Y), of which
        only what is square to forward counts: from (1, 0, 0), +Z is to the right."""
        if (at is None) == (not avatar):
            raise ValueError("scan: give either an avatar or at")
        scan = messages.RangeScan(width=width, height=height, columns=columns, rows=rows,
                                  reach=reach)
        if at is not None:
            scan.at.CopyFrom(vec(at))
        else:
            scan.avatar = avatar
        if forward is not None:
            scan.forward.CopyFrom(vec(forward))
        if up is not None:
            scan.up.CopyFrom(vec(up))
        reply, attachment = self.request(rays=messages.RayQuery(
            scan=scan, through_avatar=through_avatar, through_glass=through_glass))
        return results.scan(reply.rays, attachment)

    def distance(self, a: Entity, b: Entity, refined: bool = False, *,
                 tick: Optional[int] = None) -> Pair:
        """How two things stand to one another, exactly: each an entity id, a name, a path or an
        Avatar. `refined`: within 1e-15 of the distance, and with the depth of penetration."""
        return self.distances([(a, b)], refined, tick=tick)[0]

    def distances(self, pairs: Sequence[Tuple[Entity, Entity]], refined: bool = False, *,
                  tick: Optional[int] = None) -> List[Pair]:
        """distance() of many pairs at one tick, in their order; as many requests as
        limits.max_pairs makes it."""
        found: List[Pair] = []
        page = self.limits.max_pairs
        for start in range(0, len(pairs), page):
            query = messages.DistanceQuery(refined=refined, tick=tick, pairs=[
                messages.DistanceQuery.Pair(a=entity(a), b=entity(b))
                for a, b in pairs[start:start + page]])
            reply = self.request(distances=query)[0].distances
            found += [results.pair(one, reply.tick) for one in reply.pairs]
        if found and found[0].tick != found[-1].tick:
            raise EnfiladeError(f"distances: the clock went on between them, from tick "
                                f"{found[0].tick} to {found[-1].tick}: pause() first, or ask at "
                                f"most {page}")
        return found

    def touching(self, which: Entity, within: float = 0.0, *,
                 tick: Optional[int] = None) -> Touching:
        """What touches an entity or penetrates it, and what is nearer than `within` metres."""
        reply, _ = self.request(touching=messages.TouchingQuery(
            entity=entity(which), within=within, tick=tick))
        return results.touching(reply.touching)

    def cannot_touch_before(self, a: Entity, b: Entity, *, assume: str = "present_motion",
                            least: float = 0.0, tick: Optional[int] = None) -> Apart:
        """Before which time two certainly do not touch: as long as "present_motion" stays, or
        whatever avatars and bodies are told ("any_command"). `least`: the shortest time (seconds)
        that is worth waiting before looking again."""
        reply, _ = self.request(cannot_touch=cannot_touch_query(a, b, assume, least, tick))
        return results.apart(reply.cannot_touch)

    def names(self, ids: Union[np.ndarray, Iterable[int]]) -> Dict[int, str]:
        """An object's path or an avatar's name, by entity id; "" where no entity has the id. An
        array may have any shape: names(picture.ids)."""
        if isinstance(ids, np.ndarray):
            ids = np.unique(ids).tolist()
        wanted = list(dict.fromkeys(int(one) for one in ids))
        found: Dict[int, str] = {}
        page = 4096
        for start in range(0, len(wanted), page):
            reply, _ = self.request(
                describe=messages.DescribeEntities(ids=wanted[start:start + page]))
            found.update((one.id, one.name) for one in reply.names.entities)
        return found

    def metrics(self) -> Any:
        return self.request(metrics=messages.MetricsRequest())[0].metrics

    # ---- the end ----------------------------------------------------------------------------

    def close(self) -> None:
        """Says goodbye; avatars leave."""
        if not self._connection.broken:
            bye = messages.ClientMessage(request_id=next(self._ids), bye=messages.Bye())
            try:
                self._connection.send([bye])
            except ConnectionFailed:
                pass  # it ends either way
        self._connection.close()

    def say_no_more(self) -> None:
        """Lets a server go that ends; its last words can still be read."""
        self._connection.say_no_more()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()
