"""Point navigation: episodes anywhere, geodesic measures, and habitat-lab's episode files."""

import json
import math
import tempfile
import unittest
import warnings
from pathlib import Path
from unittest import mock

import numpy as np

import enfilade
from room import RoomCase


def follow(env, path):
    """Walks along a path by turning to each point in turn; returns the last result of step()."""
    seconds = env.ticks_per_step * env.client.tick_seconds
    at, result = 1, None
    while result is None or not (result[2] or result[3]):
        feet = np.array(env._feet)
        while at + 1 < len(path) and math.hypot(*(path[at] - feet)[[0, 2]]) < 0.02:
            at += 1
        x, _, z = path[at] - feet
        angle = math.remainder(math.atan2(-z, x) - env._heading, math.tau)
        turn = angle / (env.turn_speed * seconds)
        ahead = math.hypot(x, z) / (env.speed * seconds) if abs(turn) <= 1 else 0.0
        result = env.step((ahead, turn))
    return result


class PointNavigation(RoomCase):
    def environment(self, **options):
        options = {"starts": "anywhere", "goals": "anywhere", "channels": (), "max_steps": 2000, **options}
        env = enfilade.WalkEnv(self.scene, **options)
        self.addCleanup(env.close)
        return env

    def test_a_follower_reaches_every_goal_on_the_shortest_path(self):
        env = self.environment(radius=0.2, height=1.5, goal_radius=0.2)
        for seed in range(5):
            seen, info = env.reset(seed=seed)
            episode = env.episode
            self.assertAlmostEqual(info["geodesic_distance"], episode.geodesic_distance)
            self.assertGreaterEqual(episode.geodesic_distance, 1)
            self.assertAlmostEqual(seen["goal_polar"][0], math.hypot(*seen["to_goal"][[0, 2]]))
            path = env.navigation.path(episode.start, episode.goal)
            _, _, terminated, _, info = follow(env, path.points)
            self.assertTrue(terminated)
            self.assertTrue(info["success"])
            self.assertGreater(info["spl"], 0.97)
            self.assertLessEqual(info["spl"], 1)
            self.assertLessEqual(info["geodesic_distance"], 0.2)

    def test_kept_paths_are_about_as_short_as_those_of_a_new_search(self):
        env = self.environment(starts=[(2, 0, 0, 0)], goals=[(8, 0, 0)])
        env.reset(seed=1)
        env.action_space.seed(1)
        for _ in range(60):
            info = env.step(env.action_space.sample())[4]
            length = env.navigation.geodesic_distance(env.avatar, (8, 0, 0))
            self.assertAlmostEqual(info["geodesic_distance"], length, delta=0.02 * length)
        self.assertTrue(env._distance_query()[0].navigation.path.keep)
        kept = env.navigation.path(env.avatar, (8, 0, 0), keep=True)
        self.assertEqual(kept.length, info["geodesic_distance"])
        with self.assertRaises(enfilade.ServerError) as refused:
            env.navigation.path((2, 0, 0), (8, 0, 0), keep=True)
        self.assertIn("path.keep", str(refused.exception))

    def test_a_path_is_not_kept_over_a_reset(self):
        env = self.environment(starts=[(2, 0, 0, 0)], goals=[(8, 0, 0)])
        distances = []
        for _ in range(2):
            env.reset(seed=1)
            env.action_space.seed(1)
            distances.append([env.step(env.action_space.sample())[4]["geodesic_distance"] for _ in range(40)])
        self.assertEqual(*distances)
        self.assertGreater(len(set(distances[0])), 20)

    def test_rewards_add_up_to_the_geodesic_progress(self):
        env = self.environment(starts=[(2, 0, 0, 0)], goals=[(8, 0, 0)])
        _, info = env.reset(seed=1)
        first = info["geodesic_distance"]
        self.assertGreater(first, 10)  # around the wall
        rewards, collided = 0.0, False
        for _ in range(30):
            _, reward, _, _, info = env.step((1, 0))
            rewards += reward
            collided = collided or info["collided"]
        self.assertAlmostEqual(rewards, first - info["geodesic_distance"], places=9)
        self.assertTrue(collided)  # straight into the wall
        self.assertFalse(info["success"])
        self.assertEqual(info["spl"], 0)

    def test_the_angle_to_the_goal_is_positive_to_the_left(self):
        env = self.environment(starts=[(0, 0, 0, 0)], goals=[(0, 0, -3)], min_distance=0.5)
        seen, _ = env.reset(seed=0)
        np.testing.assert_allclose(seen["goal_polar"], [3, math.pi / 2], atol=1e-2)
        seen, *_ = env.step((0, 1))
        self.assertLess(seen["goal_polar"][1], math.pi / 2)
        self.assertTrue(env.observation_space.contains(seen))

    def test_the_same_seed_gives_the_same_episode_and_options_replace_its_ends(self):
        env = self.environment()
        env.reset(seed=3)
        first = env.episode
        env.reset(seed=4)
        self.assertNotEqual(env.episode, first)
        env.reset(seed=3)
        self.assertEqual(env.episode, first)
        env.reset(options={"start": (2, 0, 0, 90), "goal": (8, 0, 0)})
        self.assertEqual((env.episode.start, env.episode.facing), ((2, 0, 0), 90))

    def test_a_new_episode_is_a_hook(self):
        class Fixed(enfilade.WalkEnv):
            def new_episode(self):
                return enfilade.Episode((2.0, 0.0, 0.0), 0.0, (4.0, 0.0, 0.0), 2.0)
        env = Fixed(self.scene, starts="anywhere", goals="anywhere", channels=())
        self.addCleanup(env.close)
        _, info = env.reset(seed=1)
        self.assertEqual(info["geodesic_distance"], 2)

    def test_episode_files_are_those_of_habitat_lab(self):
        env = self.environment()
        env.reset(seed=1)
        with tempfile.TemporaryDirectory() as folder:
            for name in ("episodes.json", "episodes.json.gz"):
                file = Path(folder) / name
                enfilade.write_episodes(file, [env.episode], "room.obj")
                (read,) = enfilade.read_episodes(file)
                np.testing.assert_allclose(read.start, env.episode.start)
                np.testing.assert_allclose(read.goal, env.episode.goal)
                self.assertAlmostEqual(math.remainder(read.facing - env.episode.facing, 360), 0, places=9)
                self.assertEqual(read.geodesic_distance, env.episode.geodesic_distance)
            one = json.loads((Path(folder) / "episodes.json").read_text())["episodes"][0]
            one["start_rotation"] = [0, 0, 0, 1]  # habitat's agent looks along -Z
            (Path(folder) / "north.json").write_text(json.dumps({"episodes": [one]}))
            self.assertAlmostEqual(enfilade.read_episodes(Path(folder) / "north.json")[0].facing, 90)
            (Path(folder) / "bad.json").write_text('{"episodes":[{}]}')
            with self.assertRaises(ValueError):
                enfilade.read_episodes(Path(folder) / "bad.json")
        played = self.environment(goals=None, starts=(), episodes=[read])
        played.reset(seed=1)
        self.assertEqual(played.episode, read)

    def test_who_falls_out_of_the_scene_ends_the_episode(self):
        env = self.environment(starts=[(9, 0, 9, 0)], goals=[(0, 0, 0)], speed=5.0)
        before, _ = env.reset(seed=0)
        for _ in range(200):
            seen, reward, terminated, _, info = env.step((1, 0))
            if terminated:
                break
        self.assertTrue(terminated)
        self.assertTrue(info["fell"])
        self.assertFalse(info["success"])
        self.assertEqual(seen.keys(), before.keys())
        env.reset(seed=0)
        env.step((0, 0))

    def test_several_environments_run_episodes(self):
        envs = enfilade.VectorWalkEnv(self.scene, 3, starts="anywhere", goals="anywhere", channels=())
        self.addCleanup(envs.close)
        envs.reset(seed=1)
        _, rewards, _, _, infos = envs.step(np.zeros((3, 2)))
        np.testing.assert_allclose(rewards, 0, atol=1e-6)
        self.assertTrue(all(distance >= 0.9 for distance in infos["geodesic_distance"]))

    def test_an_episode_without_its_distance_is_measured(self):
        for given in (math.nan, math.inf):
            env = self.environment(goals=None, starts=(), episodes=[
                enfilade.Episode((2, 0, 0), 0, (8, 0, 0), given)])
            _, info = env.reset(seed=1)
            self.assertAlmostEqual(info["geodesic_distance"],
                                   env.navigation.geodesic_distance((2, 0, 0), (8, 0, 0)))
            _, reward, *_, info = env.step((0, 0))
            self.assertAlmostEqual(reward, 0, places=6)
            self.assertEqual(reward, info["progress"])
            measured = info["geodesic_distance"]
            with mock.patch.object(env.navigation, "query", side_effect=AssertionError("it is known")):
                self.assertEqual(env._post_reset(2, {}) and env.episode.geodesic_distance, measured)
        env = self.environment(goals=None, starts=(), episodes=[
            enfilade.Episode((2, 0, 0), 0, (5.1, 3.1, 0), math.nan, "to the wall")])
        with self.assertRaisesRegex(enfilade.EnfiladeError, "'to the wall': no path leads .*: .+"):
            env.reset(seed=1)

    def test_an_episode_whose_goal_no_path_reaches_is_passed_over_with_a_warning(self):
        far = enfilade.Episode((2.0, 0.0, 0.0), 0.0, (1000.0, 0.0, 0.0), 998.0, "far")
        near = enfilade.Episode((2.0, 0.0, 0.0), 0.0, (8.0, 0.0, 0.0), 11.0, "near")
        env = self.environment(goals=None, starts=(), episodes=[far, near])
        with self.assertWarnsRegex(UserWarning, "'far': no path leads .*: .+; the next episode is taken") as warned:
            _, info = env.reset(seed=1)
        self.assertEqual(warned.filename, __file__)
        self.assertEqual(env.episode, near)
        # The file's distance is another agent's: that of this one counts, and the first reward does not jump.
        self.assertAlmostEqual(info["geodesic_distance"], env.navigation.geodesic_distance((2, 0, 0), (8, 0, 0)))
        _, reward, *_, stepped = env.step((0, 0))
        self.assertAlmostEqual(reward, info["geodesic_distance"] - stepped["geodesic_distance"], places=9)
        self.assertLess(abs(reward), 0.3)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            vector = enfilade.VectorWalkEnv(self.scene, 3, episodes=[far, near], channels=())
            self.addCleanup(vector.close)
            vector.reset(seed=1)
        self.assertEqual([one.episode for one in vector.envs], [near] * 3)
        env = self.environment(goals=None, starts=(), episodes=[far])
        with self.assertRaisesRegex(enfilade.EnfiladeError, "^episode 'far': no path leads .*: .+"):
            env.reset(seed=1)
        with self.assertRaisesRegex(RuntimeError, "call reset"):
            env.step((1, 0))

    def test_an_episode_of_a_hook_is_not_played_without_a_path(self):
        class Far(enfilade.WalkEnv):
            def new_episode(self):
                return enfilade.Episode((2.0, 0.0, 0.0), 0.0, (1000.0, 0.0, 0.0), 998.0, "far")
        env = Far(self.scene, starts="anywhere", goals="anywhere", channels=())
        self.addCleanup(env.close)
        with self.assertRaisesRegex(enfilade.EnfiladeError, "'far': no path leads"):
            env.reset(seed=1)

    def test_an_episode_that_is_not_drawn_leaves_the_other_environments_usable(self):
        vector = enfilade.VectorWalkEnv(address=self.server.address, num_envs=2, starts="anywhere", goals="anywhere",
                                        channels=())
        self.addCleanup(vector.close)
        vector.envs[1].min_distance = 1000
        with self.assertWarnsRegex(UserWarning, "^environment 1: no path of 1000 to inf m was found"):
            _, infos = vector.reset(seed=1)
        self.assertEqual(list(infos["tick"]), [1, None])
        with self.assertWarnsRegex(UserWarning, "^environment 1: no path"):
            _, _, _, truncated, infos = vector.step(np.zeros((2, 2)))
        self.assertEqual((list(infos["tick"]), list(truncated)), ([7, None], [False, True]))
        vector.envs[1].min_distance = 1
        *_, infos = vector.step(np.zeros((2, 2)))
        self.assertEqual(list(infos["tick"]), [13, 1])
        for env in vector.envs:
            env.min_distance = 1000
        with self.assertRaisesRegex(enfilade.EpisodeNotFound, "^environment 0: no path"):
            vector.reset(seed=1)

    def test_after_a_reset_that_failed_on_its_options_no_step_counts(self):
        env = self.environment(starts=[(2, 0, 0, 0)], goals=[(4, 0, 0)])
        for options in ({"starts": (0, 0, 0)}, {"goal": (0, 0)}, {"start": 5}, {"goal": (1000, 0, 0)}):
            env.reset(seed=1)
            env.step((0, 1))
            with self.assertRaises((ValueError, enfilade.EnfiladeError)):
                env.reset(options=options)
            with self.assertRaisesRegex(RuntimeError, "call reset"):
                env.step((1, 0))

    def test_meshes_are_there_before_environments_wait_for_each_other(self):
        shown, size = [], {"radius": 0.23, "height": 1.61}
        vector = enfilade.VectorWalkEnv(address=self.server.address, num_envs=2, starts="anywhere",
                                        channels=(), **size)
        self.addCleanup(vector.close)
        with self.server.connect(world=vector.envs[0].client.world) as client:
            client.navigation(**size, progress=shown.append).snap((0, 0, 0))
        self.assertEqual(shown, [])

    def test_a_file_without_the_distance_is_written_and_read(self):
        episode = enfilade.Episode((2.0, 0.0, 0.0), 90.0, (8.0, 0.0, 0.0), math.nan, "1")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "episodes.json"
            enfilade.write_episodes(file, [episode], "room.obj")
            (one,) = json.loads(file.read_text(), parse_constant=self.fail)["episodes"]
            self.assertEqual(one["info"], {})
            one["info"] = {"geodesic_distance": None}
            file.write_text(json.dumps({"episodes": [one]}))
            (read,) = enfilade.read_episodes(file)
            self.assertTrue(math.isnan(read.geodesic_distance))
            self.assertEqual((read.start, read.goal), (episode.start, episode.goal))
            with self.assertRaisesRegex(ValueError, r"episodes\[0\].goal"):
                enfilade.write_episodes(file, [enfilade.Episode((2, 0, 0), 0, (8, 0, math.nan), 6)], "room.obj")

    def test_scenes_and_radii_of_goals_are_kept(self):
        episodes = [enfilade.Episode((2.0, 0.0, float(i)), 90.0, (8.0, 0.0, 0.0), 6.0, str(i), scene, radius)
                    for i, (scene, radius) in enumerate((("a.glb", 0.2), ("a.glb", None), ("b.glb", 0.0)))]
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "episodes.json"
            enfilade.write_episodes(file, episodes[:2])
            self.assertEqual(enfilade.read_episodes(file), episodes[:2])
            listed = json.loads(file.read_text())["episodes"]
            self.assertEqual([one["goals"][0]["radius"] for one in listed], [0.2, None])
            enfilade.write_episodes(file, episodes)
            with self.assertRaisesRegex(ValueError, "episodes.json: .*2 scenes; give scene_id.*'a.glb', 'b.glb'"):
                enfilade.read_episodes(file)
            self.assertEqual(enfilade.read_episodes(file, "a.glb"), episodes[:2])
            self.assertEqual(enfilade.read_episodes(file, scene_id="b.glb"), episodes[2:])
            with self.assertRaisesRegex(ValueError, "scene_id: .*'c.glb', but in 'a.glb', 'b.glb'"):
                enfilade.read_episodes(file, "c.glb")
            enfilade.write_episodes(file, episodes, "room.obj")
            self.assertEqual({one.scene_id for one in enfilade.read_episodes(file)}, {"room.obj"})
            enfilade.write_episodes(file, [enfilade.Episode((0, 0, 0), 0, (1, 0, 0), 1, "", f"{i}.glb")
                                           for i in range(30)])
            with self.assertRaisesRegex(ValueError, "30 scenes.*'19.glb' and 10 more$"):
                enfilade.read_episodes(file)
            with self.assertRaisesRegex(ValueError, r"scene: .*episodes\[0\]"):
                enfilade.write_episodes(file, [enfilade.Episode((0, 0, 0), 0, (1, 0, 0), 1)])

    def test_wrong_files_are_named_with_the_episode(self):
        good = {"start_position": [0, 0, 0], "start_rotation": [0, 0, 0, 1], "goals": [{"position": [1, 0, 0]}]}
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "some.json"
            for wrong, words in (({"start_position": [0, 0]}, "start_position"),
                                 ({"goals": [{"position": [1, 0]}]}, "position"), ({"goals": []}, "goals"),
                                 ({"goals": [{"position": [1, 0, 0], "radius": -1}]}, "radius"),
                                 ({"start_rotation": [0, 0, 0, 0]}, "unit quaternion"),
                                 ({"start_rotation": [0, 0, 1]}, "start_rotation"),
                                 ({"start_position": [0, math.nan, 0]}, "start_position")):
                file.write_text(json.dumps({"episodes": [good, {**good, **wrong}]}))
                with self.assertRaisesRegex(ValueError, r"some.json: episodes\[1\]: .*" + words):
                    enfilade.read_episodes(file)
            del good["goals"]
            file.write_text(json.dumps({"episodes": [good]}))
            with self.assertRaisesRegex(ValueError, r"episodes\[0\]: 'goals' is missing"):
                enfilade.read_episodes(file)
            for name, text in (("no.json", "PointNav"), ("list.json", "[]"), ("no.json.gz", "{}")):
                (Path(folder) / name).write_text(text)
                with self.assertRaisesRegex(ValueError, name + ": not a file of PointNav"):
                    enfilade.read_episodes(Path(folder) / name)

    def test_an_impossible_episode_says_why(self):
        env = self.environment(starts=[(0, 0, 0)], goals=[(1000, 0, 0)])
        reason = env.navigation.path((0, 0, 0), (1000, 0, 0)).reason
        with self.assertRaises(enfilade.EnfiladeError) as raised:
            env.reset(seed=1)
        self.assertIn("in 1 draw", str(raised.exception))
        self.assertIn(reason, str(raised.exception))
        env = self.environment(min_distance=500)
        with self.assertRaisesRegex(enfilade.EnfiladeError, "in 64 draws.*it is .* m long"):
            env.reset(seed=1)

    def test_a_goal_that_cannot_be_reached_is_drawn_again(self):
        env = self.environment(starts=[(0, 0, 0)], goals=[(5.1, 3.1, 0), (3, 0, 0)])
        for seed in range(5):
            env.reset(seed=seed)
            self.assertEqual(env.episode.goal, (3, 0, 0))
        env.reset(options={"goal": (-3, 0, 0)})
        self.assertEqual((env.episode.start, env.episode.goal), ((0, 0, 0), (-3, 0, 0)))

    def test_wrong_arguments_are_named(self):
        episode = enfilade.Episode((0, 0, 0), 0, (3, 0, 0), 3)
        played = {"goals": None, "starts": ()}
        for options, name in (({"starts": "everywhere"}, "starts"), ({"starts": ()}, "starts"),
                              ({"starts": 5}, "starts"), ({"goal": (1, 0, 0)}, "goal"), ({"goals": []}, "goals"),
                              ({"pitch": 2}, "pitch"), ({"min_distance": math.nan}, "min_distance"),
                              ({"min_distance": -1}, "min_distance"), ({"episodes": [], **played}, "episodes"),
                              ({"goals": None, "episodes": [episode]}, "starts"),
                              ({"episodes": [(0, 0, 0)], **played}, r"episodes\[0\]"),
                              ({"episodes": [enfilade.Episode((0, 0), 0, (1, 0, 0), 1)], **played},
                               r"episodes\[0\].start")):
            with self.assertRaisesRegex(ValueError, name):
                self.environment(**options)


if __name__ == "__main__":
    unittest.main()
