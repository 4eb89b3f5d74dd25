"""Lidars: times, places and distances of their rays."""

import math
import unittest

import numpy as np

import enfilade
from room import FLOOR, WALL, RoomCase


class LidarTest(RoomCase):
    def walker(self, at=(0, 0, 0), **options):
        ann = self.client.spawn("ann", at=at, **options)
        ann.enter()
        return ann

    def test_at_rest_a_turn_is_the_scan_of_the_server(self):
        self.walker(at=(1, 0, -2), facing=30)
        elevations = np.linspace(0.3, -0.3, 16)
        lidar = enfilade.Lidar(self.client, "ann", enfilade.LidarPattern.spinning(elevations, 360))
        for _ in range(2):
            cloud = lidar.sweep()
            scan = self.client.scan("ann", height=0.6, columns=360, rows=16)
            self.assertEqual(set(scan.entity.ravel()) & {FLOOR, WALL}, {FLOOR, WALL})
            # An edge may decide otherwise by rounding.
            same = cloud.entity.reshape(360, 16).T == scan.entity
            self.assertGreater(same.mean(), 0.999)
            np.testing.assert_allclose(cloud.distance.reshape(360, 16).T[same], scan.distance[same], rtol=1e-5)
            np.testing.assert_array_equal(cloud.ray, np.arange(360 * 16))

    def test_rays_start_where_the_avatar_is_at_their_time(self):
        ann = self.walker()
        ann.drive((1.2, 0, 0))
        # A rangefinder of 1 kHz, straight ahead: the wall comes closer by 1.2 mm from ray to ray.
        lidar = enfilade.Lidar(self.client, "ann", enfilade.LidarPattern([0.0], [0.0], [0.0], 0.001))
        cloud = enfilade.lidar._joined([lidar.observe() for _ in range(30)])
        self.assertEqual(len(cloud.time), 500)  # of 30 ticks of 1/60 s
        np.testing.assert_allclose(np.diff(cloud.time), 0.001, atol=1e-9)
        self.assertEqual(set(cloud.entity), {WALL})
        np.testing.assert_allclose(np.diff(cloud.distance), -0.0012, atol=1e-9)
        np.testing.assert_allclose(cloud.origin[:, 0] + cloud.distance, 5, atol=1e-9)

    def test_rays_turn_with_the_avatar(self):
        ann = self.walker()
        ann.turn(90, rate=90)
        lidar = enfilade.Lidar(self.client, "ann", enfilade.LidarPattern([0.0], [0.0], [0.0], 0.0005),
                               height=1.0, ahead=0.2, left=0.1, yaw=0.5)
        cloud = lidar.observe()
        angle = np.unwrap(np.arctan2(-cloud.direction[:, 2], cloud.direction[:, 0]))
        np.testing.assert_allclose(np.diff(angle), math.radians(90) * 0.0005, atol=1e-9)
        heading = angle - 0.5
        c, s = np.cos(heading), np.sin(heading)
        np.testing.assert_allclose(cloud.origin[:, 0], 0.2 * c - 0.1 * s, atol=1e-9)
        np.testing.assert_allclose(cloud.origin[:, 2], -0.2 * s - 0.1 * c, atol=1e-9)
        feet = self.client.step(avatars=True).avatars["ann"].feet
        np.testing.assert_allclose(cloud.origin[:, 1], 1 + feet[1], atol=1e-9)

    def test_points_in_the_frame_of_the_sensor(self):
        self.walker(facing=90)  # along -Z
        pattern = enfilade.LidarPattern([0.0, math.pi / 2, math.pi], [-0.5, 0.0, 0.0], [0, 0.01, 0.02], 0.03)
        # Pitched down by a quarter turn, its "ahead" is the floor and its "up" the heading.
        lidar = enfilade.Lidar(self.client, "ann", pattern, height=1.0, pitch=-math.pi / 2)
        cloud = lidar.sweep()
        down = cloud.direction[0]
        np.testing.assert_allclose(down, (0, -math.cos(0.5), math.sin(0.5)), atol=1e-12)
        self.assertEqual(cloud.entity[0], FLOOR)
        np.testing.assert_allclose(cloud.point[0], cloud.origin[0] + down * cloud.distance[0], atol=1e-9)
        np.testing.assert_allclose(cloud.in_sensor[0], cloud.distance[0] * np.array(
            [math.cos(0.5), -math.sin(0.5), 0]), atol=1e-12)
        self.assertEqual(cloud.entity[2], 0)  # into the sky
        self.assertTrue(np.isnan(cloud.distance[2]) and np.isnan(cloud.in_sensor[2]).all())

    def test_periods_that_are_no_ticks_are_whole(self):
        self.walker()
        pattern = enfilade.LidarPattern.spinning([0.0], 100, rate=7.3)
        lidar = enfilade.Lidar(self.client, "ann", pattern)
        clouds = [lidar.sweep() for _ in range(5)]
        for number, cloud in enumerate(clouds):
            np.testing.assert_array_equal(cloud.ray, np.arange(100))
            np.testing.assert_allclose(cloud.time - clouds[0].time, number / 7.3, atol=1e-9)
        rest = lidar.observe()  # with what the last sweep() measured beyond its period
        self.assertEqual(rest.ray[0], 0)
        self.assertLess(len(rest.ray), 100)

    def test_a_teleport_has_no_places_between(self):
        ann = self.walker()
        lidar = enfilade.Lidar(self.client, "ann", enfilade.LidarPattern([0.0], [0.0], [0.0], 0.002))
        lidar.observe()
        ann.teleport((-4, 0, 0))
        np.testing.assert_allclose(lidar.observe().origin[:, 0], -4, atol=1e-9)

    def test_unusable_patterns_and_worlds_are_named(self):
        for arguments, words in ((([], [], [], 1), "every ray"), (([0], [0, 1], [0], 1), "every ray"),
                                 (([0, 0], [0, 0], [0.5, 0.2], 1), "ascending"),
                                 (([0], [0], [1], 1), "ascending"), (([0], [0], [0], 0), "period"),
                                 (([math.nan], [0], [0], 1), "finite")):
            with self.assertRaisesRegex(ValueError, words):
                enfilade.LidarPattern(*arguments)
        for arguments in (([], 4), ([0.0], 0), ([0.0], 4, 0)):
            with self.assertRaises(ValueError):
                enfilade.LidarPattern.spinning(*arguments)
        pattern = enfilade.LidarPattern.spinning([0.0], 6)
        with self.assertRaisesRegex(enfilade.EnfiladeError, "'bob' is not in the world"):
            enfilade.Lidar(self.client, "bob", pattern).observe()
        self.walker()
        lidar = enfilade.Lidar(self.client, "ann", pattern)
        lidar.observe()
        self.client.step()
        with self.assertRaisesRegex(enfilade.EnfiladeError, "between two observations"):
            lidar.sweep()


if __name__ == "__main__":
    unittest.main()
