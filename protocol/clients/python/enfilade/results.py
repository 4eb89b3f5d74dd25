"""Replies and events of the server as plain Python data. Metres, seconds, radians; Y up."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from . import messages
from .kept_request import varint

Vector = Tuple[float, float, float]


def vector(message: Any) -> Vector:
    return (message.x, message.y, message.z)


def _verdict(number: int) -> str:
    return messages.word(messages.Verdict, number, "VERDICT_")


def _feature(number: int) -> str:
    return messages.word(messages.Feature, number, "FEATURE_") if number else ""


@dataclass(frozen=True)
class Contact:
    """A contact event: ContactEvent of the .proto."""

    tick: int
    time: float
    kind: str  # "begin", "persist", "end", "near", "blocked", "enter", "leave", "left_world"
    reason: str  # of an end: "parted", "left", "shutdown", "restart", "seek"
    phase: str  # of "near": "begin", "min", "end"
    a: int
    b: int
    a_name: str
    b_name: str
    verdict: str  # "separated", "touching", "penetrating": exact
    distance: float
    error_bound: float
    point_a: Vector
    point_b: Vector
    normal: Vector  # unit, from a to b
    decided_by: str  # "filter" or "rational"
    feature_a: str  # of the nearest part, at point_a: "vertex", "edge", "face"; "" if they
    feature_b: str  # penetrate, and for "left_world"
    a_global_id: str = ""  # IFC GlobalIds
    b_global_id: str = ""
    storey: str = ""  # where the contact lies: PROTOCOL.md, "Events"
    room: str = ""  # number of the IFC space
    room_name: str = ""


_CONTACT_ENUMS = messages.ContactEvent.DESCRIPTOR.enum_types_by_name
_KIND, _REASON, _PHASE = (_CONTACT_ENUMS[name] for name in ("Kind", "Reason", "Phase"))


def contact(event: Any) -> Contact:
    return Contact(
        tick=event.tick, time=event.time,
        kind=messages.word(_KIND, event.kind, "KIND_"),
        reason=messages.word(_REASON, event.reason, "REASON_") if event.reason else "",
        phase=messages.word(_PHASE, event.phase, "PHASE_") if event.phase else "",
        a=event.a, b=event.b, a_name=event.a_name, b_name=event.b_name,
        verdict=_verdict(event.verdict), distance=event.distance, error_bound=event.error_bound,
        point_a=vector(event.point_a), point_b=vector(event.point_b), normal=vector(event.normal),
        decided_by=messages.word(messages.DecidedBy, event.decided_by, "DECIDED_BY_"),
        feature_a=_feature(event.feature_a), feature_b=_feature(event.feature_b),
        a_global_id=event.a_global_id, b_global_id=event.b_global_id,
        storey=event.storey, room=event.room, room_name=event.room_name)


@dataclass(frozen=True)
class Notice:
    """The outcome of an order: Notice of the .proto."""

    tick: int
    kind: str  # "spawned", "refused", "arrived", "blocked", "done", "capture", "left",
    #            "dropped"
    avatar: str
    id: int
    tag: int
    position: Vector
    obstacle: int
    obstacle_name: str
    text: str


def notice(message: Any) -> Notice:
    kinds = messages.Notice.DESCRIPTOR.enum_types_by_name["Kind"]
    return Notice(
        tick=message.tick, kind=messages.word(kinds, message.kind, "KIND_"),
        avatar=message.avatar, id=message.id, tag=message.tag, position=vector(message.position),
        obstacle=message.obstacle, obstacle_name=message.obstacle_name, text=message.text)


@dataclass(frozen=True)
class AvatarState:
    """An avatar's position and its last move: AvatarState of the .proto."""

    id: int
    name: str
    feet: Vector
    gaze: Vector
    eye_height: float
    grounded: bool
    flying: bool
    asked: Vector  # metres: requested displacement of the tick
    made: Vector  # metres: actual displacement of the feet
    stopped_by: int  # entity id of the first obstacle; 0: none
    stopped_by_name: str
    joints: Tuple[float, ...] = ()
    facing: float = 0.0  # DEGREES, of parts and links
    last_stopped_tick: int = 0  # the last tick with `stopped_by`; 0: none since it spawned

    @property
    def eyes(self) -> Vector:
        return (self.feet[0], self.feet[1] + self.eye_height, self.feet[2])


def avatar_state(message: Any) -> AvatarState:
    move = message.move
    return AvatarState(
        id=message.id, name=message.name, feet=vector(message.feet), gaze=vector(message.gaze),
        eye_height=message.eye_height, grounded=message.grounded, flying=message.flying,
        asked=vector(move.asked), made=vector(move.made), stopped_by=move.stopped_by,
        stopped_by_name=move.stopped_by_name, joints=tuple(j.value for j in message.joints),
        facing=message.facing, last_stopped_tick=message.last_stopped_tick)


@dataclass(frozen=True)
class Step:
    tick: int
    time: float
    state_hash: int  # equal hashes: equal worlds, to the last bit
    idle: bool  # every queue is empty and no avatar falls or is driven
    avatars: Dict[str, AvatarState] = field(default_factory=dict)  # if requested


def step(reply: Any) -> Step:
    states = {one.name: avatar_state(one) for one in reply.avatars}
    return Step(reply.tick, reply.time, reply.state_hash, reply.idle, states)


@dataclass(frozen=True)
class State:
    """All avatars: State of the .proto. `dropped` states were omitted since the last one."""

    tick: int
    time: float
    state_hash: int
    avatars: Dict[str, AvatarState]
    dropped: int
    message: Any  # with the bodies


def state(message: Any) -> State:
    states = {one.name: avatar_state(one) for one in message.avatars}
    return State(message.tick, message.time, message.hash, states, message.dropped, message)


@dataclass(frozen=True, eq=False)  # arrays do not compare as one
class Frame:
    """A picture. Channels that were not requested are None. The arrays are writable and have no
    other owner; they share one piece of memory."""

    tick: int
    time: float
    renderer: str
    software: bool
    rgb: Optional[np.ndarray]  # height x width x 3, uint8, sRGB
    depth: Optional[np.ndarray]  # height x width, float32: metres along the axis; NaN: background
    ids: Optional[np.ndarray]  # height x width, uint32: entity ids; 0: background
    normals: Optional[np.ndarray]  # height x width x 3, float32: unit, facing the eye; 0: none
    range: Optional[np.ndarray]  # height x width, float32: metres along the ray; NaN: none
    message: Any  # the Frame of the .proto, with the camera as used
    class_ids: Optional[np.ndarray] = None  # height x width, uint32: ObjectInfo.class_id; 0: none
    things: Optional[np.ndarray] = None  # height x width, uint32: ObjectInfo.thing; 0: background
    flow: Optional[np.ndarray] = None  # height x width x 2, float32: pixels to the right and down; NaN

    def channel(self, name: str) -> Any:
        """Returns the array of a channel by its name in requests."""
        return getattr(self, {"class": "class_ids", "thing": "things"}.get(name, name))


# By name: number, type and values per pixel. The bytes of rgb come last, so that the other channels
# are aligned.
_CHANNELS = {"depth": (messages.CHANNEL_DEPTH, np.dtype(np.float32), 1),
             "ids": (messages.CHANNEL_IDS, np.dtype(np.uint32), 1),
             "range": (messages.CHANNEL_RANGE, np.dtype(np.float32), 1),
             "class": (messages.CHANNEL_CLASS, np.dtype(np.uint32), 1),
             "thing": (messages.CHANNEL_THING, np.dtype(np.uint32), 1),
             "flow": (messages.CHANNEL_FLOW, np.dtype(np.float32), 2),
             "normals": (messages.CHANNEL_NORMALS, np.dtype(np.float32), 3),
             "rgb": (messages.CHANNEL_RGB, np.dtype(np.uint8), 3)}
_BY_NUMBER = {number: (name, kind, depth) for name, (number, kind, depth) in _CHANNELS.items()}
_RAW: int = messages.ENCODING_RAW


def channels(names: Any) -> List[int]:
    """Returns the numbers of channels, in the order of _CHANNELS."""
    unknown = set(names) - set(_CHANNELS)
    if unknown:
        raise ValueError(f"channels: unknown {sorted(unknown)}; give some of {sorted(_CHANNELS)}")
    return [channel[0] for name, channel in _CHANNELS.items() if name in names]


def frame(message: Any, attachment: memoryview) -> Frame:
    found: Dict[str, np.ndarray] = {}
    for plane in message.planes:
        known = _BY_NUMBER.get(plane.channel)
        if known is None:
            continue
        name, kind, depth = known
        height, width = plane.height, plane.width
        count = height * width * depth
        if plane.encoding > _RAW or plane.length != count * kind.itemsize:
            raise ValueError(f"the frame's {name} is not raw pixels of its size")
        shape = (height, width) if depth == 1 else (height, width, depth)
        found[name] = np.frombuffer(attachment, kind, count, plane.offset).reshape(shape)
    return Frame(message.tick, message.time, message.renderer, message.software, found.get("rgb"),
                 found.get("depth"), found.get("ids"), found.get("normals"), found.get("range"),
                 message, found.get("class"), found.get("thing"), found.get("flow"))


@dataclass(frozen=True, eq=False)  # arrays do not compare as one
class Hits:
    """The first hits of rays, an entry per ray. Without a hit: entity 0, NaN elsewhere."""

    tick: int
    entity: np.ndarray  # uint32
    distance: np.ndarray  # float64, metres from the origin
    point: np.ndarray  # N x 3
    normal: np.ndarray  # N x 3, unit, towards the ray's origin
    names: List[str]


# A Ray as a field of a RayQuery, on the wire: keys and lengths, and little-endian doubles.
_RAY = np.dtype([("ray", "V2"), ("origin", "V2"), ("x", "V1"), ("ox", "<f8"), ("y", "V1"),
                 ("oy", "<f8"), ("z", "V1"), ("oz", "<f8"), ("direction", "V2"), ("x2", "V1"),
                 ("dx", "<f8"), ("y2", "V1"), ("dy", "<f8"), ("z2", "V1"), ("dz", "<f8"),
                 ("key", "V1"), ("reach", "<f8")])
_KEYS = {"ray": b"\x0a\x43", "origin": b"\x0a\x1b", "direction": b"\x12\x1b", "x": b"\x09",
         "y": b"\x11", "z": b"\x19", "x2": b"\x09", "y2": b"\x11", "z2": b"\x19", "key": b"\x19"}
RAY_BYTES = _RAY.itemsize
_RAYS_KEY = bytes((messages.ClientMessage.DESCRIPTOR.fields_by_name["rays"].number << 3 | 2,))


class RayRequest:
    """A ClientMessage with the rays of N x 3 arrays, written by numpy: a hundred times faster than a
    message per ray. `options` are the other fields of the RayQuery: concatenated bytes are merged
    messages in protobuf."""

    def __init__(self, request_id: int, origins: np.ndarray, directions: np.ndarray, reach: float,
                 options: Any) -> None:
        rays = np.empty(len(origins), _RAY)
        for name, key in _KEYS.items():
            rays[name] = np.void(key)
        for axis, letter in enumerate("xyz"):
            rays["o" + letter], rays["d" + letter] = origins[:, axis], directions[:, axis]
        rays["reach"] = reach
        query = rays.tobytes() + options.SerializeToString()
        self.request_id = request_id
        self._bytes = b"".join((messages.ClientMessage(request_id=request_id).SerializeToString(),
                                _RAYS_KEY, varint(len(query)), query))

    def SerializeToString(self) -> bytes:
        return self._bytes


def hits(reply: Any) -> Hits:
    found = reply.hits
    met = np.array([hit.met for hit in found], bool)
    numbers = np.full((len(found), 7), np.nan)
    if met.any():
        numbers[met] = [(hit.distance, *vector(hit.point), *vector(hit.normal))
                        for hit in found if hit.met]
    entity = np.array([hit.entity for hit in found], np.uint32)
    return Hits(reply.tick, entity, numbers[:, 0], numbers[:, 1:4], numbers[:, 4:],
                [hit.name for hit in found])


def packed_hits(reply: Any, attachment: memoryview) -> Hits:
    """Returns the hits of a packed query: RayReply.met names the entities of its attachment."""
    count, rest = divmod(len(attachment), 60)
    if rest:
        raise ValueError(f"the reply to rays has {len(attachment)} bytes, not 60 per ray")
    numbers = np.frombuffer(attachment, "<f8", 7 * count).reshape(count, 7)
    entity = np.frombuffer(attachment, "<u4", count, 56 * count)
    names = {0: "", **{one.id: one.name for one in reply.met}}
    return Hits(reply.tick, entity, numbers[:, 0], numbers[:, 1:4], numbers[:, 4:],
                [names[one] for one in entity.tolist()])


def joined(parts: List[Hits]) -> Hits:
    """Joins the replies to the parts of one query, in order."""
    if len(parts) == 1:
        return parts[0]
    return Hits(parts[-1].tick, *(np.concatenate([getattr(part, name) for part in parts])
                                  for name in ("entity", "distance", "point", "normal")),
                [name for part in parts for name in part.names])


@dataclass(frozen=True, eq=False)  # arrays do not compare as one
class Scan:
    """A range scan: rows from the top, each from the left."""

    tick: int
    distance: np.ndarray  # rows x columns, float32, metres along each ray; NaN: no hit
    entity: np.ndarray  # rows x columns, uint32; 0: no hit


def scan(reply: Any, attachment: memoryview) -> Scan:
    shape = (reply.rows, reply.columns)
    count = reply.rows * reply.columns
    if len(attachment) != 8 * count:
        raise ValueError(f"the scan has {len(attachment)} bytes, not 8 for each of {count} rays")
    distance = np.frombuffer(attachment, np.float32, count, 0).reshape(shape)
    entity = np.frombuffer(attachment, np.uint32, count, 4 * count).reshape(shape)
    return Scan(reply.tick, distance, entity)


@dataclass(frozen=True)
class ObjectInfo:
    """An object of the scene: Entity of the .proto."""

    id: int
    path: str
    class_name: str  # the IFC class, or that of the sidecar or the extras ("chair"); or ""
    class_id: int  # in pictures; 0: no class
    thing: int  # the id of the first object of what a person would call one object
    box: Optional[Tuple[Vector, Vector]]  # initial corners, metres; None without a mesh
    storey: str
    material: str
    global_id: str  # IFC GlobalId, or ""
    attributes: Dict[str, Tuple[float, ...]]  # that the file gives it, as "_ID" of a glTF instance


def object_info(message: Any) -> ObjectInfo:
    box = (vector(message.box.min), vector(message.box.max)) if message.HasField("box") else None
    return ObjectInfo(message.id, message.name, message.class_name, message.class_id, message.thing,
                      box, message.storey, message.material, message.global_id,
                      {one.name: tuple(one.values) for one in message.attributes})


@dataclass(frozen=True)
class Replay:
    """The state of a replay: Replay of the .proto."""

    file: str
    first_tick: int  # first target of seek()
    last_tick: int
    tick: int  # of this state
    at_end: bool
    branched: bool  # a client took over
    branched_at: int  # the last recorded tick before the branch
    clock: str  # "lockstep", "free_run", "paused"
    speed: float  # simulated seconds a second, when it runs freely
    diverged: str  # the difference from the recording; "": none


def replay(message: Any) -> Replay:
    return Replay(file=message.file, first_tick=message.first_tick, last_tick=message.last_tick,
                  tick=message.tick, at_end=message.at_end, branched=message.branched,
                  branched_at=message.branched_at, clock=_mode(message.clock),
                  speed=message.clock.speed, diverged=message.diverged)


def _mode(clock: Any) -> str:
    modes = messages.Clock.DESCRIPTOR.enum_types_by_name
    return messages.word(modes["Mode"], clock.mode, "MODE_")


@dataclass(frozen=True)
class Pair:
    """The relation of two entities: PairState of the .proto. Exact for its tick."""

    tick: int
    a: int
    b: int
    a_name: str
    b_name: str
    verdict: str  # "separated", "touching", "penetrating"
    distance: float  # metres; 0 unless separated
    error_bound: float
    point_a: Vector
    point_b: Vector
    normal: Vector  # unit, from a to b
    decided_by: str  # "filter" or "rational"
    penetration: float  # metres, of the nearest parts; only if refined
    feature_a: str  # as in Contact
    feature_b: str


def pair(message: Any, tick: int) -> Pair:
    return Pair(
        tick=tick, a=message.a, b=message.b, a_name=message.a_name, b_name=message.b_name,
        verdict=_verdict(message.verdict), distance=message.distance,
        error_bound=message.error_bound, point_a=vector(message.point_a),
        point_b=vector(message.point_b), normal=vector(message.normal),
        decided_by=messages.word(messages.DecidedBy, message.decided_by, "DECIDED_BY_"),
        penetration=message.penetration,
        feature_a=_feature(message.feature_a), feature_b=_feature(message.feature_b))


@dataclass(frozen=True)
class Touching:
    """The entities that touch an entity, or are close to it; the nearest first."""

    tick: int
    found: List[Pair]  # `a` is the queried entity
    left_out: int  # close entities that exceed the work or size of one reply
    mounting: List[int]  # of a kinematic body: its initial contacts, which events exclude


def touching(reply: Any) -> Touching:
    return Touching(reply.tick, [pair(one, reply.tick) for one in reply.found], reply.left_out,
                    list(reply.mounting))


@dataclass(frozen=True)
class Apart:
    """The time until which two certainly stay apart: CannotTouchReply of the .proto."""

    tick: int
    now: Pair
    before: float  # seconds from now; 0: unknown; infinity: they cannot touch at all
    closing_speed: float
    closing_acceleration: float
    look_again: float  # seconds
    proved: bool  # no contact is missed before `look_again`


def apart(reply: Any) -> Apart:
    return Apart(tick=reply.tick, now=pair(reply.now, reply.tick),
                 before=float("inf") if reply.never else reply.before,
                 closing_speed=reply.closing_speed,
                 closing_acceleration=reply.closing_acceleration,
                 look_again=reply.look_again, proved=reply.proved)


@dataclass(frozen=True)
class Horizon:
    """A proved time before which an avatar comes into contact with nothing: ContactHorizon of the
    .proto. It holds for the entities that are present at `tick`, except those in `touching` and
    dynamic bodies."""

    tick: int
    time: float  # seconds of simulated time
    avatar: int
    not_before: float  # seconds of simulated time; infinity: it meets nothing; <= time: unknown
    approaches: Tuple[Tuple[int, float], ...]  # entities and their times, the earliest first;
    #                                            entity 0: all that are not listed
    touching: Tuple[int, ...]  # entities in contact with it, as its floor
    unbounded: int  # the nearest dynamic body, of which nothing is proved; 0: none
    unbounded_distance: float  # metres, lower bound


def horizon(message: Any, events: Any) -> Horizon:
    approaches = tuple((one.entity, one.not_before) for one in message.approaches)
    return Horizon(tick=events.tick, time=events.time, avatar=message.avatar,
                   not_before=approaches[0][1] if approaches else float("inf"),
                   approaches=approaches, touching=tuple(message.touching),
                   unbounded=message.unbounded, unbounded_distance=message.unbounded_distance)


@dataclass(frozen=True)
class World:
    """One of the server's worlds: World of the .proto."""

    name: str
    scene: str
    clients: int
    tick: int
    clock: str  # "lockstep", "free_run", "paused"
    speed: float  # simulated seconds a second, when it runs freely
    driven: bool  # a client drives its clock
    drop_when_empty: bool
    failure: str  # the error that ended it; "": it runs


def world(message: Any) -> World:
    return World(name=message.name, scene=message.scene, clients=message.clients, tick=message.tick,
                 clock=_mode(message.clock), speed=message.clock.speed, driven=message.clock.has_driver,
                 drop_when_empty=message.drop_when_empty, failure=message.failure)
