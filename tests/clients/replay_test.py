"""`serve RECORDING`: the program plays it to clients, who seek in it and branch off."""

import json
import subprocess
import unittest

import enfilade
import enfilade.process
from recorded import verify
from room import obj, room_file

TICKS = 900


class Replay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = room_file(cls.addClassCleanup)
        cls.folder = cls.scene.parent
        cls.walk = cls.folder / "walk.mcap"
        with enfilade.serve(cls.scene, "--record", str(cls.walk)) as server, \
                server.connect() as client:
            ann = client.spawn("ann", at=(0, 0, 0))
            for x in (8, -8) * 4:
                ann.walk((x, 0, 1))
            cls.hashes = [client.step().state_hash for _ in range(TICKS)]

    def play(self, *more):
        server = enfilade.serve(self.walk, *more)
        self.addCleanup(server.stop)
        return server

    def run_program(self, *arguments):
        return subprocess.run([enfilade.process.find_program(), *map(str, arguments)],
                              capture_output=True, text=True, timeout=120)

    def test_it_is_played_from_any_tick(self):
        server = self.play("--from", "400")
        self.assertEqual(server.ready["recording"], "walk.mcap")
        with server.connect() as client:
            self.assertIn("replay", client.capabilities)
            self.assertEqual((client.replay.first_tick, client.replay.last_tick), (0, TICKS))
            self.assertEqual(client.replay.tick, 400)
            self.assertEqual(client.step().state_hash, self.hashes[400])
            self.assertEqual(client.seek(7).state_hash, self.hashes[6])
            self.assertEqual(client.step(93).state_hash, self.hashes[99])
            with self.assertRaises(enfilade.ServerError) as refused:
                client.spawn("bob", at=(0, 0, 3))
            self.assertEqual(refused.exception.code, "ERROR_NOT_ALLOWED")
            self.assertEqual(client.step(TICKS).tick, TICKS)
            self.assertTrue(client.replay.at_end)
            with self.assertRaises(enfilade.ServerError) as ended:
                client.step()
            self.assertEqual(ended.exception.code, "ERROR_REPLAY_ENDED")
            self.assertIn("take_over()", ended.exception.remedy)

    def test_play_and_pause_are_reported_to_all_clients(self):
        server = self.play()
        with server.connect() as driver, server.connect() as other:
            driver.free_run(0.5)
            other.metrics()
            self.assertEqual((other.replay.clock, other.replay.speed), ("free_run", 0.5))
            driver.pause()
            other.metrics()
            self.assertEqual(other.replay.clock, "paused")

    def test_a_branch_is_recorded_and_verified(self):
        branch = self.folder / "branch.mcap"
        with self.play("--record", str(branch)) as server, server.connect() as client:
            client.seek(300)
            client.subscribe(notices=True)
            ann = client.take_over("ann")
            client.step()
            dropped = [one.text for one in client.notices() if one.kind == "dropped"]
            self.assertEqual(set(dropped), {"by a TakeOver"})
            ann.walk((0, 0, 5))
            client.spawn("bob", at=(0, 0, -3))
            last = client.run_until_idle()
            self.assertTrue(client.replay.branched)
            self.assertEqual(client.replay.branched_at, 300)
        code, report, errors = verify(branch)
        self.assertEqual(code, 0, errors)
        self.assertEqual(report["state_hash"], f"{last.state_hash:016x}")
        again = self.run_program("serve", self.walk, "--record", branch, "--listen", "127.0.0.1:0")
        self.assertEqual(again.returncode, 1)
        self.assertIn("move it, or give another file name", again.stderr)

    def test_what_cannot_be_played_is_said(self):
        other = self.folder / "other.obj"
        other.write_text(obj().replace("5.2", "5.3"))
        changed = self.run_program("serve", other, self.walk, "--listen", "127.0.0.1:0")
        self.assertEqual(changed.returncode, 4, changed.stderr)
        self.assertIn("the scene: hash", changed.stderr)
        beyond = self.run_program("serve", self.walk, "--from", TICKS + 1, "--listen", "127.0.0.1:0")
        self.assertEqual(beyond.returncode, 1)
        self.assertIn("give one from 0 to 900", beyond.stderr)
        for wrong in ([self.scene, "--from", "3"], [self.walk, "--epsilon", "0.001"],
                      [self.walk, self.walk]):
            self.assertEqual(self.run_program("serve", *wrong).returncode, 2, wrong)

    def test_a_spoilt_recording_is_not_played(self):
        spoilt = self.folder / "spoilt.mcap"
        data = bytearray(self.walk.read_bytes())
        data[len(data) // 2] ^= 4
        spoilt.write_bytes(data)
        ended = self.run_program("serve", spoilt, "--listen", "127.0.0.1:0")
        self.assertEqual(ended.returncode, 1)
        self.assertIn("byte", ended.stderr)

    def test_of_several_runs_any_is_played_left_and_compared(self):
        several = self.folder / "several.mcap"
        scene = self.folder / "lift.obj"
        scene.write_text(obj())
        scene.with_suffix(".walk.json").write_text(json.dumps(
            {"walk": 1, "bodies": [{"kind": "lift", "name": "lift", "objects": ["column"],
                                    "stops": [0, 1.5]}]}))
        hashes = []
        with enfilade.serve(scene, "--record", str(several)) as server, \
                server.connect() as client:
            for name, ticks in (("ann", 50), ("bob", 80)):
                client.restart()
                client.spawn(name, at=(0, 0, 5)).drive((0, 0, 1))  # to the lift
                hashes.append(client.step(ticks).state_hash)
        for run, ticks in ((1, 50), (2, 80)):
            with enfilade.serve(several, "--run", str(run)) as server, server.connect() as client:
                self.assertEqual(client.replay.last_tick, ticks)
                self.assertEqual(client.step(ticks + 10).state_hash, hashes[run - 1])
        for wrong, words in ((["--from", 60], "or another run than 1 of 2"),
                             (["--run", 3], "no run 3 in it; give a run from 1 to 2")):
            ended = self.run_program("serve", several, *wrong, "--listen", "127.0.0.1:0")
            self.assertEqual(ended.returncode, 1, wrong)
            self.assertIn(words, ended.stderr)
        for wrong in ([self.scene, "--run", "2"], [several, "--run", "0"]):
            self.assertEqual(self.run_program("serve", *wrong).returncode, 2, wrong)
        self.runs_in_process(scene, several)

    def runs_in_process(self, scene, several):
        whole = self.run_program("replay", several, "--verify", "--run", 2)
        late = self.run_program("replay", several, "--verify", "--run", 2, "--from", 70)
        self.assertEqual((whole.returncode, late.returncode), (0, 0), whole.stderr + late.stderr)
        report, after = json.loads(whole.stdout), json.loads(late.stdout)
        self.assertEqual((report["ticks"], report["closed"]), (80, True))
        self.assertEqual(report["state_hash"], after["state_hash"])

        script, branch = self.folder / "wait.jsonl", self.folder / "branch.mcap"
        script.write_text('{"wait":1,"for":"bob"}\n')
        made = self.run_program("replay", several, "--run", 2, "--from", 40, "--then", script,
                                "--out", self.folder / "b", "--record", branch)
        self.assertEqual(made.returncode, 0, made.stderr)
        inspected = self.run_program("inspect", branch).stdout
        self.assertIn("a branch of %s, run 2, after tick 40" % several.resolve(), inspected)
        # Compared with its parent run: bob is in both.
        compared = json.loads(self.run_program("diff", several, branch, "--json").stdout)
        self.assertEqual([run["ticks"] for run in compared["before"]["runs"]], [80])
        self.assertFalse([one for one in compared["happenings"] if one["before"]])

        again = self.run_program("replay", scene, several, "--run", 2, "--json",
                                 "--out", self.folder / "again")
        self.assertEqual(again.returncode, 0, again.stderr + again.stdout)
        report = json.loads(again.stdout)
        self.assertEqual([run["ticks"] for run in report["after"]["runs"]], [80])
        self.assertTrue(report["same"], "the lift is found by its object in each run")

    def test_it_is_played_in_the_scene_that_is_named(self):
        moved = self.folder / "moved.obj"
        moved.write_text(obj())
        server = enfilade.serve(moved, str(self.walk))
        self.addCleanup(server.stop)
        with server.connect() as client:
            self.assertEqual(client.step(50).state_hash, self.hashes[49])


if __name__ == "__main__":
    unittest.main()
