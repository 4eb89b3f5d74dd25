"""A blocking client of one server."""

from __future__ import annotations

import contextlib
import itertools
import time
import warnings
from collections import deque
from typing import Any, Callable, Deque, Dict, Iterable, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import messages, results
from .arguments import UINT32, UINT64, optional_whole, whole
from .avatar import Avatar
from .connection import Connection, Received, raise_refusal, server_error
from .errors import ConnectionFailed, EnfiladeError, OrderFailed, ServerError
from .navigation import Navigation
from .plans import FloorPlan, floor_plan
from .questions import Point, avatar_ids, cannot_touch_query, entity, frame_request, points, vec
from .results import (Apart, Contact, Frame, Hits, Horizon, Notice, Pair, Replay, Scan, State,
                      Step, Touching, World)

PROTOCOL_VERSION = "1.0.0"
KEPT_FRAMES = 16  # of watches, until frames() takes them; the oldest are dropped first
MAX_RUN_TICKS = 36_000  # ticks that run_until_idle() runs before it gives up
MAX_AT_ONCE = 10_000  # messages that are received without waiting, before their content is returned

Entity = Union[int, str, Avatar]  # an id, a name or a path
Reply = Tuple[Any, memoryview]  # a message and its attachment


def connect(address: str = "127.0.0.1:7878", *, name: str = "enfilade python", token: str = "",
            timeout: float = 30.0, world: str = "main") -> "Client":
    """Connects to HOST:PORT, with a token if the server requires one, and enters a world. Raises
    ConnectionFailed, or ServerError if the server refuses."""
    host, colon, port = address.rpartition(":")
    if not colon or not port.isdigit():
        raise ValueError(f"address: give HOST:PORT, as 127.0.0.1:7878, not {address!r}")
    return Client(host.strip("[]"), int(port), name=name, token=token, timeout=timeout, world=world)


class Client:
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
            self.welcome: Any = self.request(hello=hello)[0].welcome
        except BaseException:
            self._connection.close()
            raise
        self._connection.max_message = self.limits.max_message
        if self._replay is None and self.welcome.HasField("replay"):
            self._replay = results.replay(self.welcome.replay)

    def _start(self, connection: Any) -> None:
        """Initializes all but `welcome`."""
        self._connection = connection
        self._ids = itertools.count(1)
        self._tags = itertools.count(1)
        self._contacts: Deque[Contact] = deque()
        self._notices: Deque[Notice] = deque()
        self._horizons: Deque[Horizon] = deque()
        self._states: Deque[State] = deque(maxlen=1)
        self._frames: Deque[Frame] = deque(maxlen=KEPT_FRAMES)
        self._replay: Optional[Replay] = None  # as last reported
        self._subscribed: Any = messages.Subscribe()
        self._sequence = 0  # of the last events
        self._answered = 0  # the request of the last reply taken
        self._show_progress: Optional[Callable[[float], None]] = None  # of navigation meshes

    # ---- the server --------------------------------------------------------------------------

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
        """The renderer's name; empty if the server cannot draw."""
        return self.welcome.renderer

    @property
    def bodies(self) -> Dict[str, Any]:
        """Doors, lifts and all other bodies, by name."""
        return {body.name: body for body in self.welcome.scene.bodies}

    # ---- requests ---------------------------------------------------------------------------

    def pipeline(self, requests: Iterable[Dict[str, Any]]) -> List[Reply]:
        """Sends several requests in one write and takes their replies, in order. A request is
        {"step": messages.Step(ticks=1)}. After all replies, the first failure is raised."""
        return self.take(self.post(requests))

    def post(self, requests: Iterable[Dict[str, Any]]) -> List[int]:
        """The first half of pipeline(): sends without waiting. Returns the request ids."""
        batch = [messages.ClientMessage(**body) for body in requests]
        posted = self._post(batch)
        for one in batch:
            if one.HasField("subscribe"):
                self._subscribed = one.subscribe
        return posted

    def _post(self, batch: List[Any]) -> List[int]:
        """Numbers and sends ClientMessages, which the caller may use again."""
        posted = [next(self._ids) for _ in batch]
        for one, number in zip(batch, posted):
            one.request_id = number
        self._send(batch)
        return posted

    def _send(self, batch: List[Any]) -> None:
        try:
            self._connection.send(batch)
        except ConnectionFailed:
            self._raise_final_error()
            raise

    def take(self, posted: List[int]) -> List[Reply]:
        """The second half: returns the replies to the posted requests, in their order. After all
        replies, the first refusal is raised."""
        replies = self.replies(posted)
        for reply, _ in replies:
            raise_refusal(reply)
        return replies

    def replies(self, posted: List[int]) -> List[Reply]:
        """As take(), but does not raise refusals: see raise_refusal()."""
        return [self._reply_to(one) for one in posted]

    def request(self, **body: Any) -> Reply:
        """Sends one request, as step=messages.Step(ticks=1). Returns the reply and its attachment."""
        return self.pipeline([body])[0]

    def _raise_final_error(self) -> None:
        """Raises the server's final error, if any: it says more than a broken pipe."""
        try:
            while self._await_events(0.0):
                pass
        except ConnectionFailed:
            pass

    def _reply_to(self, request_id: int) -> Reply:
        if request_id <= self._answered:
            raise EnfiladeError(f"the reply to request {request_id} was discarded: a later one was "
                                "taken first")
        while True:
            received = self._connection.next()
            assert received is not None  # None only with a time limit
            if received.message.reply_to == request_id:
                self._answered = request_id
                self._connection.done(received)
                return received.message, received.attachment
            self._keep(received, request_id)

    def _keep(self, received: Received, awaited: int = 0) -> None:
        """Keeps a message that does not reply to `awaited`. An interrupted call can be repeated."""
        message = received.message
        body = message.WhichOneof("body")
        if message.reply_to != 0:
            # Replies come in order: an earlier one belongs to an interrupted request.
            if awaited and message.reply_to > awaited:
                raise self._connection._failed(f"it replies to request {message.reply_to}, not to "
                                               f"request {awaited}")
        elif body == "events":
            self._keep_events(received)
        elif body == "state":
            self._states.append(results.state(message.state))
        elif body == "replay":
            self._replay = results.replay(message.replay)
        elif body == "navigation_progress" and self._show_progress:
            self._show_progress(message.navigation_progress.share)
        elif body == "frame":
            if not self._frames or self._frames[-1].message != message.frame:
                self._frames.append(results.frame(message.frame, received.attachment))
        elif body == "error":
            self._connection.broken = message.error.message
            self._connection.done(received)
            raise server_error(message.error, fatal=True)
        elif body == "bye":
            self._connection.broken = f"the server ended the connection: {message.bye.reason}"
            self._connection.done(received)
            raise ServerError(message.bye.code, message.bye.reason, fatal=True)
        self._connection.done(received)

    def _keep_events(self, received: Received) -> None:
        events = received.message.events
        if received.marks is None:
            received.marks = (self._sequence + 1, len(self._contacts), len(self._notices), len(self._horizons))
        sequence, contacts, notices, horizons = received.marks
        if events.sequence != sequence:
            raise self._connection._failed(
                f"received events {events.sequence} instead of {sequence}")
        for kept, length in ((self._contacts, contacts), (self._notices, notices),
                             (self._horizons, horizons)):
            while len(kept) > length:  # of an interrupted attempt
                kept.pop()
        self._contacts.extend([results.contact(one) for one in events.contacts])
        self._notices.extend([results.notice(one) for one in events.notices])
        self._horizons.extend([results.horizon(one, events) for one in events.horizons])
        self._sequence = sequence

    def _await_events(self, seconds: float) -> bool:
        """Receives one unsolicited message; False if none came in time."""
        received = self._connection.next(seconds)
        if received is not None:
            self._keep(received)
        return received is not None

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

    # ---- events -----------------------------------------------------------------------------

    def subscribe(self, *, contacts: bool = False, near_misses: bool = False, notices: bool = False,
                  state: bool = False, state_rate: float = 0.0,
                  persists: bool = False,
                  contact_horizon: Union[bool, Iterable[int]] = False,
                  approaches: int = 1) -> List[Contact]:
        """Selects the unsolicited messages, instead of the previous selection. Returns the active
        contacts, as they began (with contacts=True). All contacts and notices are kept until they
        are taken. With `persists` contacts() also has each continuing contact in every tick between
        its beginning and its end, with the values of that tick. `contact_horizon`: True for all
        avatars, or entity ids of avatars (Notice.id, AvatarState.id). horizons() then has a proved
        time before which each comes into contact with nothing; `approaches` (1 to 16) is the
        maximum number of entities in it."""
        if near_misses and self.welcome.policies.near_miss <= 0:
            warnings.warn("subscribe: this server reports no near misses; start it with --near-miss "
                          "METRES", stacklevel=2)
        if persists and "persists" not in self.welcome.capabilities:
            warnings.warn("subscribe: this server does not report that contacts persist; start a "
                          "newer one", stacklevel=2)
        wanted = messages.Subscribe(contacts=contacts, near_misses=near_misses, notices=notices,
                                    state=state, state_rate=state_rate, persists=persists)
        if contact_horizon is not False:
            if "contact_horizon" not in self.welcome.capabilities:
                warnings.warn("subscribe: this server computes no contact horizons; start a newer "
                              "one", stacklevel=2)
            wanted.contact_horizon.approaches = whole(approaches, "approaches")
            if contact_horizon is not True:
                wanted.contact_horizon.avatars.extend(avatar_ids(contact_horizon))
        reply, _ = self.request(subscribe=wanted)
        return [results.contact(one) for one in reply.subscribe.live]

    @contextlib.contextmanager
    def _with_notices(self) -> Iterator[None]:
        """Subscribes to notices meanwhile; they are dropped afterwards if they were not subscribed."""
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
        """Takes the contact events, in order. With `seconds` it waits at most this long for each
        next one, as needed with a free-running clock. Call subscribe(contacts=True) first."""
        return self._taken(self._contacts, seconds)

    def notices(self, seconds: float = 0.0) -> Iterator[Notice]:
        """Takes the outcomes of orders, in order. Call subscribe(notices=True) first."""
        return self._taken(self._notices, seconds)

    def horizons(self, seconds: float = 0.0) -> Iterator[Horizon]:
        """Takes the contact horizons of avatars, in order: all of them after the first tick, then
        those that changed. One holds until its time for the entities of its tick, whatever
        clients command, unless one of the two steps onto a dynamic body. A later one of the same
        avatar replaces it; restart() and seek(), by any client, void all. Call
        subscribe(contact_horizon=True) first, on a server with a low --speed-limit."""
        return self._taken(self._horizons, seconds)

    def states(self, seconds: float = 0.0) -> Iterator[State]:
        """Takes the states of all avatars, the latest only. Call subscribe(state=True) first."""
        return self._taken(self._states, seconds)

    def _taken(self, kept: Deque[Any], seconds: float) -> Iterator[Any]:
        while True:
            for _ in range(MAX_AT_ONCE):
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
        """Takes the contacts that came with replies, which are all in lockstep."""
        return [self._contacts.popleft() for _ in range(len(self._contacts))]

    # ---- pictures and queries ---------------------------------------------------------------

    def frame(self, avatar: str = "", *, eye: Optional[Point] = None,
              target: Optional[Point] = None, forward: Optional[Point] = None,
              up: Optional[Point] = None, width: int = 640, height: int = 480,
              fov_y: Optional[float] = None, intrinsics: Optional[Sequence[float]] = None,
              height_y: Optional[float] = None, near: Optional[float] = None,
              far: Optional[float] = None, channels: Sequence[str] = ("rgb",), glass: str = "",
              renderer: str = "", shadows: Optional[bool] = None, lens: str = "",
              distortion: Sequence[float] = (), depth_noise: Union[None, int, Mapping[str, Any]] = None,
              flow_from: Optional[int] = None, flow_forward: Optional[Point] = None,
              collision_shapes: bool = False, samples: int = 1, tick: Optional[int] = None) -> Frame:
        """Returns a picture of the last tick. It is taken from the eyes of `avatar` (along `forward`
        if given), or from `eye` towards `target` or along `forward`; `avatar` is then invisible.
        `up` (with an eye) must not be parallel to the view: straight down needs one. The lens:
        `fov_y` radians, or `intrinsics` (fx, fy, cx, cy) in pixels from the top left corner, or,
        with an eye, `height_y` metres of an orthographic picture. `channels`: some of "rgb", "depth", "ids",
        "normals", "range", "class", "thing", "flow". `glass`: "clear" or "solid". `renderer`: "gl" or "rays".
        `shadows`: of the sun, in the colour; None: where they cost little. `lens`: "fisheye" (OpenCV's model;
        `fov_y` is then the angle of the whole width, default pi, or `intrinsics` replace it; `distortion`
        k1 to k4) or "equirectangular", which has neither. `depth_noise`: the seed of a structured-light
        camera's noise in "depth", or {"model": "redwood", "seed":, "scale":, "distortion": FILE}, see
        load_distortion(). `flow_from`: the earlier tick of the channel "flow", of the last 32, and
        `flow_forward` the direction in which the avatar looked then, if `forward` is given. `collision_shapes`
        draws avatars as these, not as people. `samples`: 1, 4 or 16 of the colour in each pixel."""
        query = frame_request(avatar, eye=eye, target=target, forward=forward, up=up, width=width,
                              height=height, fov_y=fov_y, intrinsics=intrinsics, height_y=height_y,
                              near=near, far=far, channels=channels, glass=glass,
                              renderer=renderer, shadows=shadows, lens=lens, distortion=distortion,
                              depth_noise=depth_noise, flow_from=flow_from,
                              flow_forward=flow_forward, collision_shapes=collision_shapes,
                              samples=samples, tick=tick)
        if samples != 1 and "samples" not in self.welcome.capabilities:
            warnings.warn("frame: this server draws one sample a pixel; start a newer one", stacklevel=2)
        if shadows and "shadows" not in self.welcome.capabilities:
            warnings.warn("frame: this server draws no shadows; start a newer one", stacklevel=2)
        reply, attachment = self.request(frame=query)
        return results.frame(reply.frame, attachment)

    def watch(self, number: int = 1, avatar: str = "", *, rate: float = 0.0, **view: Any) -> None:
        """Subscribes to pictures: one at once, then as ticks run, at most `rate` per second of
        simulated time (0: one per tick). `view` as for frame(). frames() takes them, the latest
        only."""
        self.request(watch_frames=messages.WatchFrames(
            watch=whole(number, "number"), rate=rate, frame=frame_request(avatar, **view)))

    def unwatch(self, number: int = 1) -> None:
        self.request(watch_frames=messages.WatchFrames(watch=whole(number, "number")))

    def frames(self, seconds: float = 0.0) -> Iterator[Frame]:
        """Takes the pictures of watches: Frame.message.watch names the watch, and .dropped counts
        the omitted pictures."""
        return self._taken(self._frames, seconds)

    def rays(self, origins: Any, directions: Any, *, reach: float = 0.0, through_avatar: str = "",
             through_glass: bool = False) -> Hits:
        """Returns the first hit of each ray, within `reach` metres (0: unlimited); N x 3 numbers
        each. limits.max_rays determines the number of requests."""
        origins, directions = points(origins, "origins"), points(directions, "directions")
        if len(origins) != len(directions):
            raise ValueError(f"rays: {len(origins)} origins and {len(directions)} directions")
        page = min(self.limits.max_rays, (self.limits.max_message - 512) // results.RAY_BYTES)
        packed = "packed_rays" in self.welcome.capabilities
        replies: List[Hits] = []
        for start in range(0, max(1, len(origins)), page):
            options = messages.RayQuery(through_avatar=through_avatar, through_glass=through_glass, packed=packed)
            query = results.RayRequest(next(self._ids), origins[start:start + page],
                                       directions[start:start + page], reach, options)
            self._send([query])
            reply, attachment = self.take([query.request_id])[0]
            replies.append(results.packed_hits(reply.rays, attachment) if packed else
                           results.hits(reply.rays))
        if replies[0].tick != replies[-1].tick:
            raise EnfiladeError(f"rays: the clock advanced between the requests, from tick "
                                f"{replies[0].tick} to {replies[-1].tick}: pause() first, or give "
                                f"at most {page}")
        return results.joined(replies)

    def sees(self, origin: Point, target: Point, *, through_avatar: str = "") -> bool:
        """Returns whether the line between two points (x, y, z), in metres of the scene's frame, is
        free. Avatars block it, also this client's own, except `through_avatar`. From an avatar's
        eyes: origin = AvatarState.eyes. There is no angle of view: the target may lie behind it."""
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
        """Returns a range scan over `width` x `height` radians, from an avatar's eyes along its view
        direction, or from `at` along +X; `forward` replaces either as angle 0. Column c has the angle
        -width/2 + c * width / (columns - 1), from left to right. In a full turn, the default, it is
        -pi + c * 2 pi / columns: column 0 looks backwards and column columns/2 ahead. Row r has
        height/2 - r * height / (rows - 1), from the top. Angles are about `up` (default +Y); only
        its component perpendicular to forward counts. From (1, 0, 0), +Z is to the right."""
        if (at is None) == (not avatar):
            raise ValueError("scan: give either an avatar or at")
        scan = messages.RangeScan(width=width, height=height, columns=whole(columns, "columns"),
                                  rows=whole(rows, "rows"), reach=reach)
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
        """Returns the exact relation of two entities, each an id, a name, a path or an Avatar.
        `refined`: within 1e-15 of the distance, and with the penetration depth."""
        return self.distances([(a, b)], refined, tick=tick)[0]

    def distances(self, pairs: Sequence[Tuple[Entity, Entity]], refined: bool = False, *,
                  tick: Optional[int] = None) -> List[Pair]:
        """distance() of many pairs at one tick, in their order. limits.max_pairs determines the
        number of requests."""
        found: List[Pair] = []
        page = self.limits.max_pairs
        for start in range(0, len(pairs), page):
            query = messages.DistanceQuery(refined=refined, tick=optional_whole(tick, "tick"), pairs=[
                messages.DistanceQuery.Pair(a=entity(a), b=entity(b))
                for a, b in pairs[start:start + page]])
            reply = self.request(distances=query)[0].distances
            found += [results.pair(one, reply.tick) for one in reply.pairs]
        if found and found[0].tick != found[-1].tick:
            raise EnfiladeError(f"distances: the clock advanced between the requests, from tick "
                                f"{found[0].tick} to {found[-1].tick}: pause() first, or give at "
                                f"most {page}")
        return found

    def touching(self, which: Entity, within: float = 0.0, *,
                 tick: Optional[int] = None) -> Touching:
        """Returns the entities that touch or penetrate one, and those closer than `within` metres."""
        reply, _ = self.request(touching=messages.TouchingQuery(
            entity=entity(which), within=within, tick=optional_whole(tick, "tick")))
        return results.touching(reply.touching)

    def cannot_touch_before(self, a: Entity, b: Entity, *, assume: str = "present_motion",
                            least: float = 0.0, tick: Optional[int] = None) -> Apart:
        """Returns a time before which two entities cannot touch: if the "present_motion" continues, or under
        "any_command" to avatars and bodies. `least`: the shortest useful waiting time (seconds)."""
        return results.apart(self.request(cannot_touch=cannot_touch_query(a, b, assume, least, tick))[0].cannot_touch)

    def floor_plan(self, floor: float) -> FloorPlan:
        """Returns the plan of the storey whose floor is at a height (metres): what a plane cuts 1.2 m above."""
        return floor_plan(self.request(floor_plan=messages.FloorPlanRequest(floor=floor))[0].floor_plan)

    def navigation(self, radius: Optional[float] = None, height: Optional[float] = None,
                   step: Optional[float] = None, *, speed: Optional[float] = None, doors: str = "as_they_are",
                   progress: Optional[Callable[[float], None]] = None) -> Navigation:
        """Returns paths and places for an upright avatar of a size in metres (default: as an avatar's).
        `doors`: "as_they_are" at the tick of each query, or "open". The first query builds meshes, and calls
        `progress` with the share that is done, 0 to 1; each restarts the timeout. `step`: that of the world."""
        return Navigation(self, radius, height, speed, doors, progress, step)

    def names(self, ids: Union[np.ndarray, Iterable[int]]) -> Dict[int, str]:
        """Returns the path of an object or the name of an avatar, by entity id; "" for an unknown
        id. An array may have any shape: names(picture.ids)."""
        if isinstance(ids, np.ndarray):
            ids = np.unique(ids).tolist()
        wanted = list(dict.fromkeys(whole(one, "ids") for one in ids))
        found: Dict[int, str] = {}
        page = 4096
        for start in range(0, len(wanted), page):
            reply, _ = self.request(
                describe=messages.DescribeEntities(ids=wanted[start:start + page]))
            found.update((one.id, one.name) for one in reply.names.entities)
        return found

    def objects(self) -> List[results.ObjectInfo]:
        """Returns all objects of the scene, in the order of their ids, with path, class, thing, box,
        storey and material."""
        count, page = self.welcome.scene.objects, 8192
        found: List[results.ObjectInfo] = []
        for first in range(1, count + 1, page):
            ids = range(first, min(first + page, count + 1))
            reply, _ = self.request(describe=messages.DescribeEntities(ids=ids, details=True))
            found += [results.object_info(one) for one in reply.names.entities]
        return found

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

    def metrics(self) -> Any:
        return self.request(metrics=messages.MetricsRequest())[0].metrics

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
