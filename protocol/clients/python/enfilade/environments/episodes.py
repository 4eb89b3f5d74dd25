"""Episodes of point navigation: drawn in a scene, and files as habitat-lab's PointNav data sets."""

from __future__ import annotations

import gzip
import json
import math
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from ..arguments import number, numbers
from ..errors import EpisodeNotFound
from ..navigation import Navigation

MAX_DRAWS = 64  # of a start and a goal, for one episode
MAX_LISTED = 20  # scenes in an error
NEAR_START = 2.0  # metres: where a given start is looked for on the mesh

Point3 = Tuple[float, float, float]


@dataclass(frozen=True)
class Episode:
    """Where a walk starts and where it shall end. `geodesic_distance`: of the shortest path, metres; NaN:
    not known."""
    start: Point3  # the feet
    facing: float  # degrees about +Y, 0 looks along +X
    goal: Point3
    geodesic_distance: float
    id: str = ""
    scene_id: str = ""  # as in its file
    goal_radius: Optional[float] = None  # metres, of the goal in its file; WalkEnv has its own


def check_episode(one: Episode, name: str) -> None:
    """Raises ValueError with the name of the field if start, facing, goal or its radius are not finite
    numbers."""
    numbers(one.start, f"{name}.start", (3,))
    number(one.facing, f"{name}.facing")
    numbers(one.goal, f"{name}.goal", (3,))
    if one.goal_radius is not None:
        number(one.goal_radius, f"{name}.goal_radius", 0)


def checked_places(given: Any, name: str, counts: Sequence[int]) -> List[Tuple[float, ...]]:
    """Returns the places; none for "anywhere"."""
    if isinstance(given, str):
        if given != "anywhere":
            raise ValueError(f"{name}: give places or \"anywhere\", not {given!r}")
        return []
    try:
        given = list(given)
    except TypeError:
        raise ValueError(f"{name}: give positions or \"anywhere\", not {given!r}") from None
    if not given:
        raise ValueError(f"{name}: give at least one position, or \"anywhere\"")
    return [numbers(one, f"{name}[{i}]", counts) for i, one in enumerate(given)]


def checked_episodes(given: Sequence[Episode]) -> List[Episode]:
    if not isinstance(given, (list, tuple)) or not given:
        raise ValueError("episodes: give at least one")
    for i, one in enumerate(given):
        if not isinstance(one, Episode):
            raise ValueError(f"episodes[{i}]: give an Episode, not {one!r}")
        check_episode(one, f"episodes[{i}]")
    return list(given)


def draw_episode(navigation: Navigation, random: np.random.Generator, *, min_distance: float = 1.0,
                 max_distance: float = math.inf, start: Optional[Sequence[float]] = None,
                 goal: Optional[Sequence[float]] = None, starts: Sequence[Sequence[float]] = (),
                 goals: Sequence[Sequence[float]] = ()) -> Episode:
    """Draws a start and a goal between which there is a path: the one given, or one of those given,
    or else a place on any island that is no roof. The goal is on the start's island. Distances are
    geodesic. Raises EpisodeNotFound with the reason of the last draw if none is found."""
    starts = starts if start is None else [start]
    goals = goals if goal is None else [goal]

    def place(given: Sequence[Sequence[float]], island: Optional[int] = None) -> Sequence[float]:
        if len(given):
            return tuple(map(float, given[int(random.integers(len(given)))]))
        spot = navigation.random_place(int(random.integers(0, 2 ** 63)), island=island)
        if spot is None:
            raise EpisodeNotFound("no place to stand was found in this scene: is the unit right, and the radius?")
        return tuple(map(float, spot.at))

    def island_of(point: Sequence[float]) -> Optional[int]:
        spot = navigation.snap(point[:3], NEAR_START)
        return None if spot is None else spot.island

    draws = 1 if len(starts) == 1 and len(goals) == 1 else MAX_DRAWS
    for _ in range(draws):
        first = place(starts)
        last = place(goals, None if len(goals) else island_of(first))[:3]
        path = navigation.path(first[:3], last)
        if path.found and min_distance <= path.length <= max_distance:
            facing = first[3] if len(first) > 3 else random.uniform(0, 360)
            return Episode(first[:3], float(facing), last, path.length)  # type: ignore[arg-type]
    why = path.reason if not path.found else f"it is {path.length:g} m long"
    where = " to ".join("(" + ", ".join(f"{metres:g}" for metres in end[:3]) + ")" for end in (first, last))
    raise EpisodeNotFound(f"no path of {min_distance:g} to {max_distance:g} m was found in "
                          f"{draws} {'draws' if draws > 1 else 'draw'}; the last, from {where}: {why}")


def read_episodes(file: Union[str, Path], scene_id: Optional[str] = None) -> List[Episode]:
    """Reads habitat-lab's PointNav JSON, also .json.gz: scene_id, start_position, start_rotation, the first of
    the goals, info. `scene_id`: only the episodes of this scene; a file with several needs one. A
    `geodesic_distance` that is missing is NaN: WalkEnv measures it. Raises ValueError with the file, and
    the number of the episode or the scenes."""
    with (gzip.open if str(file).endswith(".gz") else open)(file, "rt", encoding="utf-8") as text:
        try:
            listed = json.load(text)["episodes"]
            count = len(listed)
        except (EOFError, KeyError, TypeError, ValueError, gzip.BadGzipFile, zlib.error) as error:
            raise ValueError(f"{file}: not a file of PointNav episodes: {error!r}") from None
    episodes = []
    for i in range(count):
        try:
            episodes.append(_from_habitat(listed[i]))
        except (AttributeError, KeyError, IndexError, TypeError, ValueError) as error:
            why = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise ValueError(f"{file}: episodes[{i}]: {why}") from None
    scenes = list(dict.fromkeys(one.scene_id for one in episodes))
    if scene_id is None and len(scenes) > 1:
        raise ValueError(f"{file}: its episodes are in {len(scenes)} scenes; give scene_id, one of {_listed(scenes)}")
    if scene_id is not None and scene_id not in scenes:
        raise ValueError(f"scene_id: {file} has no episodes in {scene_id!r}, but in {_listed(scenes)}")
    return [one for one in episodes if scene_id in (None, one.scene_id)]


def _listed(scenes: Sequence[str]) -> str:
    more = len(scenes) - MAX_LISTED
    return ", ".join(map(repr, scenes[:MAX_LISTED])) + (f" and {more} more" if more > 0 else "")


def write_episodes(file: Union[str, Path], episodes: Sequence[Episode], scene: str = "") -> None:
    """Writes the same format; `scene` is the scene_id of all, by default each has its own. A
    `geodesic_distance` that is not known is left out."""
    for i, one in enumerate(episodes):
        check_episode(one, f"episodes[{i}]")
        if not (scene or one.scene_id):
            raise ValueError(f"scene: give one, episodes[{i}] has no scene_id")
    data = {"episodes": [_to_habitat(one, i, scene) for i, one in enumerate(episodes)]}
    written = json.dumps(data, allow_nan=False)  # before the file is opened
    with (gzip.open if str(file).endswith(".gz") else open)(file, "wt", encoding="utf-8") as text:
        text.write(written)


# habitat's agent looks along -Z; its rotation about +Y is (x, y, z, w). `facing` 90 looks along -Z.

def _from_habitat(one: Dict[str, Any]) -> Episode:
    x, y, z, w = numbers(one["start_rotation"], "start_rotation", (4,))
    if abs(math.sqrt(x * x + y * y + z * z + w * w) - 1) > 1e-2:
        raise ValueError(f"start_rotation {one['start_rotation']}: not a unit quaternion (x, y, z, w)")
    if abs(x) > 1e-3 or abs(z) > 1e-3:
        raise ValueError(f"start_rotation {one['start_rotation']}: only rotations about Y")
    facing = 90.0 + math.degrees(2 * math.atan2(y, w))
    start = numbers(one["start_position"], "start_position", (3,))
    if not one["goals"]:
        raise ValueError("goals: give at least one")
    goal = numbers(one["goals"][0]["position"], "goals[0].position", (3,))
    distance = (one.get("info") or {}).get("geodesic_distance")
    distance = math.nan if distance is None else float(distance)
    if distance < 0:
        raise ValueError(f"geodesic_distance: give at least 0, not {distance:g}")
    radius = one["goals"][0].get("radius")
    if radius is not None:
        radius = number(radius, "goals[0].radius", 0)
    return Episode(start, facing % 360, goal, distance, str(one.get("episode_id", "")),  # type: ignore[arg-type]
                   str(one.get("scene_id", "")), radius)


def _to_habitat(one: Episode, number: int, scene: str) -> Dict[str, Any]:
    half = 0.5 * math.radians(one.facing - 90.0)
    is_known = math.isfinite(one.geodesic_distance)
    return {"episode_id": one.id or str(number), "scene_id": scene or one.scene_id, "start_position": list(one.start),
            "start_rotation": [0.0, math.sin(half), 0.0, math.cos(half)],
            "info": {"geodesic_distance": one.geodesic_distance} if is_known else {},
            "goals": [{"position": list(one.goal), "radius": one.goal_radius}], "shortest_paths": None}
