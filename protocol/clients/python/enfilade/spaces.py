"""Spaces of observations and actions: those of gymnasium if installed, else these."""

from __future__ import annotations

from typing import Any, Dict as DictOf, Mapping, Optional, Sequence

import numpy as np


class _Space:
    def __init__(self, shape: Any, dtype: Any) -> None:
        self.shape = shape
        self.dtype = np.dtype(dtype) if dtype is not None else None
        self._random = np.random.default_rng()

    def seed(self, seed: Optional[int] = None) -> None:
        self._random = np.random.default_rng(seed)

    def contains(self, x: Any) -> bool:
        raise NotImplementedError

    def __contains__(self, x: Any) -> bool:
        return self.contains(x)


class _Box(_Space):
    """Arrays between `low` and `high`."""

    def __init__(self, low: Any, high: Any, shape: Optional[Sequence[int]] = None,
                 dtype: Any = np.float32) -> None:
        low, high = np.asarray(low, dtype), np.asarray(high, dtype)
        full = tuple(shape) if shape is not None else np.broadcast_shapes(low.shape, high.shape)
        super().__init__(full, dtype)
        self.low = np.broadcast_to(low, full).copy()
        self.high = np.broadcast_to(high, full).copy()

    def sample(self) -> np.ndarray:
        if np.issubdtype(self.dtype, np.integer):
            return self._random.integers(self.low, self.high, self.shape, endpoint=True,
                                         dtype=self.dtype)
        low = np.where(np.isfinite(self.low), self.low, -1e6)
        high = np.where(np.isfinite(self.high), self.high, 1e6)
        return self._random.uniform(low, high, self.shape).astype(self.dtype)

    def contains(self, x: Any) -> bool:
        x = x if isinstance(x, np.ndarray) else np.asarray(x, self.dtype)
        return np.can_cast(x.dtype, self.dtype) and x.shape == self.shape and \
            bool(np.all(x >= self.low) and np.all(x <= self.high))

    def __repr__(self) -> str:
        return f"Box({self.low.min()}, {self.high.max()}, {self.shape}, {self.dtype})"


class _Discrete(_Space):
    """Whole numbers from 0 to n - 1."""

    def __init__(self, n: int) -> None:
        super().__init__((), np.int64)
        self.n = n

    def sample(self) -> int:
        return int(self._random.integers(self.n))

    def contains(self, x: Any) -> bool:
        if isinstance(x, np.ndarray) and x.shape == ():
            x = x.item()
        return isinstance(x, (int, np.integer)) and 0 <= x < self.n

    def __repr__(self) -> str:
        return f"Discrete({self.n})"


class _Dict(_Space):
    """One space per name."""

    def __init__(self, spaces: Mapping[str, Any]) -> None:
        super().__init__(None, None)
        self.spaces: DictOf[str, Any] = dict(spaces)

    def seed(self, seed: Optional[int] = None) -> None:
        for number, space in enumerate(self.spaces.values()):
            space.seed(None if seed is None else seed + number)

    def sample(self) -> DictOf[str, Any]:
        return {name: space.sample() for name, space in self.spaces.items()}

    def contains(self, x: Any) -> bool:
        return set(x) == set(self.spaces) and all(
            space.contains(x[name]) for name, space in self.spaces.items())

    def __getitem__(self, name: str) -> Any:
        return self.spaces[name]

    def __repr__(self) -> str:
        return f"Dict({self.spaces})"


EnvBase: Any = object
VectorEnvBase: Any = object
NEXT_STEP: Any = "NextStep"  # restart of episodes: a value of gymnasium.vector.AutoresetMode
Box: Any = _Box
Discrete: Any = _Discrete
Dict: Any = _Dict

try:
    import gymnasium
except ImportError:
    HAVE_GYMNASIUM = False
else:
    HAVE_GYMNASIUM = True
    EnvBase = gymnasium.Env
    VectorEnvBase = gymnasium.vector.VectorEnv
    if hasattr(gymnasium.vector, "AutoresetMode"):  # since 1.1
        NEXT_STEP = gymnasium.vector.AutoresetMode.NEXT_STEP
    Box, Discrete, Dict = gymnasium.spaces.Box, gymnasium.spaces.Discrete, gymnasium.spaces.Dict


def batched(space: Any, count: int) -> Any:
    """Returns the space of `count` stacked values of `space`."""
    if HAVE_GYMNASIUM:
        from gymnasium.vector.utils import batch_space
        return batch_space(space, count)
    if isinstance(space, _Dict):
        return _Dict({name: batched(one, count) for name, one in space.spaces.items()})
    if isinstance(space, _Discrete):
        return _Box(0, space.n - 1, (count,), np.int64)
    return _Box(np.stack([space.low] * count), np.stack([space.high] * count), None, space.dtype)
