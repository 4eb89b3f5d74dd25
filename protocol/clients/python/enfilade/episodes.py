"""Episodes of point navigation: drawn in a scene, and files as habitat-lab's PointNav data sets."""

from __future__ import annotations

import gzip
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from .errors import EnfiladeError
from .navigation import Navigation

MAX_DRAWS = 64  # of a start and a goal, for one episode

Point3 = Tuple[float, float, float]


@dataclass(frozen=True)
class Episode:
    """Where a walk starts and where it shall end. `geodesic_distance`: of the shortest path, metres."""
    start: Point3  # the feet
    facing: float  # degrees about +Y, 0 looks along +X
    goal: Point3
    geodesic_distance: float
    id: str = ""


def draw_episode(navigation: Navigation, random: np.random.Generator, *, min_distance: float = 1.0,
                 max_distance: float = math.inf, start: Optional[Sequence[float]] = None,
                 goal: Optional[Sequence[float]] = None) -> Episode:
    """Draws a start and a goal on the largest island between which there is a path. Distances are geodesic.
    Raises EnfiladeError if none is found."""
    def place(given: Optional[Sequence[float]]) -> Optional[Point3]:
        if given is not None:
            return tuple(map(float, given[:3]))  # type: ignore[return-value]
        spot = navigation.random_place(int(random.integers(0, 2 ** 63)), island=0)
        return None if spot is None else tuple(map(float, spot.at))  # type: ignore[return-value]

    for _ in range(MAX_DRAWS):
        first, last = place(start), place(goal)
        if first is None or last is None:
            raise EnfiladeError("no place to stand was found in this scene: is the unit right, and the radius?")
        distance = navigation.geodesic_distance(first, last)
        if min_distance <= distance <= max_distance and math.isfinite(distance):
            facing = start[3] if start is not None and len(start) > 3 else random.uniform(0, 360)
            return Episode(first, float(facing), last, distance)
    raise EnfiladeError(f"no path of {min_distance:g} to {max_distance:g} m was found in {MAX_DRAWS} draws")


def read_episodes(file: Union[str, Path]) -> List[Episode]:
    """Reads habitat-lab's PointNav JSON, also .json.gz: start_position, start_rotation, goals, info."""
    with (gzip.open if str(file).endswith(".gz") else open)(file, "rt", encoding="utf-8") as text:
        data = json.load(text)
    try:
        return [_from_habitat(one) for one in data["episodes"]]
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise ValueError(f"{file}: not a file of PointNav episodes: {error!r}") from None


def write_episodes(file: Union[str, Path], episodes: Sequence[Episode], scene: str) -> None:
    """Writes the same format; `scene` is the scene_id of all."""
    data = {"episodes": [_to_habitat(one, i, scene) for i, one in enumerate(episodes)]}
    with (gzip.open if str(file).endswith(".gz") else open)(file, "wt", encoding="utf-8") as text:
        json.dump(data, text)


# habitat's agent looks along -Z; its rotation about +Y is (x, y, z, w). `facing` 90 looks along -Z.

def _from_habitat(one: Dict[str, Any]) -> Episode:
    x, y, z, w = map(float, one["start_rotation"])
    if abs(x) > 1e-3 or abs(z) > 1e-3:
        raise ValueError(f"start_rotation {one['start_rotation']}: only rotations about Y")
    facing = 90.0 + math.degrees(2 * math.atan2(y, w))
    start = tuple(map(float, one["start_position"]))
    goal = tuple(map(float, one["goals"][0]["position"]))
    distance = float((one.get("info") or {}).get("geodesic_distance", math.nan))
    return Episode(start, facing % 360, goal, distance, str(one.get("episode_id", "")))  # type: ignore[arg-type]


def _to_habitat(one: Episode, number: int, scene: str) -> Dict[str, Any]:
    half = 0.5 * math.radians(one.facing - 90.0)
    return {"episode_id": one.id or str(number), "scene_id": scene, "start_position": list(one.start),
            "start_rotation": [0.0, math.sin(half), 0.0, math.cos(half)],
            "info": {"geodesic_distance": one.geodesic_distance},
            "goals": [{"position": list(one.goal), "radius": None}], "shortest_paths": None}
