"""Point navigation with a scripted follower and a random walker: success and SPL over random episodes.

    python3 point_navigation.py SCENE.. [--episodes 200] [--seed 1]

The follower asks for its shortest path in each step and walks along it; the random walker shows what chance
gives. ENFILADE names the program if it is not on the PATH; PYTHONPATH needs protocol/clients/python.
"""
import argparse
import math

import numpy as np

import enfilade


def follower(env):
    """Returns a greedy policy: in each step, turn to the next point of the shortest path from where the avatar
    is, then walk to it."""
    seconds = env.ticks_per_step * env.client.tick_seconds

    def act(seen):
        path = env.navigation.path(env.avatar, env.episode.goal, keep=True).points
        ahead = [point for point in path[1:] if math.hypot(*(point - path[0])[[0, 2]]) >= 0.02]
        if not ahead:
            return 0.0, 0.0
        x, _, z = ahead[0] - path[0]
        heading = math.atan2(seen["heading"][1], seen["heading"][0])
        turn = math.remainder(math.atan2(-z, x) - heading, math.tau) / (env.turn_speed * seconds)
        return math.hypot(x, z) / (env.speed * seconds) if abs(turn) <= 1 else 0.0, turn

    return act


def chance(env):
    return lambda _: env.action_space.sample()


def measure(env, make_policy, episodes, seed):
    measures = []
    for number in range(episodes):
        seen, _ = env.reset(seed=seed + number)
        policy, over = make_policy(env), False
        while not over:
            seen, _, terminated, truncated, info = env.step(policy(seen))
            over = terminated or truncated
        measures.append((info["success"], info["spl"]))
    return np.mean(np.array(measures, float), axis=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--episodes", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    for scene in arguments.scenes:
        with enfilade.WalkEnv(scene, starts="anywhere", goals="anywhere", channels=(), radius=0.2, height=1.5,
                              goal_radius=0.2, max_steps=500) as env:
            for name, policy in (("follower", follower), ("random", chance)):
                episodes = arguments.episodes if policy is follower else max(1, arguments.episodes // 10)
                success, spl = measure(env, policy, episodes, arguments.seed)
                print(f"{scene}: {name}: success {success:.3f}, SPL {spl:.3f} over {episodes} episodes", flush=True)


if __name__ == "__main__":
    main()
