"""Environments with Gymnasium's API: an avatar walks through the scene and observes pictures.

Gymnasium itself is optional: if it is installed, these classes are its environments and use its
spaces. The world runs in lockstep and restarts with reset(). The same seed and the same actions
therefore give the same observations, pixel for pixel on the same renderer.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from .. import messages, results, spaces
from ..arguments import UINT32, number, numbers, whole
from ..avatar import Avatar
from ..cameras import Camera, CameraRequest, chosen_cameras
from ..client import Client, connect
from ..connection import raise_refusal
from ..errors import OrderFailed
from ..kept_request import KeptRequest
from ..process import Server, serve
from ..world_group import Member
from .episodes import Episode, checked_episodes, checked_places, draw_episode
from .walker import Observation, Walker

_RADII, _HEIGHTS = (0.05, 5), (0.2, 10)  # metres: those of Spawn
MAX_STARTS = 32  # that are drawn for one episode


class WalkEnv(Walker, spaces.EnvBase):
    """One avatar in a world of its own.

    scene or address: a model, for which a server process is started, or HOST:PORT of a running
        server (this client must then drive its world `world`). Or client: a connected one, which
        close() leaves open.
    starts: start positions, (x, y, z) of the feet or (x, y, z, facing in degrees); each reset chooses
        one at random, and a facing if none is given. Or "anywhere": random places. A start that the world
        refuses is drawn again, up to 32 times; one that reset(options=...) names is not. Of `episodes`
        one whose start is refused, or whose goal no path reaches, is passed over with a warning.
    goal: the walk succeeds within `goal_radius` metres of it, on the ground.
    goals: goals instead, of which each reset chooses one that can be reached, or "anywhere". Distances
        are then geodesic, at least `min_distance` at the start. Or `episodes` instead of starts and goals,
        which take turns.
    radius, height: size of the avatar in metres. eye_height: of the camera above the feet, metres.
    pitch, fov_y: of the camera in radians, upwards positive (default 0), and its vertical angle (1.2).
        size: (width, height) of the pictures in pixels (128, 128); `channels` as of a Camera ("rgb",
        "depth"), or none. Or `cameras` instead: Cameras with different names, whose observations have
        the names NAME_rgb, NAME_depth, ...
    ticks_per_step: 1/60 s each. speed: metres per second. turn_speed: radians per second.
    discrete: actions are 0 stand, 1 walk ahead, 2 turn left, 3 turn right; else two numbers in -1..1,
        ahead and turn (left is positive).

    Observations: the channels (depth and range in metres, inf for the background), "position" of the feet,
    "heading" as its cosine and sine, and with a goal "to_goal" in metres and "goal_polar": the distance
    on the ground, and the angle from the heading, left positive. The reward is the progress towards the
    goal, or without a goal the distance walked, in metres; override reward() and is_over(), and
    new_episode() for other starts and goals. `info` has "collided": in any tick of the step an obstacle
    stopped the avatar, or came into contact with it; the ground on which it stands is no obstacle. With goals or
    episodes `info` has "geodesic_distance", "success" and "spl", too: the distance that is left counts as
    walked. A fall out of the scene ends the episode, with "fell" in `info` and the observation before it.

    Raises ValueError with the name of the argument before anything is sent. After an order, a step or a
    picture that the server refuses, call reset() next. A KeyboardInterrupt during a step leaves it usable,
    but the world may have advanced by that step.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(self, scene: Union[str, Path, None] = None, *, address: str = "",
                 starts: Union[str, Sequence[Sequence[float]]] = (),
                 goal: Optional[Sequence[float]] = None,
                 goals: Union[None, str, Sequence[Sequence[float]]] = None,
                 episodes: Optional[Sequence[Episode]] = None, min_distance: float = 1.0,
                 radius: Optional[float] = None, height: Optional[float] = None,
                 eye_height: Optional[float] = None, pitch: Optional[float] = None,
                 cameras: Sequence[Camera] = (),
                 goal_radius: float = 0.5, size: Optional[Tuple[int, int]] = None,
                 channels: Optional[Sequence[str]] = None, ticks_per_step: int = 6,
                 speed: float = 1.4, turn_speed: float = math.pi / 2, max_steps: int = 1000,
                 fov_y: Optional[float] = None, discrete: bool = False,
                 render_mode: Optional[str] = "rgb_array", server_arguments: Sequence[str] = (),
                 client: Optional[Client] = None, world: str = "main", token: str = "") -> None:
        if sum(one is not None for one in (goal, goals, episodes)) > 1:
            raise ValueError("give one of goal, goals and episodes")
        if episodes is not None and not (isinstance(starts, (tuple, list)) and not starts):
            raise ValueError("starts: leave it out, episodes have their own")
        self.starts = [] if episodes is not None else checked_places(starts, "starts", (3, 4))
        self.goals = None if goals is None else checked_places(goals, "goals", (3,))
        self.episodes = None if episodes is None else checked_episodes(episodes)
        self._first_goal = None if goal is None else np.array(numbers(goal, "goal", (3,)))
        for name, count in (("ticks_per_step", ticks_per_step), ("max_steps", max_steps)):
            whole(count, name, 1, UINT32)
        self.min_distance = number(min_distance, "min_distance", 0)
        self._size = {"radius": None if radius is None else number(radius, "radius", *_RADII),
                      "height": None if height is None else number(height, "height", *_HEIGHTS)}
        self.is_geodesic = goals is not None or episodes is not None
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode: give None or 'rgb_array', not {render_mode!r}")
        if eye_height is not None:
            number(eye_height, "eye_height")
        if isinstance(server_arguments, str):
            raise ValueError("server_arguments: give a list of strings")
        if sum(one is not None for one in (scene, address or None, client)) != 1:
            raise ValueError("give one of scene, address and client")
        self.goal_radius = number(goal_radius, "goal_radius", above=0)
        chosen = chosen_cameras(
            cameras, size=size, channels=channels, fov_y=fov_y, pitch=pitch, height=eye_height)
        super().__init__(
            chosen, goal=self._first_goal, ticks_per_step=ticks_per_step,
            speed=number(speed, "speed", above=0), turn_speed=number(turn_speed, "turn_speed", 0),
            discrete=discrete, render_mode=render_mode)
        self.max_steps = max_steps
        self.observation_space = self._observation_space(self.goal is not None or self.is_geodesic)
        self.action_space = spaces.Discrete(4) if discrete else \
            spaces.Box(-1.0, 1.0, (2,), np.float32)
        if not spaces.HAVE_GYMNASIUM:
            self.np_random = np.random.default_rng()
        self._steps = 0
        self._start: Sequence[float] = ()  # of the episode
        self.episode: Optional[Episode] = None  # the present one, with goals or episodes
        self._drawn: Optional[Episode] = None  # the last one that has a path, as it was drawn
        self._reached: Dict[Tuple[float, ...], float] = {}  # lengths of paths, by start and goal
        self._episode_number = 0
        self._walked = 0.0  # metres in this episode
        self._left = math.inf  # geodesic distance to the goal, metres
        self.server: Optional[Server] = None
        self._own_client = client is None
        try:
            self._use(client or self._connected(scene, address, server_arguments, world=world,
                                                token=token))
            self._begin()
        except BaseException:
            self.close()
            raise

    def _begin(self) -> None:
        self.navigation = self.client.navigation(**self._size, speed=self.speed)
        self.client.lockstep()
        self.client.subscribe(contacts=True, notices=True)
        self.metadata = {**self.metadata, "render_fps": 1 / self._seconds}

    def _connected(self, scene: Union[str, Path, None], address: str,
                   arguments: Sequence[str], **options: str) -> Client:
        if scene is None:
            return connect(address, name="enfilade environment", **options)
        self.server = serve(scene, *arguments)
        return self.server.connect(name="enfilade environment", **options)

    @property
    def avatar(self) -> Avatar:
        """The avatar, as a place for queries: navigation.path(env.avatar, goal, keep=True)."""
        return Avatar(self.client, self._name)

    # ---- a task may override these -----------------------------------------------------------

    def new_episode(self) -> Episode:
        """Returns the next of `episodes`, or draws one; only with goals or episodes."""
        if self.episodes is not None:
            episode = self.episodes[self._episode_number % len(self.episodes)]
            self._episode_number += 1
            return episode
        self._drawn = draw_episode(self.navigation, self.np_random, min_distance=self.min_distance,
                                   starts=self.starts, goals=self.goals or ())
        return self._drawn

    def _one_of(self, places: Any) -> Optional[Sequence[float]]:
        return places[int(self.np_random.integers(len(places)))] if places else None

    def reward(self, before: np.ndarray, after: np.ndarray, info: Dict[str, Any]) -> float:
        """Returns the reward of a step between two positions of the feet, in metres."""
        if self.is_geodesic:
            return float(info["progress"])
        if self.goal is None:
            return float(math.hypot(after[0] - before[0], after[2] - before[2]))
        return self._to_goal(before) - self._to_goal(after)

    def is_over(self, position: np.ndarray, info: Dict[str, Any]) -> bool:
        """Returns whether the task has ended, with or without success (`terminated`)."""
        if self.is_geodesic:
            return bool(info["success"])
        return self.goal is not None and self._to_goal(position) <= self.goal_radius

    def _to_goal(self, position: Sequence[float]) -> float:
        assert self.goal is not None
        return math.hypot(self.goal[0] - position[0], self.goal[2] - position[2])

    # ---- Gymnasium's API --------------------------------------------------------------------

    def reset(self, *, seed: Optional[int] = None,
              options: Optional[Dict[str, Any]] = None) -> Tuple[Observation, Dict[str, Any]]:
        """Restarts the world. `options` may have "start", as in `starts`, and "goal", if the
        environment has one: both for this episode."""
        options = options or {}
        return self._entered(self._post_reset(seed, options), options)

    def step(self, action: Any) -> Tuple[Observation, float, bool, bool, Dict[str, Any]]:
        return self._take_step(self._post_step(self._meaning(action)))

    def render(self) -> Optional[np.ndarray]:
        """Returns the last colour picture; None before reset() and after close()."""
        if self.render_mode is None or self._feet is None:
            return None
        if self._rgb is not None:
            return self._rgb.copy()
        look = self.cameras[0].camera if self.cameras else Camera("")
        request = CameraRequest(replace(look, channels=("rgb",), depth_noise=None), self._name)
        request.aim(self._heading)
        reply, attachment = self.client.take(self.client._post([request.request]))[0]
        return results.frame(reply.frame, attachment).rgb

    def close(self) -> None:
        self._feet = None
        if self._own_client and hasattr(self, "client"):
            self.client.close()
        if self.server is not None:
            self.server.stop()

    def __enter__(self) -> "WalkEnv":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    # ---- reset() in two halves, so that several environments work at the same time -----------

    def _post_reset(self, seed: Optional[int], options: Dict[str, Any]) -> List[int]:
        self._feet = self._rgb = None  # until the reset succeeds
        start, self.goal = self._chosen(seed, options)
        facing = start[3] if len(start) > 3 else float(self.np_random.uniform(0, 360))
        self._face(math.radians(facing))
        for camera in self.cameras:
            camera.forget()
        self._steps = 0
        self._tag += 1
        self._start = start
        spawn = messages.Spawn(at=messages.Vec3(x=start[0], y=start[1], z=start[2]), facing=facing,
                               **self._size)
        return self.client._post([
            messages.ClientMessage(restart=messages.Restart()),
            messages.ClientMessage(command=messages.Command(avatar=self._name, tag=self._tag,
                                                            spawn=spawn)),
            messages.ClientMessage(step=messages.Step(ticks=1, avatars=True)), *self._pictures(),
            *self._reach_query()])

    def _entered(self, posted: List[int], options: Dict[str, Any]) -> Tuple[Observation, Dict[str, Any]]:
        """Takes the reply to _post_reset(). Draws again while the start is refused or no path leads to the
        goal."""
        given = self.starts if self.episodes is None else self.episodes
        draws = 1 if "start" in options or len(given) == 1 else MAX_STARTS
        for refused in range(1, draws + 1):
            try:
                return self._take_reset(posted)
            except OrderFailed as error:
                if refused == draws:
                    if draws > 1:
                        error.args = (f"{draws} starts were refused; the last: {error}",)
                    raise
                if self.episodes is not None:
                    warnings.warn(f"{error}; the next episode is taken", stacklevel=3)
            posted = self._post_reset(None, options)
        raise AssertionError("at least one start is drawn")

    def _chosen(self, seed: Optional[int], options: Dict[str, Any]) -> Tuple[Any, Any]:
        """Returns the start and the goal of the episode."""
        unknown = set(options) - {"start", "goal"}
        if unknown:
            raise ValueError(f"options: unknown {sorted(unknown)}; give start or goal")
        goal = options.get("goal")
        if goal is not None and self._first_goal is None and not self.is_geodesic:
            raise ValueError("options: goal needs an environment with a goal")
        goal = self._first_goal if goal is None else np.array(numbers(goal, "goal", (3,)))
        self._walked = 0.0
        start = options.get("start")
        if start is not None:
            start = numbers(start, "start", (3, 4))
        if spaces.HAVE_GYMNASIUM:
            super().reset(seed=seed)
        elif seed is not None:
            self.np_random = np.random.default_rng(seed)
        if seed is not None:
            self.action_space.seed(seed)
        if not self.is_geodesic:
            return start or self._one_of(self.starts) or self._anywhere(), goal
        if start is None and goal is None:
            self.episode = self.new_episode()
        else:
            self.episode = self._drawn = draw_episode(
                self.navigation, self.np_random, min_distance=0.0, start=start, goal=goal,
                starts=self.starts, goals=self.goals or ())
        self._left = self.episode.geodesic_distance
        return (*self.episode.start, self.episode.facing), np.array(self.episode.goal)

    def _reach_query(self) -> List[Any]:
        """Asks for the path of an episode that was not drawn, for example of a file: it may have none. Once
        for each pair of places."""
        if not self.is_geodesic or self.episode is self._drawn:
            return []
        assert self.episode is not None
        length = self._reached.get((*self.episode.start, *self.episode.goal))
        if length is not None:
            self._set_shortest(length)
            return []
        return [messages.ClientMessage(
            navigation=self.navigation.query([self.episode.goal], start=self.episode.start))]

    def _check_reach(self, path: Any) -> None:
        """Raises OrderFailed without a path. Its length is the `geodesic_distance` of an episode that has
        none."""
        episode = self.episode
        assert episode is not None
        if not path.found:
            raise OrderFailed(f"episode {episode.id!r}: no path leads from {episode.start} to "
                              f"{episode.goal}: {path.reason}")
        if self.episodes is not None:
            self._reached[(*episode.start, *episode.goal)] = path.length
        self._set_shortest(path.length)

    def _set_shortest(self, length: float) -> None:
        assert self.episode is not None
        if not math.isfinite(self.episode.geodesic_distance):
            self.episode = replace(self.episode, geodesic_distance=length)
        self._left = length  # that of a file may be of another agent: the first reward would jump

    def _anywhere(self) -> Sequence[float]:
        spot = self.navigation.random_place(int(self.np_random.integers(0, 2 ** 63)))
        if spot is None:
            raise OrderFailed("starts: no place to stand was found in this scene")
        return tuple(map(float, spot.at))

    def _take_reset(self, posted: List[int]) -> Tuple[Observation, Dict[str, Any]]:
        replies = self.client.replies(posted)
        for reply, _ in replies[:3]:
            raise_refusal(reply)
        entered = replies[2][0].step
        contacts = [one for one in self.client._kept_contacts() if one.reason != "restart"]
        why = self._refusals()
        if not self._take_avatar(entered):
            where = ", ".join(f"{metres:g}" for metres in self._start[:3])
            raise OrderFailed(f"the avatar could not spawn at ({where}): {' '.join(why)}")
        feet, self._feet = self._feet, None  # in case this fails
        for reply, _ in replies[3:]:
            raise_refusal(reply)
        if len(replies) > 3 + len(self.cameras):
            self._check_reach(replies.pop()[0].navigation.paths[0])
        self._feet = feet
        info = self._info(entered.tick, entered.state_hash, contacts, False)
        if self.is_geodesic:
            info["geodesic_distance"] = self._left
        return self._observation(replies[3:]), info

    # ---- step() in two halves ---------------------------------------------------------------

    def _post_step(self, meaning: Tuple[float, float]) -> List[int]:
        self._drive.set(*self._turn(meaning))
        return self.client._post([self._drive, self._run, *self._pictures(),
                                  *self._distance_query()])

    def _kept_step(self, member: Member) -> KeptRequest:
        """The requests of a step in this episode. The numbers are _step_numbers()."""
        queries = [KeptRequest(one) for one in self._distance_query()]
        return member.kept_step(self._name, [self._drive, self._run,
                                             *(one.request for one in self.cameras), *queries])

    def _step_numbers(self, meaning: Tuple[float, float]) -> Sequence[float]:
        numbers = self._turn(meaning)
        for camera in self.cameras:
            numbers += camera.numbers(self._heading)
        return numbers

    def _distance_query(self) -> List[Any]:
        if not self.is_geodesic:
            return []
        assert self.goal is not None
        return [messages.ClientMessage(
            navigation=self.navigation.query([self.goal], avatar=self._name, keep=True))]

    def _take_step(self, posted: List[int]) -> Tuple[Observation, float, bool, bool,
                                                     Dict[str, Any]]:
        replies = self.client.replies(posted)
        before, contacts = self._feet, self.client._kept_contacts()
        left = any(one.kind == "left" and one.avatar == self._name for one in self.client._notices)
        self.client._notices.clear()
        self._feet = None  # in case this fails
        for reply, _ in replies[:2]:
            raise_refusal(reply)
        assert before is not None
        made = replies[1][0].step
        self._steps += 1
        if not self._take_avatar(made):
            if not left:
                raise OrderFailed("the avatar is no longer in the world: another client commands it")
            self._feet = before
            return self._seen, 0.0, True, False, self._fallen(made, contacts)
        feet, self._feet = self._feet, None  # in case a picture or the path is refused
        for reply, _ in replies[2:]:
            raise_refusal(reply)
        self._feet = feet
        path = replies.pop()[0].navigation.paths[0] if self.is_geodesic else None
        info = self._info(made.tick, made.state_hash, contacts, self._has_collided(made.tick, contacts))
        return (self._observation(replies[2:]), *self._judged(before, info, path))

    def _take_packed(self, step: Tuple[int, int, np.ndarray, str, int]) -> Dict[str, Any]:
        """Keeps the avatar's state of a packed step. Returns its info."""
        tick, state_hash, self._feet, self._stopped_by, self._last_stopped = step
        self._steps += 1
        contacts = self._contacts_of_step()
        return self._info(tick, state_hash, contacts, self._has_collided(tick, contacts))

    def _judged(self, before: np.ndarray, info: Dict[str, Any],
                path: Any) -> Tuple[float, bool, bool, Dict[str, Any]]:
        """The results of step() after the observation. `path`: to the goal; None if it is not geodesic."""
        after = self._feet
        assert after is not None
        if path is not None:
            self._add_measures(info, before, after, path)
        return (self.reward(before, after, info), self.is_over(after, info),
                self._steps >= self.max_steps, info)

    def _fallen(self, made: Any, contacts: List[results.Contact]) -> Dict[str, Any]:
        """The info of the step in which the avatar fell out of the scene."""
        info = self._info(made.tick, made.state_hash, contacts, any(map(self._is_collision, contacts)))
        info["fell"] = True
        if self.is_geodesic:
            info.update(progress=0.0, geodesic_distance=self._left, success=False, spl=0.0)
        return info

    def _add_measures(self, info: Dict[str, Any], before: np.ndarray, after: np.ndarray,
                      path: Any) -> None:
        assert self.episode is not None
        self._walked += float(np.linalg.norm(after - before))
        left = path.length if path.found else self._left
        shortest = self.episode.geodesic_distance
        success = left <= self.goal_radius
        walked = self._walked + left
        info.update(progress=self._left - left, geodesic_distance=left, success=success,
                    spl=1.0 if success and walked <= shortest else shortest / walked if success else 0.0)
        self._left = left
