#!/usr/bin/env python3
"""Records a walker's views: one NPZ file per picture, with colour, depth, object ids and camera."""

import argparse
import json
from pathlib import Path

import numpy as np

import enfilade

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("scene", help="a model")
parser.add_argument("out", type=Path, help="folder for the files")
parser.add_argument("--start", nargs=3, type=float, default=(1.5, 0.05, 0), metavar=("X", "Y", "Z"))
parser.add_argument("--to", nargs=3, type=float, default=(9, 0, 0), metavar=("X", "Y", "Z"))
parser.add_argument("--every", type=int, default=30, help="ticks between pictures")
parser.add_argument("--size", nargs=2, type=int, default=(160, 120), metavar=("WIDTH", "HEIGHT"))
options = parser.parse_args()
options.out.mkdir(parents=True, exist_ok=True)

with enfilade.serve(options.scene) as server, server.connect(name="data set") as client:
    client.lockstep()
    client.subscribe(notices=True)
    walker = client.spawn("walker", options.start)
    walker.enter()
    walker.walk(options.to)
    seen, pictures, idle = set(), [], False
    while not idle:
        step = client.step(options.every, avatars=True)
        idle = step.idle
        picture = walker.frame(width=options.size[0], height=options.size[1],
                               channels=("rgb", "depth", "ids"))
        state = step.avatars["walker"]
        file = options.out / f"{len(pictures):05}.npz"
        np.savez_compressed(file, rgb=picture.rgb, depth=picture.depth, ids=picture.ids,
                            eye=state.eyes, forward=state.gaze,
                            fov_y=picture.message.camera.fov_y)
        pictures.append({"file": file.name, "tick": step.tick, "feet": state.feet})
        seen.update(np.unique(picture.ids).tolist())
    names = client.names(sorted(seen - {0}))
    (options.out / "index.json").write_text(json.dumps({"pictures": pictures, "names": names},
                                                       indent=1))
    how = [notice.kind for notice in client.notices()]
print(f"{len(pictures)} pictures of {len(names)} objects in {options.out}; the walk: {', '.join(how)}")
