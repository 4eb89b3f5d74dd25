"""The environments: Gymnasium's API, and the same seed for the same observations."""

import math
import os
import time
import unittest
import unittest.mock

import numpy as np

import enfilade
from room import RoomCase, obj

_STARTS = [(0, 0.01, 0), (-3, 0.01, 2)]


def walk(env, seed, steps):
    """All that is seen on a walk of random actions."""
    results = [env.reset(seed=seed)]
    results += [env.step(env.action_space.sample()) for _ in range(steps)]
    return results


def refused_pictures(env):
    """While it lasts, the pictures of `env` are larger than the server draws."""
    large = enfilade.cameras.CameraRequest(enfilade.Camera("", (60000, 60000)), env._name)
    return unittest.mock.patch.object(env, "cameras", [large])


class Environments(RoomCase):
    def environment(self, **options):
        options = {"starts": _STARTS, "size": (16, 12), **options}
        env = enfilade.WalkEnv(self.scene, **options)
        self.addCleanup(env.close)
        return env

    def assert_same(self, one, other):
        self.assertEqual(one.keys(), other.keys())
        for name in one:
            np.testing.assert_array_equal(one[name], other[name], name)

    def test_the_same_seed_gives_the_same_observations(self):
        self.need_pictures()
        env = self.environment()
        first, again, another = walk(env, 7, 12), walk(env, 7, 12), walk(env, 8, 12)
        for one, other in zip(first, again):
            self.assert_same(one[0], other[0])
            self.assertEqual(one[-1]["state_hash"], other[-1]["state_hash"])
        self.assertNotEqual(first[-1][-1]["state_hash"], another[-1][-1]["state_hash"])

    def test_observations_lie_in_their_space(self):
        self.need_pictures()
        env = self.environment(size=None, goal=(3, 0, 0), cameras=[enfilade.Camera(
            "", (16, 12), ("rgb", "depth", "ids", "class", "thing", "normals", "range"), pitch=0.6)])
        results = walk(env, 1, 5)
        for result in results:
            self.assertTrue(env.observation_space.contains(result[0]))
        for name in ("depth", "range"):
            self.assertTrue(np.isinf(results[0][0][name]).any())  # the sky
            self.assertTrue(np.isfinite(results[0][0][name]).any())
        self.assertEqual(env.render().shape, (12, 16, 3))

    def test_a_step_brings_the_pictures_of_many_cameras_however_late_they_are_read(self):
        self.need_pictures()
        cameras = [enfilade.Camera(f"c{i}", (800, 600), ("rgb",), yaw=0.1 * i) for i in range(16)]
        env = self.environment(size=None, cameras=cameras)
        env.reset(seed=1)
        posted = env._post_step(env._meaning(np.zeros(2)))
        time.sleep(1)  # 23 MB are more than the sockets keep
        seen = env._take_step(posted)[0]
        self.assertTrue(all(seen[f"c{i}_rgb"].any() for i in range(16)))

    def test_more_cameras_than_a_server_keeps_pictures_are_refused(self):
        cameras = [enfilade.Camera(f"c{i}", (8, 8)) for i in range(65)]
        with self.assertRaisesRegex(ValueError, "cameras: .* at most 64 pictures"):
            self.environment(size=None, cameras=cameras)

    def test_who_goes_ahead_comes_to_the_goal(self):
        env = self.environment(starts=[(0, 0.01, 0, 0)], goal=(2, 0, 0), channels=(), discrete=True)
        env.reset(seed=0)
        rewards = []
        for _ in range(100):
            seen, reward, terminated, truncated, info = env.step(1)
            rewards.append(reward)
            if terminated:
                break
        self.assertTrue(terminated)
        self.assertLessEqual(np.hypot(*seen["to_goal"][[0, 2]]), 0.5)
        self.assertAlmostEqual(sum(rewards), seen["position"][0], places=6)

    def test_turning_left_turns_towards_minus_z(self):
        env = self.environment(starts=[(0, 0.01, 0, 0)], channels=(), turn_speed=np.pi / 2,
                               ticks_per_step=60)
        env.reset(seed=0)
        seen = env.step([1, 1])[0]
        np.testing.assert_allclose(seen["heading"], (0, 1), atol=1e-12)
        self.assertLess(seen["position"][2], -1)

    def test_the_wall_stops_the_avatar_and_max_steps_truncate(self):
        env = self.environment(starts=[(4, 0.01, 0, 0)], channels=(), max_steps=12)
        env.reset(seed=0)
        for _ in range(12):
            seen, reward, terminated, truncated, info = env.step([1, 0])
        self.assertEqual(info["stopped_by"], "wall")
        self.assertEqual((terminated, truncated), (False, True))
        self.assertLess(reward, 1e-9)

    def test_a_start_without_room_is_an_error(self):
        env = self.environment(starts=[(0, 0, 6)], channels=())
        with self.assertRaisesRegex(enfilade.OrderFailed, "column"):
            env.reset(seed=0)

    def test_starts_that_are_refused_are_drawn_again(self):
        bad, good = (0, 0, 6), (0, 0.01, 0)
        env, vector = self.environment(starts=[bad, good], channels=()), self.vector(3, starts=[bad, good])
        for seed in range(8):
            self.assertLess(env.reset(seed=seed)[0]["position"][2], 1)
            self.assertLess(vector.reset(seed=seed)[0]["position"][:, 2].max(), 1)
        for one in (env, vector):
            with self.assertRaisesRegex(enfilade.OrderFailed, r"could not spawn at \(0, 0, 6\)"):
                one.reset(seed=1, options={"start": bad})

    def test_options_hold_for_starts_that_are_drawn_again(self):
        env = self.environment(starts=[(0, 0, 6), (0, 0.01, 0)], channels=(), goal=(3, 0, 0))
        for seed in range(8):
            seen, _ = env.reset(seed=seed, options={"goal": (-4, 0, 0)})
            np.testing.assert_allclose(seen["position"] + seen["to_goal"], (-4, 0, 0), atol=1e-9)

    def test_starts_that_are_all_refused_are_counted_with_the_reason(self):
        bad = [(0, 0, 6), (5.1, 0, 0)]
        for env in (self.environment(starts=bad, channels=()), self.vector(2, starts=bad)):
            with self.assertRaisesRegex(enfilade.OrderFailed, r"32 starts were refused; the last: .*\(.*\): ."):
                env.reset(seed=1)

    def test_an_episode_whose_start_is_refused_is_passed_over(self):
        episodes = [enfilade.Episode(start, 0.0, (3.0, 0.0, 0.0), 5.0, name)
                    for name, start in (("bad", (0.0, 0.0, 6.0)), ("good", (0.0, 0.0, 0.0)))]
        env = self.environment(starts=(), episodes=episodes, channels=())
        with self.assertWarnsRegex(UserWarning, r"\(0, 0, 6\).*; the next episode is taken"):
            env.reset(seed=1)
        self.assertEqual(env.episode.id, "good")
        env = self.environment(starts=(), episodes=episodes[:1], channels=())
        with self.assertRaisesRegex(enfilade.OrderFailed, "^the avatar could not spawn"):
            env.reset(seed=1)

    def test_a_vector_of_environments_does_as_each_alone(self):
        vector = enfilade.VectorWalkEnv(self.scene, 2, starts=_STARTS, channels=(), max_steps=3)
        self.addCleanup(vector.close)
        alone = self.environment(channels=(), max_steps=3)
        seen, _ = vector.reset(seed=5)
        expected = alone.reset(seed=6)[0]
        np.testing.assert_array_equal(seen["position"][1], expected["position"])
        for _ in range(3):
            seen, rewards, terminated, truncated, infos = vector.step([[1, 0.5]] * 2)
            expected = alone.step([1, 0.5])
            np.testing.assert_array_equal(seen["position"][1], expected[0]["position"])
        self.assertTrue(truncated.all())
        seen, rewards, terminated, truncated, infos = vector.step([[1, 0]] * 2)
        np.testing.assert_array_equal(rewards, [0, 0])
        np.testing.assert_array_equal(infos["tick"], [1, 1])

    def vector(self, count, is_packing=True, **options):
        default = {"starts": _STARTS} if "cameras" in options else {"starts": _STARTS, "channels": ()}
        vector = enfilade.VectorWalkEnv(address=self.server.address, num_envs=count, **{**default, **options})
        self.addCleanup(vector.close)
        self.assertEqual(vector._is_packing, [True] * count)
        if not is_packing:
            vector._is_packing, vector._plain = [False] * count, None  # as with a server without packed_steps
        return vector

    def assert_same_steps(self, count, steps, actions, **options):
        """Packed steps are as those in messages. Returns the infos of the packed ones."""
        both = [self.vector(count, is_packing, **options) for is_packing in (True, False)]
        (seen, _), (expected, _) = (one.reset(seed=3) for one in both)
        self.assert_same(seen, expected)
        infos = []
        for _ in range(steps):
            action = actions()
            (seen, *packed), (expected, *others) = (one.step(action) for one in both)
            self.assert_same(seen, expected)
            for one, other in zip(packed[:-1], others[:-1]):
                np.testing.assert_array_equal(one, other)
            self.assertEqual({name: list(one) for name, one in packed[-1].items()},
                             {name: list(one) for name, one in others[-1].items()})
            infos.append(packed[-1])
        return infos

    def test_packed_steps_are_as_steps_in_messages(self):
        random = np.random.default_rng(2)
        infos = self.assert_same_steps(3, 40, lambda: random.uniform((0.5, -0.3), 1, (3, 2)),
                                       starts=[(3.5, 0, 0, 0), (-3, 0, 2)], goal=(4.4, 0, 1), max_steps=15)
        self.assertIn("wall", {one for info in infos for one in info["stopped_by"]})
        self.assertTrue(any(one for info in infos for one in info["contacts"]))
        self.assertIn(1, {tick for info in infos for tick in info["tick"]}, "an episode ended")

    def test_packed_steps_come_with_pictures_and_distances(self):
        self.need_pictures()
        self.assert_same_steps(2, 12, lambda: [1, 3], goals=[(-4, 0, 0)], discrete=True, max_steps=7,
                               cameras=[enfilade.Camera("a", (16, 12), ahead=0.1),
                                        enfilade.Camera("b", (8, 8), ("ids", "flow"), yaw=1.0)])

    def test_pictures_without_a_copy_are_those_with_one(self):
        self.need_pictures()
        cameras = [enfilade.Camera("a", (16, 12), ("rgb", "depth")), enfilade.Camera("b", (8, 8), ("ids",))]
        options = {"goals": [(-4, 0, 0)], "discrete": True, "max_steps": 7, "cameras": cameras}
        copies, views = self.vector(3, **options), self.vector(3, copy=False, **options)
        self.assert_same(views.reset(seed=3)[0], copies.reset(seed=3)[0])
        last = {}
        for number in range(1, 20):
            views.envs[0].client.navigation().snap((0, 0, 0))  # a round without pictures
            before = {name: one.copy() for name, one in last.items()}
            seen, expected = views.step([1, 3, 2])[0], copies.step([1, 3, 2])[0]
            self.assert_same(seen, expected)
            self.assert_same(last, before)
            last = {} if number % 8 == 7 else seen  # a restart may take more rounds
            is_restart = number % 8 == 0
            for name in ("a_rgb", "b_ids"):
                self.assertEqual(seen[name].flags.writeable, is_restart, f"{name} in step {number}")
            self.assertTrue(seen["a_depth"].flags.writeable)
        world = views.envs[1].client.world
        self.client.drop_world(world)
        with self.assertRaisesRegex(enfilade.ServerError, "environment 1"):
            views.step([1, 3, 2])

    def test_an_avatar_that_falls_ends_its_episode_in_a_packed_step(self):
        infos = self.assert_same_steps(2, 60, lambda: np.array([[1, 0], [0, 0]], float),
                                       starts=[(9, 0, 9, 0)])
        falls = [info["fell"] for info in infos if "fell" in info]
        self.assertGreater(len(falls), 0)
        self.assertEqual(list(falls[0]), [True, None])

    def test_a_world_that_is_dropped_fails_its_packed_step_alone(self):
        vector = self.vector(2)
        vector.reset(seed=1)
        self.client.drop_world(vector.envs[0].client.world)
        with self.assertRaisesRegex(enfilade.ServerError, "environment 0"):
            vector.step(np.ones((2, 2)))
        self.assertGreater(vector.envs[1]._steps, 0)

    def test_after_a_refused_picture_an_environment_asks_for_a_reset(self):
        self.need_pictures()
        env = self.environment(goals=[(-4, 0, 0)], starts=[(0, 0.01, 0)])
        expected = env.reset(seed=1)
        with refused_pictures(env), self.assertRaises(enfilade.ServerError):
            env.step((1, 0))
        with self.assertRaisesRegex(RuntimeError, "call reset"):
            env.step((1, 0))
        self.assertIsNone(env.render())
        again = env.reset(seed=1)
        self.assert_same(again[0], expected[0])
        self.assertEqual(again[1]["state_hash"], expected[1]["state_hash"])
        env.step((1, 0))

    def test_a_refused_picture_restarts_one_environment_of_a_vector(self):
        self.need_pictures()
        for is_packing in (True, False):
            vector = self.vector(3, is_packing, cameras=[enfilade.Camera("", (16, 12))])
            vector.reset(seed=1)
            with refused_pictures(vector.envs[1]), self.assertWarnsRegex(UserWarning, "environment 1"):
                *_, truncated, infos = vector.step(np.ones((3, 2)))
            self.assertEqual(list(truncated), [False, True, False])
            self.assertEqual(list(infos["_error"]), [False, True, False])
            *_, infos = vector.step(np.ones((3, 2)))
            self.assertEqual(list(infos["tick"]), [13, 1, 13])

    def test_an_interrupted_packed_step_leaves_the_environments_usable(self):
        vector = self.vector(3, starts=[(4, 0, 0, 0)])
        vector.reset(seed=1)
        for interrupted in range(3):
            for step in range(6):
                vector.step(np.ones((3, 2)))
            with unittest.mock.patch.object(vector.envs[interrupted], "_contacts_of_step",
                                            side_effect=KeyboardInterrupt):
                with self.assertRaises(KeyboardInterrupt):
                    vector.step(np.ones((3, 2)))
            vector.reset(seed=1)

    def test_a_reward_that_is_set_on_an_environment_counts_in_its_vector(self):
        vector = self.vector(3, starts=[(4, 0, 0, 0)])
        vector.reset(seed=1)
        vector.step(np.ones((3, 2)))
        vector.envs[1].reward = lambda *given: 42.0
        _, rewards, *_ = vector.step(np.ones((3, 2)))
        self.assertEqual(rewards[1], 42)
        self.assertNotIn(42, rewards[[0, 2]])

    def test_a_kept_request_replaces_its_numbers(self):
        m = enfilade.messages
        def drive(x, z):
            return m.ClientMessage(command=m.Command(avatar="ann", drive=m.Drive(
                velocity=m.Vec3(x=x, z=z))))
        request = drive(0, 0)
        velocity = request.command.drive.velocity
        kept = enfilade.kept_request.KeptRequest(request, (velocity, "x"), (velocity, "z"))
        step = enfilade.kept_request.KeptRequest(m.ClientMessage(step=m.Step(ticks=700)))
        for x, z in ((0.25, -7.0), (0.0, 1e300)):
            expected = drive(x, z)
            kept.set(x, z)
            kept.request_id = expected.request_id = 300
            self.assertEqual(m.ClientMessage.FromString(kept.SerializeToString()), expected)
        joined = enfilade.kept_request.KeptRequest.joined(b"", b"\x12", [step, kept])
        joined.set(3.0, 4.0)
        world = m.StepMany.World.FromString(bytes(joined.body))
        self.assertEqual(list(world.requests), [m.ClientMessage(step=m.Step(ticks=700)), drive(3.0, 4.0)])

    def test_a_server_with_tokens_takes_them_from_environments(self):
        tokens = self.folder / "tokens"
        tokens.write_text("admin keeper-0123456789\n")
        with enfilade.serve(self.scene, "--token-file", str(tokens)) as server:
            options = {"address": server.address, "starts": _STARTS, "channels": ()}
            with self.assertRaises(enfilade.ServerError):
                enfilade.VectorWalkEnv(num_envs=2, **options)
            vector = enfilade.VectorWalkEnv(num_envs=2, token="keeper-0123456789", **options)
            vector.reset(seed=1)
            vector.close()
            env = enfilade.WalkEnv(token="keeper-0123456789", **options)
            env.reset(seed=1)
            env.close()

    def tick_by_tick(self, env, start, actions, ticks):
        """After each action: whether the avatar met the wall or the column in one of `ticks`, and the feet."""
        env.reset(options={"start": start})
        for ahead, turn in actions:
            infos = [env.step((ahead, 0 if tick else turn))[-1] for tick in range(ticks)]
            yield any(one["stopped_by"] or any(contact.kind == "begin" and contact.b_name != "floor"
                                               for contact in one["contacts"])
                      for one in infos), env._feet

    def grazing_walks(self, count, steps):
        """Starts that look past the column or the ends of the wall, and actions that turn."""
        random = np.random.default_rng(4)
        for _ in range(count):
            x, z = ((0, 6), (5.1, 4), (5.1, -4))[random.integers(3)]
            angle, aside = random.uniform(0, 2 * math.pi), random.uniform(-0.6, 0.6)
            ahead = np.array((math.cos(angle), -math.sin(angle)))
            at = (x, z) - ahead * random.uniform(0.75, 1.1) + aside * ahead[::-1] * (1, -1)
            start = (at[0], 0.01, at[1], math.degrees(angle))
            yield start, random.uniform((0.5, -1), 1, (steps, 2))

    def test_a_collision_in_any_tick_of_a_step_counts(self):
        ticks, count, steps = 30, 4, 4
        alone = self.environment(channels=(), ticks_per_step=1, turn_speed=ticks * math.pi / 2)
        vectors = [self.vector(count, is_packing, ticks_per_step=ticks) for is_packing in (True, False)]
        walks, missed, free, left = list(self.grazing_walks(48, steps)), 0, 0, 0
        for first in range(0, len(walks), count):
            some, stopped = walks[first:first + count], [""] * count
            try:
                truth = [list(self.tick_by_tick(alone, *walk, ticks)) for walk in some]
            except enfilade.OrderFailed:
                continue  # a start in an obstacle
            for vector in vectors:
                for env, (start, _) in zip(vector.envs, some):
                    env.starts = [start]
                vector.reset()
                for step in range(steps):
                    seen, *_, infos = vector.step(np.array([actions[step] for _, actions in some]))
                    for i in range(count):
                        collided, feet = truth[i][step]
                        np.testing.assert_allclose(seen["position"][i], feet, atol=1e-9)
                        self.assertEqual(infos["collided"][i], collided, (first + i, step))
                        missed += collided and not infos["stopped_by"][i]
                        free += not collided
                        left += collided and not infos["stopped_by"][i] and bool(stopped[i]) and not any(
                            one.kind in ("begin", "blocked") for one in infos["contacts"][i])
                    stopped = infos["stopped_by"]
        self.assertGreater(missed, 20)  # by a look at the last tick of each step
        self.assertGreater(free, 20)
        self.assertGreater(left, 0)  # stopped in the first ticks only, after a step that ended there

    def test_a_ramp_after_a_collision_is_none(self):
        scene = self.folder / "ramp.obj"
        scene.write_text(obj() + "o ramp\n" + "".join(
            f"v {x} {y} {z}\n" for x, y in ((4.4, 0), (0, 0), (0, 1)) for z in (-3, 3)) +
            "".join("f " + " ".join(str(25 + i) for i in face) + "\n" for face in
                    ((0, 2, 4), (1, 5, 3), (0, 4, 5, 1), (2, 3, 5, 4), (0, 1, 3, 2))))
        env = enfilade.WalkEnv(scene, starts=[(4.65, 0.05, 0, 0)], channels=(), ticks_per_step=30,
                               turn_speed=2 * math.pi)
        self.addCleanup(env.close)
        env.reset()
        self.assertTrue(env.step((1, 0))[-1]["stopped_by"].startswith("wall"))
        infos = [env.step((1, 1))[-1], env.step((1, 0))[-1]]  # away from the wall, up the ramp
        self.assertGreater(env._feet[1], 0.2)
        self.assertEqual([info["collided"] for info in infos], [False, False])

    def test_stairs_are_no_collision(self):
        with enfilade.serve(os.environ["ENFILADE_BUILDING"]) as server:
            env = enfilade.WalkEnv(address=server.address, starts=[(49, 0.01, -4, 0)], channels=(),
                                   ticks_per_step=30)
            env.reset()
            infos = [env.step((1, 0))[-1] for _ in range(6)]
            self.assertGreater(env._feet[1], 1.5)
            env.close()
        self.assertTrue(any("tread" in contact.b_name for info in infos for contact in info["contacts"]))
        self.assertEqual({info["collided"] for info in infos}, {False})

    def test_a_failed_start_is_reported_with_number_and_position(self):
        vector = enfilade.VectorWalkEnv(
            address=self.server.address, num_envs=3,
            make=lambda number, client: enfilade.WalkEnv(
                client=client, channels=(), starts=[(0, 0, 6) if number == 1 else _STARTS[0]]))
        self.addCleanup(vector.close)
        with self.assertWarnsRegex(UserWarning, r"environment 1: .*\(0, 0, 6\).*column") as warned:
            _, infos = vector.reset(seed=1)
        self.assertEqual(warned.filename, __file__)
        self.assertEqual(infos["error"][1], str(warned.warning))

    def test_a_refused_start_leaves_the_other_environments_usable(self):
        vector = self.vector(3)
        vector.envs[1].starts = [(0, 0, 6)]
        with self.assertWarnsRegex(UserWarning, "^environment 1: "):
            _, infos = vector.reset(seed=1)
        self.assertEqual(list(infos["tick"]), [1, None, 1])
        with self.assertWarnsRegex(UserWarning, "^environment 1: "):
            seen, rewards, terminated, truncated, infos = vector.step(np.zeros((3, 2)))
        self.assertEqual(list(infos["tick"]), [7, None, 7])
        self.assertEqual((rewards[1], list(terminated), list(truncated)), (0, [False] * 3, [False, True, False]))
        self.assertTrue(all(not one[1].any() for one in seen.values()))
        vector.envs[1].starts = _STARTS
        seen, *_, infos = vector.step(np.zeros((3, 2)))
        self.assertEqual(list(infos["tick"]), [13, 1, 13])
        for env in vector.envs:
            env.starts = [(0, 0, 6)]
        with self.assertRaisesRegex(enfilade.OrderFailed, "^environment 0: "):  # none remains
            vector.reset(seed=1)
        with self.assertRaisesRegex(RuntimeError, "call reset"):
            vector.step(np.zeros((3, 2)))
        for env in vector.envs:
            env.starts = _STARTS
        vector.reset(seed=1)
        self.assertTrue(vector.single_observation_space.contains({name: one[1] for name, one in seen.items()}))
        with self.assertRaisesRegex(ValueError, "options"):
            vector.reset(options={"goal": (0, 0, 0)})
        with self.assertRaisesRegex(RuntimeError, "call reset"):  # none has begun
            vector.step(np.zeros((3, 2)))

    def test_a_vector_has_worlds_of_one_server_and_leaves_none(self):
        vector = enfilade.VectorWalkEnv(address=self.server.address, num_envs=3, starts=_STARTS,
                                        size=(16, 12), channels=())
        self.addCleanup(vector.close)
        self.assertEqual(len(self.client.worlds()), 4)
        self.assertEqual(vector.num_envs, 3)
        self.assertEqual(vector.observation_space["position"].shape, (3, 3))
        self.assertEqual(vector.single_action_space.shape, (2,))
        self.assertIn("autoreset_mode", vector.metadata)
        one, _ = vector.reset(seed=[4, 4, None])
        np.testing.assert_array_equal(one["position"][0], one["position"][1])
        hashes = vector.step([[1, 0]] * 3)[4]["state_hash"]
        self.assertEqual(hashes[0], hashes[1])
        self.assertEqual(self.client.step().tick, 1)  # no other client stepped
        vector.close()
        for _ in range(1000):
            if list(self.client.worlds()) == ["main"]:
                return
            time.sleep(0.01)
        self.fail(f"worlds were left: {self.client.worlds()}")

    def test_arguments_that_are_none_are_named(self):
        for name, value in (("size", (10,)), ("size", (12.5, 5)), ("size", (0, 0)), ("size", (99999, 9)),
                            ("goal_radius", math.nan), ("max_steps", 0), ("ticks_per_step", 0),
                            ("ticks_per_step", "a"), ("radius", -1), ("radius", "a"), ("height", 11),
                            ("eye_height", math.inf), ("speed", "a"), ("turn_speed", -1), ("fov_y", 4)):
            with self.assertRaisesRegex(ValueError, name):
                enfilade.WalkEnv(address=self.server.address, starts=_STARTS, **{name: value})

    def test_arguments_of_one_camera_are_refused_next_to_cameras(self):
        camera = enfilade.Camera("a")
        for options, name in (({"size": (8, 8)}, "size"), ({"channels": ()}, "channels"), ({"pitch": 0.0}, "pitch"),
                              ({"fov_y": 1.0}, "fov_y"), ({"eye_height": 1.0}, "eye_height"),
                              ({"cameras": [camera, enfilade.Camera("a", yaw=1.0)]}, "cameras: .*'a'"),
                              ({"cameras": [5]}, r"cameras\[0\]"), ({"cameras": camera}, "cameras")):
            with self.assertRaisesRegex(ValueError, name):
                enfilade.WalkEnv(address=self.server.address, starts=_STARTS, **{"cameras": [camera], **options})
        for name, value in (("name", 5), ("yaw", math.nan), ("ahead", math.inf), ("left", "a"), ("fov_y", 0),
                            ("lens", "pinhole"), ("depth_noise", -1), ("depth_noise", {"seeds": 1}),
                            ("distortion", (0.1,))):
            with self.assertRaisesRegex(ValueError, "lens" if name == "distortion" else name):
                enfilade.Camera(**{"name": "a", name: value})
        for name, options in (("flow", {"channels": ("flow",), "ahead": 0.1}),
                              ("flow", {"channels": ("flow",), "lens": "fisheye"}),
                              ("fov_y", {"lens": "fisheye", "fov_y": 7}),
                              ("lens", {"lens": "equirectangular", "fov_y": 1}),
                              ("depth_noise", {"depth_noise": 1, "channels": ("rgb",)})):
            with self.assertRaisesRegex(ValueError, name):
                enfilade.Camera("a", **options)

    def test_cameras_have_the_lens_and_the_noise_of_frame(self):
        self.need_pictures()
        looks = {"plain": {}, "fisheye": {"lens": "fisheye", "fov_y": 4.0, "distortion": (0.01, 0.002)},
                 "round": {"lens": "equirectangular"}, "noisy": {"depth_noise": {"seed": 5, "scale": 2.0}}}
        for options in ({}, {"pitch": 0.3}):
            env = self.environment(size=None, starts=[(2, 0.01, 0, 30)], cameras=[
                enfilade.Camera(name, (32, 24), ("depth", "rgb"), **look, **options)
                for name, look in looks.items()])
            env.reset(seed=1)
            seen, *_ = env.step((0.5, 0.2))
            self.assertTrue(env.observation_space.contains(seen))
            pitch, (cosine, sine) = options.get("pitch", 0.0), seen["heading"]
            across = math.cos(pitch)
            for name, look in looks.items():
                frame = env.client.frame("walker", forward=(across * cosine, math.sin(pitch), -across * sine),
                                         width=32, height=24, channels=("depth", "rgb"),
                                         **({"fov_y": 1.2} if "lens" not in look else {}), **look)
                depth = np.where(np.isnan(frame.depth), np.inf, frame.depth)
                np.testing.assert_array_equal(seen[name + "_depth"], depth, name)
                np.testing.assert_array_equal(seen[name + "_rgb"], frame.rgb, name)
        self.assertLess(seen["round_depth"].min(), 0)
        self.assertFalse(np.array_equal(seen["noisy_depth"], seen["plain_depth"]))
        env._rgb = None
        np.testing.assert_array_equal(env.render(), seen["plain_rgb"])

    def test_kept_requests_have_the_numbers_that_are_set(self):
        messages = enfilade.messages
        one = messages.ClientMessage(frame=messages.FrameRequest(width=8))
        numbers = [(one.frame.flow_forward, "x"), (one.frame, "flow_from"), (one.frame.flow_forward, "z")]
        kept = enfilade.kept_request.KeptRequest(one, *numbers)
        for whole in (0, 1, 127, 128, 2**32, 2**63, 2**64 - 1):
            kept.set(0.5, whole, -1e300)
            seen = messages.ClientMessage.FromString(bytes(kept.body)).frame
            self.assertEqual((seen.width, seen.flow_from, seen.flow_forward.x, seen.flow_forward.z),
                             (8, whole, 0.5, -1e300))
            world = enfilade.kept_request.KeptRequest.joined(b"", b"\x12", [kept, kept])  # World.requests
            world.set(1.5, 7, 2.5, 0.5, whole, 3.5)
            first, second = messages.StepMany.World.FromString(bytes(world.body)).requests
            self.assertEqual((first.frame.flow_from, second.frame.flow_from), (7, whole))
            self.assertEqual((first.frame.flow_forward.z, second.frame.flow_forward.z), (2.5, 3.5))

    def test_flow_begins_at_the_last_observation(self):
        self.need_pictures()
        env = self.environment(size=None, starts=[(2, 0.01, 0, 30)], ticks_per_step=4, cameras=[
            enfilade.Camera("", (32, 24), ("ids", "flow"), pitch=0.2, yaw=0.5)])
        def look(cosine, sine):
            yaw = math.atan2(sine, cosine) + 0.5
            return math.cos(0.2) * math.cos(yaw), math.sin(0.2), -math.cos(0.2) * math.sin(yaw)
        for _ in range(2):
            before, info = env.reset(seed=1)
            np.testing.assert_allclose(before["flow"][before["ids"] != 0], 0, atol=1e-4)
            for action in ((1, 0.5), (0.5, -1), (1, 0)):
                tick = info["tick"]
                seen, *_, info = env.step(action)
                self.assertEqual(info["tick"], tick + 4)
                flow = env.client.frame("walker", forward=look(*seen["heading"]), width=32, height=24, fov_y=1.2,
                                        channels=("flow",), flow_from=tick, flow_forward=look(*before["heading"])).flow
                known = ~np.isnan(flow)
                self.assertGreater(known.sum(), 100)
                np.testing.assert_allclose(seen["flow"][known], flow[known], atol=1e-4)
                self.assertTrue(np.isinf(seen["flow"][~known]).all())
                self.assertGreater(np.abs(flow[known]).max(), 0.5)
                self.assertTrue(env.observation_space.contains(seen))
                before = seen
        with self.assertRaisesRegex(ValueError, "ticks_per_step: at most 31"):
            self.environment(size=None, ticks_per_step=32, cameras=[enfilade.Camera("", (8, 8), ("flow",))])

    def test_actions_that_are_no_sequence_are_named(self):
        vector = enfilade.VectorWalkEnv(address=self.server.address, num_envs=2, starts=_STARTS, channels=())
        self.addCleanup(vector.close)
        vector.reset(seed=1)
        with self.assertRaisesRegex(ValueError, "actions: give 2"):
            vector.step(5)
        vector.step([(0, 0)] * 2)

    def test_a_vector_larger_than_the_server_takes_is_refused(self):
        with self.assertRaisesRegex(ValueError, "num_envs"):
            enfilade.VectorWalkEnv(address=self.server.address, num_envs=1000, starts=_STARTS)
        self.assertEqual(list(self.client.worlds()), ["main"])


if __name__ == "__main__":
    unittest.main()
