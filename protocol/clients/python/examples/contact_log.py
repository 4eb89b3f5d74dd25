#!/usr/bin/env python3
"""Prints the contacts of a walk as they occur: one JSON object per line."""

import argparse
import dataclasses
import json

import enfilade

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("scene", help="a model")
parser.add_argument("--start", nargs=3, type=float, default=(1.5, 0.05, 0), metavar=("X", "Y", "Z"))
parser.add_argument("--to", nargs=3, type=float, default=(9, 0, 0), metavar=("X", "Y", "Z"))
options = parser.parse_args()

with enfilade.serve(options.scene) as server, server.connect(name="contact log") as client:
    client.lockstep()
    client.subscribe(contacts=True)
    walker = client.spawn("walker", options.start)
    walker.enter()
    walker.walk(options.to)
    idle = False
    while not idle:
        idle = client.step(60).idle
        for contact in client.contacts():
            print(json.dumps(dataclasses.asdict(contact)))
