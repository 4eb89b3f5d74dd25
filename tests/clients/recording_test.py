"""Recordings from outside: made, killed, verified, spoilt, and read by MCAP's own reader."""

import json
import os
import random
import shutil
import struct
import subprocess
import time
import unittest
from pathlib import Path

import enfilade.process
from room import obj, room_file

MCAP = Path(__file__).parent / "mcap"
WALK = [{"spawn": "ann", "at": [0, 0, 0]}, {"spawn": "bob", "at": [2, 0, 3]},
        {"walk": "ann", "to": [4, 0, 0]}, {"walk": "ann", "to": [-4, 0, 2]},
        {"walk": "bob", "to": [-2, 0, 3]}]


class Recording(unittest.TestCase):
    def setUp(self):
        self.scene = room_file(self.addCleanup)
        self.folder = self.scene.parent
        self.file = self.folder / "walk.mcap"

    def arguments(self, *more, lines=WALK):
        script = self.folder / "walk.jsonl"
        script.write_text("".join(json.dumps(line) + "\n" for line in lines))
        return [enfilade.process.find_program(), "replay", self.scene, script, "--out",
                self.folder / "out", "--record", self.file, *more]

    def record(self, **options):
        subprocess.run(self.arguments(**options), check=True, capture_output=True, timeout=120)
        return json.loads((self.folder / "out" / "summary.json").read_text())

    def verify(self, *before):
        done = subprocess.run([enfilade.process.find_program(), "replay", *before, self.file,
                               "--verify"], capture_output=True, text=True, timeout=120)
        return done.returncode, json.loads(done.stdout) if done.stdout else None, done.stderr

    def other_reader(self, *arguments):
        if not shutil.which("node") or not (MCAP / "node_modules").is_dir():
            if os.environ.get("CI"):
                self.fail(f"no other reader of MCAP: npm ci in {MCAP}")
            self.skipTest(f"npm ci in {MCAP} brings the other reader")
        done = subprocess.run(["node", MCAP / "read_recording.mjs", *arguments, self.file],
                              capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_a_recording_ends_in_the_state_that_the_walk_ended_in(self):
        summary = self.record()
        code, report, errors = self.verify()
        self.assertEqual(code, 0, errors)
        self.assertEqual(report, {"ticks": summary["ticks"], "state_hash": summary["state_hash"],
                                "closed": True})

    def test_motion_of_other_lengths_is_verified_with_them(self):
        subprocess.run(self.arguments("--epsilon", "0.002", "--slope", "40", "--sliding", "stop"),
                       check=True, capture_output=True, timeout=120)
        self.assertEqual(self.verify()[0], 0)

    def test_another_scene_is_reported(self):
        self.record()
        other = self.folder / "moved.obj"
        other.write_text(obj().replace("v 5 ", "v 5.01 "))
        code, report, errors = self.verify(other)
        self.assertEqual(code, 4)
        self.assertEqual(report["diverged"]["who"], "the scene")
        self.assertIn("recorded", errors)

    def test_the_scene_may_have_moved_to_another_place(self):
        self.record()
        moved = self.folder / "elsewhere" / "room.obj"
        moved.parent.mkdir()
        self.scene.rename(moved)
        code, _, errors = self.verify()
        self.assertEqual(code, 1)
        self.assertIn("the recorded scene does not exist", errors)
        self.assertEqual(self.verify(moved)[0], 0)

    def test_a_recording_whose_writer_was_killed_verifies_to_its_last_tick(self):
        pacing = [{"walk": "ann", "to": [x, 0, 1]} for x in (4, -4) * 4000]
        chance = random.Random(5)
        verified = 0
        for _ in range(6):
            with subprocess.Popen(self.arguments(lines=WALK + pacing),
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as walk:
                deadline = time.monotonic() + 60
                while not self.file.exists() or self.file.stat().st_size < 100_000:  # its orders take less
                    self.assertLess(time.monotonic(), deadline)
                    time.sleep(0.01)
                time.sleep(chance.random() * 0.2)
                walk.kill()
            code, report, errors = self.verify()
            self.assertEqual(code, 0, errors)
            self.assertFalse(report["closed"])
            verified += report["ticks"]
            read = self.other_reader("--stream")
            self.assertEqual(read["/enfilade/state"]["messages"], report["ticks"])
            self.file.unlink()
        self.assertGreater(verified, 100)

    def test_a_flipped_byte_is_reported_with_its_place(self):
        self.record()
        bytes_ = bytearray(self.file.read_bytes())
        bytes_[len(bytes_) // 2] ^= 4
        self.file.write_bytes(bytes_)
        code, _, errors = self.verify()
        self.assertEqual(code, 1)
        self.assertIn(f"{self.file}: at byte ", errors)

    def test_the_reader_of_mcaps_authors_reads_the_same(self):
        summary = self.record()
        for how in ((), ("--stream",)):
            read = self.other_reader(*how)
            self.assertEqual(read["/enfilade/state"]["messages"], summary["ticks"])
            self.assertEqual(read["/enfilade/start"]["messages"], 1)
            self.assertGreater(read["/enfilade/events"]["messages"], 0)

    def test_other_files_are_refused_by_name(self):
        self.file.write_bytes(struct.pack("<16d", *range(16)))
        code, _, errors = self.verify()
        self.assertEqual(code, 1)
        self.assertIn(f"{self.file}: at byte 0: not an MCAP file", errors)


if __name__ == "__main__":
    unittest.main()
