"""Environments with Gymnasium's API: an avatar walks through the scene and sees.

Gymnasium itself is optional: where it is installed, the classes here are its environments and use its
spaces. Everything is made in lockstep and begins anew with reset(), so that the same seed and the same
actions give the same observations, pixel for pixel on the same renderer.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import messages, results, spaces
from .client import Client, connect, frame_request
from .errors import OrderFailed
from .process import Server, serve

Observation = Dict[str, np.ndarray]


class WalkEnv(spaces.EnvBase):
    """One avatar in a world of its own.

    scene or address: a model that a server process is started for, or HOST:PORT of one that runs
        (this client must then be its driver).
    starts: places to begin at, (x, y, z) of the feet or (x, y, z, facing in degrees); one is chosen at
        each reset, and a facing where none is given.
    goal: where the walk ends well, within `goal_radius` metres on the ground.
    size: (width, height) of the pictures in pixels; `channels` of "rgb", "depth", "ids", or none.
    ticks_per_step: 1/60 s each. speed: metres a second. turn_speed: radians a second.
    discrete: actions are 0 stand, 1 go ahead, 2 turn left, 3 turn right; else two numbers in -1..1,
        ahead and turn (left is positive).

    Observations: the channels (depth in metres, inf where there is nothing), "position" of the feet,
    "heading" as its cosine and sine, and "to_goal" in metres when there is a goal. The reward is the way
    made towards the goal, or without one the way made, in metres; override reward() and is_over().
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(self, scene: Union[str, Path, None] = None, *, address: str = "",
                 starts: Sequence[Sequence[float]], goal: Optional[Sequence[float]] = None,
                 goal_radius: float = 0.5, size: Tuple[int, int] = (128, 128),
                 channels: Sequence[str] = ("rgb", "depth"), ticks_per_step: int = 6,
                 speed: float = 1.4, turn_speed: float = math.pi / 2, max_steps: int = 1000,
                 fov_y: float = 1.2, discrete: bool = False,
                 render_mode: Optional[str] = "rgb_array", server_arguments: Sequence[str] = (),
                 client: Optional[Client] = None) -> None:
        if not starts:
            raise ValueError("starts: give at least one place to begin at")
        self.starts = [tuple(map(float, start)) for start in starts]
        self.goal = None if goal is None else np.asarray(goal, np.float64)
        self.goal_radius, self.size, self.channels = goal_radius, size, tuple(channels)
        self.ticks_per_step, self.speed, self.turn_speed = ticks_per_step, speed, turn_speed
        self.max_steps, self.fov_y, self.discrete = max_steps, fov_y, discrete
        self.render_mode = render_mode
        self.observation_space = self._observation_space()
        self.action_space = spaces.Discrete(4) if discrete else \
            spaces.Box(-1.0, 1.0, (2,), np.float32)
        if not spaces.HAVE_GYMNASIUM:
            self.np_random = np.random.default_rng()
        self.server: Optional[Server] = None
        self.client = client or self._connected(scene, address, server_arguments)
        self.client.lockstep()
        self.client.subscribe(contacts=True, notices=True)
        self._seconds = ticks_per_step * self.client.tick_seconds
        self._name = "walker"
        self._heading = 0.0
        self._steps = 0
        self._state: Optional[results.AvatarState] = None
        self._frame: Optional[results.Frame] = None

    def _connected(self, scene: Union[str, Path, None], address: str,
                   arguments: Sequence[str]) -> Client:
        if (scene is None) == (not address):
            raise ValueError("give either a scene or the address of a server")
        if scene is None:
            return connect(address, name="enfilade environment")
        self.server = serve(scene, *arguments)
        return self.server.connect(name="enfilade environment")

    def _observation_space(self) -> Any:
        width, height = self.size
        box = spaces.Box
        parts: Dict[str, Any] = {}
        if "rgb" in self.channels:
            parts["rgb"] = box(0, 255, (height, width, 3), np.uint8)
        if "depth" in self.channels:
            parts["depth"] = box(0.0, np.inf, (height, width), np.float32)
        if "ids" in self.channels:
            parts["ids"] = box(0, 2**32 - 1, (height, width), np.uint32)
        parts["position"] = box(-np.inf, np.inf, (3,), np.float64)
        parts["heading"] = box(-1.0, 1.0, (2,), np.float64)
        if self.goal is not None:
            parts["to_goal"] = box(-np.inf, np.inf, (3,), np.float64)
        return spaces.Dict(parts)

    # ---- what a task may override -----------------------------------------------------------

    def reward(self, before: np.ndarray, after: np.ndarray, info: Dict[str, Any]) -> float:
        """Of a step from one position of the feet to another, in metres."""
        if self.goal is None:
            return float(math.hypot(after[0] - before[0], after[2] - before[2]))
        return self._to_goal(before) - self._to_goal(after)

    def is_over(self, position: np.ndarray, info: Dict[str, Any]) -> bool:
        """Whether the task is done, well or badly (`terminated`)."""
        return self.goal is not None and self._to_goal(position) <= self.goal_radius

    def _to_goal(self, position: np.ndarray) -> float:
        assert self.goal is not None
        return math.hypot(self.goal[0] - position[0], self.goal[2] - position[2])

    # ---- Gymnasium's API --------------------------------------------------------------------

    def reset(self, *, seed: Optional[int] = None,
              options: Optional[Dict[str, Any]] = None) -> Tuple[Observation, Dict[str, Any]]:
        """The world anew. `options` may have "start", as of `starts`, and "goal"."""
        return self._take_reset(self._post_reset(seed, options or {}))

    def step(self, action: Any) -> Tuple[Observation, float, bool, bool, Dict[str, Any]]:
        return self._take_step(self._post_step(action))

    def render(self) -> Optional[np.ndarray]:
        """The colours that were seen last."""
        if self.render_mode is None or self._state is None:
            return None
        if self._frame is not None and self._frame.rgb is not None:
            return self._frame.rgb.copy()
        return self.client.frame(self._name, forward=self._forward(), width=self.size[0],
                                 height=self.size[1], fov_y=self.fov_y).rgb

    def close(self) -> None:
        self.client.close()
        if self.server is not None:
            self.server.stop()

    # ---- in two halves, so that several environments work at the same time --------------------

    def _post_reset(self, seed: Optional[int], options: Dict[str, Any]) -> List[int]:
        if spaces.HAVE_GYMNASIUM:
            super().reset(seed=seed)
        elif seed is not None:
            self.np_random = np.random.default_rng(seed)
        if seed is not None:
            self.action_space.seed(seed)
        start = options.get("start", self.starts[int(self.np_random.integers(len(self.starts)))])
        if "goal" in options and self.goal is not None:
            self.goal = np.asarray(options["goal"], np.float64)
        facing = start[3] if len(start) > 3 else float(self.np_random.uniform(0, 360))
        self._heading = math.radians(facing)
        self._steps = 0
        spawn = messages.Spawn(at=messages.Vec3(x=start[0], y=start[1], z=start[2]), facing=facing)
        return self.client.post([
            {"restart": messages.Restart()},
            {"command": messages.Command(avatar=self._name, tag=1, spawn=spawn)},
            {"step": messages.Step(ticks=1, avatars=True)}, *self._picture()])

    def _take_reset(self, posted: List[int]) -> Tuple[Observation, Dict[str, Any]]:
        replies = [self.client._reply_to(one) for one in posted]
        for reply, _ in replies[:3]:
            self.client._raise_refusal(reply)
        entered = results.step(replies[2][0].step)
        contacts = [one for one in self.client.contacts() if one.reason != "restart"]
        notices = list(self.client.notices())
        if self._name not in entered.avatars:
            why = [one.text for one in notices if one.kind == "refused"]
            raise OrderFailed(f"the avatar could not begin there: {' '.join(why)}")
        for reply, _ in replies[3:]:
            self.client._raise_refusal(reply)
        self._state = entered.avatars[self._name]
        return self._observation(replies[3:]), self._info(entered, contacts)

    def _post_step(self, action: Any) -> List[int]:
        if self._state is None:
            raise RuntimeError("reset() comes before the first step()")
        ahead, turn = self._meaning(action)
        self._heading = math.remainder(self._heading + turn * self.turn_speed * self._seconds,
                                       math.tau)
        x, _, z = self._forward()
        velocity = messages.Vec3(x=ahead * self.speed * x, z=ahead * self.speed * z)
        drive = messages.Command(avatar=self._name, tag=2, drive=messages.Drive(velocity=velocity))
        return self.client.post([
            {"command": drive},
            {"step": messages.Step(ticks=self.ticks_per_step, avatars=True)}, *self._picture()])

    def _take_step(self, posted: List[int]) -> Tuple[Observation, float, bool, bool,
                                                     Dict[str, Any]]:
        replies = self.client.take(posted)
        assert self._state is not None
        before = np.array(self._state.feet)
        made = results.step(replies[1][0].step)
        self._state = made.avatars[self._name]
        self._steps += 1
        info = self._info(made, list(self.client.contacts()))
        list(self.client.notices())  # nothing here waits for them
        after = np.array(self._state.feet)
        return (self._observation(replies[2:]), self.reward(before, after, info),
                self.is_over(after, info), self._steps >= self.max_steps, info)

    def _meaning(self, action: Any) -> Tuple[float, float]:
        if not self.discrete:
            ahead, turn = np.clip(np.asarray(action, np.float64), -1.0, 1.0)
            return float(ahead), float(turn)
        return ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -1.0))[int(action)]

    def _forward(self) -> Tuple[float, float, float]:
        return (math.cos(self._heading), 0.0, -math.sin(self._heading))

    def _picture(self) -> List[Dict[str, Any]]:
        if not self.channels:
            return []
        return [{"frame": frame_request(self._name, forward=self._forward(), width=self.size[0],
                                        height=self.size[1], fov_y=self.fov_y,
                                        channels=self.channels)}]

    def _observation(self, pictures: Sequence[Tuple[Any, memoryview]]) -> Observation:
        assert self._state is not None
        seen: Observation = {}
        if pictures:
            reply, attachment = pictures[0]
            self._frame = results.frame(reply.frame, attachment)
            for name in ("rgb", "depth", "ids"):
                if name in self.channels:
                    seen[name] = getattr(self._frame, name)
            if "depth" in seen:
                depth = seen["depth"]
                depth[np.isnan(depth)] = np.inf
        seen["position"] = np.array(self._state.feet)
        x, _, z = self._forward()
        seen["heading"] = np.array([x, -z])
        if self.goal is not None:
            seen["to_goal"] = self.goal - seen["position"]
        return seen

    def _info(self, made: results.Step, contacts: List[results.Contact]) -> Dict[str, Any]:
        assert self._state is not None
        return {"tick": made.tick, "state_hash": made.state_hash, "contacts": contacts,
                "stopped_by": self._state.stopped_by_name}


class VectorWalkEnv:
    """Several WalkEnvs that work at the same time, with the API of Gymnasium's VectorEnv.

    Each has a server process of its own. `make` makes one of them: make(number) is a WalkEnv. One whose
    episode ended begins anew with the next step(), whose action for it is left aside and whose reward is
    0 (Gymnasium's "next step" mode).
    """

    metadata: Dict[str, Any] = {"autoreset_mode": "NextStep"}

    def __init__(self, make: Callable[[int], WalkEnv], num_envs: int) -> None:
        self.num_envs = num_envs
        self.envs: List[WalkEnv] = []
        try:
            for number in range(num_envs):
                self.envs.append(make(number))
        except BaseException:
            self.close()
            raise
        self.single_observation_space = self.envs[0].observation_space
        self.single_action_space = self.envs[0].action_space
        self._over = np.zeros(num_envs, bool)

    def reset(self, *, seed: Union[int, Sequence[Optional[int]], None] = None,
              options: Optional[Dict[str, Any]] = None) -> Tuple[Observation, Dict[str, Any]]:
        """`seed` is one for each, or a number to which the environment's own number is added."""
        seeds = [None if seed is None else seed + i for i in range(self.num_envs)] \
            if seed is None or isinstance(seed, int) else list(seed)
        posted = [env._post_reset(one, options or {}) for env, one in zip(self.envs, seeds)]
        taken = [env._take_reset(ids) for env, ids in zip(self.envs, posted)]
        self._over[:] = False
        return self._stacked([one[0] for one in taken]), self._gathered([one[1] for one in taken])

    def step(self, actions: Any) -> Tuple[Observation, np.ndarray, np.ndarray, np.ndarray,
                                          Dict[str, Any]]:
        over = self._over.copy()
        posted = [env._post_reset(None, {}) if ended else env._post_step(action)
                  for env, ended, action in zip(self.envs, over, actions)]
        taken: List[Tuple[Observation, float, bool, bool, Dict[str, Any]]] = []
        for env, ended, ids in zip(self.envs, over, posted):
            if ended:
                seen, info = env._take_reset(ids)
                taken.append((seen, 0.0, False, False, info))
            else:
                taken.append(env._take_step(ids))
        observations, rewards, terminated, truncated, infos = zip(*taken)
        self._over = np.array(terminated) | np.array(truncated)
        return (self._stacked(observations), np.array(rewards), np.array(terminated),
                np.array(truncated), self._gathered(infos))

    def render(self) -> List[Optional[np.ndarray]]:
        return [env.render() for env in self.envs]

    def close(self) -> None:
        for env in self.envs:
            env.close()

    @staticmethod
    def _stacked(observations: Sequence[Observation]) -> Observation:
        return {name: np.stack([one[name] for one in observations]) for name in observations[0]}

    @staticmethod
    def _gathered(infos: Sequence[Dict[str, Any]]) -> Dict[str, Any]:
        gathered: Dict[str, Any] = {}
        for name in infos[0]:
            values = np.empty(len(infos), object)
            for number, info in enumerate(infos):
                values[number] = info[name]
            gathered[name] = values
            gathered["_" + name] = np.ones(len(infos), bool)
        return gathered
