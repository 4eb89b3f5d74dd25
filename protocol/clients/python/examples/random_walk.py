#!/usr/bin/env python3
"""A random walk that observes depth: prints the distance walked and the obstacles."""

import argparse

import numpy as np

import enfilade

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("scene", help="a model, or HOST:PORT of a server without another driver")
parser.add_argument("--start", nargs=3, type=float, default=(1.5, 0.05, 0), metavar=("X", "Y", "Z"))
parser.add_argument("--steps", type=int, default=50)
parser.add_argument("--seed", type=int, default=1)
options = parser.parse_args()

where = {"address": options.scene} if ":" in options.scene else {"scene": options.scene}
env = enfilade.WalkEnv(**where, starts=[options.start], size=(64, 48), channels=("depth",))
try:
    seen, info = env.reset(seed=options.seed)
    walked = 0.0
    for number in range(options.steps):
        # Ahead, and away from the side that is nearer.
        left, right = np.split(np.minimum(seen["depth"], 20), 2, axis=1)
        turn = np.sign(left.mean() - right.mean()) * env.np_random.random()
        seen, reward, terminated, truncated, info = env.step(np.array([1.0, turn]))
        walked += reward
        x, y, z = seen["position"]
        print(f"{info['tick']:5} at {x:7.2f} {y:5.2f} {z:7.2f}, "
              f"nearest seen {seen['depth'].min():6.2f} m, stopped by {info['stopped_by'] or '-'}")
    print(f"walked {walked:.2f} m in {options.steps} steps; state hash {info['state_hash']:016x}")
finally:
    env.close()
