"""Differences between two walks, recorded walks in other models, and exports of recordings."""

import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import enfilade.process
import numpy as np
from room import obj

WALK = [{"spawn": "ann", "at": [0, 0, 0]}, {"spawn": "bob", "at": [2, 0, 3]},
        {"walk": "ann", "to": [4, 0, 0]}, {"walk": "ann", "to": [-4, 0, 2]},
        {"walk": "bob", "to": [-2, 0, 3]}, {"look": "bob", "at": [0, 3, 6]}]
TABLE = ((1.8, 0, -0.4), (2.2, 0.8, 0.4))  # in Ann's way


def box(name, low, high):
    """One more object for the room's OBJ file; corners are counted from the last one."""
    lines = [f"o {name}"]
    for corner in range(8):
        x, y, z = ((high if corner >> axis & 1 else low)[axis] for axis in range(3))
        lines.append(f"v {x} {y} {z}")
    for face in ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)):
        lines.append("f " + " ".join(str(i - 8) for i in face))
    return "\n".join(lines) + "\n"


class Difference(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.room = self.model("room.obj", obj())
        self.before = self.record("before", self.room)

    def model(self, name, text):
        (self.folder / name).write_text(text)
        return self.folder / name

    def run_program(self, *arguments):
        done = subprocess.run([enfilade.process.find_program(), *arguments], capture_output=True,
                              text=True, timeout=120)
        return done.returncode, done.stdout, done.stderr

    def record(self, name, scene, lines=WALK, options=()):
        script = self.folder / "walk.jsonl"
        script.write_text("".join(json.dumps(line) + "\n" for line in lines))
        file = self.folder / f"{name}.mcap"
        code, _, errors = self.run_program("replay", scene, script, "--out", self.folder / name,
                                           "--record", file, *options)
        self.assertEqual(code, 0, errors)
        return file

    def diff(self, after, *options, before=None):
        code, out, errors = self.run_program("diff", before or self.before, after, "--json",
                                             *options)
        self.assertIn(code, (0, 3), errors)
        return code, json.loads(out)

    def test_the_same_walk_has_no_difference(self):
        again = self.record("again", self.room)
        code, report = self.diff(again)
        self.assertEqual((code, report["same"], report["worse"]), (0, True, 0))
        code, text, _ = self.run_program("diff", self.before, again)
        self.assertEqual(code, 0)
        self.assertIn("no difference", text)

    def test_something_in_the_way_is_new_and_worse(self):
        full = self.model("full.obj", obj() + box("table", *TABLE))
        after = self.record("after", full)
        code, report = self.diff(after)
        self.assertEqual(code, 3)
        new = [c for c in report["happenings"] if c["change"] == "new" and c["kind"] == "contact"]
        self.assertTrue(new)
        for change in new:
            self.assertEqual((change["after"]["a"], change["b_in_model"]), ("ann", "after"))
            self.assertIn("table", change["after"]["b"])
            self.assertTrue(change["worse"])
            self.assertAlmostEqual(change["after"]["point"][0], 1.8, delta=0.01)
        # The other way round it got better.
        code, report = self.diff(self.before, before=after)
        self.assertEqual((code, report["worse"]), (0, 0))
        gone = [c for c in report["happenings"] if c["kind"] == "contact"]
        self.assertEqual({c["change"] for c in gone}, {"gone"})
        self.assertEqual({c["b_in_model"] for c in gone}, {"before"})

    def test_a_walk_that_no_longer_arrives_is_worse(self):
        fence = ((2, 0, -10), (2.2, 3, 1.8))
        after = self.record("after", self.model("fence.obj", obj() + box("fence", *fence)))
        code, report = self.diff(after)
        self.assertEqual(code, 3)
        lost = [o for o in report["orders"] if o["worse"]]
        self.assertEqual([(o["avatar"], o["tag"], o["before"]["outcome"], o["after"]["outcome"])
                          for o in lost], [("ann", 3, "arrived", "blocked")])
        self.assertIn("fence", lost[0]["after"]["obstacle"])
        self.assertIn("no longer succeed: 1", self.run_program("diff", self.before, after)[1])

    def test_a_clearance_is_judged_by_the_tolerance(self):
        def pillar(z):
            return obj() + box("pillar", (1, 0, z), (1.2, 2, z + 0.2))
        there, near_miss = WALK[:3], ("--near-miss", "0.1")
        wide = self.record("wide", self.model("wide.obj", pillar(0.34)), there, near_miss)
        narrow = self.record("narrow", self.model("narrow.obj", pillar(0.32)), there, near_miss)
        code, report = self.diff(narrow, before=wide)
        near = [c for c in report["clearances"] if "pillar" in c["b"] and c["a"] == "ann"]
        self.assertEqual(len(near), 1, report["clearances"])
        self.assertEqual((code, near[0]["worse"]), (3, True))
        self.assertAlmostEqual(near[0]["changed_by_at_least"], -0.02, delta=0.002)
        code, report = self.diff(narrow, "--tolerance", "0.05", before=wide)
        self.assertEqual((code, report["clearances"]), (0, []))

    def test_another_time_is_reported_but_not_worse(self):
        slow = [dict(line, speed=0.7) if line.get("walk") == "bob" else line for line in WALK]
        code, report = self.diff(self.record("slow", self.room, slow))
        self.assertEqual((code, report["worse"], report["same"]), (0, 0, False))
        bob = [o for o in report["orders"] if o["avatar"] == "bob" and o["tag"] == 5]
        self.assertGreater(bob[0]["after"]["time"], bob[0]["before"]["time"])
        self.assertIn("bob", {w["avatar"] for w in report["ways"]})

    def test_files_that_are_no_recordings_are_errors(self):
        self.assertEqual(self.run_program("diff", self.before, self.room)[0], 1)
        self.assertEqual(self.run_program("diff", self.before, self.folder / "none.mcap")[0], 1)
        self.assertEqual(self.run_program("diff", self.before)[0], 2)

    # ---- a recorded walk in another model

    def test_a_recorded_walk_in_its_own_model_has_no_difference(self):
        out = self.folder / "walked_again"
        code, text, errors = self.run_program("replay", self.room, self.before, "--out", out)
        self.assertEqual(code, 0, errors)
        self.assertIn("no difference", text)
        report = json.loads((out / "diff.json").read_text())
        runs = [report[which]["runs"][0] for which in ("before", "after")]
        self.assertEqual(runs[0]["state_hash"], runs[1]["state_hash"])

    def test_a_recorded_walk_in_a_changed_model_reports_the_changes(self):
        full = self.model("full.obj", obj() + box("table", *TABLE))
        out = self.folder / "walked_again"
        code, text, errors = self.run_program("replay", full, self.before, "--out", out)
        self.assertEqual(code, 3, errors)
        self.assertEqual((out / "diff.txt").read_text(), text)
        report = json.loads((out / "diff.json").read_text())
        # It is the walk that the script makes there, to the last bit, as far as it goes.
        direct = self.record("direct", full)
        contacts = {}
        for which, folder in (("direct", "direct"), ("again", "walked_again")):
            lines = (self.folder / folder / "contacts.jsonl").read_text().splitlines()
            contacts[which] = [line for line in lines if json.loads(line)["event"] == "begin"]
        self.assertEqual(contacts["direct"], contacts["again"])
        self.assertEqual(self.run_program("replay", full, out / "new.mcap", "--verify")[0], 0)
        self.assertTrue((out / "summary.json").exists() and direct.exists())
        if not json.loads((out / "summary.json").read_text())["renderer"]:
            if os.environ.get("CI"):
                self.fail("no EGL device: install libegl-mesa0 and libgl1-mesa-dri")
            self.skipTest("no EGL device")
        named = {c["picture"] for c in report["happenings"] if "picture" in c}
        self.assertIn("changes/001.png", named)
        for picture in sorted(named) + ["changes/map.png"]:
            self.assertEqual((out / picture).read_bytes()[:4], b"\x89PNG")

    def test_commands_that_a_model_refuses_are_reported(self):
        scene = self.model("door.obj", obj() + box("leaf", (3, 0, -0.5), (3.05, 2, 0.5)))
        sidecar = {"walk": 1, "bodies": [
            {"name": "gate", "objects": ["leaf"], "kind": "hinged", "anchor": [3, 0, -0.5],
             "axis": [0, 1, 0], "limits": [0, 90]}]}
        (self.folder / "door.walk.json").write_text(json.dumps(sidecar))
        before = self.record("door", scene, WALK + [{"body": "gate", "do": "open"}])
        code, text, errors = self.run_program("replay", self.room, before, "--out",
                                              self.folder / "walked_again")
        self.assertIn(code, (0, 3), errors)
        report = json.loads((self.folder / "walked_again" / "diff.json").read_text())
        self.assertEqual([r["who"] for r in report["refused_commands"]], ["gate"])
        self.assertIn("Commands that the model refused: 1", text)

    # ---- what is in a recording

    def test_inspect_describes_a_recording(self):
        code, out, errors = self.run_program("inspect", self.before, "--json")
        self.assertEqual(code, 0, errors)
        report = json.loads(out)
        summary = json.loads((self.folder / "before" / "summary.json").read_text())
        run = report["runs"][0]
        self.assertEqual((run["ticks"], run["state_hash"], report["closed"]),
                         (summary["ticks"], summary["state_hash"], True))
        self.assertEqual([a["name"] for a in run["avatars"]], ["ann", "bob"])
        self.assertAlmostEqual(run["avatars"][1]["way_length"], 4, delta=0.05)
        self.assertEqual(run["commands"], {"look": 1, "spawn": 2, "walk": 3})
        channels = {c["topic"]: c["messages"] for c in report["channels"]}
        self.assertEqual(channels["/enfilade/state"], summary["ticks"])
        self.assertIn("ann", self.run_program("inspect", self.before)[1])

    def test_inspect_reports_how_far_a_damaged_recording_is_readable(self):
        whole = self.before.read_bytes()
        cut = self.folder / "cut.mcap"
        cut.write_bytes(whole[:len(whole) // 2])
        code, out, _ = self.run_program("inspect", cut, "--json")
        report = json.loads(out)
        self.assertEqual((code, report["closed"]), (0, False))
        self.assertLessEqual(report["whole_bytes"], len(whole) // 2)
        self.assertEqual(self.run_program("inspect", cut, "--strict")[0], 3)
        spoilt = bytearray(whole)
        spoilt[len(whole) // 2] ^= 4
        cut.write_bytes(spoilt)
        code, out, _ = self.run_program("inspect", cut, "--json")
        self.assertEqual(code, 1)
        self.assertIn("at byte", json.loads(out)["spoilt"])

    # ---- what others read

    def test_exported_ways_show_what_the_avatars_saw(self):
        out = self.folder / "exported"
        code, _, errors = self.run_program("export", self.before, "--out", out)
        self.assertEqual(code, 0, errors)
        events = (self.folder / "before" / "contacts.jsonl").read_text().splitlines()
        contacts = (out / "contacts.jsonl").read_text().splitlines()
        self.assertEqual(contacts, events)
        script = self.folder / "walk.jsonl"
        options = ("--size", "64x48", "--fov", "60", "--channels", "depth", "--no-mp4")
        done = self.run_program("capture", self.room, script, "--out", self.folder / "a", "--avatar",
                                "bob", "--every", "1", *options)
        if done[0] != 0 and not os.environ.get("CI"):
            self.skipTest(done[2])
        self.assertEqual(done[0], 0, done[2])
        for source, extra in (("bob.tum", ()), ("cameras.glb", ("--camera", "bob", "--fps", "60"))):
            folder = self.folder / source.replace(".", "_")
            done = self.run_program("capture", self.room, out / source, "--out", folder, *extra,
                                    *options)
            self.assertEqual(done[0], 0, done[2])
            seen = sorted((self.folder / "a" / "depth").iterdir())
            again = sorted((folder / "depth").iterdir())
            # glTF's animations begin at 0, before the first tick.
            again = again[len(again) - len(seen):]
            self.assertEqual(len(seen), len(again))
            worst = 0.0
            for left, right in zip(seen[::20], again[::20]):
                left, right = np.load(left), np.load(right)
                # Ann walks through the one and not through the other.
                same = np.isclose(left, right, rtol=1e-4, equal_nan=True)
                worst = max(worst, 1 - same.mean())
            self.assertLess(worst, 0.25)
            if source == "bob.tum":
                self.assertEqual(np.load(seen[-1]).tobytes(), np.load(again[-1]).tobytes())

    def test_ways_are_lines_of_eight_numbers(self):
        out = self.folder / "exported"
        self.run_program("export", self.before, "--out", out)
        lines = [line.split() for line in (out / "ann.tum").read_text().splitlines()
                 if not line.startswith("#")]
        self.assertTrue(all(len(line) == 8 for line in lines))
        self.assertEqual(sorted(p.name for p in out.iterdir()),
                         ["ann.tum", "bob.tum", "cameras.glb", "contacts.jsonl"])


if __name__ == "__main__":
    unittest.main()
