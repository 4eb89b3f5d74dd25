"""Floor plans: the walls, doors and rooms of a storey as outlines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional, Tuple

import numpy as np

from . import messages


@dataclass(frozen=True)
class PlanShape:
    """An object or body in a plan: FloorPlan.Shape of the .proto."""

    kind: str  # "wall", "furniture", "body", "door", "open_door", "swing" or "lift"
    entity: int  # of a body: its first object
    loops: Tuple[np.ndarray, ...]  # closed outlines: rows of x and z, metres
    lines: Tuple[np.ndarray, ...]  # open ones


@dataclass(frozen=True)
class PlanRoom:
    """A space of an IFC file."""

    name: str  # such as a number; may be empty
    long_name: str  # such as "Living room"; may be empty
    global_id: str
    low: np.ndarray  # corners of its box: x, y, z, metres
    high: np.ndarray
    surface: np.ndarray  # triangles, n×3×3; empty: the box is its solid


@dataclass(frozen=True)
class FloorPlan:
    """A horizontal section 1.2 m above a floor; bodies are where the model has them."""

    floor: float  # metres
    storey: str  # the name in the file; may be empty
    shapes: Tuple[PlanShape, ...]  # in the order of drawing
    rooms: Tuple[PlanRoom, ...]
    north: Optional[Tuple[float, float]]  # its direction in x and z; None: unknown


def floor_plan(message: Any) -> FloorPlan:
    shapes = tuple(PlanShape(kind=_kind(shape.kind), entity=shape.entity, loops=_lines(shape.loops),
                             lines=_lines(shape.lines)) for shape in message.shapes)
    rooms = tuple(PlanRoom(name=room.name, long_name=room.long_name, global_id=room.global_id,
                           low=_corner(room.min), high=_corner(room.max),
                           surface=np.array(room.surface, dtype=float).reshape(-1, 3, 3)) for room in message.rooms)
    north = tuple(message.north.points) if message.HasField("north") else None
    return FloorPlan(floor=message.floor, storey=message.storey, shapes=shapes, rooms=rooms, north=north)


def _kind(value: int) -> str:
    kinds = messages.FloorPlan.DESCRIPTOR.nested_types_by_name["Shape"].enum_types_by_name
    return messages.word(kinds["Kind"], value, "KIND_")


def _lines(lines: Any) -> Tuple[np.ndarray, ...]:
    return tuple(np.array(line.points, dtype=float).reshape(-1, 2) for line in lines)


def _corner(point: Any) -> np.ndarray:
    return np.array((point.x, point.y, point.z))
