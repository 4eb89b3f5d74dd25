"""Lidars whose rays have their own times: spinning ones, and any other pattern."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import List, Optional, Sequence, Tuple

import numpy as np

from .client import Client
from .errors import EnfiladeError
from .results import AvatarState

# Metres in one tick. A farther displacement is a teleport: the sensor has not been in between.
_TELEPORT = 1.0
_ROUNDING = 1e-9  # of a tick's length, in sums of periods


@dataclass(frozen=True, eq=False)  # arrays do not compare as one
class LidarPattern:
    """The rays of one period, which repeats.

    azimuth, elevation: radians from the sensor's axis, to the left and upwards positive. time: seconds
    since the start of the period, ascending, within [0, period)."""

    azimuth: np.ndarray
    elevation: np.ndarray
    time: np.ndarray
    period: float

    def __post_init__(self) -> None:
        for name in ("azimuth", "elevation", "time"):
            object.__setattr__(self, name, np.array(getattr(self, name), np.float64, ndmin=1))
        if not 0 < self.period < math.inf:
            raise ValueError(f"period: give seconds above 0, not {self.period}")
        shape = (len(self.time),)
        if shape == (0,) or not self.azimuth.shape == self.elevation.shape == self.time.shape == shape:
            raise ValueError("azimuth, elevation, time: give one number each for every ray, not the shapes "
                             f"{self.azimuth.shape}, {self.elevation.shape}, {self.time.shape}")
        if not (np.isfinite(self.azimuth).all() and np.isfinite(self.elevation).all()):
            raise ValueError("azimuth, elevation: give finite radians")
        if not (np.diff(self.time) >= 0).all() or not (self.time[0] >= 0 and self.time[-1] < self.period):
            raise ValueError(f"time: give ascending seconds within [0, {self.period:g})")

    @classmethod
    def spinning(cls, elevations: Sequence[float], columns: int, rate: float = 10.0) -> "LidarPattern":
        """A spinning lidar: one beam for each of the `elevations` (radians), which measure together
        `columns` times per turn. It turns `rate` times per second, clockwise seen from above, and
        begins behind, as Client.scan(). Rays of one time have the order of `elevations`."""
        if columns < 1 or len(elevations) < 1:
            raise ValueError("spinning: give at least one column and one elevation")
        if not 0 < rate < math.inf:
            raise ValueError(f"rate: give turns per second above 0, not {rate}")
        column = np.repeat(np.arange(columns), len(elevations))
        return cls(math.pi - column * (2 * math.pi / columns), np.tile(elevations, columns),
                   column / (columns * rate), 1 / rate)

    def directions(self) -> np.ndarray:
        """N x 3, unit, in the sensor's frame: ahead, up, to the right."""
        across = np.cos(self.elevation)
        return np.stack([across * np.cos(self.azimuth), np.sin(self.elevation),
                         -across * np.sin(self.azimuth)], axis=1)


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Measurements of a lidar, an entry per ray. Without a hit: entity 0, NaN in distance and points."""

    ray: np.ndarray  # its index in the pattern
    time: np.ndarray  # seconds of simulated time
    origin: np.ndarray  # N x 3, scene frame: where the sensor was at that time
    direction: np.ndarray  # N x 3, unit, scene frame
    distance: np.ndarray  # metres
    entity: np.ndarray  # uint32; Client.names() has the names
    point: np.ndarray  # N x 3, scene frame
    in_sensor: np.ndarray  # N x 3, the sensor's frame at that time: ahead, up, to the right


def _joined(clouds: Sequence[PointCloud]) -> PointCloud:
    return PointCloud(*(np.concatenate([getattr(cloud, one.name) for cloud in clouds])
                        for one in fields(PointCloud)))


def _split(cloud: PointCloud, at: int) -> Tuple[PointCloud, PointCloud]:
    arrays = [getattr(cloud, one.name) for one in fields(PointCloud)]
    return PointCloud(*(array[:at] for array in arrays)), PointCloud(*(array[at:] for array in arrays))


def _heading(state: AvatarState, default: float) -> float:
    """Radians about +Y from +X; `default` if it looks straight up or down."""
    x, _, z = state.gaze
    return math.atan2(-z, x) if math.hypot(x, z) > 1e-9 else default


class Lidar:
    """A lidar on an avatar. The world must be in lockstep.

        lidar = enfilade.Lidar(client, "ann", enfilade.LidarPattern.spinning(
            np.linspace(0.26, -0.26, 16), 900))
        ann.walk((6, 0, 0))
        cloud = lidar.sweep()  # a turn of 0.1 s: the avatar walks meanwhile

    Each ray has a time of its own. It starts where the sensor is at that time, between its places at
    the two neighbouring ticks, and meets the scene of the later one: other things that move are ahead
    by less than a tick. The rays ignore the avatar itself.

    height: metres above the feet; None: the avatar's eyes. ahead, left: metres from its axis. yaw,
    pitch: radians of the sensor's axis from the avatar's heading, to the left and upwards positive.
    reach: metres; 0: unlimited."""

    def __init__(self, client: Client, avatar: str, pattern: LidarPattern, *, height: Optional[float] = None,
                 ahead: float = 0.0, left: float = 0.0, yaw: float = 0.0, pitch: float = 0.0,
                 reach: float = 0.0, through_glass: bool = False) -> None:
        self.pattern = pattern
        self._client, self._avatar = client, avatar
        self._height, self._ahead, self._left, self._yaw = height, ahead, left, yaw
        self._options = {"reach": reach, "through_glass": through_glass, "through_avatar": avatar}
        self._local = pattern.directions()
        c, s = math.cos(pitch), math.sin(pitch)
        self._tilted = self._local @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        self._before: Optional[AvatarState] = None
        self._heading = 0.0
        self._start = self._tick = 0
        self._now = 0.0
        self._next = 0  # rays since the start of the first period
        self._kept: List[PointCloud] = []  # measured, of a period that sweep() has not returned

    def observe(self) -> PointCloud:
        """Runs one tick and returns the rays since the last one."""
        return self._taken([*self._kept, self._observe()])

    def sweep(self) -> PointCloud:
        """Runs ticks until the period is complete, and returns its rays."""
        count = len(self.pattern.time)
        begun = self._next - sum(len(cloud.ray) for cloud in self._kept)
        end = (begun // count + 1) * count
        clouds = list(self._kept)
        while self._next < end:
            clouds.append(self._observe())
        done, rest = _split(self._taken(clouds), end - begun)
        if len(rest.ray):
            self._kept = [rest]
        return done

    def _taken(self, clouds: List[PointCloud]) -> PointCloud:
        self._kept = []
        return _joined(clouds)

    def _state(self, ticks: int) -> AvatarState:
        done = self._client.step(ticks, avatars=True)
        state = done.avatars.get(self._avatar)
        if state is None:
            raise EnfiladeError(f"lidar: avatar {self._avatar!r} is not in the world")
        if self._before is not None and done.tick != self._tick + 1:
            raise EnfiladeError(f"lidar: the world went from tick {self._tick} to {done.tick} between two "
                                "observations: let observe() or sweep() run the ticks, or make a new Lidar")
        self._tick, self._now = done.tick, done.time
        return state

    def _observe(self) -> PointCloud:
        if self._before is None:
            # The rays start at a known place: the first tick only shows it.
            self._before = self._state(1)
            self._heading = _heading(self._before, 0.0)
            self._start = self._tick
        before, began, seconds = self._before, self._now, self._client.tick_seconds
        state = self._state(1)
        rays, times = self._due((self._tick - self._start) * seconds)
        fraction = np.clip(times / seconds - (self._tick - 1 - self._start), 0.0, 1.0)
        heading = _heading(state, self._heading)
        if math.dist(before.feet, state.feet) > _TELEPORT:
            before, self._heading = state, heading
        turned = math.remainder(heading - self._heading, 2 * math.pi)
        headings = self._heading + turned * fraction
        origin, direction = self._placed(rays, fraction[:, None], headings, before, state)
        self._before, self._heading = state, heading
        hits = self._client.rays(origin, direction, **self._options)
        if len(rays) and hits.tick != self._tick:
            raise EnfiladeError(f"lidar: the clock advanced from tick {self._tick} to {hits.tick}: "
                                "lockstep() first")
        return PointCloud(rays, began + fraction * seconds, origin, direction, hits.distance, hits.entity,
                          hits.point, self._local[rays] * hits.distance[:, None])

    def _due(self, elapsed: float) -> Tuple[np.ndarray, np.ndarray]:
        """The rays before `elapsed` seconds since the start that are not measured: indices, times."""
        pattern = self.pattern
        count = len(pattern.time)
        until = elapsed - _ROUNDING * self._client.tick_seconds
        cycle = int(until // pattern.period)
        end = cycle * count + int(np.searchsorted(pattern.time, until - cycle * pattern.period))
        number = np.arange(self._next, max(self._next, end))
        self._next = max(self._next, end)
        return number % count, pattern.time[number % count] + number // count * pattern.period

    def _placed(self, rays: np.ndarray, fraction: np.ndarray, headings: np.ndarray, before: AvatarState,
                state: AvatarState) -> Tuple[np.ndarray, np.ndarray]:
        """Origins and directions in the scene's frame."""
        def place(one: AvatarState) -> np.ndarray:
            height = one.eye_height if self._height is None else self._height
            return np.add(one.feet, (0, height, 0))

        c, s = np.cos(headings), np.sin(headings)
        aside = np.stack([self._ahead * c - self._left * s, np.zeros_like(c),
                          -self._ahead * s - self._left * c], axis=1)
        origin = (1 - fraction) * place(before) + fraction * place(state) + aside
        c, s = np.cos(headings + self._yaw), np.sin(headings + self._yaw)
        ahead, up, right = self._tilted[rays].T
        return origin, np.stack([ahead * c + right * s, up, -ahead * s + right * c], axis=1)
