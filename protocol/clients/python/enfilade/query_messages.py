"""Requests built from Python arguments: pictures and queries, and points for all requests."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Iterable, List, Mapping, Optional, Sequence, Union

import numpy as np

from . import messages, results
from .arguments import UINT64, optional_whole, whole

Point = Sequence[float]


def avatar_ids(ids: Iterable[int]) -> List[int]:
    found = list(ids) if isinstance(ids, Iterable) else []
    if not found:  # none would mean all of them
        raise ValueError("contact_horizon: give ids of avatars, or True for all of them")
    return [whole(one, "contact_horizon") for one in found]


def vec(point: Point) -> Any:
    try:
        x, y, z = map(float, point)
    except (TypeError, ValueError):
        raise ValueError(f"a point: give three numbers (x, y, z), not {point!r}") from None
    return messages.Vec3(x=x, y=y, z=z)


def points(points: Any, name: str) -> np.ndarray:
    array = np.asarray(points, np.float64)
    if array.size == 0:
        return array.reshape(0, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name}: give N x 3 numbers, not the shape {array.shape}")
    return array


def doors_value(name: str) -> int:
    """Returns the value of NavigationQuery.Doors."""
    values = messages.NavigationQuery.DESCRIPTOR.enum_types_by_name["Doors"].values_by_name
    value = values.get("DOORS_" + name.upper())
    if value is None or value.number == 0:
        raise ValueError(f"doors: unknown value {name!r}; give as_they_are or open")
    return int(value.number)


def entity(which: Any) -> Any:
    """Returns the EntityRef of an id, a name, a path, or an object with a name, as an Avatar."""
    if isinstance(which, str):
        return messages.EntityRef(name=which)
    if isinstance(getattr(which, "name", None), str):
        return messages.EntityRef(name=which.name)
    if which is None:
        raise ValueError("entity: give an id, a name, a path or an avatar")
    return messages.EntityRef(id=whole(which, "entity"))


def _named(prefix: str, name: str, argument: str) -> int:
    number = messages._found.get(prefix + name.upper())
    if number is None:
        raise ValueError(f"{argument}: unknown value {name!r}")
    return int(number)


def cannot_touch_query(a: Any, b: Any, assume: str, least: float, tick: Optional[int]) -> Any:
    kinds = messages.CannotTouchQuery.DESCRIPTOR.enum_types_by_name["Assume"].values_by_name
    kind = kinds.get("ASSUME_" + assume.upper())
    if kind is None or kind.number == 0:
        raise ValueError(f"assume: unknown value {assume!r}; give present_motion or any_command")
    return messages.CannotTouchQuery(a=entity(a), b=entity(b), assume=kind.number, least=least,
                                     tick=optional_whole(tick, "tick"))


def _set_lens(request: Any, lens: str, width: Optional[float], distortion: Sequence[float]) -> None:
    if lens not in ("fisheye", "equirectangular"):
        raise ValueError(f"lens: give \"fisheye\" or \"equirectangular\", not {lens!r}")
    if lens == "equirectangular":
        if width is not None or len(distortion):
            raise ValueError("lens: an equirectangular picture has neither fov_y nor distortion")
        request.lens.equirectangular.SetInParent()
        return
    if len(distortion) > 4:
        raise ValueError("distortion: give at most four coefficients, k1 to k4")
    request.lens.fisheye.SetInParent()
    if width is not None:
        request.lens.fisheye.width = width
    for name, value in zip(("k1", "k2", "k3", "k4"), distortion):
        setattr(request.lens.fisheye, name, value)


def load_distortion(table: Any) -> np.ndarray:
    """Returns a distortion table as rows x columns x 5 factors. `table` is an array, an .npy file of this
    shape, or a text file. Its first line has the numbers of rows and columns. Then a line of five
    numbers follows for each cell of the grid, row by row."""
    if isinstance(table, (str, Path)):
        if str(table).endswith(".npy"):
            table = np.load(table, allow_pickle=False)
        else:
            with open(table, encoding="utf-8") as file:
                rows, columns = (int(word) for word in file.readline().split())
                table = np.loadtxt(file).reshape(rows, columns, -1)
    array = np.ascontiguousarray(table, "<f4")
    if array.ndim != 3 or array.shape[2] != 5 or 0 in array.shape:
        raise ValueError(f"distortion: a table has rows x columns x 5 factors, not {array.shape}")
    return array


def _depth_noise(noise: Union[int, Mapping[str, Any]]) -> Any:
    if not isinstance(noise, Mapping):
        return messages.DepthNoise(seed=whole(noise, "depth_noise", 0, UINT64))
    unknown = set(noise) - {"model", "seed", "scale", "distortion"}
    if unknown:
        raise ValueError(f"depth_noise: unknown {sorted(unknown)}; give model, seed, scale, distortion")
    if noise.get("model", "redwood") != "redwood":
        raise ValueError(f"depth_noise: the model is 'redwood', not {noise['model']!r}")
    message = messages.DepthNoise(seed=whole(noise.get("seed", 0), "depth_noise: seed", 0, UINT64),
                                  scale=noise.get("scale", 0.0))
    if noise.get("distortion") is not None:
        table = load_distortion(noise["distortion"])
        message.distortion = table.tobytes()
        message.distortion_rows = table.shape[0]
    return message


def frame_request(avatar: str = "", *, eye: Optional[Point] = None, target: Optional[Point] = None,
                  forward: Optional[Point] = None, up: Optional[Point] = None, width: int = 640,
                  height: int = 480, fov_y: Optional[float] = None,
                  intrinsics: Optional[Sequence[float]] = None, height_y: Optional[float] = None,
                  near: Optional[float] = None, far: Optional[float] = None,
                  channels: Sequence[str] = ("rgb",), glass: str = "", renderer: str = "",
                  shadows: Optional[bool] = None, lens: str = "", distortion: Sequence[float] = (),
                  depth_noise: Union[None, int, Mapping[str, Any]] = None, flow_from: Optional[int] = None,
                  flow_forward: Optional[Point] = None, collision_shapes: bool = False,
                  samples: int = 1, tick: Optional[int] = None) -> Any:
    """Returns the FrameRequest that Client.frame() sends."""
    if sum(one is not None for one in (fov_y, intrinsics, height_y)) > 1:
        raise ValueError("frame: give one of fov_y, intrinsics and height_y")
    if target is not None and forward is not None:
        raise ValueError("frame: give either a target or forward")
    if eye is None and not avatar:
        raise ValueError("frame: give an avatar or an eye")
    if eye is None and not (target is None and up is None and height_y is None):
        raise ValueError("frame: target, up and height_y need an eye; for an avatar's eyes give "
                         "forward")
    if depth_noise is not None and "depth" not in channels:
        raise ValueError("depth_noise: it needs \"depth\" among the channels")
    for name, given in (("flow_from", flow_from), ("flow_forward", flow_forward)):
        if given is not None and "flow" not in channels:
            raise ValueError(f"{name}: it needs \"flow\" among the channels")
    request = messages.FrameRequest(width=whole(width, "width"), height=whole(height, "height"),
                                    channels=results.channels(channels), shadows=shadows,
                                    collision_shapes=collision_shapes, samples=whole(samples, "samples"),
                                    tick=optional_whole(tick, "tick"))
    if eye is None:
        view = request.eyes
        view.avatar = avatar
    else:
        view = request.free
        view.eye.CopyFrom(vec(eye))
        view.hide_avatar = avatar
    for name, point in (("target", target), ("forward", forward), ("up", up)):
        if point is not None:
            getattr(view, name).CopyFrom(vec(point))
    for name, value in (("fov_y", None if lens else fov_y), ("height_y", height_y), ("near", near), ("far", far)):
        if value is not None:
            setattr(view, name, value)
    if intrinsics is not None:
        fx, fy, cx, cy = intrinsics
        request.intrinsics.CopyFrom(messages.Intrinsics(fx=fx, fy=fy, cx=cx, cy=cy))
    if lens or len(distortion):
        _set_lens(request, lens, fov_y, distortion)
    if flow_from is not None:
        request.flow_from = whole(flow_from, "flow_from", high=UINT64)
    if flow_forward is not None:
        request.flow_forward.CopyFrom(vec(flow_forward))
    if depth_noise is not None:
        request.depth_noise.CopyFrom(_depth_noise(depth_noise))
    if glass:
        request.glass = _named("GLASS_", glass, "glass")
    if renderer:
        request.renderer = _named("RENDERER_", renderer, "renderer")
    return request
