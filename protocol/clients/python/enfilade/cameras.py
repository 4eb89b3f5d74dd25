"""Cameras of an environment's avatar."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import messages, spaces
from .arguments import number
from .kept_request import KeptRequest
from .query_messages import frame_request

FIRST_TICK = 1  # of the first observation of an episode
_BOXES = {"rgb": (0, 255, (3,), np.uint8), "depth": (0.0, np.inf, (), np.float32),
          "range": (0.0, np.inf, (), np.float32), "ids": (0, 2**32 - 1, (), np.uint32),
          "class": (0, 2**32 - 1, (), np.uint32), "thing": (0, 2**32 - 1, (), np.uint32),
          "normals": (-1.0, 1.0, (3,), np.float32), "flow": (-np.inf, np.inf, (2,), np.float32)}


@dataclass(frozen=True)
class Camera:
    """A camera on an avatar: where it sits and looks, seen from the avatar's heading.

    size: (width, height) in pixels. channels: some of "rgb", "depth", "ids", "class", "thing",
    "normals", "range", "flow". Flow is in pixels to the right and down since the last observation: 0
    after reset(), inf where it is unknown. It needs a camera without lens, with ahead and left 0. yaw,
    pitch: radians, left and upwards positive. height: metres above the feet; None: the avatar's eyes.
    ahead, left: metres from its axis. samples: 1, 4 or 16 of the colour in
    each pixel. fov_y: radians, the vertical angle, by default 1.2. lens, distortion and depth_noise are
    those of Client.frame(): with "fisheye" fov_y is the angle of the whole width, by default pi, and
    "equirectangular" has none. Depths behind a lens are negative, and those that the noise loses are
    inf, as the background."""

    name: str
    size: Tuple[int, int] = (128, 128)
    channels: Sequence[str] = ("rgb", "depth")
    fov_y: Optional[float] = None
    yaw: float = 0.0
    pitch: float = 0.0
    height: Optional[float] = None
    ahead: float = 0.0
    left: float = 0.0
    samples: int = 1
    lens: str = ""
    distortion: Sequence[float] = ()
    depth_noise: Union[None, int, Mapping[str, Any]] = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise ValueError(f"name: give text, not {self.name!r}")
        if not isinstance(self.channels, (list, tuple, set)) or set(self.channels) - set(_BOXES):
            raise ValueError(f"channels: give some of {tuple(_BOXES)}, not {self.channels!r}")
        try:
            width, height = self.size
            good = width == int(width) >= 1 and height == int(height) >= 1
        except (OverflowError, TypeError, ValueError):
            good = False
        if not good:
            raise ValueError(f"size: give two whole numbers of pixels, at least 1, not {self.size!r}")
        if self.fov_y is not None and self.lens:
            number(self.fov_y, "fov_y", high=2 * math.pi, above=0)
        elif self.fov_y is not None:
            number(self.fov_y, "fov_y", above=0, below=math.pi)
        number(self.pitch, "pitch", above=-math.pi / 2, below=math.pi / 2)
        for name in ("yaw", "ahead", "left") + (() if self.height is None else ("height",)):
            number(getattr(self, name), name)
        if "flow" in self.channels and (self.lens or self.ahead or self.left):
            raise ValueError("channels: \"flow\" needs a camera without lens, ahead and left")
        if self.samples not in (1, 4, 16):
            raise ValueError(f"samples: give 1, 4 or 16, not {self.samples}")
        if self.lens or len(self.distortion) or self.depth_noise is not None:
            self.request("avatar")  # checks them

    def request(self, avatar: str) -> Any:
        """Returns the FrameRequest of a picture along +X from an avatar's eyes."""
        width, height = map(int, self.size)
        fov_y = 1.2 if self.fov_y is None and not self.lens else self.fov_y
        return frame_request(avatar, forward=(1, 0, 0), width=width, height=height, fov_y=fov_y,
                             channels=self.channels, samples=self.samples, lens=self.lens,
                             distortion=self.distortion, depth_noise=self.depth_noise)


def chosen_cameras(cameras: Sequence[Camera], **one: Any) -> List[Camera]:
    """Returns the cameras that have channels: those given, or a single one with the options `one`, of
    which None is the default. Raises ValueError for both, and for two cameras of one name."""
    given = {name: value for name, value in one.items() if value is not None}
    if not isinstance(cameras, (list, tuple)):
        raise ValueError("cameras: give a list of Cameras")
    if not len(cameras):
        cameras = [Camera("", **given)]
    elif given:
        name = {"height": "eye_height"}.get(next(iter(given)), next(iter(given)))
        raise ValueError(f"{name}: leave it out, each of the cameras has its own")
    for i, camera in enumerate(cameras):
        if not isinstance(camera, Camera):
            raise ValueError(f"cameras[{i}]: give a Camera, not {camera!r}")
        if any(camera.name == other.name for other in cameras[:i]):
            raise ValueError(f"cameras: two have the name {camera.name!r}")
    return [camera for camera in cameras if camera.channels]


class CameraRequest:
    """The request for a camera's picture, which aim() turns."""

    def __init__(self, camera: Camera, avatar: str) -> None:
        self.camera = camera
        self.channels = tuple(camera.channels)
        self.prefix = camera.name + "_" if camera.name else ""
        request = messages.ClientMessage(frame=camera.request(avatar))
        eyes = request.frame.eyes
        if camera.height is not None:
            eyes.height = camera.height
        self._is_aside = camera.ahead != 0 or camera.left != 0
        self.has_flow = "flow" in camera.channels
        self._seen_at: Optional[Tuple[int, Tuple[float, ...]]] = None  # tick and direction; None: never
        self._aimed: Tuple[float, ...] = ()
        numbers = [(eyes.forward, name) for name in "xyz"]
        if self._is_aside:
            numbers += [(eyes.offset, name) for name in "xz"]
        if self.has_flow:
            numbers += [(request.frame.flow_forward, name) for name in "xyz"]
            numbers.append((request.frame, "flow_from"))
        self.request = KeptRequest(request, *numbers)
        self._across, self._up = math.cos(camera.pitch), math.sin(camera.pitch)

    def aim(self, heading: float) -> None:
        """Looks along the avatar's heading, radians."""
        self.request.set(*self.numbers(heading))

    def numbers(self, heading: float) -> Tuple[float, ...]:
        """The numbers of `request` along a heading."""
        yaw = heading + self.camera.yaw
        forward = self._across * math.cos(yaw), self._up, -self._across * math.sin(yaw)
        if self.has_flow:
            self._aimed = forward
            tick, before = self._seen_at or (FIRST_TICK, forward)
            return (*forward, *before, tick)
        if not self._is_aside:
            return forward
        c, s = math.cos(heading), math.sin(heading)
        ahead, left = self.camera.ahead, self.camera.left
        return (*forward, ahead * c - left * s, -ahead * s - left * c)

    def keep(self, tick: int) -> None:
        """Begins the next flow at the picture of the last aim."""
        self._seen_at = tick, self._aimed

    def forget(self) -> None:
        """Begins the next flow at its own picture, as after a restart."""
        self._seen_at = None

    def spaces(self) -> Dict[str, Any]:
        """The spaces of its observations, by name."""
        width, height = map(int, self.camera.size)
        parts: Dict[str, Any] = {}
        for name in self.channels:
            low, high, more, kind = _BOXES[name]
            if name == "depth" and self.camera.lens:
                low = -np.inf
            parts[self.prefix + name] = spaces.Box(low, high, (height, width, *more), kind)
        return parts
