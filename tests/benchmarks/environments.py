"""Steps per second of Python environments: worlds stepped together (StepMany) against one connection per
world, in turns in one run. The observations of both must be equal. Processor times are per step and world, of the
worlds stepped together.

Then environments with goals: distances by kept paths against those by a new search in each step, and by how much the
kept ones are longer.

    python3 environments.py SCENE [--quick] [--only-goals]
"""

import argparse
import os
import statistics
import time
from pathlib import Path

import numpy as np

import enfilade

OPTIONS = {"starts": "anywhere", "size": (128, 128), "max_steps": 10 ** 6}


class Separate:
    """One connection per world: every request is sent to all before a reply is taken."""

    def __init__(self, server: enfilade.Server, count: int, channels: tuple) -> None:
        self.maker = server.connect()
        worlds = [self.maker.create_world(drop_when_empty=True).name for _ in range(count)]
        self.clients = [enfilade.connect(server.address, world=world) for world in worlds]
        self.envs = [enfilade.WalkEnv(client=one, channels=channels, **OPTIONS) for one in self.clients]

    def reset(self, seed: int) -> None:
        for i, env in enumerate(self.envs):
            env.reset(seed=seed + i)
        self.over = [False] * len(self.envs)

    def step(self, actions: np.ndarray) -> dict:
        posted = [env._post_reset(None, {}) if over else env._post_step(env._meaning(action))
                  for env, action, over in zip(self.envs, actions, self.over)]
        taken = [env._take_reset(ids) if over else env._take_step(ids)
                 for env, ids, over in zip(self.envs, posted, self.over)]
        self.over = [len(one) > 2 and bool(one[2] or one[3]) for one in taken]
        seen = [one[0] for one in taken]
        return {name: np.stack([one[name] for one in seen]) for name in seen[0]}

    def close(self) -> None:
        for client in (*self.clients, self.maker):
            client.close()


class Together:
    """VectorWalkEnv."""

    def __init__(self, server: enfilade.Server, count: int, channels: tuple) -> None:
        self.vector = enfilade.VectorWalkEnv(address=server.address, num_envs=count, channels=channels,
                                             **OPTIONS)

    def reset(self, seed: int) -> None:
        self.vector.reset(seed=seed)

    def step(self, actions: np.ndarray) -> dict:
        return self.vector.step(actions)[0]

    def close(self) -> None:
        self.vector.close()


def processor_seconds(pid: int) -> float:
    """User and system time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(server: enfilade.Server, count: int, channels: tuple, steps: int, rounds: int) -> str:
    both = [Separate(server, count, channels), Together(server, count, channels)]
    random = np.random.default_rng(1)
    rates: list = [[], []]
    spent = np.zeros(2)  # processor seconds of the client and the server, together
    for one in both:
        one.reset(1)
    for _ in range(rounds):
        actions = random.uniform(-1, 1, (steps, count, 2))
        seen = []
        for one, rate in zip(both, rates):
            before = np.array([time.process_time(), processor_seconds(server.process.pid)])
            start = time.perf_counter()
            for action in actions:
                last = one.step(action)
            rate.append(count * steps / (time.perf_counter() - start))
            if isinstance(one, Together):
                spent += [time.process_time(), processor_seconds(server.process.pid)] - before
            seen.append(last)
        for name in seen[0]:
            np.testing.assert_array_equal(seen[0][name], seen[1][name])
    for one in both:
        one.close()
    separate, together = (statistics.median(rate) for rate in rates)
    client, served = 1e6 * spent / (rounds * steps * count)
    return (f"{count:4} worlds, {'+'.join(channels) or 'no pictures':12} separate {separate:8.0f}/s   "
            f"together {together:8.0f}/s   ratio {together / separate:.2f}   "
            f"client {client:4.0f} us, server {served:4.0f} us")


def search_each_time(env: enfilade.WalkEnv) -> None:
    """Lets an environment search its path to the goal in each step."""
    query = env.navigation.query
    env.navigation.query = lambda goals, **options: query(goals, **{**options, "keep": False})


def measure_goals(server: enfilade.Server, count: int, steps: int, warm_up: int) -> str:
    """The worlds walk the same walks. Doors that close at the start of a world do so in the warm-up."""
    both = [enfilade.VectorWalkEnv(address=server.address, num_envs=count, channels=(), goals="anywhere",
                                   **OPTIONS) for _ in range(2)]
    for env in both[1].envs:
        search_each_time(env)
    random = np.random.default_rng(1)
    spent, differences = [0.0, 0.0], []
    for one in both:
        one.reset(seed=1)
    for i in range(warm_up + steps):
        action = random.uniform(-1, 1, (count, 2))
        lengths = []
        for k, one in enumerate(both):
            start = time.perf_counter()
            lengths.append(one.step(action)[4]["geodesic_distance"].astype(float))
            spent[k] += (time.perf_counter() - start) * (i >= warm_up)
        differences += (lengths[0] / lengths[1] - 1).tolist() * (i >= warm_up)
    for one in both:
        one.close()
    kept, searched = (count * steps / seconds for seconds in spent)
    percent = 100 * np.array(differences)
    low, middle, high = np.percentile(percent, (1, 50, 99))
    return (f"{count:4} worlds, goals        searched {searched:7.0f}/s   kept {kept:7.0f}/s   "
            f"ratio {kept / searched:.1f}\n"
            f"     kept distances are longer by {middle:.3f} % in the median, {low:.2f} and {high:.2f} % at 1 and "
            f"99 %, {percent.max():.2f} % at most")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only-goals", action="store_true")
    arguments = parser.parse_args()
    with enfilade.serve(arguments.scene) as server:
        cases = () if arguments.only_goals else (((), 200), (("depth",), 40), (("rgb",), 40))
        for channels, steps in cases:
            for count in (1, 16) if arguments.quick else (1, 4, 16, 64):
                print(measure(server, count, channels, max(8, steps * 16 // max(count, 4) // 4),
                              3 if arguments.quick else 7), flush=True)
        print(measure_goals(server, 16, 25 if arguments.quick else 250, 25), flush=True)


if __name__ == "__main__":
    main()
