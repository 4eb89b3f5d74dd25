"""Misuse: interrupts, wrong arguments, and servers without an owner."""

import gc
import itertools
import os
import pickle
import signal
import sys
import time
import unittest
from pathlib import Path

import numpy as np

import enfilade
from enfilade import messages, process
from room import COLUMN, FLOOR, WALL, RoomCase


def gone(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except FileNotFoundError:
        return True


class Interrupts(RoomCase):
    def interrupted(self, work, times):
        """Does `work` again and again while a timer's handler raises KeyboardInterrupt in it."""
        def stop(*_):
            raise KeyboardInterrupt
        before = signal.signal(signal.SIGALRM, stop)
        self.addCleanup(signal.signal, signal.SIGALRM, before)
        caught = 0
        for number in range(times):
            try:
                signal.setitimer(signal.ITIMER_REAL, 0.0005 + 0.00013 * (number % 37))
                while True:
                    work()
            except KeyboardInterrupt:
                caught += 1
        self.assertEqual(caught, times)

    def test_an_interrupted_step_leaves_the_client_in_step(self):
        self.client.spawn("ann", at=(0, 0.01, 0)).enter()
        self.interrupted(lambda: self.client.step(1, avatars=True), 60)
        tick = self.client.step().tick
        self.assertEqual(self.client.step(3).tick, tick + 3)

    def test_interrupted_answers_that_are_long_and_events_are_not_lost(self):
        """Answers longer than the client's buffer, among events that must follow one another."""
        ann = self.client.spawn("ann", at=(0, 0.01, 0))
        ann.enter()

        def hop():
            ann.jump(0.05)
            self.client.step(20)
            self.assertEqual(self.client.scan("ann", columns=20000).distance.shape, (1, 20000))
        self.interrupted(hop, 40)
        self.client.step(120)
        kinds = [one.kind for one in self.client.contacts() if one.b == FLOOR]
        self.assertGreater(len(kinds), 2)
        for one, other in itertools.pairwise(kinds):
            self.assertNotEqual(one, other)  # every begin has its end: none lost, none twice

    def test_an_interrupt_after_any_line_of_the_client_loses_nothing(self):
        """The same, exhaustively: an exception at the k-th line that runs, for every k."""
        ann = self.client.spawn("ann", at=(0, 0.01, 0))
        ann.enter()
        folder = str(Path(enfilade.__file__).parent)
        kinds = []
        for number in itertools.count(1):
            left = number

            def line(frame, event, _):
                nonlocal left
                if event == "line" and frame.f_code.co_filename.startswith(folder):
                    left -= 1
                    if left == 0:
                        raise KeyboardInterrupt
                return line

            ann.jump(0.05)
            sys.settrace(line)
            try:
                self.client.step(60)
            except KeyboardInterrupt:
                pass
            finally:
                sys.settrace(None)
            self.client.step(1)
            kinds += [one.kind for one in self.client.contacts() if one.b == FLOOR]
            if left > 0:
                break
        self.assertGreater(number, 30)
        for one, other in itertools.pairwise(kinds):
            self.assertNotEqual(one, other)

    def test_a_reply_that_was_left_aside_is_not_waited_for(self):
        first = self.client.post([{"step": messages.Step(ticks=1)}])
        self.assertEqual(self.client.step().tick, 2)
        with self.assertRaisesRegex(enfilade.EnfiladeError, "discarded"):
            self.client.take(first)
        self.assertEqual(self.client.step().tick, 3)

    def test_an_environment_goes_on_after_an_interrupt(self):
        with enfilade.WalkEnv(client=self.client, starts=[(0, 0.01, 0)], channels=()) as env:
            env.reset(seed=1)

            def work():
                try:
                    env.step([0.1, 1])
                except RuntimeError:
                    env.reset(seed=1)
            self.interrupted(work, 20)
            env.reset(seed=1)
            env.step([1, 0])
        self.assertEqual(self.client.step().idle, False)  # its client is ours, and open


class Vectors(RoomCase):
    def vector(self, **options):
        made = enfilade.VectorWalkEnv(
            self.scene, 2, **{"starts": [(0, 0.01, 0, 0)], "channels": (), **options})
        self.addCleanup(made.close)
        return made

    def test_wrong_counts_and_actions_are_refused_before_anything_is_sent(self):
        vector = self.vector()
        self.assertEqual(vector.observation_space["position"].shape, (2, 3))
        vector.reset(seed=np.int64(1))
        first = vector.step(np.zeros((2, 2)))[4]["tick"].tolist()
        for wrong in (np.zeros((1, 2)), np.zeros((3, 2)), [[np.nan, 0], [0, 0]],
                      [[0, 0], [0, np.nan]], [[0, 0], [0, 0, 0]], [[0, 0], 1]):
            with self.assertRaises(ValueError):
                vector.step(wrong)
        with self.assertRaises(ValueError):
            vector.reset(seed=[1])
        seen, rewards, *_, infos = vector.step(np.zeros((2, 2)))
        self.assertEqual((seen["position"].shape, rewards.shape), ((2, 3), (2,)))
        self.assertEqual(infos["tick"].tolist(), [tick + 6 for tick in first])

    def test_after_one_has_failed_the_next_step_restarts_it_and_the_other_goes_on(self):
        vector = self.vector()
        vector.reset(seed=1)
        for number in range(2):
            vector.envs[number].client.restart()  # without the environment: the world is empty
            with self.assertWarnsRegex(UserWarning, f"environment {number}: "):
                *_, truncated, infos = vector.step(np.zeros((2, 2)))
            self.assertEqual(truncated.tolist(), [number == 0, number == 1])
            self.assertEqual(infos["_error"].tolist(), truncated.tolist())
            ticks = vector.step(np.zeros((2, 2)))[4]["tick"]
            self.assertEqual(ticks[number], 1)
            self.assertGreater(ticks[1 - number], 6)
            self.assertEqual(vector.step(np.zeros((2, 2)))[1].shape, (2,))
        with self.assertRaises(enfilade.OrderFailed):
            vector.reset(options={"start": (0, 0, 6)})
        with self.assertRaisesRegex(RuntimeError, "reset"):
            vector.step(np.zeros((2, 2)))
        self.assertEqual(len(vector.reset(seed=2)[0]["position"]), 2)

    def test_a_start_that_is_refused_is_drawn_again(self):
        vector = self.vector(starts=[(0, 0.01, 0, 0), (0, 0, 6)])  # the second lies in the column
        for seed in range(8):
            seen, _ = vector.reset(seed=seed)
            self.assertEqual(np.round(seen["position"][:, 2]).tolist(), [0, 0])
        blocked = self.vector(starts=[(0, 0, 6)])
        with self.assertRaises(enfilade.OrderFailed):
            blocked.reset()


class Arguments(RoomCase):
    def environment(self, **options):
        return enfilade.WalkEnv(client=self.client, **{
            "starts": [(0, 0.01, 0, 0)], "channels": (), **options})

    def test_arguments_that_are_none_are_refused_by_name(self):
        for name, value in (("goal", (12,)), ("goal", 3.0), ("starts", [(1, 2)]),
                            ("starts", (1.5, 0, 0)), ("channels", "depth"),
                            ("channels", ("rgb", "haze")), ("ticks_per_step", 0),
                            ("speed", 1e9), ("fov_y", 200), ("render_mode", "human"),
                            ("server_arguments", "--no-cache"), ("scene", "room.obj")):
            with self.assertRaisesRegex(ValueError, name):
                self.environment(**{name: value})
        self.assertEqual(self.client.step().tick, 1)

    def test_actions_that_are_none_change_nothing(self):
        env = self.environment()
        env.reset(seed=1)
        env.step([1, 0])
        tick = self.client.step().tick
        for wrong in ([np.nan, 0], [0, np.nan], 3, [1], "ab"):
            with self.assertRaisesRegex(ValueError, "action"):
                env.step(wrong)
        self.assertEqual(env.step([1, 0])[4]["tick"], tick + 6)
        discrete = self.environment(discrete=True)
        discrete.reset(seed=1)
        for wrong in (-1, 4, 1.7, "x"):
            with self.assertRaisesRegex(ValueError, "action"):
                discrete.step(wrong)
            self.assertFalse(discrete.action_space.contains(wrong))
        discrete.step(np.int64(3))

    def test_a_goal_of_options_is_for_one_episode(self):
        env = self.environment(goal=(3, 0, 0))
        first = env.reset(seed=4)[0]["to_goal"]
        other = env.reset(seed=4, options={"goal": (8, 0, 0)})[0]["to_goal"]
        np.testing.assert_allclose(other - first, (5, 0, 0))
        np.testing.assert_array_equal(env.reset(seed=4)[0]["to_goal"], first)
        for options in ({"strat": (0, 0, 0)}, {"goal": (8,)}, {"start": (1, 2)}):
            with self.assertRaises(ValueError):
                env.reset(options=options)
        with self.assertRaisesRegex(ValueError, "goal"):
            self.environment().reset(options={"goal": (8, 0, 0)})

    def test_after_a_reset_that_failed_there_is_no_episode(self):
        env = self.environment()
        env.reset(seed=1)
        with self.assertRaisesRegex(enfilade.OrderFailed, "column") as caught:
            env.reset(options={"start": (0, 0, 6)})
        self.assertNotIn("no avatar", str(caught.exception))
        with self.assertRaisesRegex(RuntimeError, "reset"):
            env.step([0, 0])
        self.assertIsNone(env.render())
        env.reset(seed=1)
        env.step([0, 0])

    def test_a_body_command_has_one_action(self):
        for wrong in ({"open": False}, {}, {"open": True, "close": True}):
            with self.assertRaisesRegex(ValueError, "give one of"):
                self.client.body("door", **wrong)
        with self.assertRaises(TypeError):
            self.client.body("door", opne=True)
        with self.assertRaisesRegex(enfilade.ServerError, "door"):
            self.client.body("door", to=0.0)

    def test_queries_without_a_place_or_with_two_are_refused_here(self):
        for wrong in (lambda: self.client.frame(),
                      lambda: self.client.frame(eye=(0, 1, 0), target=(1, 1, 1), forward=(1, 0, 0)),
                      lambda: self.client.frame("ann", up=(1, 0, 0)),
                      lambda: self.client.frame(eye=(0, 1, 0), fov_y=1, intrinsics=(9, 9, 5, 5)),
                      lambda: self.client.frame(eye=(0, 1, 0), glass="thick"),
                      lambda: self.client.scan(), lambda: self.client.scan("ann", at=(0, 1, 0)),
                      lambda: self.client.rays([(0, 1)], [(1, 0)]),
                      lambda: self.client.run_until_idle(at_a_time=0)):
            with self.assertRaises(ValueError):
                wrong()

    def test_a_run_until_idle_makes_no_more_ticks_than_most(self):
        ann = self.client.spawn("ann", at=(0, 0.01, 0))
        ann.enter()
        ann.drive((0.1, 0, 0))
        with self.assertRaises(enfilade.OrderFailed):
            self.client.run_until_idle(100)
        self.assertEqual(self.client.step().tick, 102)


class Questions(RoomCase):
    def test_more_rays_than_one_request_takes_are_asked_in_parts(self):
        count = self.client.limits.max_rays + 7
        hits = self.client.rays(np.tile((0.0, 1, 0), (count, 1)), np.tile((2.0, 0, 0), (count, 1)))
        self.assertTrue((hits.entity == WALL).all())
        np.testing.assert_array_equal(hits.distance, np.full(count, 5.0))
        self.assertEqual(len(hits.names), count)

    def test_rays_of_numpy_are_those_of_messages(self):
        random = np.random.default_rng(3)
        origins, directions = random.normal(size=(5, 3)), random.normal(size=(5, 3))
        options = messages.RayQuery(through_avatar="ann", packed=True)
        request = enfilade.results.RayRequest(300, origins, directions, 7.5, options)
        ray, vec = messages.Ray, messages.Vec3
        query = messages.RayQuery(through_avatar="ann", packed=True, rays=[
            ray(origin=vec(x=o[0], y=o[1], z=o[2]), direction=vec(x=d[0], y=d[1], z=d[2]), reach=7.5)
            for o, d in zip(origins, directions)])
        self.assertEqual(messages.ClientMessage.FromString(request.SerializeToString()),
                         messages.ClientMessage(request_id=300, rays=query))

    def test_a_request_that_is_too_long_is_not_sent(self):
        with self.assertRaisesRegex(ValueError, "max_message"):
            self.client.request(describe=messages.DescribeEntities(
                ids=[2**32 - 1] * self.client.limits.max_message))
        self.assertEqual(self.client.step().tick, 1)

    def test_the_lens_and_up_are_as_asked(self):
        self.need_pictures()
        look = {"eye": (0, 1.5, 0), "width": 33, "height": 33, "channels": ("depth", "ids")}
        down = self.client.frame(target=(0, 0, 0), up=(1, 0, 0), near=0.1, far=30, glass="solid",
                                 **look)
        self.assertEqual(down.ids[16, 16], FLOOR)
        self.assertAlmostEqual(down.depth[16, 16], 1.5, places=4)
        self.assertEqual((down.message.camera.near, down.message.camera.far), (0.1, 30))
        self.assertEqual(down.message.glass, messages.GLASS_SOLID)
        self.assertFalse(down.message.shadows)
        self.assertTrue(self.client.frame(eye=(0, 1, 0), forward=(1, 0, 0), shadows=True).message.shadows)
        lens = self.client.frame(forward=(1, 0, 0), intrinsics=(40, 41, 16, 17), **look)
        self.assertEqual(lens.message.intrinsics,
                         messages.Intrinsics(fx=40, fy=41, cx=16, cy=17))
        self.assertEqual(self.client.frame(forward=(1, 0, 0), height_y=2.0, **look).ids[16, 16], WALL)
        rays = self.client.frame(forward=(1, 0, 0), renderer="rays", **look)
        self.assertIn("Embree", rays.renderer)
        self.assertNotEqual(down, lens)

    def test_names_take_an_array_of_ids(self):
        ids = np.array([[WALL, WALL], [COLUMN, WALL]], np.uint32)
        self.assertEqual(self.client.names(ids), {WALL: "wall", COLUMN: "column"})

    def test_a_name_that_has_just_left_enters_again(self):
        for _ in range(3):
            other = self.server.connect()
            self.client.close()
            self.client = other
            self.addCleanup(other.close)
            for _ in range(100):
                try:
                    other.lockstep()
                    break
                except enfilade.ServerError:  # the one before still drives
                    time.sleep(0.01)
            self.assertEqual(other.spawn("ann", at=(0, 0.01, 0)).enter().name, "ann")

    def test_an_error_of_the_server_can_be_pickled(self):
        error = enfilade.ServerError(6, "no", "drive.velocity.x", True)
        again = pickle.loads(pickle.dumps(error))
        self.assertEqual((str(again), again.code, again.field, again.fatal),
                         (str(error), error.code, error.field, True))

    def test_in_free_run_what_has_come_is_taken_without_waiting(self):
        self.client.subscribe(contacts=True, state=True)
        ann = self.client.spawn("ann", at=(0, 0.3, 0))
        self.client.free_run(speed=8)
        contacts, ticks = [], []
        for _ in range(500):
            contacts += list(self.client.contacts())
            ticks += [one.tick for one in self.client.states()]
            if contacts and len(ticks) > 3:
                break
            time.sleep(0.01)
        self.assertTrue(contacts)
        time.sleep(0.2)
        self.client.pause()
        delivered = [one.tick for one in self.client.states()]
        self.assertEqual(len(delivered), 1)
        self.assertGreater(delivered[0], ticks[-1])


class Servers(RoomCase):
    def test_a_server_without_an_owner_is_ended(self):
        pids = [enfilade.serve(self.scene).process.pid for _ in range(2)]
        gc.collect()
        for _ in range(500):
            process._reap()  # of the last thread, which the first may precede by a while
            if not any(one.process.pid in pids for one in process._running):
                break
            time.sleep(0.01)
        self.assertFalse([one.process.pid for one in process._running if one.process.pid in pids])
        self.assertTrue(all(map(gone, pids)))

    def test_an_environment_that_cannot_be_made_leaves_no_server(self):
        before = set(process._running)
        with self.assertRaisesRegex(ValueError, "speed"):
            enfilade.WalkEnv(self.scene, starts=[(0, 0, 0)], channels=(), speed=1e6)
        self.assertLessEqual(process._running, before)

    def test_the_log_is_there_after_the_end(self):
        server = enfilade.serve(self.scene)
        before = server.log()
        self.assertEqual(server.stop(), 0)
        self.assertTrue(server.log().startswith(before))
        self.assertEqual(server.stop(), 0)

    def test_clients_that_do_not_close_let_a_server_go_that_ends(self):
        server = enfilade.serve(self.scene)
        client, asked = server.connect(), []
        self.addCleanup(client.close)
        client.shutdown_send()  # there is nothing to read: it ends nothing
        client.metrics()
        shutdown_send = client.shutdown_send
        client.shutdown_send = lambda: asked.append(shutdown_send())
        self.assertEqual(server.stop(), 0)
        self.assertTrue(asked)
        with self.assertRaises(enfilade.ServerError) as caught:
            client.step()
        self.assertEqual(caught.exception.code, "ERROR_SHUTTING_DOWN")

    def test_a_program_that_is_no_server_is_reported(self):
        with self.assertRaisesRegex(enfilade.StartFailed, "is not an Enfilade server"):
            enfilade.serve(self.scene, program="/bin/echo")

    def test_the_build_of_the_current_folder_is_found(self):
        named, path, here = os.environ.pop("ENFILADE", None), os.environ["PATH"], os.getcwd()
        try:
            os.environ["PATH"] = "/nowhere"
            checkout = self.folder / "checkout"
            (checkout / "build").mkdir(parents=True)
            (checkout / "protocol").mkdir()
            (checkout / "protocol" / "enfilade.proto").touch()
            program = checkout / "build" / "enfilade"
            program.touch(0o755)
            os.chdir(checkout)
            if not (Path(enfilade.__file__).parents[4] / "build" / "enfilade").exists():
                self.assertEqual(process.find_program(), str(program.resolve()))
        finally:
            os.chdir(here)
            os.environ["PATH"] = path
            if named is not None:
                os.environ["ENFILADE"] = named


if __name__ == "__main__":
    unittest.main()
