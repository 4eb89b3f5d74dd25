"""Steps of several WalkEnvs without pictures and geodesic distances: what they have in common is
done once for all."""

from __future__ import annotations

import math
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from ..kept_request import KeptRequest
from ..world_group import Member, PackedSteps
from .walk_env import WalkEnv
from .walker import Observation

Result = Tuple[Observation, np.ndarray, np.ndarray, np.ndarray, Dict[str, Any]]


OWN_JUDGEMENTS = {"reward", "is_over"}  # functions that users set on an environment


class PlainSteps:
    """The numbers are those of WalkEnv.step(), bit for bit: sines and roots come from math, because
    numpy's differ in the last digits."""

    def __init__(self, envs: Sequence[WalkEnv]) -> None:
        self._envs = envs
        self.at = 0  # the environment that step() is at, or was when it failed
        self._members: List[Member] = [env.client for env in envs]

    @staticmethod
    def fits(envs: Sequence[WalkEnv]) -> bool:
        """Whether step() does all that the environments do: those of a subclass may do more."""
        return all(type(one) is WalkEnv and not one.cameras and not one.is_geodesic and
                   (one.goal is None) == (envs[0].goal is None) for one in envs)

    def can_post(self) -> bool:
        return all(env._feet is not None and not OWN_JUDGEMENTS & vars(env).keys() for env in self._envs) and \
            not any(one.is_closed() for one in self._members)

    def step(self, meanings: Sequence[Tuple[float, float]], kept: Sequence[KeptRequest],
             ) -> Optional[Result]:
        """The result of VectorWalkEnv.step(). None if a step was refused or an avatar is gone: the
        replies are then left to be taken one by one."""
        for self.at, (env, member, request, meaning) in enumerate(
                zip(self._envs, self._members, kept, meanings)):
            request.set(*env._turn(meaning))
            member.post_kept(request)
        steps: Optional[PackedSteps] = None
        for member in self._members:
            steps = member.packed_steps()
            if steps is None:
                return None
        assert steps is not None
        before = np.array([env._feet for env in self._envs])
        contacts = []
        for i, (env, member) in enumerate(zip(self._envs, self._members)):
            self.at = i
            member.reply_to_kept()
            env._feet, env._stopped_by = steps.feet[i], steps.stopped_by[i]
            env._last_stopped = steps.last_stopped[i]
            env._steps += 1
            contacts.append(env._contacts_of_step())
            member.forget_reply()
        rewards, terminated = self._judged(before.tolist(), steps.feet.tolist())
        truncated = np.array([env._steps >= env.max_steps for env in self._envs])
        return self._places(steps.feet), rewards, terminated, truncated, self._infos(steps, contacts)

    def _judged(self, before: List[List[float]], after: List[List[float]],
                ) -> Tuple[np.ndarray, np.ndarray]:
        """WalkEnv.reward() and WalkEnv.is_over()."""
        if self._envs[0].goal is None:
            walked = [math.hypot(x - x0, z - z0) for (x0, _, z0), (x, _, z) in zip(before, after)]
            return np.array(walked), np.zeros(len(walked), bool)
        left = [env._to_goal(feet) for env, feet in zip(self._envs, after)]
        rewards = [env._to_goal(feet) - now for env, feet, now in zip(self._envs, before, left)]
        over = [now <= env.goal_radius for env, now in zip(self._envs, left)]
        return np.array(rewards), np.array(over)

    def _places(self, feet: np.ndarray) -> Observation:
        """WalkEnv._place()."""
        seen = {"position": feet.copy(),
                "heading": np.array([env._direction for env in self._envs])}
        if self._envs[0].goal is not None:
            seen["to_goal"] = np.array([env.goal for env in self._envs]) - feet
            seen["goal_polar"] = np.array([env._polar(x, z) for env, (x, _, z) in
                                           zip(self._envs, seen["to_goal"].tolist())])
        return seen

    def _infos(self, steps: PackedSteps, contacts: Sequence[List[Any]]) -> Dict[str, Any]:
        collided = [env._has_collided(tick, one)
                    for env, tick, one in zip(self._envs, steps.ticks, contacts)]
        infos: Dict[str, Any] = {}
        for name, values in (("tick", steps.ticks), ("state_hash", steps.hashes), ("contacts", contacts),
                             ("stopped_by", steps.stopped_by), ("collided", collided)):
            infos[name] = column = np.empty(len(values), object)
            column[:] = values
            infos["_" + name] = np.ones(len(values), bool)
        return infos
