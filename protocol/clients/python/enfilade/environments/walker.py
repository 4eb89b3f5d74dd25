"""An avatar that actions move, and what it observes: the part of an environment that knows no task."""

from __future__ import annotations

import math
import operator
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from .. import messages, results, spaces
from ..cameras import Camera, CameraRequest
from ..client import Client
from ..exchange import Reply
from ..kept_request import KeptRequest

Observation = Dict[str, np.ndarray]

DISTANCES = frozenset({"depth", "range", "flow"})  # channels with NaN where nothing is known
MAX_FLOW_TICKS = 31  # between two observations: a server keeps the last 32 ticks
_DISCRETE = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -1.0))


class Walker:
    """The base of WalkEnv. Its arguments have been checked."""

    def __init__(self, cameras: Sequence[Camera], *, goal: Optional[np.ndarray], ticks_per_step: int,
                 speed: float, turn_speed: float, discrete: bool, render_mode: Optional[str]) -> None:
        self._name = "walker"
        self.ticks_per_step = ticks_per_step
        self.speed, self.turn_speed, self.discrete = speed, turn_speed, discrete
        self.render_mode = render_mode
        drive = messages.ClientMessage(command=messages.Command(
            avatar=self._name, drive=messages.Drive(velocity=messages.Vec3())))
        velocity = drive.command.drive.velocity
        self._drive = KeptRequest(drive, (velocity, "x"), (velocity, "z"))
        self._run = KeptRequest(messages.ClientMessage(
            step=messages.Step(ticks=ticks_per_step, avatars=True)))
        self.cameras = [CameraRequest(one, self._name) for one in cameras]
        self._picture_key = next((one.prefix + "rgb" for one in self.cameras if "rgb" in one.channels),
                                 "rgb")
        self.goal = goal  # of the episode; None: the walk has none
        self._face(0.0)
        self._tag = 0  # of the last reset()'s spawn
        self._feet: Optional[np.ndarray] = None  # metres; None: no episode has begun
        self._stopped_by = ""  # in the last tick
        self._last_stopped = 0  # the last tick in which an obstacle stopped it; 0: none
        self._rgb: Optional[np.ndarray] = None
        self._seen: Observation = {}  # of the last step

    def _use(self, client: Client) -> None:
        """Sets the client. Raises ValueError if its server allows no such speed, step or picture."""
        self.client = client
        self._floor = math.cos(client.welcome.policies.walkable_slope) - 1e-9
        limit = client.welcome.policies.speed_limit
        if self.speed > limit:
            raise ValueError(f"speed: {self.speed:g} m/s exceeds the server's limit of {limit:g}")
        max_ticks = client.limits.max_ticks_per_step
        if self.ticks_per_step > max_ticks:
            raise ValueError(f"ticks_per_step: the server runs at most {max_ticks} at a time")
        widest, highest = client.limits.max_picture_width, client.limits.max_picture_height
        for one in self.cameras:
            width, height = one.camera.size
            if width > widest or height > highest:
                raise ValueError(f"size: the server draws at most {widest} x {highest} pixels, "
                                 f"not {width} x {height}")
        if self.ticks_per_step > MAX_FLOW_TICKS and any(one.has_flow for one in self.cameras):
            raise ValueError(f"ticks_per_step: at most {MAX_FLOW_TICKS} with the channel flow")
        most = client.limits.max_unread_pictures
        if len(self.cameras) > most:
            raise ValueError(f"cameras: the server keeps at most {most} pictures of one step")
        self._seconds = self.ticks_per_step * client.tick_seconds

    # ---- actions ----------------------------------------------------------------------------

    def _meaning(self, action: Any) -> Tuple[float, float]:
        """Returns ahead and turn of an action. Raises ValueError."""
        if self.discrete:
            try:
                return _DISCRETE[range(4).index(operator.index(action))]
            except (TypeError, ValueError):
                raise ValueError(f"action: give 0, 1, 2 or 3, not {action!r}") from None
        try:
            ahead, turn = map(float, action)
        except (TypeError, ValueError):
            raise ValueError(f"action: give two numbers, not {action!r}") from None
        if math.isnan(ahead) or math.isnan(turn):
            raise ValueError(f"action: {action!r} is not a number")
        return min(max(ahead, -1.0), 1.0), min(max(turn, -1.0), 1.0)

    def _turn(self, meaning: Tuple[float, float]) -> Tuple[float, float]:
        """Turns the heading. Returns the velocity of the step on the ground, x and z."""
        self._check_begun()
        ahead, turn = meaning
        self._face(math.remainder(self._heading + turn * self.turn_speed * self._seconds, math.tau))
        cosine, sine = self._direction
        return ahead * self.speed * cosine, ahead * self.speed * -sine

    def _face(self, heading: float) -> None:
        self._heading = heading
        self._direction = math.cos(heading), math.sin(heading)  # along x and -z

    # ---- the avatar in the world ------------------------------------------------------------

    def _take_avatar(self, step: Any) -> bool:
        """Keeps the avatar's state of a StepReply; False if it is not in the world."""
        for one in step.avatars:
            if one.name == self._name:
                feet = one.feet
                self._feet = np.array((feet.x, feet.y, feet.z))
                self._stopped_by = one.move.stopped_by_name
                self._last_stopped = one.last_stopped_tick
                return True
        return False

    def _check_begun(self) -> None:
        if self._feet is None:
            raise RuntimeError("call reset() first: no episode has begun, the last reset() or step() "
                               "failed, or the environment was closed")

    def _refusals(self) -> List[str]:
        """Returns the refusals of the spawn, and discards all other notices."""
        kept = self.client._notices
        why = [one.text for one in kept if one.kind == "refused" and
               (one.avatar, one.tag) == (self._name, self._tag)]
        kept.clear()
        return why

    def _contacts_of_step(self) -> List[results.Contact]:
        """Takes the contacts that came with a packed step."""
        client = self.client
        client._notices.clear()
        return client._kept_contacts() if client._contacts else []

    def _has_collided(self, tick: int, contacts: List[results.Contact]) -> bool:
        """Whether an obstacle stopped the avatar in any tick of the step that ended at `tick`, or came into
        contact with it."""
        return self._last_stopped > tick - self.ticks_per_step or any(map(self._is_collision, contacts))

    def _is_collision(self, contact: results.Contact) -> bool:
        """Whether a contact event is one of the avatar with something that it cannot stand on."""
        if self._name not in (contact.a_name, contact.b_name):
            return False
        is_first = contact.a_name == self._name
        if contact.kind == "blocked":
            return is_first
        down = -contact.normal[1] if is_first else contact.normal[1]
        return contact.kind == "begin" and down < self._floor

    def _info(self, tick: int, state_hash: int, contacts: List[results.Contact],
              collided: bool) -> Dict[str, Any]:
        return {"tick": tick, "state_hash": state_hash, "contacts": contacts,
                "stopped_by": self._stopped_by, "collided": collided}

    # ---- observations -----------------------------------------------------------------------

    def _observation_space(self, has_goal: bool) -> Any:
        box = spaces.Box
        parts: Dict[str, Any] = {}
        for camera in self.cameras:
            parts.update(camera.spaces())
        parts["position"] = box(-np.inf, np.inf, (3,), np.float64)
        parts["heading"] = box(-1.0, 1.0, (2,), np.float64)
        if has_goal:
            parts["to_goal"] = box(-np.inf, np.inf, (3,), np.float64)
            parts["goal_polar"] = box(-np.inf, np.inf, (2,), np.float64)
        return spaces.Dict(parts)

    def _pictures(self) -> List[Any]:
        """The requests for the cameras' pictures along the present heading."""
        for camera in self.cameras:
            camera.aim(self._heading)
        return [camera.request for camera in self.cameras]

    def _observation(self, pictures: Sequence[Reply]) -> Observation:
        assert self._feet is not None
        self._seen = {**self._pictured(pictures), **self._place()}
        return self._seen

    def _pictured(self, pictures: Sequence[Reply]) -> Observation:
        """The channels of the pictures that came, with infinity instead of NaN: unknown, background."""
        seen = self._channels(pictures)
        for camera in self.cameras:
            for name in DISTANCES.intersection(camera.channels):
                seen[camera.prefix + name] = np.fmin(seen[camera.prefix + name], np.float32(np.inf))
        return seen

    def _channels(self, pictures: Sequence[Reply]) -> Observation:
        """The channels as they came."""
        seen: Observation = {}
        for camera, (reply, attachment) in zip(self.cameras, pictures):
            frame = results.frame(reply.frame, attachment)
            for name in camera.channels:
                seen[camera.prefix + name] = frame.channel(name)
            if camera.has_flow:
                camera.keep(frame.tick)
        if self.render_mode is not None and self._picture_key in seen:
            self._rgb = seen[self._picture_key].copy()  # the observation belongs to its reader
        return seen

    def _place(self) -> Observation:
        """Position, heading and goal, as seen by the avatar."""
        assert self._feet is not None
        seen = {"position": self._feet.copy(), "heading": np.array(self._direction)}
        if self.goal is not None:
            seen["to_goal"] = self.goal - seen["position"]
            seen["goal_polar"] = np.array(self._polar(seen["to_goal"][0], seen["to_goal"][2]))
        return seen

    def _polar(self, x: float, z: float) -> Tuple[float, float]:
        """The distance of a place relative to the feet, and its angle from the heading."""
        angle = math.atan2(-z, x) - self._heading
        return math.hypot(x, z), math.remainder(angle, math.tau)
