"""Many worlds in one round trip, orders that turn and teleport, checkpoints, objects and cameras."""

import json
import math
import os
import subprocess
import tempfile
import unittest
import unittest.mock
from pathlib import Path

import numpy as np

import enfilade
from room import COLUMN, FLOOR, WALL, RoomCase

_STARTS = [(0, 0, 0), (-3, 0, -3), (-5, 0, 2)]


class GroupTest(RoomCase):
    def group(self, count):
        names = [self.client.create_world(drop_when_empty=True).name for _ in range(count)]
        base = self.server.connect()
        self.addCleanup(base.close)
        return enfilade.WorldGroup(base, names), names

    def test_members_are_as_clients_of_their_worlds(self):
        group, names = self.group(3)
        self.assertEqual([one.world for one in group.members], names)
        for number, client in enumerate(group.members):
            client.lockstep()
            client.subscribe(contacts=True, notices=True)
            client.spawn("ann", at=(number, 0, 0)).enter()
        posted = [one.post([{"command": enfilade.messages.Command(
            avatar="ann", drive=enfilade.messages.Drive(velocity=enfilade.messages.Vec3(x=1.4)))},
            {"step": enfilade.messages.Step(ticks=60 * (i + 1), avatars=True)}])
            for i, one in enumerate(group.members)]
        for number, (client, ids) in enumerate(zip(group.members, posted)):
            step = client.take(ids)[1][0].step
            self.assertEqual(step.tick, 60 * (number + 1) + 1)
            self.assertGreater(step.avatars[0].feet.x, number + 1)
            self.assertIn("floor", [one.b_name for one in client.contacts()])
        self.assertEqual(self.client.step().tick, 1, "the world of the others did not move")

    def test_a_world_steps_in_a_group_as_alone(self):
        group, _ = self.group(2)
        hashes = []
        for client in (*group.members, self.client):
            client.lockstep()
            ann = client.spawn("ann", at=(0, 0, 0))
            ann.walk((4, 0, 2), (-3, 0, 1))
            hashes.append(client.run_until_idle().state_hash)
        self.assertEqual(len(set(hashes)), 1)

    def test_a_refusal_harms_nobody(self):
        group, names = self.group(3)
        for client in group.members:
            client.lockstep()
        def post(client, number):
            client.subscribe(notices=True)
            spawn = enfilade.messages.Spawn(at=enfilade.messages.Vec3(z=6 if number == 1 else 0))
            return client.post([
                {"command": enfilade.messages.Command(avatar="ann", spawn=spawn)},
                {"step": enfilade.messages.Step(ticks=1, avatars=True)},
                {"frame": enfilade.messages.FrameRequest(
                    eyes=enfilade.messages.AvatarEyes(avatar="ann"), width=16, height=8)}])
        posted = [post(client, i) for i, client in enumerate(group.members)]
        replies = [client.replies(ids) for client, ids in zip(group.members, posted)]
        for number in (0, 2):
            frame, attachment = replies[number][2]
            self.assertEqual(len(attachment), 16 * 8 * 3)
            self.assertEqual(len(frame.frame.planes), 1)
        self.assertEqual(replies[1][2][0].error.code, enfilade.messages.ERROR_UNKNOWN_AVATAR)
        self.assertIn("column", [one.text for one in group.members[1].notices()][0])

    def test_a_dropped_world_is_an_error_and_the_others_go_on(self):
        group, names = self.group(2)
        for client in group.members:
            client.lockstep()
        self.client.drop_world(names[0])
        posted = [one.post([{"step": enfilade.messages.Step(ticks=1)}]) for one in group.members]
        with self.assertRaises(enfilade.ServerError):
            group.members[0].take(posted[0])
        self.assertEqual(group.members[1].take(posted[1])[0][0].step.tick, 1)

    def test_a_world_that_does_not_exist_is_named_and_the_others_can_be_entered(self):
        name = self.client.create_world().name
        self.addCleanup(lambda: self.client.drop_world(name))
        with self.server.connect() as base:
            for worlds in (["nope"], [name, "nope"], ["nope", name]):
                with self.assertRaisesRegex(enfilade.ServerError, "ERROR_UNKNOWN_WORLD: .*'nope'"):
                    enfilade.WorldGroup(base, worlds)
            self.assertEqual(enfilade.WorldGroup(base, [name]).members[0].step().tick, 1)

    def test_unusable_requests_are_named(self):
        m = enfilade.messages
        step = m.ClientMessage(step=m.Step(ticks=1))
        for many, words in ((m.StepMany(), "worlds"),
                            (m.StepMany(worlds=[m.StepMany.World(world="main")] * 2), "twice"),
                            (m.StepMany(worlds=[m.StepMany.World(world="main", requests=[
                                m.ClientMessage(step_many=m.StepMany())])]), "step_many"),
                            (m.StepMany(worlds=[m.StepMany.World(world="main")],
                                        memory_socket="enfilade-/tmp/x"), "memory_socket")):
            with self.assertRaisesRegex(enfilade.ServerError, words):
                self.client.request(step_many=many)
        reply, _ = self.client.request(step_many=m.StepMany(worlds=[
            m.StepMany.World(world="nowhere", requests=[step, step])]))
        messages = reply.step_many.worlds[0].messages
        self.assertEqual([one.reply_to for one in messages], [1, 2])
        self.assertEqual(messages[0].error.code, m.ERROR_UNKNOWN_WORLD)

    def test_pictures_come_through_shared_memory(self):
        names = [self.client.create_world(drop_when_empty=True).name for _ in range(2)]
        pictures = {}
        for shared in (False, True):
            base = self.server.connect()
            self.addCleanup(base.close)
            group = enfilade.WorldGroup(base, names, shared_memory=shared)
            request = {"frame": enfilade.query_messages.frame_request(
                eye=(0, 1, 0), forward=(1, 0, 0.2), width=33, height=21, channels=("rgb", "depth"))}
            taken = []
            for _ in range(3):
                posted = [one.post([request]) for one in group.members]
                replies = [one.take(ids)[0] for one, ids in zip(group.members, posted)]
                taken.append([enfilade.results.frame(reply.frame, attachment)
                              for reply, attachment in replies])
            self.assertEqual(group._memory is not None, shared)
            self.assertEqual(taken[2][0].depth.flags.writeable, not shared)
            pictures[shared] = taken
        for before, after in zip(pictures[False][2], pictures[True][2]):
            np.testing.assert_array_equal(before.rgb, after.rgb)
            np.testing.assert_array_equal(before.depth, after.depth)
        # The round before is still there.
        np.testing.assert_array_equal(pictures[True][1][1].depth, pictures[True][2][1].depth)

    def test_larger_memory_replaces_the_first(self):
        names = [self.client.create_world(drop_when_empty=True).name]
        base = self.server.connect()
        self.addCleanup(base.close)
        group = enfilade.WorldGroup(base, names, shared_memory=True)
        member, view = group.members[0], dict(eye=(0, 1, 0), forward=(1, 0, 0.2), channels=("depth",))
        small = member.frame(width=8, height=8, **view).depth
        seen = small.copy()
        large = member.frame(width=320, height=240, **view).depth
        self.assertFalse(large.flags.writeable)
        np.testing.assert_array_equal(small, seen)
        np.testing.assert_array_equal(
            large, self.client.frame(width=320, height=240, **view).depth)

    def test_a_server_without_the_socket_sends_pictures_in_its_replies(self):
        names = [self.client.create_world(drop_when_empty=True).name]
        base = self.server.connect()
        self.addCleanup(base.close)
        elsewhere = enfilade.world_group._SharedMemory()
        elsewhere.name = "enfilade-nowhere"
        with unittest.mock.patch("enfilade.world_group._SharedMemory", return_value=elsewhere):
            group = enfilade.WorldGroup(base, names, shared_memory=True)
        member = group.members[0]
        self.assertIsNone(group._memory)
        frame = member.frame(eye=(0, 1, 0), forward=(1, 0, 0), width=8, height=8)
        self.assertEqual(frame.rgb.shape, (8, 8, 3))
        self.assertTrue(frame.rgb.flags.writeable)

    def test_memory_of_another_user_is_not_read(self):
        module = enfilade.world_group
        with unittest.mock.patch.object(module, "_CREDENTIALS") as credentials, \
                unittest.mock.patch.object(module, "_PASSING_SECONDS", 0.2):
            credentials.unpack.return_value = (1, 4242, 4242)
            credentials.size = 12
            with self.assertRaisesRegex(enfilade.ConnectionFailed, "as this user or as root"):
                enfilade.WorldGroup(self.client, ["main"], shared_memory=True)

    def test_a_hundred_environments(self):
        vector = enfilade.VectorWalkEnv(address=self.server.address, num_envs=100, starts=_STARTS,
                                        channels=())
        self.addCleanup(vector.close)
        vector.reset(seed=1)
        seen = vector.step(np.ones((100, 2)))[0]
        self.assertEqual(seen["position"].shape, (100, 3))
        vector.close()


class OrdersTest(RoomCase):
    def setUp(self):
        super().setUp()
        self.client.lockstep()

    def test_an_avatar_turns_with_a_rate(self):
        ann = self.client.spawn("ann", at=(0, 0, 0))
        ann.turn(90, rate=180)
        step = self.client.run_until_idle()
        np.testing.assert_allclose(step.avatars["ann"].gaze, (0, 0, -1), atol=1e-9)
        ann.turn(facing=0)
        np.testing.assert_allclose(self.client.run_until_idle().avatars["ann"].gaze, (1, 0, 0), atol=1e-9)
        with self.assertRaisesRegex(enfilade.ServerError, "rate"):
            ann.turn(90, rate=0)
        with self.assertRaisesRegex(enfilade.ServerError, "turn.by"):
            self.client.command("ann", turn=enfilade.messages.Turn())

    def test_parts_turn_until_something_stops_them(self):
        self.client.subscribe(notices=True)
        box = enfilade.messages.Box(min=enfilade.messages.Vec3(x=-0.2, z=-0.2),
                                    max=enfilade.messages.Vec3(x=2, y=1, z=0.2))
        bar = self.client.spawn("bar", at=(0, 0.002, 4.8), facing=90,
                                parts=[enfilade.messages.ConvexPart(box=box)])
        bar.turn(-170)
        step = self.client.run_until_idle()
        blocked = [one for one in self.client.notices() if one.kind == "blocked"]
        self.assertEqual([one.obstacle_name for one in blocked], ["column"])
        self.assertTrue(-90 < step.avatars["bar"].facing < 0)
        self.assertEqual(self.client.metrics().worst_penetration, 0)

    def test_a_teleport_needs_room(self):
        self.client.subscribe(notices=True)
        ann = self.client.spawn("ann", at=(0, 0, 0))
        ann.enter()
        ann.teleport((0, 0, 6))
        ann.teleport((-4, 0, 3), facing=180)
        step = self.client.run_until_idle()
        kinds = [(one.kind, one.text) for one in self.client.notices()]
        self.assertIn("column", dict(kinds)["refused"])
        self.assertIn("done", dict(kinds))
        np.testing.assert_allclose(step.avatars["ann"].feet, (-4, 0, 3), atol=2e-3)
        np.testing.assert_allclose(step.avatars["ann"].gaze, (-1, 0, 0), atol=1e-9)

    def test_a_driver_resets_a_world_without_being_admin(self):
        with tempfile.TemporaryDirectory() as folder:
            tokens = Path(folder) / "tokens"
            tokens.write_text("drive driver-0123456789ab\ndrive other-0123456789abc\n")
            with enfilade.serve(self.scene, "--token-file", str(tokens)) as server:
                with server.connect(token="driver-0123456789ab") as driver:
                    driver.lockstep()
                    driver.spawn("ann", at=(0, 0, 0)).enter()
                    driver.restart()
                    self.assertEqual(driver.step().tick, 1)
                    with server.connect(token="other-0123456789abc") as other:
                        other.spawn("bob", at=(2, 0, 0))
                        with self.assertRaisesRegex(enfilade.ServerError, "bob.*admin"):
                            driver.restart()

    def test_a_world_continues_from_saved_bytes(self):
        ann = self.client.spawn("ann", at=(0, 0, 0))
        ann.walk((4.9, 0, 3), (-3, 0, 0))
        self.client.step(90)
        saved = self.client.save()
        expected = [self.client.step(30).state_hash for _ in range(8)]
        self.client.subscribe(contacts=True)
        back = self.client.restore(saved)
        self.assertEqual(back.tick, 90)
        self.assertIn(("end", "seek"), [(one.kind, one.reason) for one in self.client.contacts()])
        self.assertEqual([self.client.step(30).state_hash for _ in range(8)], expected)
        enfilade.Avatar(self.client, "ann").drive((1, 0, 0))  # it belongs to this client
        with enfilade.serve(self.scene) as server, server.connect() as other:
            other.lockstep()
            other.restore(saved)
            self.assertEqual([other.step(30).state_hash for _ in range(8)], expected)
            for damaged in (b"", saved[:-9], saved[:100] + b"\x80" + saved[101:]):
                with self.assertRaisesRegex(enfilade.ServerError, "restore.checkpoint|checkpoint"):
                    other.restore(damaged)
            self.assertEqual(other.step(1).tick, 90 + 8 * 30 + 1, "a refused one changes nothing")

    def test_a_recording_continues_with_a_new_run(self):
        with tempfile.TemporaryDirectory() as folder:
            recording = Path(folder) / "w.mcap"
            with enfilade.serve(self.scene, "--record", str(recording)) as server:
                with server.connect() as client:
                    client.lockstep()
                    ann = client.spawn("ann", at=(0, 0, 0))
                    ann.walk((4.9, 0, 3))
                    client.step(60)
                    saved = client.save()
                    expected = client.step(90).state_hash
                    client.restore(saved)
                    self.assertEqual(client.step(90).state_hash, expected)
                    client.restore(saved)
                    enfilade.Avatar(client, "ann").drive((-1, 0, 0))
                    other = client.step(30).state_hash
            self.assertNotEqual(other, expected)
            def replay(*options):
                done = subprocess.run([enfilade.process.find_program(), "replay", str(recording), "--verify",
                                       *options], capture_output=True, text=True, timeout=120)
                self.assertEqual(done.returncode, 0, done.stderr)
                return json.loads(done.stdout)
            self.assertEqual(replay()["ticks"], 150 + 90 + 30)
            self.assertEqual(replay("--run", "2")["state_hash"], f"{expected:016x}")
            last = replay("--run", "3", "--from", "70")
            self.assertEqual((last["state_hash"], last["ticks"]), (f"{other:016x}", 30))

    def test_a_checkpoint_larger_than_a_message_is_sent_in_parts(self):
        ann = self.client.spawn("ann", at=(0, 0, 0))
        for _ in range(6):
            ann.walk(*((0.1 * (i % 20), 0, 0) for i in range(10_000)))
        self.client.step(5)
        saved = self.client.save()
        self.assertGreater(len(saved), self.client.limits.max_message)
        expected = self.client.step(20).state_hash
        self.client.restore(saved)
        self.assertEqual(self.client.step(20).state_hash, expected)
        restore = enfilade.messages.RestoreWorld(uploaded=True)
        with self.assertRaisesRegex(enfilade.ServerError, "nothing was uploaded"):
            self.client.request(restore=restore)
        self.client.request(upload=enfilade.messages.Upload(part=b"abc", first=True))
        reply, _ = self.client.request(upload=enfilade.messages.Upload(part=b"de"))
        self.assertEqual(reply.upload.bytes, 5)
        with self.assertRaisesRegex(enfilade.ServerError, "not a checkpoint"):
            self.client.request(restore=restore)


class ObjectsTest(RoomCase):
    def test_objects_have_boxes_and_are_things(self):
        objects = {one.path: one for one in self.client.objects()}
        self.assertEqual(sorted(objects), ["column", "floor", "wall"])
        wall = objects["wall"]
        self.assertEqual((wall.id, wall.thing, wall.class_id, wall.class_name), (WALL, WALL, 0, ""))
        np.testing.assert_allclose(wall.box, ((5, 0, -4), (5.2, 3, 4)), atol=1e-6)

    def test_classes_and_things_of_the_sidecar_are_channels(self):
        (Path(self.scene).parent / "room.walk.json").write_text(
            '{"walk":1,"classes":{"wall":["wall","column"],"floor":["floor"]},'
            '"things":[["wall","column"]]}')
        self.addCleanup((Path(self.scene).parent / "room.walk.json").unlink)
        with enfilade.serve(self.scene) as server, server.connect() as client:
            objects = {one.path: one for one in client.objects()}
            self.assertEqual(objects["column"].class_name, "wall")
            self.assertEqual((objects["floor"].class_id, objects["wall"].class_id), (1, 2))
            self.assertEqual(objects["wall"].thing, objects["column"].thing)
            frame = client.frame(eye=(0, 1.5, 0), target=(5, 1, 5), width=64, height=48,
                                 channels=("ids", "class", "thing"))
            self.assertEqual(sorted(np.unique(frame.ids)), [0, FLOOR, WALL, COLUMN])
            self.assertTrue((frame.class_ids[frame.ids == COLUMN] == 2).all())
            self.assertTrue((frame.class_ids[frame.ids == FLOOR] == 1).all())
            self.assertTrue((frame.things[frame.ids == COLUMN] == objects["wall"].thing).all())
            self.assertTrue((frame.class_ids[frame.ids == 0] == 0).all())


class CamerasTest(RoomCase):
    def test_cameras_have_their_places_and_channels(self):
        cameras = [enfilade.Camera("front", (32, 24), ("rgb", "depth")),
                   enfilade.Camera("left", (16, 16), ("ids", "depth"), yaw=math.pi / 2, height=0.5)]
        env = enfilade.WalkEnv(self.scene, starts=[(0, 0, 0, 0)], cameras=cameras)
        self.addCleanup(env.close)
        seen, _ = env.reset(seed=1)
        self.assertIn(seen, env.observation_space)
        self.assertEqual(seen["front_rgb"].shape, (24, 32, 3))
        self.assertAlmostEqual(float(seen["front_depth"][12, 16]), 5.0, places=3)  # the wall
        self.assertTrue(np.isinf(seen["left_depth"][0]).all())
        seen = env.step((0, 0))[0]
        # Half a metre above the floor, the lowest row looks down by fov/2 less half a pixel.
        down = math.tan(0.6) * 15 / 16
        self.assertAlmostEqual(float(seen["left_depth"][15, 8]), 0.5 / down, delta=0.01)
        self.assertEqual(env.render().shape, (24, 32, 3))

    def test_eye_height_is_above_the_feet(self):
        env = enfilade.WalkEnv(self.scene, starts=[(0, 0, 0, 180)], eye_height=0.4, size=(9, 9),
                               channels=("depth",))
        self.addCleanup(env.close)
        depth = env.reset(seed=1)[0]["depth"]
        self.assertAlmostEqual(float(depth[8, 4]), 0.4 / (math.tan(0.6) * 8 / 9), delta=0.01)

    def test_a_lens_sees_all_around_and_noise_is_seeded(self):
        whole = self.client.frame(eye=(0, 1, 0), forward=(1, 0, 0), width=64, height=32,
                                  channels=("range", "ids"), lens="equirectangular")
        self.assertAlmostEqual(float(whole.range[15:17, 32].mean()), 5.0, delta=0.02)
        self.assertEqual(whole.ids[31, 3], FLOOR)
        self.assertAlmostEqual(float(whole.range[31, 3]), 1.0, delta=0.01)
        fisheye = self.client.frame(eye=(0, 1, 0), forward=(0, -1, 0), up=(1, 0, 0), width=33,
                                    height=33, channels=("range", "depth"), lens="fisheye")
        self.assertAlmostEqual(float(fisheye.range[16, 16]), 1.0, delta=1e-3)
        narrow = self.client.frame(eye=(0, 1, 0), forward=(0, -1, 0), up=(1, 0, 0), width=33, height=33,
                                   channels=("range",), lens="fisheye", intrinsics=(40, 40, 16.5, 16.5))
        self.assertAlmostEqual(float(narrow.range[16, 32]), 1 / math.cos(16 / 40), delta=1e-3)
        with self.assertRaisesRegex(enfilade.ServerError, "lens"):
            self.client.frame(eye=(0, 1, 0), forward=(1, 0, 0), width=8, height=8, lens="fisheye",
                              renderer="gl")
        view = dict(eye=(0, 1, 0), forward=(1, 0, 0), width=32, height=32, channels=("depth",))
        noisy = [self.client.frame(**view, depth_noise=seed).depth for seed in (1, 1, 2)]
        np.testing.assert_array_equal(noisy[0], noisy[1])
        self.assertFalse(np.array_equal(noisy[0], noisy[2], equal_nan=True))

    def test_a_distortion_table_is_read_from_files(self):
        view = dict(eye=(0, 1, 0), forward=(1, 0, 0), width=32, height=32, channels=("depth",))
        table = np.ones((2, 4, 5), np.float32)
        table[:, 2:] = 1.1  # the right half is reported too near
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        binary, text = Path(folder.name) / "t.npy", Path(folder.name) / "t.txt"
        np.save(binary, table)
        with open(text, "w", encoding="utf-8") as file:
            file.write("2 4\n")
            np.savetxt(file, table.reshape(-1, 5))
        plain = self.client.frame(**view, depth_noise=7).depth
        seen = [self.client.frame(**view, depth_noise={"model": "redwood", "seed": 7, "distortion": one}).depth
                for one in (table, binary, text)]
        np.testing.assert_array_equal(seen[0], seen[1])
        np.testing.assert_array_equal(seen[0], seen[2])
        ratio = np.nanmedian(plain[12:20] / seen[0][12:20], axis=0)
        self.assertAlmostEqual(float(np.median(ratio[2:14])), 1.0, delta=0.01)
        self.assertAlmostEqual(float(np.median(ratio[18:30])), 1.1, delta=0.03)
        with self.assertRaisesRegex(ValueError, "rows x columns x 5"):
            self.client.frame(**view, depth_noise={"distortion": np.ones((4, 4))})
        with self.assertRaisesRegex(enfilade.ServerError, "factors"):
            self.client.frame(**view, depth_noise={"distortion": -table})


class FlowTest(RoomCase):
    VIEW = dict(width=48, height=36, channels=("flow", "depth", "ids"))

    def test_a_driven_avatars_flow_is_the_motion_of_points(self):
        self.client.lockstep()
        ann = self.client.spawn("ann", at=(0, 0, 0), facing=0)
        ann.enter()
        self.client.step(5)
        before = self.client.step(1, avatars=True)
        old = before.avatars["ann"]
        ann.drive((1, 0, 0.5))
        now = self.client.step(6, avatars=True).avatars["ann"]
        frame = ann.frame(forward=(1, 0, 0.1), flow_from=before.tick, flow_forward=(1, 0, -0.2),
                          **self.VIEW)
        f = 18 / math.tan(0.6)
        def axes(forward):
            forward = np.array(forward, float) / np.linalg.norm(forward)
            right = np.cross(forward, (0, 1, 0))
            right /= np.linalg.norm(right)
            return forward, right, np.cross(right, forward)
        forward, right, up = axes((1, 0, 0.1))
        x, y = np.meshgrid(np.arange(48) + 0.5, np.arange(36) + 0.5)
        rays = forward + (x - 24)[..., None] / f * right - (y - 18)[..., None] / f * up
        points = np.array(now.eyes) + frame.depth[..., None].astype(float) * rays
        forward, right, up = axes((1, 0, -0.2))
        then = points - np.array(old.eyes)
        z = then @ forward
        expected = np.stack([x - (24 + f * (then @ right) / z), y - (18 - f * (then @ up) / z)], -1)
        seen = frame.ids != 0
        self.assertGreater(seen.sum(), 500)
        np.testing.assert_allclose(frame.flow[seen], expected[seen], atol=2e-3)
        self.assertTrue(np.isnan(frame.flow[~seen]).all())
        self.assertGreater(np.abs(frame.flow[seen]).max(), 1)

    def test_a_watchs_flow_begins_at_its_last_picture(self):
        self.client.lockstep()
        ann = self.client.spawn("ann", at=(0, 0, 0), facing=0)
        ann.enter()
        view = dict(eye=(-1, 1, 0), forward=(1, 0, 0), intrinsics=(40, 40, 24, 18), **self.VIEW)
        self.client.watch(1, rate=15, **view)
        last = next(self.client.frames(5))
        self.assertEqual(last.message.flow_from, last.tick)
        np.testing.assert_allclose(last.flow[last.ids != 0], 0, atol=1e-9)
        ann.drive((0, 0, 1.2))
        for _ in range(3):
            self.client.step(4)
            seen = next(self.client.frames(5))
            self.assertEqual((seen.message.flow_from, seen.tick), (last.tick, last.tick + 4))
            np.testing.assert_array_equal(seen.flow, self.client.frame(flow_from=last.tick, **view).flow)
            last = seen
        with self.assertRaisesRegex(enfilade.ServerError, "flow_from"):
            self.client.watch(1, flow_from=0, **view)

    def test_moving_avatars_flow_and_ticks_that_are_gone_are_refused(self):
        self.client.lockstep()
        bob = self.client.spawn("bob", at=(2, 0, 0), facing=-90)  # the figure need not turn
        bob.enter()
        first = self.client.step(5).tick
        bob.drive((0, 0, 1.2))
        self.client.step(10)
        view = dict(eye=(-1, 1, 0), forward=(1, 0, 0), intrinsics=(40, 40, 24, 18), **self.VIEW)
        frame = self.client.frame(flow_from=first, **view)
        names = self.client.names(frame.ids)
        moving = np.isin(frame.ids, [one for one, name in names.items() if name == "bob"])
        self.assertGreater(moving.sum(), 20)
        # 0.2 m to the right at a distance of at least 2.7 m.
        self.assertTrue((frame.flow[moving][:, 0] > 2).all())
        still = (frame.ids != 0) & ~moving
        np.testing.assert_allclose(frame.flow[still], 0, atol=1e-4)
        self.client.step(40)
        for options, words in (({"flow_from": first}, "not among the last"), ({}, "flow_from")):
            with self.assertRaisesRegex(enfilade.ServerError, words):
                self.client.frame(**options, **view)
        with self.assertRaisesRegex(enfilade.ServerError, "lens"):
            self.client.frame(eye=(0, 1, 0), forward=(1, 0, 0), lens="fisheye", flow_from=56, **self.VIEW)
        with self.assertRaises(enfilade.ServerError) as raised:
            self.client.frame(flow_from=first, **view)
        self.assertEqual(raised.exception.remedy, "give a tick that the world has completed, one of the last 32")

    def test_options_of_a_picture_that_would_have_no_effect_are_named(self):
        view = dict(eye=(0, 1, 0), forward=(1, 0, 0), width=8, height=6)
        for options, name in (({"depth_noise": 1}, "depth_noise"), ({"flow_from": 0}, "flow_from"),
                              ({"flow_forward": (1, 0, 0)}, "flow_forward"),
                              ({"channels": ("depth",), "depth_noise": -1}, "depth_noise"),
                              ({"channels": ("flow",), "flow_from": -1}, "flow_from"),
                              ({"width": -1}, "width"), ({"samples": 1.5}, "samples"), ({"tick": -1}, "tick")):
            with self.assertRaisesRegex(ValueError, name):
                self.client.frame(**{**view, **options})


class VideoTest(unittest.TestCase):
    def setUp(self):
        """Puts an ffmpeg first that writes its input to its last argument."""
        tools = tempfile.TemporaryDirectory()
        self.addCleanup(tools.cleanup)
        tool = Path(tools.name) / "ffmpeg"
        tool.write_text('#!/bin/sh\nfor last; do :; done\ncat > "$last"\n')
        tool.chmod(0o755)
        change = unittest.mock.patch.dict(os.environ, PATH=f"{tools.name}:{os.environ['PATH']}")
        change.start()
        self.addCleanup(change.stop)

    def test_without_ffmpeg_it_says_so(self):
        with unittest.mock.patch.dict(os.environ, PATH="/nowhere"):
            with self.assertRaisesRegex(enfilade.EnfiladeError, "install"):
                enfilade.Video("walk.mp4")

    def test_pictures_become_a_film(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "walk.mp4"
            with enfilade.Video(path, fps=10) as video:
                for i in range(5):
                    video.add(np.full((33, 51, 3), 40 * i, np.uint8))
                with self.assertRaisesRegex(ValueError, "pixels"):
                    video.add(np.zeros((10, 10, 3), np.uint8))
                self.assertFalse(path.exists())
            self.assertEqual(path.stat().st_size, 5 * 33 * 51 * 3)
            self.assertEqual(list(Path(folder).iterdir()), [path])
            with self.assertRaises(KeyError):
                with enfilade.Video(Path(folder) / "not.mp4") as video:
                    video.add(np.zeros((8, 8, 3), np.uint8))
                    raise KeyError
            self.assertEqual(list(Path(folder).iterdir()), [path])


if __name__ == "__main__":
    unittest.main()
