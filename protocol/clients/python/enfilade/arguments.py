"""Checks of arguments: a ValueError names the argument."""

from __future__ import annotations

import math
import operator
from typing import Any, Optional, Sequence, Tuple

UINT32, UINT64 = 2**32 - 1, 2**64 - 1  # largest values


def numbers(given: Any, name: str, counts: Sequence[int]) -> Tuple[float, ...]:
    """Returns finite numbers, as many as one of `counts`."""
    try:
        found = () if isinstance(given, str) else tuple(map(float, given))
    except (TypeError, ValueError):
        found = ()
    if len(found) not in counts or not all(map(math.isfinite, found)):
        raise ValueError(f"{name}: give {' or '.join(map(str, counts))} finite numbers, not {given!r}")
    return found


def number(given: Any, name: str, low: float = -math.inf, high: float = math.inf, *,
           above: float = -math.inf, below: float = math.inf) -> float:
    """Returns a finite number from `low` to `high`, and above and below limits that it must not reach."""
    try:
        found = math.nan if isinstance(given, str) else float(given)
    except (TypeError, ValueError):
        found = math.nan
    if math.isfinite(found) and low <= found <= high and above < found < below:
        return found
    limits = [f"{text} {limit:g}" for text, limit in (("from", low), ("up to", high), ("above", above),
                                                      ("below", below)) if math.isfinite(limit)]
    raise ValueError(f"{name}: give a finite number {' '.join(limits)}".rstrip() + f", not {given!r}")


def whole(given: Any, name: str, low: int = 0, high: int = UINT32) -> int:
    """Returns a whole number from `low` to `high`."""
    try:
        found = operator.index(given)
    except TypeError:
        raise ValueError(f"{name}: give a whole number, not {given!r}") from None
    if not low <= found <= high:
        raise ValueError(f"{name}: give a whole number from {low} to {high}, not {given!r}")
    return found


def optional_whole(given: Any, name: str, low: int = 0, high: int = UINT64) -> Optional[int]:
    return None if given is None else whole(given, name, low, high)
