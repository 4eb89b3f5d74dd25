"""A blocking client of one server."""

from __future__ import annotations

import itertools
import time
from collections import deque
from typing import Any, Deque, Dict, Iterable, Iterator, List, Optional, Sequence, Tuple

from . import messages, results
from .connection import Connection, server_error
from .errors import ConnectionFailed, OrderFailed, ServerError
from .results import AvatarState, Contact, Frame, Hits, Notice, Scan, State, Step

PROTOCOL_VERSION = "1.0.0"
KEPT_FRAMES = 16  # of watches, until frames() takes them; older ones go first
LONGEST_RUN = 36_000  # ticks that run_until_idle() makes before it gives up

Point = Sequence[float]


def _vec(point: Point) -> Any:
    x, y, z = point
    return messages.Vec3(x=x, y=y, z=z)


def connect(address: str = "127.0.0.1:7878", *, name: str = "enfilade python", token: str = "",
            timeout: float = 30.0) -> "Client":
    """Connects to HOST:PORT, with a token where the server wants one. Raises ConnectionFailed, or ServerError when it is refused."""
    host, colon, port = address.rpartition(":")
    if not colon or not port.isdigit():
        raise ValueError(f"address: give HOST:PORT, as 127.0.0.1:7878, not {address!r}")
    return Client(host.strip("[]"), int(port), name=name, token=token,
                  timeout=timeout)


class Client:
    """One connection. Not for use from two threads at once; open one connection each.

    `timeout` (seconds) is for connecting and for each reply: a step's reply comes after all its
    ticks. Errors of the server are raised as ServerError; what it sends unasked is kept until
    contacts(), notices(), states() or frames() take it.
    """

    def __init__(self, host: str, port: int, *, name: str = "enfilade python", token: str = "",
                 timeout: float = 30.0) -> None:
        self._connection = Connection(host, port, timeout)
        self._ids = itertools.count(1)
        self._tags = itertools.count(1)
        self._contacts: Deque[Contact] = deque()
        self._notices: Deque[Notice] = deque()
        self._states: Deque[State] = deque(maxlen=1)
        self._frames: Deque[Frame] = deque(maxlen=KEPT_FRAMES)
        self._sequence = 0
        hello = messages.Hello(protocol_version=PROTOCOL_VERSION, client_name=name,
                               token=token)
        try:
            self.welcome: Any = self.request(hello=hello)[0].welcome
        except BaseException:
            self._connection.close()
            raise

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

    def pipeline(self, requests: Iterable[Dict[str, Any]]) -> List[Tuple[Any, memoryview]]:
        """Sends several requests in one write and takes their replies, in order; each is given as
        {"step": messages.Step(ticks=1)}. The first that failed is raised when all were answered."""
        return self.take(self.post(requests))

    def post(self, requests: Iterable[Dict[str, Any]]) -> List[int]:
        """The first half of pipeline(): sends, and does not wait."""
        asked = [messages.ClientMessage(request_id=next(self._ids), **body) for body in requests]
        try:
            self._connection.send(asked)
        except ConnectionFailed:
            self._raise_last_words()
            raise
        return [one.request_id for one in asked]

    def take(self, posted: List[int]) -> List[Tuple[Any, memoryview]]:
        """The second half: the replies to what was posted before anything else was."""
        replies = [self._reply_to(one) for one in posted]
        for reply, _ in replies:
            self._raise_refusal(reply)
        return replies

    def request(self, **body: Any) -> Tuple[Any, memoryview]:
        """The reply to one request, given as step=messages.Step(ticks=1), and its attachment."""
        return self.pipeline([body])[0]

    def _raise_last_words(self) -> None:
        """What the server said before it closed is worth more than a broken pipe."""
        try:
            while self._await_events(0.0):
                pass
        except ConnectionFailed:
            pass

    def _reply_to(self, request_id: int) -> Tuple[Any, memoryview]:
        while True:
            received = self._connection.receive()
            assert received is not None  # only a receive with a time limit returns None
            message, attachment = received
            if message.reply_to == request_id:
                return message, attachment
            self._keep(message, attachment)

    @staticmethod
    def _raise_refusal(reply: Any) -> None:
        if reply.HasField("error"):
            raise server_error(reply.error)
        if reply.HasField("command") and not reply.command.accepted:
            raise server_error(reply.command.error)

    def _keep(self, message: Any, attachment: memoryview) -> None:
        body = message.WhichOneof("body")
        if message.reply_to != 0:
            raise self._connection._failed(f"it answers request {message.reply_to}, which is not "
                                           "the one that waits")
        if body == "events":
            self._sequence += 1
            if message.events.sequence != self._sequence:
                raise self._connection._failed(
                    f"events {message.events.sequence} came in the place of {self._sequence}")
            self._contacts.extend(results.contact(one) for one in message.events.contacts)
            self._notices.extend(results.notice(one) for one in message.events.notices)
        elif body == "state":
            self._states.append(results.state(message.state))
        elif body == "frame":
            self._frames.append(results.frame(message.frame, attachment))
        elif body == "error":
            self._connection.broken = message.error.message
            raise server_error(message.error, fatal=True)
        elif body == "bye":
            self._connection.broken = f"it said goodbye: {message.bye.reason}"
            raise ServerError(message.bye.code, message.bye.reason, fatal=True)

    def _await_events(self, seconds: float) -> bool:
        """Takes one message that comes unasked; False when none came in time."""
        received = self._connection.receive(seconds)
        if received is not None:
            self._keep(*received)
        return received is not None

    # ---- time -------------------------------------------------------------------------------

    def step(self, ticks: int = 1, *, avatars: bool = False) -> Step:
        """Makes ticks, in lockstep. `avatars` asks where everyone is after the last."""
        reply, _ = self.request(step=messages.Step(ticks=ticks, avatars=avatars))
        return results.step(reply.step)

    def run_until_idle(self, most: int = LONGEST_RUN, *, at_a_time: int = 60) -> Step:
        """Steps until every queue is empty. Raises OrderFailed after `most` ticks."""
        for _ in range(-(-most // at_a_time)):
            done = self.step(at_a_time, avatars=True)
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

    # ---- avatars and bodies -----------------------------------------------------------------

    def command(self, avatar: str, *, tag: Optional[int] = None, **order: Any) -> int:
        """Queues an order, given as walk=messages.Walk(...); the tag that its notices will carry.
        Raises ServerError when it is refused at once."""
        tag = next(self._tags) if tag is None else tag
        self.request(command=messages.Command(avatar=avatar, tag=tag, **order))
        return tag

    def spawn(self, name: str, at: Point, facing: float = 0.0, **options: Any) -> "Avatar":
        """Queues an avatar's entry, feet at `at`, looking `facing` DEGREES about +Y from +X.
        `options` are other fields of Spawn: radius, height, flying, parts, links. It is in the world
        after the next tick; Avatar.enter() makes it, and raises when there is no room."""
        avatar = Avatar(self, name)
        avatar.entry = self.command(name, spawn=messages.Spawn(at=_vec(at), facing=facing, **options))
        return avatar

    def body(self, name: str, *, speed: Optional[float] = None, **action: Any) -> None:
        """Commands a door, a lift or something on a path: open=True, close=True, stop=True, run=True,
        to=0.5 (its coordinate) or level=1 (a lift's stop)."""
        command = messages.BodyCommand(body=name)
        if speed is not None:
            command.speed = speed
        if len(action) != 1:
            raise ValueError("body: give one of open, close, stop, run, to, level")
        (what, value), = action.items()
        if what in ("to", "level"):
            setattr(command, what, value)
        else:
            getattr(command, what).SetInParent()
        self.request(body_command=command)

    # ---- what happens -----------------------------------------------------------------------

    def subscribe(self, *, contacts: bool = False, near_misses: bool = False, notices: bool = False,
                  state: bool = False, state_rate: float = 0.0) -> List[Contact]:
        """Says what the server sends unasked, in the place of what it sent before. Returns the
        contacts that live now, as they began."""
        reply, _ = self.request(subscribe=messages.Subscribe(
            contacts=contacts, near_misses=near_misses, notices=notices, state=state,
            state_rate=state_rate))
        return [results.contact(one) for one in reply.subscribe.live]

    def contacts(self, seconds: float = 0.0) -> Iterator[Contact]:
        """The contact events that came, in order. With `seconds` it waits so long for each next one,
        as is needed when the clock runs freely; subscribe(contacts=True) first."""
        return self._taken(self._contacts, seconds)

    def notices(self, seconds: float = 0.0) -> Iterator[Notice]:
        """How orders went, in order. subscribe(notices=True) first."""
        return self._taken(self._notices, seconds)

    def states(self, seconds: float = 0.0) -> Iterator[State]:
        """Where everyone is: only the latest is kept. subscribe(state=True) first."""
        return self._taken(self._states, seconds)

    def _taken(self, kept: Deque[Any], seconds: float) -> Iterator[Any]:
        while True:
            while kept:
                yield kept.popleft()
            deadline = time.monotonic() + seconds
            while not kept:
                left = deadline - time.monotonic()
                if left <= 0 or not self._await_events(left):
                    return

    # ---- pictures and questions -------------------------------------------------------------

    def frame(self, avatar: str = "", *, eye: Optional[Point] = None,
              target: Optional[Point] = None, forward: Optional[Point] = None,
              width: int = 640, height: int = 480, fov_y: Optional[float] = None,
              channels: Sequence[str] = ("rgb",), tick: Optional[int] = None) -> Frame:
        """A picture of the last tick: from the eyes of `avatar` (looking along `forward` where that is
        given), or from `eye` towards `target` or along `forward`, and then without `avatar` in it.
        `channels` are of "rgb", "depth", "ids", "normals", "range"."""
        asked = frame_request(avatar, eye=eye, target=target, forward=forward, width=width,
                              height=height, fov_y=fov_y, channels=channels, tick=tick)
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

    def rays(self, origins: Sequence[Point], directions: Sequence[Point], *, reach: float = 0.0,
             through_avatar: str = "", through_glass: bool = False) -> Hits:
        """What each ray meets first, within `reach` metres (0: without end)."""
        if len(origins) != len(directions):
            raise ValueError(f"rays: {len(origins)} origins and {len(directions)} directions")
        rays = [messages.Ray(origin=_vec(origin), direction=_vec(direction), reach=reach)
                for origin, direction in zip(origins, directions)]
        reply, _ = self.request(rays=messages.RayQuery(
            rays=rays, through_avatar=through_avatar, through_glass=through_glass))
        return results.hits(reply.rays)

    def sees(self, origin: Point, target: Point, *, through_avatar: str = "") -> bool:
        """Whether nothing stands between two points."""
        direction = [t - o for o, t in zip(origin, target)]
        reach = sum(d * d for d in direction) ** 0.5
        ray = messages.Ray(origin=_vec(origin), direction=_vec(direction), reach=reach)
        reply, _ = self.request(rays=messages.RayQuery(
            rays=[ray], only_blocked=True, through_avatar=through_avatar))
        return not reply.rays.hits[0].met

    def scan(self, avatar: str = "", *, at: Optional[Point] = None, forward: Optional[Point] = None,
             width: float = 6.283185307179586, height: float = 0.0, columns: int = 360,
             rows: int = 1, reach: float = 0.0) -> Scan:
        """A range scan over `width` x `height` radians, from an avatar's eyes or from `at`."""
        scan = messages.RangeScan(width=width, height=height, columns=columns, rows=rows,
                                  reach=reach)
        if at is not None:
            scan.at.CopyFrom(_vec(at))
        else:
            scan.avatar = avatar
        if forward is not None:
            scan.forward.CopyFrom(_vec(forward))
        reply, attachment = self.request(rays=messages.RayQuery(scan=scan))
        return results.scan(reply.rays, attachment)

    def names(self, ids: Iterable[int]) -> Dict[int, str]:
        """An object's path or an avatar's name, by entity id; "" where no entity has the id."""
        wanted = [int(one) for one in ids]
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

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()


def frame_request(avatar: str = "", *, eye: Optional[Point] = None, target: Optional[Point] = None,
                  forward: Optional[Point] = None, width: int = 640, height: int = 480,
                  fov_y: Optional[float] = None, channels: Sequence[str] = ("rgb",),
                  tick: Optional[int] = None) -> Any:
    """The FrameRequest that Client.frame() sends."""
    asked = messages.FrameRequest(width=width, height=height, channels=results.channels(channels))
    view = asked.eyes if eye is None else asked.free
    if eye is None:
        asked.eyes.avatar = avatar
        if target is not None:
            raise ValueError("frame: a target needs an eye; eyes of an avatar take forward")
    else:
        asked.free.eye.CopyFrom(_vec(eye))
        asked.free.hide_avatar = avatar
        if target is not None:
            asked.free.target.CopyFrom(_vec(target))
    if forward is not None:
        view.forward.CopyFrom(_vec(forward))
    if fov_y is not None:
        view.fov_y = fov_y
    if tick is not None:
        asked.tick = tick
    return asked


class Avatar:
    """An avatar of this client. Orders queue, and are carried out as ticks are made."""

    def __init__(self, client: Client, name: str) -> None:
        self._client = client
        self.name = name
        self.entry = 0  # the tag of its spawn

    def enter(self) -> AvatarState:
        """Makes one tick, in lockstep, in which it enters. Raises OrderFailed where it cannot."""
        state = self._client.step(1, avatars=True).avatars.get(self.name)
        if state is None:
            kept = self._client._notices
            why = [one.text for one in kept if one.tag == self.entry and one.kind == "refused"]
            raise OrderFailed(f"avatar {self.name!r} did not enter: " +
                              (why[-1] if why else "subscribe to notices to learn why"))
        return state

    def walk(self, *along: Point, speed: Optional[float] = None) -> int:
        """To each of the points in turn."""
        order = messages.Walk(along=[_vec(point) for point in along])
        if speed is not None:
            order.speed = speed
        return self._client.command(self.name, walk=order)

    def look(self, at: Point) -> int:
        return self._client.command(self.name, look=messages.Look(at=_vec(at)))

    def wait(self, seconds: float) -> int:
        return self._client.command(self.name, wait=messages.Wait(seconds=seconds))

    def drive(self, velocity: Point) -> int:
        """From now on; drops what is queued. Zero stops."""
        return self._client.command(self.name, drive=messages.Drive(velocity=_vec(velocity)))

    def jump(self, height: Optional[float] = None) -> int:
        return self._client.command(self.name, jump=messages.Jump(height=height))

    def fly(self, on: bool = True) -> int:
        return self._client.command(self.name, fly=messages.Fly(on=on))

    def crouch(self, height: Optional[float] = None) -> int:
        return self._client.command(self.name, crouch=messages.Crouch(height=height))

    def drive_joints(self, values: Sequence[Optional[float]], *, speed: Optional[float] = None,
                     at_once: bool = False) -> int:
        """To these values, one a link; None leaves a joint as it is."""
        target = messages.DriveJoints.Target
        return self._client.command(self.name, drive_joints=messages.DriveJoints(
            to=[target(value=value) for value in values], speed=speed, at_once=at_once))

    def leave(self) -> int:
        return self._client.command(self.name, leave=messages.Leave())

    def frame(self, **options: Any) -> Frame:
        """What it sees; options as of Client.frame()."""
        return self._client.frame(self.name, **options)
