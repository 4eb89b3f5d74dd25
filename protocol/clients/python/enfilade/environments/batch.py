"""Observations of several environments as one array for each key."""

from __future__ import annotations

from typing import Any, Collection, Dict, List, Optional

import numpy as np

from .walker import Observation

_INFINITY = np.float32(np.inf)


class Batch:
    """Takes the observations of environments one by one. `distances`: keys in which NaN (unknown,
    background) becomes infinity. With `copies`, each is copied at once, because the server's shared
    memory is valid for two rounds only. Otherwise finish() joins pictures without a copy where they
    lie in that memory at equal intervals; it copies `distances` and all small arrays."""

    def __init__(self, space: Any, count: int, copies: bool, distances: Collection[str]) -> None:
        self._count, self._distances = count, distances
        self._spaces = space.spaces
        self._views: Dict[str, List[Optional[np.ndarray]]] = {}
        self.observations: Observation = {}
        for name, one in self._spaces.items():
            if copies or name in distances or len(one.shape) < 2:
                self.observations[name] = self._empty(name)
            else:
                self._views[name] = [None] * count

    def _empty(self, name: str) -> np.ndarray:
        one = self._spaces[name]
        return np.empty((self._count, *one.shape), one.dtype)

    def add(self, i: int, seen: Observation) -> None:
        for name, one in seen.items():
            if name in self._views:
                self._views[name][i] = one
            elif name in self._distances:
                np.fmin(one, _INFINITY, out=self.observations[name][i])
            else:
                self.observations[name][i] = one

    def clear(self, i: int) -> None:
        for all_ in self.observations.values():
            all_[i] = 0
        for views in self._views.values():
            views[i] = None

    def finish(self) -> Observation:
        """The observations of all. Those that were cleared, or never added, are zero."""
        for name, views in self._views.items():
            joined = _join(views)
            if joined is None:
                joined = self._empty(name)
                for i, one in enumerate(views):
                    joined[i] = 0 if one is None else one
            self.observations[name] = joined
        return self.observations


def _join(views: List[Optional[np.ndarray]]) -> Optional[np.ndarray]:
    """A read-only array of all, without a copy; None if they are not at equal intervals in one buffer."""
    first = views[0]
    if first is None or any(one is None or one.dtype != first.dtype or one.shape != first.shape or
                            one.strides != first.strides for one in views):
        return None
    buffer = _find_buffer(first)
    if buffer is None or any(_find_buffer(one) is not buffer for one in views[1:]):
        return None
    places = [one.__array_interface__["data"][0] for one in views]
    interval = places[1] - places[0] if len(places) > 1 else first.nbytes
    if any(place != places[0] + i * interval for i, place in enumerate(places)):
        return None
    return np.lib.stride_tricks.as_strided(first, (len(views), *first.shape),
                                           (interval, *first.strides), writeable=False)


def _find_buffer(array: Any) -> Any:
    """The object whose memory an array shows; None if that is an array's own."""
    while isinstance(array, np.ndarray):
        array = array.base
    return array.obj if isinstance(array, memoryview) else None
