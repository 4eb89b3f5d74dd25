#!/usr/bin/python3
"""Kills recorders at random moments and looks at what they leave:

    kill_recorders.py [KILLS] [SEED]

Servers and replays in turn. Each file must verify to its last tick, and hold the same ticks for the
reader of the MCAP project. $ENFILADE is the program; PYTHONPATH as for the tests next to it."""

import json
import random
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import enfilade
import enfilade.process
from recorded import other_reader, verify
from room import obj

_MAX_LIFE = 1.5  # seconds


class KilledRecorders:
    def __init__(self, test, folder, seed):
        self.test, self.folder, self.chance = test, Path(folder), random.Random(seed)
        self.scene, self.file = self.folder / "room.obj", self.folder / "killed.mcap"
        self.scene.write_text(obj())
        self.ticks = []

    def kill(self, number):
        self.file.unlink(missing_ok=True)
        seconds = self.chance.random() * _MAX_LIFE
        (self._server if number % 2 else self._replay)(seconds)
        if not self.file.exists() or self.file.stat().st_size == 0:
            return  # it had not come so far
        code, report, errors = verify(self.file)
        if code == 1 and ("not a recording of Enfilade" in errors
                          or "the header is missing" in errors):
            return  # killed before its start was in the file
        self.test.assertEqual(code, 0, errors)
        self.test.assertFalse(report["closed"])
        read = other_reader(self.test, self.file, "--stream")
        states = read.get("/enfilade/state", {"messages": 0})["messages"]
        self.test.assertEqual(states, report["ticks"])
        self.ticks.append(report["ticks"])

    def _replay(self, seconds):
        script = self.folder / "walk.jsonl"
        lines = [{"spawn": "ann", "at": [0, 0, 0]}]
        lines += [{"walk": "ann", "to": [x, 0, 1]} for x in (4, -4) * 20_000]
        script.write_text("".join(json.dumps(line) + "\n" for line in lines))
        with subprocess.Popen([enfilade.process.find_program(), "replay", self.scene, script, "--out",
                               self.folder / "out", "--record", self.file],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as walk:
            time.sleep(seconds)
            walk.kill()

    def _server(self, seconds):
        server = enfilade.serve(self.scene, "--record", str(self.file))
        with server.connect() as client:
            client.free_run(30)
            ann = client.spawn("ann", at=(0, 0, 0))
            for x in (4, -4) * 10:
                ann.walk((x, 0, 1))
            time.sleep(seconds)
            server.process.kill()
            server.stop()


def main(arguments):
    kills = int(arguments[0]) if arguments else 200
    seed = int(arguments[1]) if len(arguments) > 1 else 1
    with tempfile.TemporaryDirectory() as folder:
        killed = KilledRecorders(unittest.TestCase(), folder, seed)
        for number in range(kills):
            killed.kill(number)
    print(f"{kills} killed, {len(killed.ticks)} with a recording begun, "
          f"{sum(killed.ticks)} ticks verified, {min(killed.ticks)} to {max(killed.ticks)} a file")


if __name__ == "__main__":
    main(sys.argv[1:])
