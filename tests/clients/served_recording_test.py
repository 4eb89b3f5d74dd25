"""`serve --record`: what several clients do to a world comes back from the file, whatever ends it."""

import json
import signal
import subprocess
import time
import unittest
import urllib.request

import enfilade
import enfilade.process
from kill_recorders import KilledRecorders
from recorded import messages, other_reader, verify
from room import room_file

# The column is a lift, so that bodies are commanded too.
SIDECAR = {"walk": 1, "bodies": [{"kind": "lift", "name": "lift", "objects": ["column"], "speed": 1,
                       "stops": [0, 1.5]}]}


class ServedRecording(unittest.TestCase):
    def setUp(self):
        self.scene = room_file(self.addCleanup)
        self.folder = self.scene.parent
        (self.folder / "room.walk.json").write_text(json.dumps(SIDECAR))
        self.file = self.folder / "served.mcap"

    def serve(self, *more, **options):
        server = enfilade.serve(self.scene, "--record", str(self.file), *more, **options)
        self.addCleanup(server.stop)
        return server

    def test_what_several_clients_did_is_made_again(self):
        with self.serve() as server:
            driver = server.connect(name="driver")
            self.addCleanup(driver.close)
            driver.lockstep()
            driver.spawn("ann", at=(0, 0, 0)).walk((8, 0, 0))
            driver.step(30)
            with server.connect(name="guest") as guest:
                guest.spawn("bob", at=(0, 0, 3)).walk((0, 0, 8))
                guest.body("lift", level=1)
                driver.step(90)
            while driver.worlds()["main"].clients > 1:  # the guest's end comes on a connection of its own
                time.sleep(0.01)
            driver.step(30)  # bob leaves with the guest who brought him
            driver.spawn("cy", at=(2, 0, 2)).walk((2, 0, -2))
            driver.restart()  # before cy was there
            driver.spawn("dee", at=(4, 0, 0)).walk((9, 0, 0))
            driver.body("lift", to=0.4)
            last = driver.step(60)
        code, report, errors = verify(self.file)
        self.assertEqual(code, 0, errors)
        self.assertEqual(report["ticks"], 210)
        self.assertEqual(report["state_hash"], f"{last.state_hash:016x}")
        self.assertTrue(report["closed"])
        read = messages(self, self.file)
        self.assertEqual(sum(topic == "/enfilade/start" for topic, _, _ in read), 2)
        times = [time for _, time, _ in read]
        self.assertEqual(times, sorted(times), "time continues across a restart of the world")
        live, begun, left = {}, 0, []
        for _, _, events in (one for one in read if one[0] == "/enfilade/events"):
            for event in events.contacts:
                if event.kind == 1:  # begin
                    self.assertNotIn((event.a, event.b), live)
                    live[event.a, event.b] = event
                    begun += 1
                if event.kind == 2:
                    del live[event.a, event.b]
            left += [notice.avatar for notice in events.notices if notice.kind == 7]
        self.assertEqual(live, {}, "every contact that began has its end")
        self.assertGreater(begun, 3)
        self.assertEqual(left[:1], ["bob"])
        self.assertIn("ann", left, "the world restarted")

    def test_a_free_running_world_is_made_again(self):
        with self.serve() as server, server.connect() as client:
            client.free_run(4)
            ann = client.spawn("ann", at=(0, 0, 0))
            for x in (4, -4, 4):
                ann.walk((x, 0, 0))
                time.sleep(0.2)
        code, report, errors = verify(self.file)
        self.assertEqual(code, 0, errors)
        self.assertGreater(report["ticks"], 60)

    def test_a_world_that_stands_still_is_in_its_file(self):
        server = self.serve()
        client = server.connect()
        self.addCleanup(client.close)
        client.spawn("ann", at=(0, 0, 0))
        tick = client.step(7).tick
        deadline = time.monotonic() + 20
        while (verify(self.file)[1] or {}).get("ticks") != tick:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.2)

    def test_an_earlier_recording_is_not_overwritten(self):
        self.file.write_bytes(b"precious")
        with self.assertRaisesRegex(enfilade.StartFailed, "move it, or give another file name"):
            self.serve()
        self.assertEqual(self.file.read_bytes(), b"precious")

    def test_recorders_that_are_killed_leave_all_but_their_last_moment(self):
        killed = KilledRecorders(self, self.folder, 9)
        for number in range(6):
            killed.kill(number)
        self.assertGreater(len(killed.ticks), 2)
        self.assertGreater(sum(killed.ticks), 100)

    def test_viewers_find_what_they_know(self):
        with self.serve("--record-channels", "foxglove") as server, server.connect() as client:
            client.lockstep()
            ann = client.spawn("ann", at=(3, 0, 0))
            ann.look((3, 1.6, 8))
            ann.walk((8, 0, 0))
            client.step(60)
            client.body("lift", level=1)
            client.step(60)
            ann.leave()
            client.step(300)
        read = messages(self, self.file)
        places = {}
        for _, time_, tf in (one for one in read if one[0] == "/tf"):
            for transform in tf.transforms:
                self.assertAlmostEqual(transform.timestamp.ToNanoseconds() / 1e9, time_, 6)
                places.setdefault(transform.child_frame_id, []).append(transform)
        self.assertEqual({child: by[0].parent_frame_id for child, by in places.items()},
                         {"scene": "map", "avatar/ann": "scene", "eyes/ann": "avatar/ann",
                          "body/lift": "scene"})
        up = self.turned(places["scene"][0].rotation, (0, 1, 0))
        self.assertLess(abs(up[2] - 1), 1e-12, "the scene's Y is up, which viewers call Z")
        ahead = self.turned(places["eyes/ann"][-1].rotation, (0, 0, 1))
        below = self.turned(places["eyes/ann"][-1].rotation, (0, 1, 0))
        self.assertGreater(max(abs(ahead[0]), abs(ahead[2])), 0.99, ahead)
        self.assertLess(below[1], -0.99)
        state = [m for topic, _, m in read if topic == "/enfilade/state" and m.avatars][-1]
        self.assertAlmostEqual(places["avatar/ann"][-1].translation.x, state.avatars[0].feet.x, 2)
        self.assertGreater(places["body/lift"][-1].translation.y,
                           places["body/lift"][0].translation.y + 0.9)
        shown = set()
        for _, _, update in (one for one in read if one[0] == "/scene"):
            for deletion in update.deletions:
                shown = set() if deletion.type == 1 else shown - {deletion.id}
            for entity in update.entities:
                shown.add(entity.id)
        self.assertEqual(shown, {"still", "body/lift"}, "ann left, and her contacts ended")
        self.assertEqual(verify(self.file)[0], 0)

    def test_pictures_have_their_calibration(self):
        with self.serve("--record-frames", "0.5") as server, server.connect() as client:
            if not client.renderer:
                self.skipTest("no EGL device")
            client.lockstep()
            client.spawn("ann", at=(0, 0, 0))
            client.step(90)
            client.frame("ann", width=64, height=48)  # drawn after the others
        read = messages(self, self.file)
        images = [(t, m) for topic, t, m in read if topic == "/frames/ann/image"]
        lenses = [m for topic, _, m in read if topic == "/frames/ann/calibration"]
        self.assertGreater(len(images), 1)
        self.assertEqual(len(images), len(lenses))
        for (time_, image), lens in zip(images, lenses):
            self.assertEqual((image.format, image.data[:2]), ("jpeg", b"\xff\xd8"))
            self.assertEqual(image.frame_id, "eyes/ann")
            self.assertEqual(lens.K[2:6:3], [lens.width / 2, lens.height / 2])
            self.assertAlmostEqual(image.timestamp.ToNanoseconds() / 1e9, time_, 6)
        self.assertEqual((lenses[-1].width, lenses[-1].height), (64, 48))
        self.assertEqual(verify(self.file)[0], 0)

    @staticmethod
    def turned(q, v):
        """v turned by the unit quaternion q."""
        axis = (q.x, q.y, q.z)
        cross = lambda a, b: (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                              a[0] * b[1] - a[1] * b[0])
        t = [2 * c for c in cross(axis, v)]
        return [v[i] + q.w * t[i] + cross(axis, t)[i] for i in range(3)]

    def test_a_full_disk_ends_the_recording_and_not_the_server(self):
        limited = ("import resource, os, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
                   "resource.setrlimit(resource.RLIMIT_FSIZE, (150000, 150000));"
                   "os.execv(sys.argv[1], sys.argv[1:])")
        program = subprocess.Popen(
            ["/usr/bin/python3", "-c", limited, enfilade.process.find_program(), "serve", self.scene,
             "--listen", "127.0.0.1:0", "--record", self.file],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(program.kill)
        port = json.loads(program.stdout.readline())["port"]
        with enfilade.connect(f"127.0.0.1:{port}") as client:
            ann = client.spawn("ann", at=(0, 0, 0))
            for x in (4, -4) * 20:
                ann.walk((x, 0, 1))
            for _ in range(100):
                tick = client.step(100).tick
            self.assertEqual(tick, 10_000)
            recording = client.metrics().recording
            self.assertTrue(recording.broken)
            self.assertLess(recording.ticks, tick)
            url = f"http://127.0.0.1:{port}/metrics"
            page = urllib.request.urlopen(url, timeout=10).read().decode()
            self.assertIn('enfilade_recording_broken{world="main"} 1\n', page)
        program.send_signal(signal.SIGTERM)
        said = program.communicate(timeout=30)[1]
        self.assertEqual(program.returncode, 1)
        self.assertEqual(said.count("the recording ends"), 1, said)
        self.assertIn("File too large", said)
        code, report, errors = verify(self.file)
        self.assertEqual(code, 0, errors)
        self.assertFalse(report["closed"])
        self.assertGreater(report["ticks"], 100)
        other_reader(self, self.file, "--stream")


if __name__ == "__main__":
    unittest.main()
