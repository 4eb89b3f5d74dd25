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
from typing import List, Optional, Sequence, Tuple

import numpy as np

from .navigation import Navigation, Spot

_NOWHERE = np.full(3, np.nan)


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
    """As habitat_sim.NavMeshSettings. The server chooses cells itself; the climb and the slope are those of
    the world (`enfilade serve --step-height --slope`): None takes them."""

    agent_radius: float = 0.1
    agent_height: float = 1.5
    agent_max_climb: Optional[float] = None  # metres
    agent_max_slope: Optional[float] = None  # degrees


@dataclass(frozen=True)
class HitRecord:
    """As habitat_sim.HitRecord."""

    hit_pos: np.ndarray
    hit_normal: np.ndarray
    hit_dist: float


class GreedyGeodesicFollower:
    """Actions that lead along the path to a goal, as habitat_sim.GreedyGeodesicFollower. The agent has
    `forward_amount` metres and `turn_amount` radians per action."""

    def __init__(self, pathfinder: "PathFinder", goal_radius: float = 0.25, *,
                 forward_key: str = "move_forward", left_key: str = "turn_left",
                 right_key: str = "turn_right", stop_key: Optional[str] = None,
                 forward_amount: float = 0.25, turn_amount: float = math.radians(10)) -> None:
        self.pathfinder = pathfinder
        self.goal_radius = goal_radius
        self.keys = {"forward": forward_key, "left": left_key, "right": right_key, "stop": stop_key}
        self.forward_amount, self.turn_amount = forward_amount, turn_amount

    def next_action_along(self, position: Sequence[float], heading: float,
                          goal: Sequence[float]) -> Optional[str]:
        """Returns the key of the next action of an agent with a heading in radians (0 along +X, left
        positive); the stop key at the goal. Raises ValueError if there is no path."""
        path = self.pathfinder.navigation.path(position, goal)
        if not path.found:
            raise ValueError(f"no path: {path.reason}")
        if path.length <= self.goal_radius:
            return self.keys["stop"]
        here = np.asarray(position, float)
        ahead = next((p for p in path.points[1:]
                      if math.hypot(p[0] - here[0], p[2] - here[2]) > 0.05), path.points[-1])
        turn = math.remainder(math.atan2(here[2] - ahead[2], ahead[0] - here[0]) - heading, math.tau)
        if abs(turn) <= self.turn_amount / 2 + 1e-9:
            return self.keys["forward"]
        return self.keys["left" if turn > 0 else "right"]


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
        has another climb or slope."""
        client = self.navigation._client
        policies = client.welcome.policies
        for name, wanted, given, option in (
                ("agent_max_climb", settings.agent_max_climb, policies.step_height, "--step-height"),
                ("agent_max_slope", settings.agent_max_slope, math.degrees(policies.walkable_slope),
                 "--slope")):
            if wanted is not None and not math.isclose(wanted, given, abs_tol=1e-6):
                raise ValueError(f"{name} is {given:g} in this world, not {wanted:g}: start the server with "
                                 f"{option} {wanted:g}")
        self.navigation = client.navigation(settings.agent_radius, settings.agent_height)
        return self.navigation.build_seconds >= 0

    def save_nav_mesh(self, path: str) -> bool:
        self.navigation.save(path)
        return True

    def load_nav_mesh(self, path: str) -> bool:
        """Raises ServerError with the reason if the mesh belongs to another scene or agent."""
        self.navigation.load(path)
        return True

    def find_path(self, path: "ShortestPath | MultiGoalShortestPath") -> bool:
        """Fills in `points` and `geodesic_distance`. Returns whether there is a path."""
        many = isinstance(path, MultiGoalShortestPath)
        ends = list(path.requested_ends) if many else [path.requested_end]  # type: ignore[union-attr]
        found = self.navigation.paths(path.requested_start, ends)
        best = min(range(len(found)), key=lambda i: found[i].length, default=-1)
        path.geodesic_distance = found[best].length if best >= 0 else math.inf
        path.points = list(found[best].points) if best >= 0 else []
        if many:
            path.closest_end_point_index = best if math.isfinite(path.geodesic_distance) else -1  # type: ignore[union-attr]
        return math.isfinite(path.geodesic_distance)

    def get_random_navigable_point(self, max_tries: int = 10, island_index: int = -1) -> np.ndarray:
        """`max_tries` has no effect: the server tries often enough."""
        return _point(self.navigation.random_place(self._draw(), island=_island(island_index)))

    def get_random_navigable_point_near(self, circle_center: Sequence[float], radius: float,
                                        max_tries: int = 100, island_index: int = -1) -> np.ndarray:
        return _point(self.navigation.random_place(self._draw(), near=circle_center, max_distance=radius,
                                                   island=_island(island_index)))

    def snap_point(self, point: Sequence[float], island_index: int = -1) -> np.ndarray:
        """The closest place within 2 m; NaN: none, or it lies on another island."""
        spot = self.navigation.snap(point)
        if spot is not None and island_index >= 0 and spot.island != island_index:
            return _NOWHERE.copy()
        return _point(spot)

    def is_navigable(self, pt: Sequence[float], max_y_delta: float = 0.5) -> bool:
        return self.navigation.is_navigable(pt, max_y_delta)

    def try_step(self, start: Sequence[float], end: Sequence[float]) -> np.ndarray:
        return _point(self.navigation.try_step(start, end))

    def try_step_no_sliding(self, start: Sequence[float], end: Sequence[float]) -> np.ndarray:
        return _point(self.navigation.try_step(start, end, slide=False))

    def get_island(self, point: Sequence[float]) -> int:
        spot = self.navigation.snap(point)
        return spot.island if spot is not None and spot.island is not None else -1

    def island_area(self, island_index: int = -1) -> float:
        areas = self.navigation.island_areas
        return self.navigable_area if island_index < 0 else areas[island_index]

    @property
    def num_islands(self) -> int:
        return len(self.navigation.island_areas)

    @property
    def navigable_area(self) -> float:
        return self.navigation.navigable_area

    def distance_to_closest_obstacle(self, pt: Sequence[float], max_search_radius: float = 2.0) -> float:
        """From the agent's surface, as in habitat-sim; NaN: no agent can stand there."""
        obstacle = self.navigation.clearance(pt, max_search_radius)
        return math.nan if obstacle is None else max(0.0, obstacle.distance - self.navigation.radius)

    def closest_obstacle_surface_point(self, pt: Sequence[float],
                                       max_search_radius: float = 2.0) -> "HitRecord":
        """`hit_dist` as distance_to_closest_obstacle(); infinite without an obstacle."""
        obstacle = self.navigation.clearance(pt, max_search_radius)
        if obstacle is None or obstacle.point is None or obstacle.normal is None:
            return HitRecord(_NOWHERE.copy(), _NOWHERE.copy(), math.inf)
        distance = max(0.0, obstacle.distance - self.navigation.radius)
        return HitRecord(np.array(obstacle.point), np.array(obstacle.normal), distance)

    def get_bounds(self) -> Tuple[np.ndarray, np.ndarray]:
        """Of the scene."""
        bounds = self.navigation._client.welcome.scene.bounds
        return tuple(np.array((p.x, p.y, p.z)) for p in (bounds.min, bounds.max))  # type: ignore[return-value]

    def island_radius(self, point: Sequence[float]) -> float:
        """The distance from the point to the farthest of 1000 random places of its island; 0: none."""
        island = self.get_island(point)
        if island < 0:
            return 0.0
        spots = self.navigation.random_places(1000, 1, island=island)
        return max(float(np.linalg.norm(spot.at - np.asarray(point))) for spot in spots if spot)

    def get_topdown_view(self, meters_per_pixel: float, height: float) -> np.ndarray:
        return self.navigation.top_down(height, meters_per_pixel).cells


def _island(index: int) -> Optional[int]:
    return index if index >= 0 else None


def _point(spot: Optional[Spot]) -> np.ndarray:
    return _NOWHERE.copy() if spot is None else spot.at
