"""Names and meanings of habitat-sim's path finder on top of Client.navigation().

    from enfilade.compat import PathFinder, ShortestPath

    pathfinder = PathFinder(client.navigation(radius=0.1, height=1.5))
    path = ShortestPath()
    path.requested_start = pathfinder.get_random_navigable_point()
    path.requested_end = pathfinder.get_random_navigable_point()
    pathfinder.find_path(path)

Paths are walked by the server before they are returned. docs/coming_from_habitat.md lists what differs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import List, Optional, Sequence, Tuple, Union

import numpy as np

from .arguments import number
from .navigation import Navigation, Spot
from .query_messages import vec

_NOWHERE = np.full(3, np.nan)
_MAX_ACTIONS = 2000  # of find_path(): 500 m of steps ahead
_MAX_SEARCH_RADIUS = 20.0  # metres that the server searches for obstacles
_EXTENTS = (2.0, 4.0, 2.0)  # metres: habitat projects a point within this box on either side


class ShortestPath:
    """A request and its answer, as habitat_sim.ShortestPath."""

    def __init__(self) -> None:
        self.requested_start: Sequence[float] = ()
        self.requested_end: Sequence[float] = ()
        self.points: List[np.ndarray] = []
        self.geodesic_distance = math.inf


class MultiGoalShortestPath:
    """The same with many ends, of which the nearest one counts."""

    def __init__(self) -> None:
        self.requested_start: Sequence[float] = ()
        self.requested_ends: Sequence[Sequence[float]] = ()
        self.points: List[np.ndarray] = []
        self.geodesic_distance = math.inf
        self.closest_end_point_index = -1


@dataclass
class NavMeshSettings:
    """As habitat_sim.NavMeshSettings. The server proves paths with the agent's exact size and climb and
    chooses the mesh itself: all fields but the first four have no effect. The climb and the slope are those of
    the world (`enfilade serve --step-height --slope`): None takes them."""

    agent_radius: float = 0.1
    agent_height: float = 1.5
    agent_max_climb: Optional[float] = None  # metres
    agent_max_slope: Optional[float] = None  # degrees
    cell_size: float = 0.05
    cell_height: float = 0.2
    region_min_size: float = 20.0
    region_merge_size: float = 20.0
    edge_max_len: float = 12.0
    edge_max_error: float = 1.3
    verts_per_poly: float = 6.0
    detail_sample_dist: float = 6.0
    detail_sample_max_error: float = 1.0
    filter_low_hanging_obstacles: bool = True
    filter_ledge_spans: bool = True
    filter_walkable_low_height_spans: bool = True
    include_static_objects: bool = False

    def set_defaults(self) -> None:
        """Sets habitat's defaults, except the climb (0.2 m) and the slope (45 degrees): those of the world."""
        self.__dict__.update(NavMeshSettings().__dict__)


@dataclass(frozen=True)
class HitRecord:
    """As habitat_sim.HitRecord. Position and normal are NaN if no obstacle was found."""

    hit_pos: np.ndarray
    hit_normal: np.ndarray
    hit_dist: float


class GreedyFollowerError(ValueError):
    """No actions lead to the goal, as habitat_sim.errors.GreedyFollowerError."""


class GreedyGeodesicFollower:
    """Actions that lead along the path to a goal, as habitat_sim.GreedyGeodesicFollower, for an agent with
    `forward_amount` metres and `turn_amount` radians per action. It has no agent: the methods take the
    position of the feet and the heading in radians (0 along +X, left positive). `goal_radius`: metres; None:
    0.75 of a step ahead. `fix_thrashing` has no effect: no turn undoes the last one."""

    def __init__(self, pathfinder: "PathFinder", goal_radius: Optional[float] = None, *,
                 forward_key: str = "move_forward", left_key: str = "turn_left",
                 right_key: str = "turn_right", stop_key: Optional[str] = None,
                 fix_thrashing: bool = True, thrashing_threshold: int = 16,
                 forward_amount: float = 0.25, turn_amount: float = math.radians(10)) -> None:
        self.pathfinder = pathfinder
        self.goal_radius = 0.75 * forward_amount if goal_radius is None else goal_radius
        self.keys = {"forward": forward_key, "left": left_key, "right": right_key, "stop": stop_key}
        self.forward_amount, self.turn_amount = forward_amount, turn_amount
        self.reset()

    def reset(self) -> None:
        """Forgets the last goal. Another goal does so, too."""
        self._snapped: Tuple[Tuple[float, ...], Optional[Spot]] = ((), None)  # the last goal, and its place

    def next_action_along(self, position: Sequence[float], heading: float,
                          goal: Sequence[float]) -> Optional[str]:
        """Returns the key of the next action; the stop key at the goal. Raises GreedyFollowerError
        if there is no path."""
        return self.keys[self._next(position, heading, goal)]

    def find_path(self, position: Sequence[float], heading: float,
                  goal: Sequence[float]) -> List[Optional[str]]:
        """Returns the keys of all actions to the goal, which end with the stop key. Raises
        GreedyFollowerError if there is no path, or if steps of this length do not come within `goal_radius`."""
        taken: List[Optional[str]] = []
        while len(taken) < _MAX_ACTIONS:
            action = self._next(position, heading, goal)
            taken.append(self.keys[action])
            if action == "stop":
                return taken
            if action == "forward":
                ahead = self.forward_amount * np.array((math.cos(heading), 0, -math.sin(heading)))
                position = self.pathfinder.try_step(position, np.asarray(position, float) + ahead)
            else:
                heading += self.turn_amount if action == "left" else -self.turn_amount
        raise GreedyFollowerError(f"goal_radius: the goal is not within {self.goal_radius:g} m after "
                                  f"{_MAX_ACTIONS} actions; give more, or a smaller forward_amount than "
                                  f"{self.forward_amount:g} m")

    def _next(self, position: Sequence[float], heading: float, goal: Sequence[float]) -> str:
        wanted = tuple(map(float, goal))
        if self._snapped[0] != wanted:
            self._snapped = wanted, self.pathfinder._projected([wanted])[0]
        start, end = self.pathfinder._projected([position])[0], self._snapped[1]
        if start is None or end is None:
            raise GreedyFollowerError("no path: no agent can stand near the "
                                      f"{'start' if start is None else 'goal'}")
        path = self.pathfinder.navigation.path(start.at, end.at)
        if not path.found:
            raise GreedyFollowerError(f"no path: {path.reason}")
        if path.length <= self.goal_radius:
            return "stop"
        here = start.at
        ahead = next((p for p in path.points[1:]
                      if math.hypot(p[0] - here[0], p[2] - here[2]) > 0.05), path.points[-1])
        turn = math.remainder(math.atan2(here[2] - ahead[2], ahead[0] - here[0]) - heading, math.tau)
        if abs(turn) <= self.turn_amount / 2 + 1e-9:
            return "forward"
        return "left" if turn > 0 else "right"


class PathFinder:
    """As habitat_sim.PathFinder, for the agent of a Navigation."""

    is_loaded = True

    def __init__(self, navigation: Navigation, seed: int = 0) -> None:
        self.navigation = navigation
        self._random = np.random.default_rng(seed)

    def seed(self, seed: int) -> None:
        self._random = np.random.default_rng(seed)

    def _draw(self) -> int:
        return int(self._random.integers(0, 2 ** 63))

    def build_nav_mesh(self, settings: NavMeshSettings) -> bool:
        """Builds meshes for another agent, as habitat's recompute_navmesh(). Raises ValueError if the world
        has another climb or slope, and ServerError if the server refuses the size. The present agent then
        stays."""
        client = self.navigation._client
        policies = client.welcome.policies
        for name, wanted, given, option in (
                ("agent_max_climb", settings.agent_max_climb, policies.step_height, "--step-height"),
                ("agent_max_slope", settings.agent_max_slope, math.degrees(policies.walkable_slope),
                 "--slope")):
            if wanted is not None and not math.isclose(wanted, given, abs_tol=1e-6):
                raise ValueError(f"{name} is {given:g} in this world, not {wanted:g}: start the server with "
                                 f"{option} {wanted:g}")
        navigation = client.navigation(settings.agent_radius, settings.agent_height,
                                       speed=self.navigation.speed, doors=self.navigation.doors)
        is_built = navigation.build_seconds >= 0
        self.navigation = navigation  # a refusal leaves the present one
        return is_built

    @property
    def nav_mesh_settings(self) -> NavMeshSettings:
        """Those of the present agent and world; of the mesh itself, the defaults."""
        policies = self.navigation._client.welcome.policies
        return NavMeshSettings(self.navigation.radius, self.navigation.height, policies.step_height,
                               math.degrees(policies.walkable_slope))

    def save_nav_mesh(self, path: str) -> bool:
        self.navigation.save(path)
        return True

    def load_nav_mesh(self, path: str) -> bool:
        """Raises ServerError with the reason if the mesh belongs to another scene or agent."""
        self.navigation.load(path)
        return True

    def find_path(self, path: "ShortestPath | MultiGoalShortestPath") -> bool:
        """Fills in `points` and `geodesic_distance`. Returns whether there is a path. Start and ends are
        snap_point() of those requested; an end without a place close to it counts as unreachable."""
        many = isinstance(path, MultiGoalShortestPath)
        ends = list(path.requested_ends) if many else [path.requested_end]  # type: ignore[union-attr]
        start, *spots = self._projected([path.requested_start, *ends])
        goals = {i: spot.at for i, spot in enumerate(spots) if spot is not None}
        found = self.navigation.paths(start.at, list(goals.values())) if start is not None else []
        best = min(range(len(found)), key=lambda i: found[i].length, default=-1)
        path.geodesic_distance = found[best].length if best >= 0 else math.inf
        path.points = list(found[best].points) if best >= 0 else []
        is_found = math.isfinite(path.geodesic_distance)
        if many:
            path.closest_end_point_index = list(goals)[best] if is_found else -1  # type: ignore[union-attr]
        return is_found

    def get_random_navigable_point(self, max_tries: int = 10, island_index: int = -1) -> np.ndarray:
        """`max_tries` has no effect: the server tries often enough."""
        return _point(self.navigation.random_place(self._draw(), island=_island(island_index)))

    def get_random_navigable_point_near(self, circle_center: Sequence[float], radius: float,
                                        max_tries: int = 100, island_index: int = -1) -> np.ndarray:
        number(radius, "radius", above=0)
        if not _is_finite(circle_center):
            return _NOWHERE.copy()
        return _point(self.navigation.random_place(self._draw(), near=circle_center, max_distance=radius,
                                                   island=_island(island_index)))

    def snap_point(self, point: Sequence[float], island_index: int = -1) -> np.ndarray:
        """The closest place of that island, or of any that is not small, within 2 m along x and z and 4 m
        along y; NaN: none."""
        return _point(self._projected([point], _island(island_index))[0])

    def _projected(self, wanted: Sequence[Sequence[float]],
                   island: Optional[int] = None) -> List[Optional[Spot]]:
        """The places that snap_point() has for points; none for those that are not finite."""
        finite = [_is_finite(point) for point in wanted]
        found = iter(self.navigation.snap_all([point for point, one in zip(wanted, finite) if one],
                                              extents=_EXTENTS, island=island, drawn=island is None))
        return [next(found) if one else None for one in finite]

    def build_navmesh_vertices(self, island_index: int = -1) -> List[np.ndarray]:
        """The corners of all triangles, three by three."""
        return list(self.navigation.triangles(_island(island_index)).reshape(-1, 3))

    def build_navmesh_vertex_indices(self, island_index: int = -1) -> List[int]:
        return list(range(3 * len(self.navigation.triangles(_island(island_index)))))

    def is_navigable(self, pt: Sequence[float], max_y_delta: float = 0.5) -> bool:
        return _is_finite(pt) and self.navigation.is_navigable(pt, max_y_delta)

    def try_step(self, start: Sequence[float], end: Sequence[float]) -> np.ndarray:
        """Where a straight walk ends that slides along obstacles. If no agent can stand at `start`, it begins
        at its snap_point(); without one, or with an end that is not finite, it is `start`."""
        return self._stepped(start, end, True)

    def try_step_no_sliding(self, start: Sequence[float], end: Sequence[float]) -> np.ndarray:
        """The same without sliding."""
        return self._stepped(start, end, False)

    def _stepped(self, start: Sequence[float], end: Sequence[float], slide: bool) -> np.ndarray:
        if not (_is_finite(start) and _is_finite(end)):
            return np.array(start, float)
        spot = self.navigation.try_step(start, end, slide=slide)
        if spot is None:
            snapped = self._projected([start])[0]
            spot = snapped and self.navigation.try_step(snapped.at, end, slide=slide)
        return np.array(start, float) if spot is None else spot.at

    def get_island(self, point: Sequence[float]) -> int:
        spot = self._projected([point])[0]
        return spot.island if spot is not None and spot.island is not None else -1

    def island_area(self, island_index: int = -1) -> float:
        return self.navigable_area if island_index < 0 else self.navigation.island_area(island_index)

    @property
    def num_islands(self) -> int:
        return self.navigation.island_count

    @property
    def navigable_area(self) -> float:
        return self.navigation.navigable_area

    def distance_to_closest_obstacle(self, pt: Sequence[float], max_search_radius: float = 2.0) -> float:
        """From the agent's surface, at most `max_search_radius`; infinite: the point has no
        snap_point()."""
        return self.closest_obstacle_surface_point(pt, max_search_radius).hit_dist

    def closest_obstacle_surface_point(self, pt: Sequence[float],
                                       max_search_radius: float = 2.0) -> "HitRecord":
        """`hit_dist` as distance_to_closest_obstacle(); equal to `max_search_radius` without an obstacle."""
        radius = self.navigation.radius
        max_radius = _MAX_SEARCH_RADIUS - radius
        if not 0 < max_search_radius <= max_radius:
            raise ValueError(f"max_search_radius: give metres above 0 and up to {max_radius:g}, not {max_search_radius}")
        spot = self._projected([pt])[0]
        found = spot and self.navigation.clearance(spot.at, max(0.1, max_search_radius + radius))
        if found is None:
            return HitRecord(_NOWHERE.copy(), _NOWHERE.copy(), math.inf)
        distance = max(0.0, found.distance - radius)
        if found.point is None or found.normal is None or distance >= max_search_radius:
            return HitRecord(_NOWHERE.copy(), _NOWHERE.copy(), float(max_search_radius))
        return HitRecord(np.array(found.point), np.array(found.normal), distance)

    def get_bounds(self) -> Tuple[np.ndarray, np.ndarray]:
        """Of the scene."""
        bounds = self.navigation._client.welcome.scene.bounds
        return tuple(np.array((p.x, p.y, p.z)) for p in (bounds.min, bounds.max))  # type: ignore[return-value]

    def island_radius(self, pt: Union[None, int, Sequence[float]] = None, *,
                      island_index: Optional[int] = None) -> float:
        """The largest distance of 1000 random places of an island from their centroid: one value for all
        points of the island, which a number may name instead; 0: no island."""
        if (pt is None) == (island_index is None):
            raise TypeError("island_radius: give either pt or island_index")
        which = island_index if pt is None else pt
        island = int(which) if isinstance(which, (int, np.integer)) else self.get_island(which)
        if island < 0:
            return 0.0
        places = np.array([spot.at for spot in self.navigation.random_places(1000, 1, island=island) if spot])
        return float(np.linalg.norm(places - places.mean(axis=0), axis=1).max()) if len(places) else 0.0

    def get_topdown_view(self, meters_per_pixel: float, height: float, eps: float = 0.5) -> np.ndarray:
        """The floors within `eps` metres of the height, as is_navigable() with that `max_y_delta`."""
        return self.navigation.top_down(height, meters_per_pixel, eps).cells

    def get_topdown_island_view(self, meters_per_pixel: float, height: float, eps: float = 0.5) -> np.ndarray:
        """The number of the island at each cell of get_topdown_view(); -1: no floor."""
        seen = self.navigation.top_down(height, meters_per_pixel, eps)
        islands = np.full(seen.cells.shape, -1, np.int32)
        rows, columns = np.nonzero(seen.cells)
        x, z = (seen.corner[axis] + (cells + 0.5) * meters_per_pixel for axis, cells in ((0, columns), (2, rows)))
        reach = meters_per_pixel + 0.1  # a cell is drawn if its middle is on the mesh, which may be off the floor
        spots = self.navigation.snap_all(np.column_stack((x, np.full(len(x), float(height)), z)),
                                         extents=(reach, eps + 0.1, reach))
        islands[rows, columns] = [-1 if spot is None or spot.island is None else spot.island for spot in spots]
        return islands


def _island(index: int) -> Optional[int]:
    return index if index >= 0 else None


def _is_finite(point: Sequence[float]) -> bool:
    one = vec(point)
    return all(map(math.isfinite, (one.x, one.y, one.z)))


def _point(spot: Optional[Spot]) -> np.ndarray:
    return _NOWHERE.copy() if spot is None else spot.at
