"""Several environments on one server, each with a world of its own."""

from __future__ import annotations

import itertools
import operator
import warnings
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from .. import spaces
from ..client import Client, connect
from ..errors import EpisodeNotFound, OrderFailed, ServerError
from ..kept_request import KeptRequest
from ..process import Server, serve
from ..world_group import Member, WorldGroup
from .batch import Batch
from .plain_steps import PlainSteps, Result
from .walk_env import WalkEnv
from .walker import DISTANCES, Observation


def _is_refusal(error: Exception) -> bool:
    """Whether the environment can restart: of a start, of a picture, or if no episode was drawn."""
    if isinstance(error, ServerError):
        return not error.fatal and error.code != "ERROR_WORLD_DROPPED"
    return isinstance(error, (OrderFailed, EpisodeNotFound))


class VectorWalkEnv(spaces.VectorEnvBase):
    """Several WalkEnvs that run at the same time, in worlds of one server that share its scene: one
    message steps all of them. A VectorEnv of Gymnasium if that is installed, with its methods and
    attributes everywhere.

    scene or address: a model, for which a server process is started, or HOST:PORT of a running
        server that lets this client create worlds (the role admin). Each world is dropped when its
        client leaves.
    world_scene: one of the server's scenes, by name; empty: the first.
    token: if the server requires one, of the role admin.
    make: creates one environment for a client in a world of its own, make(number, client); by default
        WalkEnv(client=client, **options).
    copy: as in Gymnasium. True: observations belong to their reader; each picture is copied once, from
        the memory that the server shares. False: pictures of a step are that memory, read-only, and
        valid until the next step(), reset() or render(). Those with distances or flow are still
        copied, since NaN becomes infinity, and so are all of a step in which an environment restarts.

    An environment whose episode ended restarts with the next step(). That step ignores its action,
    and its reward is 0 (Gymnasium's "next step" mode).

    A start that the world refuses is drawn again, as by WalkEnv, while the others wait.

    A wrong number of actions or seeds, or an invalid action, is a ValueError before anything is sent.
    If the server refuses a start or a picture later, or no episode is drawn, that environment alone is
    truncated: its observation is zero, and `info` has "error". There is a warning, too. The next step()
    restarts it, and the others continue. Other errors are raised with the number of the environment, after
    all replies, and so is the first refusal if none remains: call reset() then. If the server ended,
    create all environments again.
    """

    metadata: Dict[str, Any] = {"render_modes": ["rgb_array"], "autoreset_mode": spaces.NEXT_STEP}

    def __init__(self, scene: Union[str, Path, None] = None, num_envs: int = 1, *,
                 address: str = "", world_scene: str = "", token: str = "",
                 make: Optional[Callable[[int, Client], WalkEnv]] = None,
                 server_arguments: Sequence[str] = (), copy: bool = True, **options: Any) -> None:
        if operator.index(num_envs) < 1:
            raise ValueError(f"num_envs: give at least 1, not {num_envs}")
        if (scene is None) == (not address):
            raise ValueError("give either a scene or an address")
        if isinstance(server_arguments, str):
            raise ValueError("server_arguments: give a list of strings")
        if make is not None and options:
            raise ValueError(f"make: set {sorted(options)} inside make; options are for the default")
        self.num_envs = num_envs
        self._copies = bool(copy)
        self.closed = False
        self.server: Optional[Server] = None
        self._maker: Optional[Client] = None
        self.envs: List[WalkEnv] = []
        make = make or (lambda _, client: WalkEnv(client=client, **options))
        try:
            if scene is not None:
                self.server = serve(scene, *server_arguments)
                address = self.server.address
            self._maker = connect(address, name="enfilade environments", token=token)
            for number, client in enumerate(self._in_worlds(self._maker, world_scene)):
                self.envs.append(make(number, client))
            self._build_meshes(address, token)
        except BaseException:
            self.close()
            raise
        self.render_mode = self.envs[0].render_mode
        self.metadata = {**self.envs[0].metadata, "autoreset_mode": spaces.NEXT_STEP}
        self.single_observation_space = self.envs[0].observation_space
        self.single_action_space = self.envs[0].action_space
        self.observation_space = spaces.batched(self.single_observation_space, num_envs)
        self.action_space = spaces.batched(self.single_action_space, num_envs)
        self._over: Optional[np.ndarray] = None  # None: reset() is next
        self._is_packing = [isinstance(env.client, Member) and "packed_steps" in env.client.capabilities
                            for env in self.envs]
        self._plain: Optional[PlainSteps] = None
        if all(self._is_packing) and PlainSteps.fits(self.envs):
            self._plain = PlainSteps(self.envs)
        self._is_discrete = any(env.discrete for env in self.envs)
        self._kept: List[Optional[KeptRequest]] = []  # the requests of a step, if not to be made
        self._last: Observation = {}  # of the last reset() or step()

    def _build_meshes(self, address: str, token: str) -> None:
        """Those that reset() needs. Their progress keeps a connection waiting, but not a round of the group."""
        sizes = {tuple(env._size.items()): env for env in self.envs if env.is_geodesic or not env.starts}
        for env in sizes.values():
            with connect(address, name="enfilade environments", token=token, world=env.client.world) as client:
                client.navigation(**env._size).snap((0.0, 0.0, 0.0))

    def _in_worlds(self, maker: Client, scene: str) -> Sequence[Client]:
        """Creates num_envs worlds, and a client in each: all on one connection."""
        max_worlds = maker.limits.max_worlds - len(maker.worlds())
        if self.num_envs > max_worlds:
            raise ValueError(f"num_envs: the server accepts {max_worlds} more worlds, "
                             f"not {self.num_envs}")
        worlds = [maker.create_world(scene=scene or maker.scenes[0], drop_when_empty=True).name
                  for _ in range(self.num_envs)]
        return WorldGroup(maker, worlds, shared_memory=True).members

    def reset(self, *, seed: Union[int, Sequence[Optional[int]], None] = None,
              options: Optional[Dict[str, Any]] = None) -> Tuple[Observation, Dict[str, Any]]:
        """`seed`: one per environment, or a number to which each adds its own index."""
        seeds, options = self._seeds(seed), options or {}
        self._over = None
        self._kept = [None] * self.num_envs
        batch = self._make_batch(copies=True)

        def take(i: int, ids: List[int]) -> Dict[str, Any]:
            seen, info = self.envs[i]._entered(ids, options)
            batch.add(i, seen)
            return info

        infos, failures = self._each(
            lambda i: self.envs[i]._post_reset(seeds[i], options), take)
        over = np.array([info is None for info in infos])
        self._over = None if over.all() else over
        for i, text in self._tolerate(failures, batch):
            warnings.warn(text, stacklevel=2)
            infos[i] = {"error": text}
        self._last = batch.finish()
        return self._last, self._gathered(infos)

    def _make_batch(self, copies: bool) -> Batch:
        distances = {camera.prefix + name for camera in self.envs[0].cameras
                     for name in DISTANCES.intersection(camera.channels)}
        return Batch(self.single_observation_space, self.num_envs, copies, distances)

    def _seeds(self, seed: Any) -> List[Optional[int]]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, (int, np.integer)):
            return [int(seed) + i for i in range(self.num_envs)]
        seeds = [None if one is None else operator.index(one) for one in seed]
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed: give {self.num_envs}, one per environment, not {len(seeds)}")
        return seeds

    def step(self, actions: Any) -> Result:
        over = self._over
        if over is None:
            raise RuntimeError("call reset() first: no environment has begun, reset() or step() was "
                               "interrupted, or the environments were closed")
        meanings = self._meanings(actions, over)
        self._over = None
        if self._plain is None or over.any() or not self._plain.can_post():
            return self._step_each(over, self._posted(over, meanings))
        try:
            made = self._plain.step(meanings, [self._kept_of(i) for i in range(self.num_envs)])
        except Exception as error:
            self._over = np.ones(self.num_envs, bool)
            raise self._numbered([(self._plain.at, error)])
        if made is None:
            return self._step_each(over, lambda i: [])
        self._last = made[0]
        self._over = made[2] | made[3]
        return made

    def _posted(self, over: np.ndarray, meanings: Sequence[Tuple[float, float]],
                ) -> Callable[[int], List[int]]:
        def post(i: int) -> List[int]:
            if over[i]:
                self._kept[i] = None  # it may have another goal
                return self.envs[i]._post_reset(None, {})
            return self._post_step(i, meanings[i])
        return post

    def _step_each(self, over: np.ndarray, post: Callable[[int], List[int]]) -> Result:
        # A restart may take several rounds, in which the server overwrites its memory.
        if over.any() and not self._copies:
            self._last = {name: one.copy() for name, one in self._last.items()}
        batch = self._make_batch(self._copies or bool(over.any()))

        def take(i: int, ids: List[int]) -> Tuple[float, bool, bool, Dict[str, Any]]:
            if over[i]:
                seen, info = self.envs[i]._entered(ids, {})
                batch.add(i, seen)
                return 0.0, False, False, info
            return self._take_step(i, ids, batch)

        taken, failures = self._each(post, take)
        self._over = np.array([one is None or one[1] or one[2] for one in taken])
        for i, text in self._tolerate(failures, batch):
            warnings.warn(text, stacklevel=3)
            taken[i] = (0.0, False, True, {"error": text})
        rewards, terminated, truncated, infos = zip(*taken)
        self._last = batch.finish()
        return (self._last, np.array(rewards), np.array(terminated),
                np.array(truncated), self._gathered(infos))

    def _meanings(self, actions: Any, over: np.ndarray) -> Sequence[Tuple[float, float]]:
        """WalkEnv._meaning() of each action; any for an environment that restarts."""
        is_array = isinstance(actions, np.ndarray) and actions.shape == (self.num_envs, 2) and \
            actions.dtype.kind == "f" and not self._is_discrete
        if is_array and not np.isnan(actions).any():
            return np.minimum(np.maximum(actions.astype(np.float64), -1.0), 1.0).tolist()
        try:
            actions = list(actions)
        except TypeError:
            raise ValueError(f"actions: give {self.num_envs}, one per environment, not {actions!r}") from None
        if len(actions) != self.num_envs:
            raise ValueError(f"actions: give {self.num_envs}, one per environment, not {len(actions)}")
        return [(0.0, 0.0) if ended else env._meaning(action)
                for env, ended, action in zip(self.envs, over, actions)]

    def _post_step(self, i: int, meaning: Tuple[float, float]) -> List[int]:
        env = self.envs[i]
        if not self._is_packing[i]:
            return env._post_step(meaning)
        kept = self._kept_of(i)
        kept.set(*env._step_numbers(meaning))
        env.client.post_kept(kept)
        return []

    def _kept_of(self, i: int) -> KeptRequest:
        kept = self._kept[i]
        if kept is None:
            kept = self._kept[i] = self.envs[i]._kept_step(self.envs[i].client)
        return kept

    def _take_step(self, i: int, ids: List[int],
                   batch: Batch) -> Tuple[float, bool, bool, Dict[str, Any]]:
        env = self.envs[i]
        if self._is_packing[i]:
            others = len(env.cameras) + env.is_geodesic
            reply = env.client.reply_to_kept()
            step = reply.packed(others)
            if step is not None:
                path = reply.messages[-1].navigation.paths[0] if env.is_geodesic else None
                pictures = list(zip(reply.messages, reply.attachments())) if env.cameras else ()
                before = env._feet
                info = env._take_packed(step)
                batch.add(i, env._channels(pictures))
                batch.add(i, env._place())
                env.client.forget_reply()
                return env._judged(before, info, path)
            ids = env.client.unpack_reply(env._name, 2 + others)
        # For an avatar that falls out of the scene:
        env._seen = {name: all_[i] for name, all_ in self._last.items()}
        seen, *result = env._take_step(ids)
        batch.add(i, seen)
        return tuple(result)

    def _each(self, post: Callable[[int], List[int]], take: Callable[[int, List[int]], Any],
              ) -> Tuple[List[Any], List[Tuple[int, Exception]]]:
        """Posts all and takes all, even if some fail: their results are None."""
        failures: List[Tuple[int, Exception]] = []
        posted: List[Optional[List[int]]] = []
        taken: List[Any] = []
        for i in range(self.num_envs):
            try:
                posted.append(post(i))
            except Exception as error:
                posted.append(None)
                failures.append((i, error))
        for i, ids in enumerate(posted):
            try:
                taken.append(None if ids is None else take(i, ids))
            except Exception as error:
                taken.append(None)
                failures.append((i, error))
        return taken, failures

    def _tolerate(self, failures: List[Tuple[int, Exception]], batch: Batch) -> List[Tuple[int, str]]:
        """Returns the texts of refusals, by environment, and clears their observations. Raises the first failure
        of another kind, or if all environments failed."""
        others = [one for one in failures if not _is_refusal(one[1])]
        if others or len(failures) == self.num_envs:
            raise self._numbered(others or failures)
        texts = [(i, str(self._numbered([(i, failure)]))) for i, failure in failures]
        for i, text in texts:
            batch.clear(i)
        return texts

    @staticmethod
    def _numbered(failures: List[Tuple[int, Exception]]) -> Exception:
        """Returns the first failure, with the number of its environment."""
        number, failure = min(failures, key=lambda one: one[0])
        if failure.args and isinstance(failure.args[0], str):
            failure.args = (f"environment {number}: {failure.args[0]}", *failure.args[1:])
        return failure

    def render(self) -> List[Optional[np.ndarray]]:
        return [env.render() for env in self.envs]

    def close(self, **_: Any) -> None:
        """Closes all, and their own server; each world ends with its client."""
        self.closed = True
        self._over = None
        for env in self.envs:
            env.close()
        if self._maker is not None:
            self._maker.close()
        if self.server is not None:
            self.server.stop()

    @staticmethod
    def _gathered(infos: Sequence[Dict[str, Any]]) -> Dict[str, Any]:
        """Returns arrays of objects: a state hash has 64 bits, and contacts are lists. `_NAME` marks
        the environments that have NAME."""
        gathered: Dict[str, Any] = {}
        for name in dict.fromkeys(itertools.chain.from_iterable(infos)):
            gathered[name] = values = np.empty(len(infos), object)
            values[:] = [info.get(name) for info in infos]
            gathered["_" + name] = np.array([name in info for info in infos])
        return gathered
