#!/usr/bin/env python3
"""Plays a recording up to a tick, takes over an avatar and sends it elsewhere."""

import argparse

import enfilade

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("recording", help="of `enfilade serve` or `replay`, with its model at its path")
parser.add_argument("--tick", type=int, default=600, help="tick of the take-over")
parser.add_argument("--avatar", required=True)
parser.add_argument("--to", nargs=3, type=float, required=True, metavar=("X", "Y", "Z"))
parser.add_argument("--record", help="a new file for the branch")
options = parser.parse_args()

record = ["--record", options.record] if options.record else []
with enfilade.serve(options.recording, *record) as server, server.connect() as client:
    replay = client.replay
    print(f"{replay.file}: ticks {replay.first_tick} to {replay.last_tick}")
    client.subscribe(contacts=True, notices=True)
    client.seek(min(options.tick, replay.last_tick))
    for contact in client.contacts():
        print(f"touching since tick {contact.tick}: {contact.a_name}, {contact.b_name}")
    avatar = client.take_over(options.avatar)
    avatar.walk(options.to)
    step = client.run_until_idle()
    for notice in client.notices():
        if notice.avatar == options.avatar:
            print(f"tick {notice.tick}: {notice.avatar} {notice.kind}")
    print(f"left at tick {client.replay.branched_at}, state {step.state_hash:016x} at {step.tick}")
