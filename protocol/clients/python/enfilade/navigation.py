"""Paths and places for an upright avatar of one size. The server walks each path before it returns it."""

from __future__ import annotations

import math
import pathlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Callable, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import messages
from .arguments import UINT32, UINT64, optional_whole, whole
from .query_messages import Point, doors_value, points, vec

if TYPE_CHECKING:
    from .avatar import Avatar
    from .client import Client

# A point of the feet, an Avatar, or the name of a room, a storey, an object or a body.
Place = Union[Point, str, "Avatar"]

_MAX_POINTS = 10_000  # of one query
_MAX_GOALS = 100


@dataclass(frozen=True)
class Path:
    """A path, or the reason why not. `points` are the feet, N x 3: waypoints of a walk after
    the first."""
    found: bool
    points: np.ndarray
    length: float  # metres along `points`: of falls those across, of rides none; infinite without a path
    reason: str = ""
    obstacle: int = 0  # the entity in the way
    obstacle_name: str = ""
    obstacle_at: Optional[Tuple[float, float, float]] = None
    clear_width: Optional[float] = None  # metres: at the obstacle (of a door: when open), or of the path
    narrowest_at: Optional[Tuple[float, float, float]] = None
    doors: Tuple["Door", ...] = ()  # with doors="open": the closed ones on the path, in order
    legs: Tuple["Leg", ...] = ()  # in order, of all points
    seconds: float = math.inf  # expected: walking, falling, doors, waiting for lifts and riding
    steps: Tuple["Step", ...] = ()  # with steps=True: in order, also those of stairs


@dataclass(frozen=True)
class Door:
    """A closed door on a path."""
    id: int
    name: str  # for Client.body()
    distance: float  # metres from the start of the path
    seconds: float  # that it takes to open
    by_touch: bool  # an avatar that walks into it opens it


@dataclass(frozen=True)
class Step:
    """A step of 2 cm and more on a path."""
    at: Tuple[float, float, float]  # on the floor before it
    rise: float  # metres; negative: down


@dataclass(frozen=True)
class Leg:
    """A part of a path, up to the first point of the next one."""
    kind: str  # "walk", "door", "drop", "lift", or "aside": out of the swing of doors, which open after it
    first: int  # index of its first point
    length: float  # metres walked
    seconds: float  # expected
    id: int = 0  # of the door, also of one that is open now, or the lift
    name: str = ""
    from_level: int = 0  # of the lift: stops
    to_level: int = 0


@dataclass(frozen=True)
class Island:
    """A part of the navigable floor. `path` is one to the island `to`, a neighbour or the largest, mostly
    without waypoints: its reason, obstacle and clear width say why not. None for the largest."""
    area: float  # square metres
    at: Tuple[float, float, float]  # a place on it
    path: Optional[Path]
    to: int = 0
    roof: bool = False  # under the sky, and above floors of other islands
    drawn: bool = True  # random_places() without `near` and `island` draws there: no roof, not tiny


@dataclass(frozen=True)
class Spot:
    """A place to stand: the feet, and the number of the island, 0 for the largest."""
    at: np.ndarray
    island: Optional[int]


@dataclass(frozen=True)
class Obstacle:
    """The closest obstacle above the step height. `entity` 0: none within the searched distance."""
    distance: float  # metres from the avatar's axis
    entity: int = 0
    name: str = ""
    point: Optional[Tuple[float, float, float]] = None  # the closest one on it
    normal: Optional[Tuple[float, float, float]] = None  # unit, towards the avatar


@dataclass(frozen=True)
class Map:
    """Walkable cells seen from above: `cells[row, column]`, rows along z, columns along x."""
    cells: np.ndarray
    corner: Tuple[float, float, float]  # smallest x and z
    cell: float = field(default=0.0)  # metres


def _xyz(point: Any) -> Tuple[float, float, float]:
    return (point.x, point.y, point.z)


def _place(place: Place) -> Any:
    if isinstance(place, str):
        return messages.NavigationPlace(name=place)
    if isinstance(getattr(place, "name", None), str):
        return messages.NavigationPlace(avatar=place.name)  # type: ignore[union-attr]
    return messages.NavigationPlace(point=vec(place))


def _path(one: Any) -> Path:
    return Path(
        found=one.found, points=np.array([_xyz(p) for p in one.points], np.float64).reshape(-1, 3),
        length=one.length if one.found else math.inf, reason=one.reason, obstacle=one.obstacle,
        obstacle_name=one.obstacle_name,
        obstacle_at=_xyz(one.obstacle_at) if one.HasField("obstacle_at") else None,
        clear_width=one.clear_width or None,
        narrowest_at=_xyz(one.narrowest_at) if one.HasField("narrowest_at") else None,
        doors=tuple(Door(d.id, d.name, d.distance, d.seconds, d.by_touch) for d in one.doors),
        legs=tuple(Leg(messages.NavigationLeg.Kind.Name(leg.kind)[len("KIND_"):].lower(), leg.first,
                       leg.length, leg.seconds, leg.id, leg.name, leg.from_level, leg.to_level)
                   for leg in one.legs),
        seconds=one.seconds if one.found else math.inf,
        steps=tuple(Step(_xyz(step.at), step.rise) for step in one.steps))


def _spot(one: Any) -> Optional[Spot]:
    if not one.found:
        return None
    return Spot(np.array(_xyz(one.at)), one.island if one.HasField("island") else None)


class Navigation:
    """Made by Client.navigation(). The step height is that of the world's policies."""

    def __init__(self, client: "Client", radius: Optional[float], height: Optional[float],
                 speed: Optional[float], doors: str,
                 progress: Optional[Callable[[float], None]] = None, step: Optional[float] = None) -> None:
        present = client.welcome.policies.step_height
        if step is not None and not math.isclose(step, present, abs_tol=1e-6):
            raise ValueError(f"step is {present:g} in this world, not {step:g}: start the server with "
                             f"--step-height {step:g}")
        self._client = client
        self.radius = 0.3 if radius is None else radius  # metres
        self.height = 1.75 if height is None else height
        self._options = {"radius": radius, "height": height, "speed": speed,
                         "doors": doors_value(doors)}
        self._progress = progress
        self.speed, self.doors = speed, doors
        self._report: Any = None  # the last reply

    def _ask(self, **query: Any) -> Tuple[Any, memoryview]:
        self._client._show_progress = self._progress
        try:
            reply, attachment = self._client.request(  # each progress restarts the wait for the reply
                navigation=messages.NavigationQuery(**self._options, progress=True, **query))
        finally:
            self._client._show_progress = None  # that of other requests is not shown
        self._report = reply.navigation
        return reply.navigation, attachment

    def query(self, goals: Sequence[Place], *, avatar: str = "", start: Optional[Place] = None,
              keep: bool = False) -> Any:
        """Returns the NavigationQuery of the paths from an avatar, or a start, to goals, for
        Client.pipeline(). `keep`, of an avatar to one goal: its last path may be used again."""
        first = messages.NavigationPlace(avatar=avatar) if start is None else _place(start)
        return messages.NavigationQuery(**self._options, progress=True, path=messages.NavigationQuery.Path(
            **{"from": first}, to=[_place(goal) for goal in goals], keep=keep))

    def path(self, start: Place, goal: Place, *, narrowest: bool = False, steps: bool = False,
             max_drop: float = 0.0, lifts: bool = False, keep: bool = False) -> Path:
        """Returns the path from one place to another. `narrowest`: also measures its clear width. `steps`:
        also lists its steps. With `max_drop` metres it may fall from edges, and with `lifts` it may ride:
        then it is the quickest. `keep`, from an Avatar: its last path to the goal serves again while it is
        about as short, and no body moved: this takes a fraction of the time."""
        return self.paths(start, [goal], narrowest=narrowest, steps=steps, max_drop=max_drop,
                          lifts=lifts, keep=keep)[0]

    def paths(self, start: Place, goals: Sequence[Place], *, narrowest: bool = False,
              steps: bool = False, max_drop: float = 0.0, lifts: bool = False,
              keep: bool = False) -> List[Path]:
        """Returns the paths from one place to many, in their order; options as for path()."""
        found: List[Path] = []
        for first in range(0, len(goals), _MAX_GOALS):
            reply, _ = self._ask(path=messages.NavigationQuery.Path(
                **{"from": _place(start)}, to=[_place(goal) for goal in goals[first:first + _MAX_GOALS]],
                narrowest=narrowest, steps=steps, max_drop=max_drop, lifts=lifts, keep=keep))
            found += [_path(one) for one in reply.paths]
        return found

    def geodesic_distance(self, start: Place, goal: Place) -> float:
        """Returns the length of the path, metres; infinite without one."""
        return self.path(start, goal).length

    def random_place(self, seed: int, **options: Any) -> Optional[Spot]:
        """As random_places() for one place."""
        return self.random_places(1, seed, **options)[0]

    def random_places(self, count: int, seed: int, *, near: Optional[Point] = None,
                      max_distance: float = 0.0, away_from: Optional[Point] = None,
                      min_distance: float = 0.0, island: Optional[int] = None) -> List[Optional[Spot]]:
        """Draws places that are uniform in area; None where none was found. The same seed gives the same
        places. Without `near` and `island` they are on islands that are `drawn`, no roofs. `near` with
        `max_distance`, and `away_from` with `min_distance`, are metres in space."""
        for point, has_point, metres, has_metres in (
                ("near", near is not None, "max_distance", max_distance != 0),
                ("away_from", away_from is not None, "min_distance", min_distance != 0)):
            if has_point != has_metres:
                given, missing = (point, metres) if has_point else (metres, point)
                raise ValueError(f"{given}: give {missing}, too")
        query = messages.NavigationQuery.Random(
            count=whole(count, "count", 1, UINT32), seed=whole(seed, "seed", 0, UINT64),
            max_distance=max_distance, min_distance=min_distance,
            island=optional_whole(island, "island", high=UINT32))
        if near is not None:
            query.near.CopyFrom(vec(near))
        if away_from is not None:
            query.away_from.CopyFrom(vec(away_from))
        return [_spot(one) for one in self._ask(random=query)[0].spots]

    def snap(self, point: Point, max_distance: float = 2.0) -> Optional[Spot]:
        """Returns where an avatar at the point stands, or the closest place; None: none is so close."""
        return self.snap_all([point], max_distance)[0]

    def snap_all(self, where: Any, max_distance: float = 2.0, *, island: Optional[int] = None,
                 drawn: bool = False, extents: Optional[Point] = None) -> List[Optional[Spot]]:
        """snap() of N x 3 points; with `island` or `drawn` to places on that island, or on islands that are
        `drawn`. `extents`: half the box in which to look, instead of `max_distance`."""
        options = {} if extents is None else {"extents": vec(extents)}
        array = points(where, "snap")
        found: List[Optional[Spot]] = []
        for first in range(0, len(array), _MAX_POINTS):
            page = array[first:first + _MAX_POINTS]
            query = messages.NavigationQuery.Snap(
                points=[vec(p) for p in page], max_distance=max_distance, drawn=drawn,
                island=optional_whole(island, "island", high=UINT32), **options)
            found += [_spot(one) for one in self._ask(snap=query)[0].spots]
        return found

    def is_navigable(self, point: Point, max_y_delta: float = 0.5) -> bool:
        """Whether an avatar can stand at the point, at a height that differs by at most this."""
        spot = self.snap(point, max_distance=max_y_delta)
        return spot is not None and math.hypot(spot.at[0] - point[0], spot.at[2] - point[2]) < 1e-3

    def try_step(self, start: Point, goal: Point, *, slide: bool = True) -> Optional[Spot]:
        """Returns where a straight walk ends; None: an avatar cannot stand at the start."""
        step = messages.NavigationQuery.Steps.Step(**{"from": vec(start)}, to=vec(goal))
        return _spot(self._ask(steps=messages.NavigationQuery.Steps(steps=[step], stop=not slide))[0].spots[0])

    def clearance(self, point: Point, max_distance: float = 2.0) -> Optional[Obstacle]:
        """Returns the closest obstacle; None: an avatar cannot stand there."""
        query = messages.NavigationQuery.Clearance(points=[vec(point)], max_distance=max_distance)
        one = self._ask(clearance=query)[0].obstacles[0]
        if not one.found:
            return None
        return Obstacle(one.distance, one.entity, one.name,
                        _xyz(one.point) if one.HasField("point") else None,
                        _xyz(one.normal) if one.HasField("normal") else None)

    def islands(self, count: int = 10) -> List[Island]:
        """Returns the largest islands, and what separates each from another."""
        query = messages.NavigationQuery.Islands(count=whole(count, "count"))
        return [Island(one.area, _xyz(one.at), _path(one.path) if one.HasField("path") else None,
                       one.to, one.roof, one.drawn)
                for one in self._ask(islands=query)[0].islands]

    def top_down(self, height: float, cell: float = 0.05, tolerance: float = 0.5) -> Map:
        """Returns a map of the floors within `tolerance` metres of a height; floors up to 5 cm beyond may show."""
        query = messages.NavigationQuery.Map(cell=cell, height=height, tolerance=tolerance, format="FORMAT_BITS")
        reply, attachment = self._ask(map=query)
        rows = np.frombuffer(attachment, np.uint8).reshape(reply.map_height, -1)
        cells = np.unpackbits(rows, axis=1, count=reply.map_width)
        return Map(cells.astype(bool), _xyz(reply.map_corner), cell)

    def top_down_png(self, height: float, cell: float = 0.05, tolerance: float = 0.5) -> bytes:
        """Returns the map as a PNG: white cells are walkable."""
        query = messages.NavigationQuery.Map(cell=cell, height=height, tolerance=tolerance, format="FORMAT_PNG")
        return bytes(self._ask(map=query)[1])

    def triangles(self, island: Optional[int] = None) -> np.ndarray:
        """Returns the triangles of the mesh, or of one island: N x 3 corners x 3 metres. The mesh only proposes
        paths; it ends up to 10 cm before places where an avatar can stand."""
        query = messages.NavigationQuery.Mesh(island=optional_whole(island, "island", high=UINT32))
        return np.frombuffer(self._ask(mesh=query)[1], np.float64).reshape(-1, 3, 3)

    def save(self, path: Union[str, pathlib.Path]) -> None:
        """Writes the meshes of this size to a file, for load()."""
        pathlib.Path(path).write_bytes(self._ask(save_mesh=messages.NavigationQuery.SaveMesh())[1])

    def load(self, path: Union[str, pathlib.Path]) -> None:
        """Takes the meshes of a file instead of building them, in any server of the same version with the
        same scene. Raises ServerError with the reason if they belong to another scene, size or step height.
        Paths are proved as ever, so a mesh can make none wrong."""
        mesh = pathlib.Path(path).read_bytes()
        uploaded = self._client._upload(mesh)
        self._ask(load_mesh=messages.NavigationQuery.LoadMesh(mesh=b"" if uploaded else mesh,
                                                              uploaded=uploaded))

    def _meshes(self) -> Any:
        if self._report is None:
            self.snap((0.0, 0.0, 0.0))
        return self._report

    @property
    def island_areas(self) -> List[float]:
        """Square metres of the islands, by number: those of the largest 1000."""
        return list(self._meshes().island_areas)

    @property
    def island_count(self) -> int:
        """The number of islands of all sizes."""
        return self._meshes().island_count

    def island_area(self, island: int) -> float:
        """Square metres of any island."""
        areas = self._meshes().island_areas
        if island < len(areas):
            return areas[island]
        if island >= self.island_count:
            raise IndexError(f"island: there are {self.island_count}, no number {island}")
        a, b, c = np.moveaxis(self.triangles(island), 1, 0)
        return float(np.abs((b[:, 2] - a[:, 2]) * (c[:, 0] - a[:, 0])
                            - (b[:, 0] - a[:, 0]) * (c[:, 2] - a[:, 2])).sum() / 2)

    @property
    def navigable_area(self) -> float:
        """Square metres."""
        return self._meshes().navigable_area

    @property
    def build_seconds(self) -> float:
        """How long the server built the meshes of this size."""
        return self._meshes().build_seconds

    @property
    def mesh_bytes(self) -> int:
        """Memory of the navigation meshes."""
        return self._meshes().mesh_bytes
