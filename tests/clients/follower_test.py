"""Actions along a path to a goal, by habitat-sim's name."""

import math
import unittest
from unittest import mock

import numpy as np

from enfilade.compat import GreedyFollowerError, GreedyGeodesicFollower, PathFinder
from room import RoomCase


class FollowerTest(RoomCase):
    def test_greedy_actions_lead_to_the_goal(self):
        pathfinder = PathFinder(self.client.navigation())
        follower = GreedyGeodesicFollower(pathfinder)
        place, heading = np.array((2.0, 0.0, 0.0)), 0.3
        for _ in range(200):
            action = follower.next_action_along(place, heading, (8, 0, 0))
            if action is None:
                break
            if action == "move_forward":
                step = 0.25 * np.array((math.cos(heading), 0, -math.sin(heading)))
                place = pathfinder.try_step(place, place + step)
            heading += {"turn_left": 1, "turn_right": -1}.get(action, 0) * math.radians(10)
        self.assertIsNone(action)
        self.assertLess(math.hypot(place[0] - 8, place[2]), 0.25)
        with self.assertRaisesRegex(ValueError, "no path"):
            follower.next_action_along(place, heading, (5.1, 9, 0))

    def test_a_reset_forgets_the_place_of_the_last_goal(self):
        pathfinder = PathFinder(self.client.navigation())
        follower = GreedyGeodesicFollower(pathfinder)
        with mock.patch.object(pathfinder, "_projected", wraps=pathfinder._projected) as projected:
            for expected in (2, 3):  # the goal is projected once, the position each time
                follower.next_action_along((2, 0, 0), 0.0, (4, 0, 0))
                self.assertEqual(projected.call_count, expected)
            follower.reset()
            follower.next_action_along((2, 0, 0), 0.0, (4, 0, 0))
            self.assertEqual(projected.call_count, 5)

    def test_find_path_returns_the_actions_up_to_the_stop(self):
        follower = GreedyGeodesicFollower(PathFinder(self.client.navigation()), stop_key="stop")
        self.assertEqual(follower.goal_radius, 0.1875)
        actions = follower.find_path((0, 0, 0), 0.0, (1, 0, 0))
        self.assertEqual(actions, ["move_forward"] * 4 + ["stop"])
        actions = follower.find_path((2, 0, 0), 0.3, (8, 0, 0))
        place, heading = (2, 0, 0), 0.3
        for action in actions:
            self.assertEqual(follower.next_action_along(place, heading, (8, 0, 0)), action)
            if action == "move_forward":
                step = 0.25 * np.array((math.cos(heading), 0, -math.sin(heading)))
                place = follower.pathfinder.try_step(place, place + step)
            heading += {"turn_left": 1, "turn_right": -1}.get(action, 0) * math.radians(10)
        self.assertEqual(actions.index("stop"), len(actions) - 1)
        with self.assertRaisesRegex(GreedyFollowerError, "no path"):
            follower.find_path((2, 0, 0), 0.3, (5.1, 9, 0))
        actions = follower.find_path((2, 0.7, 0), 0.0, (0, 1, 6))  # into the column
        self.assertEqual(actions[-1], "stop")
        self.assertIn("move_forward", actions)


if __name__ == "__main__":
    unittest.main()
