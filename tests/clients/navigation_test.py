"""Navigation by the Python client: paths, places, maps, and habitat-sim's names."""

import contextlib
import math
import os
import socket
import struct
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import enfilade
from enfilade.compat import MultiGoalShortestPath, NavMeshSettings, PathFinder, ShortestPath
from room import RoomCase, obj


def build_slowly(listener):
    """A server that builds a mesh for twice the time that the client waits for a reply."""
    m = enfilade.messages
    peer, _ = listener.accept()

    def receive():
        total, _ = struct.unpack("<II", peer.recv(8, socket.MSG_WAITALL))
        return m.ClientMessage.FromString(peer.recv(total - 4, socket.MSG_WAITALL))

    def send(message):
        body = message.SerializeToString()
        peer.sendall(struct.pack("<II", 4 + len(body), len(body)) + body)

    with peer, contextlib.suppress(OSError):  # the client may give up
        peer.sendall(peer.recv(4, socket.MSG_WAITALL))  # the magic number
        send(m.ServerMessage(reply_to=receive().request_id, welcome=m.Welcome()))
        request = receive()
        for share in range(10):
            time.sleep(0.2)
            if request.navigation.progress or request.command.go.progress:
                send(m.ServerMessage(navigation_progress=m.NavigationProgress(
                    request_id=request.request_id, share=share / 10)))
        reply = m.ServerMessage(reply_to=request.request_id)
        if request.HasField("command"):
            reply.command.accepted = True
        else:
            reply.navigation.spots.add()
        send(reply)


class NavigationTest(RoomCase):
    def setUp(self):
        super().setUp()
        self.navigation = self.client.navigation()

    def test_a_path_goes_around_the_wall_and_is_walked(self):
        path = self.navigation.path((2, 0, 0), (8, 0, 0), narrowest=True)
        self.assertTrue(path.found, path.reason)
        self.assertAlmostEqual(
            path.length, float(np.linalg.norm(np.diff(path.points, axis=0), axis=1).sum()))
        self.assertGreater(path.length, 2 * math.hypot(3, 4))
        self.assertLess(path.length, 2 * math.hypot(3, 4.3) + 1)
        ann = self.client.spawn("ann", at=path.points[0])
        ann.walk(*path.points[1:], from_floor=True)
        self.client.run_until_idle()
        self.assertEqual([one.kind for one in self.client.notices()][-1], "arrived")

    def test_a_walk_from_the_floor_begins_after_the_fall(self):
        ann = self.client.spawn("ann", at=(2, 0.5, 0))
        ann.walk((4, 0, 0), from_floor=True)
        in_the_air = 0
        for _ in range(60):
            feet = self.client.step(1, avatars=True).avatars["ann"].feet
            if feet[1] > 0.01:
                in_the_air += 1
                self.assertEqual(feet[0], 2)
        self.assertGreater(in_the_air, 5)
        self.assertGreater(feet[0], 2)

    def test_steps_of_a_path_have_their_heights(self):
        self.assertEqual(self.navigation.path((2, 0, 0), (8, 0, 0), steps=True).steps, ())
        scene = self.folder / "kerb.obj"
        scene.write_text(obj({"street": ((0, -0.5, 0), (4, 0, 4)), "pavement": ((4, -0.5, 0), (8, 0.12, 4))}))
        with enfilade.serve(scene) as server, server.connect() as client:
            navigation = client.navigation()
            self.assertEqual(navigation.path((1, 0, 2), (7, 0.12, 2)).steps, ())
            (step,) = navigation.path((7, 0.12, 2), (1, 0, 2), steps=True).steps
            self.assertAlmostEqual(step.rise, -0.12, places=2)
            self.assertAlmostEqual(step.at[0], 4, delta=0.4)

    def test_go_walks_to_a_point_and_to_an_object(self):
        ann = self.client.spawn("ann", at=(2, 0, 0))
        ann.go((8, 0, 0), speed=3)
        ann.go("column")
        self.client.run_until_idle()
        self.assertEqual([one.kind for one in self.client.notices()], ["spawned", "arrived", "arrived"])
        feet = self.client.step(1, avatars=True).avatars["ann"].feet
        self.assertLess(math.hypot(feet[0], feet[2] - 6), 2)

    def test_a_walk_is_awaited_with_its_result(self):
        ann = self.client.spawn("ann", at=(2, 0, 0))
        self.assertEqual(ann.go_and_wait((8, 0, 0)), "arrived")
        self.assertEqual(ann.walk_and_wait((2, 0, 0)), "blocked by wall")
        self.assertEqual(ann.walk_and_wait((8, 0, 0)), "arrived")
        with self.assertRaises(enfilade.OrderFailed):
            self.client.command("ann", leave=enfilade.messages.Leave())
            ann.walk_and_wait((2, 0, 0))

    def test_go_is_refused_with_the_reason(self):
        ann = self.client.spawn("ann", at=(2, 0, 0))
        with self.assertRaises(enfilade.ServerError) as raised:
            ann.go((2, 5, 0))
        self.assertIn("at the goal", str(raised.exception))
        with self.assertRaises(enfilade.ServerError) as raised:
            ann.go("nowhere")
        self.assertIn("'nowhere'", str(raised.exception))

    def test_an_unreachable_goal_has_a_reason(self):
        path = self.navigation.path((2, 0, 0), (5.1, 3.1, 0))
        self.assertFalse(path.found)
        self.assertEqual(path.length, math.inf)
        self.assertEqual(len(path.points), 0)
        self.assertTrue(path.reason)
        self.assertEqual(self.navigation.geodesic_distance((2, 0, 0), (5.1, 3.1, 0)), math.inf)

    def test_random_places_repeat_with_the_seed(self):
        places = self.navigation.random_places(50, 3)
        self.assertTrue(all(place is not None for place in places))
        again = self.navigation.random_places(50, 3)
        np.testing.assert_array_equal([p.at for p in places], [p.at for p in again])
        near = self.navigation.random_places(20, 4, near=(0, 0, 0), max_distance=2)
        self.assertTrue(all(np.linalg.norm(p.at) <= 2 for p in near))
        self.assertTrue(all(self.navigation.is_navigable(p.at) for p in near))

    def test_snap_step_and_clearance(self):
        self.assertIsNone(self.navigation.snap((5.1, 1, 0), 0.2))
        spot = self.navigation.snap((4.9, 0, 0), 1)
        self.assertAlmostEqual(spot.at[0], 4.7, delta=0.15)
        self.assertEqual(spot.island, 0)
        self.assertFalse(self.navigation.is_navigable((4.9, 0, 0)))
        self.assertAlmostEqual(self.navigation.try_step((3, 0, 0), (6, 0, 0), slide=False).at[0], 4.7, delta=0.02)
        self.assertIsNone(self.navigation.try_step((5.1, 0, 0), (6, 0, 0)))
        obstacle = self.navigation.clearance((4, 0, 0))
        self.assertEqual(obstacle.name, "wall")
        self.assertAlmostEqual(obstacle.distance, 1, delta=0.01)

    def test_a_map_shows_the_wall(self):
        top = self.navigation.top_down(0.0, 0.1)
        column = lambda x: int((x - top.corner[0]) / top.cell)
        row = lambda z: int((z - top.corner[2]) / top.cell)
        self.assertTrue(top.cells[row(0), column(2)])
        self.assertFalse(top.cells[row(0), column(5.1)])
        self.assertAlmostEqual(top.cells.sum() * 0.01, self.navigation.navigable_area, delta=8)
        self.assertGreater(self.navigation.mesh_bytes, 10_000)

    def test_a_map_is_a_picture(self):
        png = self.navigation.top_down_png(0.0, 0.1)
        self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
        rows, columns = self.navigation.top_down(0.0, 0.1).cells.shape
        self.assertEqual(png[16:24], columns.to_bytes(4, "big") + rows.to_bytes(4, "big"))

    def test_islands_tell_where_places_are_drawn(self):
        floor = self.navigation.islands()[0]
        self.assertTrue(floor.drawn)
        self.assertFalse(floor.roof)
        self.assertIsNone(floor.path)
        self.assertEqual({place.island for place in self.navigation.random_places(50, 3)}, {0})

    def test_wrong_fields_are_named(self):
        with self.assertRaises(enfilade.ServerError) as raised:
            self.client.navigation(radius=50).path((0, 0, 0), (1, 0, 0))
        self.assertEqual(raised.exception.field, "navigation.radius")
        with self.assertRaises(enfilade.ServerError) as raised:
            self.navigation.top_down(0.0, 0.001)
        self.assertEqual(raised.exception.field, "navigation.map.cell")
        with self.assertRaises(enfilade.ServerError) as raised:
            self.navigation.path((0, 0, 0), "attic")
        self.assertEqual(raised.exception.field, "navigation.path.to[0].name")
        with self.assertRaises(ValueError):
            self.client.navigation(doors="ajar")

    def test_options_of_random_places_that_would_have_no_effect_are_named(self):
        for options, name in (({"max_distance": 2}, "near"), ({"near": (0, 0, 0)}, "max_distance"),
                              ({"min_distance": 2}, "away_from"), ({"away_from": (0, 0, 0)}, "min_distance"),
                              ({"island": -1}, "island"), ({"seed": -1}, "seed"), ({"count": -1}, "count")):
            with self.assertRaisesRegex(ValueError, name):
                self.navigation.random_places(**{"count": 1, "seed": 1, **options})


class CompatTest(RoomCase):
    def setUp(self):
        super().setUp()
        self.finder = PathFinder(self.client.navigation(radius=0.1, height=1.5), seed=1)

    def test_shortest_paths(self):
        path = ShortestPath()
        path.requested_start, path.requested_end = (2, 0, 0), (8, 0, 0)
        self.assertTrue(self.finder.find_path(path))
        self.assertGreaterEqual(len(path.points), 3)
        self.assertGreater(path.geodesic_distance, 10)
        many = MultiGoalShortestPath()
        many.requested_start, many.requested_ends = (2, 0, 0), [(8, 0, 0), (3, 0, 0), (5.1, 9, 0)]
        self.assertTrue(self.finder.find_path(many))
        self.assertEqual(many.closest_end_point_index, 1)
        self.assertAlmostEqual(many.geodesic_distance, 1, delta=1e-3)
        path.requested_end = (5.1, 9, 0)
        self.assertFalse(self.finder.find_path(path))
        self.assertEqual(path.geodesic_distance, math.inf)

    def test_points_and_islands(self):
        point = self.finder.get_random_navigable_point()
        self.assertTrue(self.finder.is_navigable(point))
        self.finder.seed(5)
        first = self.finder.get_random_navigable_point_near((0, 0, 0), 3)
        self.finder.seed(5)
        np.testing.assert_array_equal(first, self.finder.get_random_navigable_point_near((0, 0, 0), 3))
        self.assertTrue(np.isnan(self.finder.snap_point((50, 0, 0))).all())
        self.assertEqual(self.finder.get_island((2, 0, 0)), 0)
        self.assertGreaterEqual(self.finder.num_islands, 1)
        self.assertGreater(self.finder.island_area(0), 300)
        self.assertLessEqual(self.finder.island_area(0), self.finder.navigable_area + 1e-9)
        self.assertAlmostEqual(self.finder.distance_to_closest_obstacle((4, 0, 0)), 0.9, delta=0.01)
        end = self.finder.try_step((3, 0, 1), (6, 0, 2))
        stop = self.finder.try_step_no_sliding((3, 0, 1), (6, 0, 2))
        self.assertGreater(end[2], stop[2])
        self.assertEqual(self.finder.get_topdown_view(0.1, 0).dtype, bool)
        np.testing.assert_array_equal(self.finder.get_topdown_view(0.1, 0, 0.5),
                                      self.finder.get_topdown_view(0.1, 0))

    def test_every_island_has_an_area_and_is_on_the_map(self):
        navigation = self.finder.navigation
        self.assertEqual(self.finder.num_islands, len(navigation.island_areas))
        self.assertEqual(self.finder.island_area(0), navigation.island_areas[0])
        with self.assertRaises(IndexError):
            self.finder.island_area(self.finder.num_islands)
        seen = self.finder.get_topdown_view(0.2, 0)
        islands = self.finder.get_topdown_island_view(0.2, 0)
        np.testing.assert_array_equal(islands >= 0, seen)
        self.assertEqual(islands.dtype, np.int32)
        low, _ = self.finder.get_bounds()
        for point in ((0, 0, 0), (2, 0, 3)):
            row, column = int((point[2] - low[2]) / 0.2), int((point[0] - low[0]) / 0.2)
            self.assertEqual(islands[row, column], self.finder.get_island(point))

    def test_the_area_of_an_island_beyond_the_list_is_that_of_its_triangles(self):
        navigation = self.finder.navigation
        known, count = navigation.island_area(0), self.finder.num_islands
        navigation._meshes().ClearField("island_areas")
        self.assertEqual(self.finder.num_islands, count)
        self.assertAlmostEqual(navigation.island_area(0), known, delta=0.01 * known)

    def test_a_map_has_the_floors_within_eps(self):
        floor, air, above = (self.finder.get_topdown_view(0.1, height, eps)
                             for height, eps in ((0, 0.1), (1, 0.9), (1, 1.1)))
        self.assertGreater(floor.sum(), 30000)
        self.assertFalse(air.any())
        np.testing.assert_array_equal(floor, above)
        with self.assertRaises(enfilade.ServerError) as raised:
            self.finder.get_topdown_view(0.1, 0, -1)
        self.assertEqual(raised.exception.field, "navigation.map.tolerance")

    def test_obstacles_are_searched_from_the_surface_and_capped(self):
        for place, max_radius, expected in (((3, 0, 0), 2.0, 1.9), ((3.05, 0, 0), 2.0, 1.85), ((0, 0, 0), 2.0, 2.0),
                                            ((0, 0, 0), 5.0, 4.9), ((3, 0, 0), 1.9, 1.9), ((3, 0, 0), 0.05, 0.05)):
            distance = self.finder.distance_to_closest_obstacle(place, max_radius)
            hit = self.finder.closest_obstacle_surface_point(place, max_radius)
            self.assertAlmostEqual(distance, expected, delta=1e-3)
            self.assertEqual(hit.hit_dist, distance)
            self.assertEqual(bool(np.isnan(hit.hit_pos).any()), distance == max_radius)
        hit = self.finder.closest_obstacle_surface_point((3.05, 0, 0))  # 1.95 from the axis
        self.assertAlmostEqual(hit.hit_pos[0], 5, delta=1e-3)
        np.testing.assert_allclose(hit.hit_normal, (-1, 0, 0), atol=1e-6)
        self.assertEqual(self.finder.distance_to_closest_obstacle((50, 0, 0)), math.inf)
        self.assertEqual(self.finder.closest_obstacle_surface_point((50, 0, 0)).hit_dist, math.inf)
        with self.assertRaisesRegex(ValueError, "max_search_radius"):
            self.finder.distance_to_closest_obstacle((0, 0, 0), 20)

    def test_a_step_from_no_place_is_the_start_or_begins_at_the_closest(self):
        for step in (self.finder.try_step, self.finder.try_step_no_sliding):
            np.testing.assert_array_equal(step((50, 0, 0), (51, 0, 0)), (50, 0, 0))
            np.testing.assert_allclose(step((5.0, 0, 0), (4, 0, 0)), (4, 0, 0), atol=1e-2)  # out of the wall

    def test_an_island_has_one_radius(self):
        radius = self.finder.island_radius((0, 0, 0))
        self.assertEqual(self.finder.island_radius((9, 0, 9)), radius)
        self.assertEqual(self.finder.island_radius(0), radius)
        self.assertEqual(self.finder.island_radius(island_index=0), radius)
        self.assertEqual(self.finder.island_radius(pt=(9, 0, 9)), radius)
        for options in ({}, {"pt": (0, 0, 0), "island_index": 0}):
            with self.assertRaisesRegex(TypeError, "either pt or island_index"):
                self.finder.island_radius(**options)
        self.assertGreater(radius, 12)  # of a floor of 20 m x 20 m: up to 14.1
        self.assertLess(radius, 15)
        self.assertEqual(self.finder.island_radius((50, 0, 0)), 0)

    def test_settings_of_the_mesh(self):
        settings = self.finder.nav_mesh_settings
        policies = self.client.welcome.policies
        self.assertEqual((settings.agent_radius, settings.agent_height), (0.1, 1.5))
        self.assertEqual(settings.agent_max_climb, policies.step_height)
        self.assertTrue(self.finder.build_nav_mesh(settings))
        settings = NavMeshSettings(cell_size=0.1, agent_radius=0.3, agent_max_climb=0.2)
        settings.set_defaults()
        self.assertEqual(settings, NavMeshSettings())
        with self.assertRaises(TypeError):
            NavMeshSettings(cellsize=0.1)

    def test_a_refused_size_leaves_the_present_agent(self):
        with self.assertRaises(enfilade.ServerError):
            self.finder.build_nav_mesh(NavMeshSettings(agent_radius=-1))
        self.assertEqual(self.finder.nav_mesh_settings.agent_radius, 0.1)
        self.assertTrue(self.finder.is_navigable((2, 0, 0)))

    def test_the_radius_of_a_random_point_is_named(self):
        for radius in (0, -1, math.nan):
            with self.assertRaisesRegex(ValueError, "^radius: "):
                self.finder.get_random_navigable_point_near((0, 0, 0), radius)

    def test_points_that_are_not_finite_are_nowhere(self):
        nowhere = self.finder.snap_point((50, 0, 0))
        for point in (nowhere, (0, math.inf, 0)):
            self.assertIs(self.finder.is_navigable(point), False)
            self.assertTrue(np.isnan(self.finder.snap_point(point)).all())
            self.assertTrue(np.isnan(self.finder.get_random_navigable_point_near(point, 3)).all())
            self.assertEqual((self.finder.get_island(point), self.finder.island_radius(point)), (-1, 0))
            self.assertEqual(self.finder.distance_to_closest_obstacle(point), math.inf)
            np.testing.assert_array_equal(self.finder.try_step(point, (1, 0, 0)), point)
            np.testing.assert_array_equal(self.finder.try_step_no_sliding((1, 0, 0), point), (1, 0, 0))
            path = ShortestPath()
            for path.requested_start, path.requested_end in ((point, (1, 0, 0)), ((1, 0, 0), point)):
                self.assertFalse(self.finder.find_path(path))
                self.assertEqual((path.geodesic_distance, path.points), (math.inf, []))
            many = MultiGoalShortestPath()
            many.requested_start, many.requested_ends = (2, 0, 0), [point, (3, 0, 0)]
            self.assertTrue(self.finder.find_path(many))
            self.assertEqual(many.closest_end_point_index, 1)
        with self.assertRaisesRegex(ValueError, "give three numbers"):
            self.finder.find_path(ShortestPath())

    def test_the_triangles_of_the_mesh_cover_the_island(self):
        navigation = self.finder.navigation
        triangles = navigation.triangles(0)
        edges = triangles[:, 1:] - triangles[:, :1]
        area = 0.5 * np.abs(np.cross(edges[:, 0][:, [0, 2]], edges[:, 1][:, [0, 2]])).sum()
        self.assertAlmostEqual(area, navigation.island_areas[0], delta=0.01 * area)
        self.assertLessEqual(len(triangles), len(navigation.triangles()))
        self.assertEqual(len(navigation.triangles(999)), 0)
        self.assertEqual(len(self.finder.build_navmesh_vertices(0)), 3 * len(triangles))
        self.assertEqual(len(self.finder.build_navmesh_vertex_indices(0)), 3 * len(triangles))

    def test_the_step_height_is_that_of_the_world(self):
        step = self.client.welcome.policies.step_height
        self.assertTrue(self.client.navigation(0.3, 1.75, step).is_navigable((2, 0, 0)))
        with self.assertRaisesRegex(ValueError, "--step-height 0.1"):
            self.client.navigation(0.3, 1.75, 0.1)

    def test_progress_is_shown_while_meshes_are_built(self):
        shown = []
        navigation = self.client.navigation(radius=0.37, progress=shown.append)
        self.assertIsNotNone(navigation.snap((2, 0, 0)))
        self.assertEqual(shown, sorted(shown))
        self.assertEqual(shown[-1], 1)
        before = len(shown)
        navigation.snap((2, 0, 0))  # the meshes are there
        self.client.spawn("ann", at=(2, 0, 0), radius=0.36).go((8, 0, 0))  # for another size
        self.assertEqual(len(shown), before)

    def test_progress_restarts_the_wait_for_a_reply(self):
        asks = {"navigation": lambda client: self.assertIsNone(client.navigation().snap((0, 0, 0))),
                "go": lambda client: enfilade.Avatar(client, "ann").go((0, 0, 0))}
        for name, ask in asks.items():
            with self.subTest(name), socket.create_server(("127.0.0.1", 0)) as listener:
                threading.Thread(target=build_slowly, args=(listener,), daemon=True).start()
                with enfilade.connect(f"127.0.0.1:{listener.getsockname()[1]}", timeout=1.0) as client:
                    ask(client)

    def test_meshes_are_saved_and_loaded(self):
        with tempfile.TemporaryDirectory() as folder:
            file = str(Path(folder) / "room.mesh")
            self.assertTrue(self.finder.save_nav_mesh(file))
            path = ShortestPath()
            path.requested_start, path.requested_end = (2, 0, 0), (8, 0, 0)
            self.assertTrue(self.finder.find_path(path))
            with enfilade.serve(self.scene) as server, server.connect() as client:
                finder = PathFinder(client.navigation(radius=0.1, height=1.5))
                self.assertTrue(finder.load_nav_mesh(file))
                again = ShortestPath()
                again.requested_start, again.requested_end = (2, 0, 0), (8, 0, 0)
                self.assertTrue(finder.find_path(again))
                np.testing.assert_array_equal(again.points, path.points)
                with self.assertRaisesRegex(enfilade.ServerError, "radius"):
                    client.navigation(radius=0.2).load(file)
                self.assertTrue(finder.build_nav_mesh(NavMeshSettings(agent_radius=0.2)))
                self.assertEqual(finder.navigation.radius, 0.2)
                with self.assertRaisesRegex(ValueError, "--step-height 0.2"):
                    finder.build_nav_mesh(NavMeshSettings(agent_max_climb=0.2))
            Path(file).write_bytes(b"no mesh")
            with self.assertRaisesRegex(enfilade.ServerError, "not a navigation mesh"):
                self.finder.load_nav_mesh(file)


class FurnitureTest(unittest.TestCase):
    """A floor with a cupboard and a bed. habitat's mesh leaves out the cupboard's small top."""

    BOXES = {
        "floor": ((-6, -0.5, -6), (6, 0, 6)),
        "cupboard": ((-0.4, 0, -0.4), (0.4, 0.9, 0.4)),
        "bed": ((2, 0, -1), (4, 0.7, 1)),
    }

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        (Path(folder.name) / "room.obj").write_text(obj(cls.BOXES))
        server = enfilade.serve(Path(folder.name) / "room.obj")
        cls.addClassCleanup(server.stop)
        client = server.connect()
        cls.addClassCleanup(client.close)
        cls.finder = PathFinder(client.navigation(radius=0.1, height=1.5))

    def path(self, start, end):
        path = ShortestPath()
        path.requested_start, path.requested_end = start, end
        return path, self.finder.find_path(path)

    def test_ends_of_paths_are_snapped(self):
        path, found = self.path((-4, 0.7, 0), (0, 0.45, 0))
        self.assertTrue(found)
        np.testing.assert_allclose(path.points[0], (-4, 0, 0), atol=0.01)
        self.assertAlmostEqual(np.abs(path.points[-1][[0, 2]]).max(), 0.5, delta=0.1)  # at the cupboard's side
        self.assertAlmostEqual(path.points[-1][1], 0, delta=0.01)
        for end, is_found in (((-4, 3.5, 3), True), ((-4, 4.5, 3), False), ((-7.5, 0, 0), True),
                              ((-8.5, 0, 0), False), ((-4, -3.5, 3), True)):
            path, found = self.path((-3, 0, 0), end)
            self.assertEqual(found, is_found, end)
            self.assertEqual(math.isfinite(path.geodesic_distance), is_found)
            self.assertEqual(self.path(end, (-3, 0, 0))[1], is_found, end)

    def test_an_end_without_a_place_does_not_hide_the_others(self):
        many = MultiGoalShortestPath()
        many.requested_start = (-4, 0, 0)
        many.requested_ends = [(-50, 0, 0), (0, 0.45, 0), (-3, 0, 0)]
        self.assertTrue(self.finder.find_path(many))
        self.assertEqual(many.closest_end_point_index, 2)
        self.assertAlmostEqual(many.geodesic_distance, 1, delta=0.01)
        many.requested_ends = many.requested_ends[:1]
        self.assertFalse(self.finder.find_path(many))
        self.assertEqual((many.closest_end_point_index, many.geodesic_distance, many.points), (-1, math.inf, []))

    def test_snapping_leaves_small_islands_out(self):
        point = np.array((0, 0.6, 0.1))
        snapped = self.finder.snap_point(point)
        self.assertAlmostEqual(snapped[1], 0, delta=0.01)
        self.assertAlmostEqual(np.linalg.norm(snapped - point), math.hypot(0.6, 0.4), delta=0.05)
        self.assertEqual(self.finder.get_island(point), 0)
        top = self.finder.navigation.snap(point).at  # a place that is given exactly stays
        self.assertAlmostEqual(top[1], 0.9, delta=0.01)
        np.testing.assert_allclose(self.finder.snap_point(top), top, atol=2e-3)

    def test_snapping_to_an_island_finds_its_closest_place(self):
        point = np.array((3, 0.5, 0.2))
        top = self.finder.snap_point(point)
        self.assertAlmostEqual(top[1], 0.7, delta=0.01)
        island = self.finder.get_island(point)
        self.assertNotEqual(island, 0)
        np.testing.assert_allclose(self.finder.snap_point(point, island), top)
        floor = self.finder.snap_point(point, 0)
        self.assertAlmostEqual(floor[1], 0, delta=0.01)
        self.assertAlmostEqual(np.linalg.norm(floor - point), math.hypot(0.9, 0.5), delta=0.05)
        self.assertTrue(np.isnan(self.finder.snap_point((-4, 0, 0), island)).all())
        self.assertTrue(np.isnan(self.finder.snap_point((3, 4.2, 0), 0)).all())


class DoorsTest(unittest.TestCase):
    """Two rooms with a door between them, and a platform that no step reaches."""

    BOXES = {
        "floor": ((-6, -0.5, -4), (6, 0, 4)),
        "left": ((-0.1, 0, -4), (0.1, 2.5, -0.5)),
        "right": ((-0.1, 0, 0.5), (0.1, 2.5, 4)),
        "leaf": ((-0.04, 0.02, -0.48), (0.04, 2.2, 0.48)),
        "platform": ((-5, 0, -3), (-3, 1, -1)),
    }
    SIDECAR = """{"walk":1,"bodies":[{"name":"door","kind":"sliding","objects":["leaf"],"axis":[0,0,1],
        "limits":[0,1.0],"speed":0.5%s}]}"""

    def server(self, more="", sidecar="", **boxes):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        (Path(folder.name) / "rooms.obj").write_text(obj({**self.BOXES, **boxes}))
        (Path(folder.name) / "rooms.walk.json").write_text(sidecar or self.SIDECAR % more)
        server = enfilade.serve(Path(folder.name) / "rooms.obj")
        self.addCleanup(server.stop)
        client = server.connect()
        self.addCleanup(client.close)
        client.lockstep()
        return client

    def test_a_path_names_its_closed_doors(self):
        client = self.server()
        self.assertFalse(client.navigation().path((-2, 0, 0), (2, 0, 0)).found)
        navigation = client.navigation(doors="open")
        path = navigation.path((-2, 0, 0), (2, 0, 0))
        self.assertEqual([one.name for one in path.doors], ["door"])
        self.assertAlmostEqual(path.doors[0].seconds, 2.0, places=6)
        self.assertLessEqual(path.doors[0].distance, 2)
        self.assertFalse(path.doors[0].by_touch)
        self.assertEqual(navigation.path((-2, 0, 0), (-2, 0, 3)).doors, ())
        client.body("door", open=True)
        client.step(180)
        self.assertEqual(navigation.path((-2, 0, 0), (2, 0, 0)).doors, ())

    def test_go_opens_the_doors_on_its_path_and_waits_for_them(self):
        client = self.server()
        client.subscribe(contacts=True)
        ann = client.spawn("ann", at=(-1, 0, 0))
        with self.assertRaises(enfilade.ServerError):
            ann.go((2, 0, 0))
        self.assertEqual(ann.go_and_wait((2, 0, 0), doors="open"), "arrived")
        self.assertNotIn("door", [one.b_name for one in client.contacts()])
        with self.assertRaisesRegex(ValueError, "doors"):
            ann.go((2, 0, 0), doors="closed")

    def test_go_opens_a_door_that_closes_by_itself(self):
        client = self.server(',"closes_after":0.2')
        ann = client.spawn("ann", at=(-4, 0, 0))
        path = client.navigation(doors="open").path((-4, 0, 0), (2, 0, 0))
        self.assertEqual([leg.kind for leg in path.legs if leg.name == "door"], ["door"])
        self.assertAlmostEqual(sum(leg.length for leg in path.legs), path.length, places=9)
        self.assertGreater(path.seconds, path.length / 1.4)
        self.assertEqual(ann.go_and_wait((2, 0, 0), doors="open", speed=0.8), "arrived")

    def test_go_reports_the_door_that_is_shut_again_and_again(self):
        client = self.server()
        ann = client.spawn("ann", at=(-4, 0, 0))
        client.subscribe(notices=True)
        tag = ann.go((2, 0, 0), doors="open")
        for _ in range(600):
            client.body("door", close=True)
            client.step(20)
            ended = [one for one in client.notices() if one.tag == tag and one.kind == "blocked"]
            if ended:
                break
        self.assertEqual(ended[0].obstacle_name, "door")
        self.assertIn("commands", ended[0].text)

    def test_go_jumps_down_from_the_platform(self):
        client = self.server()
        ann = client.spawn("ann", at=(-4, 1, -2))
        with self.assertRaises(enfilade.ServerError):
            ann.go((-2, 0, 2))
        path = client.navigation().path((-4, 1, -2), (-2, 0, 2), max_drop=1.2)
        self.assertEqual([leg.kind for leg in path.legs], ["walk", "drop", "walk"])
        self.assertEqual(ann.go_and_wait((-2, 0, 2), max_drop=1.2), "arrived")
        with self.assertRaisesRegex(enfilade.ServerError, "go.max_drop|0 to 10"):
            ann.go((-2, 0, 2), max_drop=20)

    def test_a_door_that_opens_by_touch_needs_no_command(self):
        client = self.server(',"opened_by":"touch"')
        path = client.navigation(doors="open").path((-2, 0, 0), (2, 0, 0))
        self.assertTrue(path.doors[0].by_touch)
        ann = client.spawn("ann", at=(-1, 0, 0))
        self.assertEqual(ann.go_and_wait((2, 0, 0), doors="open"), "arrived")

    def test_go_waits_for_a_leaf_that_swings_towards_it(self):
        client = self.server(sidecar="""{"walk":1,"bodies":[{"name":"door","kind":"hinged","objects":["leaf"],
            "anchor":[0,0,-0.48],"limits":[0,95],"speed":60,"opened_by":"touch","closes_after":1}]}""")
        navigation = client.navigation(doors="open")
        for x, z in ((-3, 0), (3, 0), (-2, 1.5), (2, 1.5), (-2, -1.5), (2, -1.5)):
            goal = (-x, 0, 0.2)
            self.assertTrue(navigation.path((x, 0, z), goal).doors[0].by_touch)
            ann = client.spawn("ann", at=(x, 0, z))
            self.assertEqual(ann.go_and_wait(goal, doors="open"), "arrived", (x, z))
            ann.leave()
            client.step(240)  # the door closes

    def alley(self, **boxes):
        """The leaf opens into an alley of 0.86 m before it, which is closed to the other side."""
        return self.server(sidecar="""{"walk":1,"bodies":[{"name":"door","kind":"hinged","objects":["leaf"],
            "anchor":[0,0,-0.48],"limits":[0,90],"speed":60}]}""", shelf=((0.96, 0, -0.6), (1.2, 2, 1.5)),
                           end=((0.1, 0, -1), (1.2, 2, -0.6)), **boxes)

    def test_go_steps_out_of_the_swing_of_a_door_before_it_opens(self):
        client = self.alley()
        client.subscribe(contacts=True)
        ann = client.spawn("ann", at=(0.5, 0, 0.1))
        path = client.navigation(doors="open").path((0.5, 0, 0.1), (-3, 0, 0))
        self.assertEqual(path.legs[0].kind, "aside")
        self.assertGreater(path.points[path.legs[1].first][2], 0.6)
        self.assertAlmostEqual(sum(leg.length for leg in path.legs), path.length, places=9)
        self.assertEqual(ann.go_and_wait((-3, 0, 0), doors="open"), "arrived")
        self.assertNotIn("door", [one.b_name for one in client.contacts()])
        ann.leave()
        bob = client.spawn("bob", at=(-3, 0, 0))  # the door stands open now
        self.assertEqual(client.navigation(doors="open").path((0.5, 0, 1), (-3, 0, 0)).legs[0].kind, "walk")
        with self.assertRaisesRegex(enfilade.ServerError, "opens_from is 2; there are 1 waypoints"):
            bob.walk((-2, 0, 0), opens=["door"], opens_from=2)

    def test_a_door_that_opens_over_the_only_place_is_the_reason(self):
        path = self.alley(wall=((0.1, 0, 0.55), (1.2, 2, 0.7))).navigation(doors="open").path(
            (0.5, 0, 0.1), (-3, 0, 0))
        self.assertFalse(path.found)
        self.assertIn("door 'door' opens over the start", path.reason)

    def test_open_doors_leave_other_bodies_where_they_stand(self):
        client = self.server(',"closes_after":1},{"name":"crate","kind":"lift","objects":["crate"],"stops":[-3,0]',
                             crate=((0.5, 3.05, -0.45), (1.5, 4.5, 0.45)))
        navigation = client.navigation(doors="open")
        self.assertTrue(navigation.is_navigable((1, 0, 0)))
        self.assertEqual(navigation.path((-2, 0, 0), (2, 0, 0)).length, 4)
        client.body("crate", level=0)
        client.step(600)
        self.assertFalse(navigation.is_navigable((1, 0, 0)))
        self.assertGreater(navigation.path((-2, 0, 0), (2, 0, 0)).length, 4.1)

    def test_islands_have_the_reason_that_separates_them(self):
        islands = self.server().navigation().islands(3)
        self.assertIsNone(islands[0].path)
        self.assertEqual(len(islands), 3)
        reasons = {(round(one.at[1]), one.path.obstacle_name) for one in islands[1:]}
        self.assertIn((0, "door"), reasons)
        self.assertIn(1, [height for height, _ in reasons])
        self.assertTrue(all(one.path.reason for one in islands[1:]))

    def test_the_closest_point_of_an_obstacle(self):
        client = self.server()
        obstacle = client.navigation().clearance((-1, 0, 2))
        self.assertEqual(obstacle.name, "right")
        self.assertAlmostEqual(obstacle.point[0], -0.1, places=3)
        np.testing.assert_allclose(obstacle.normal, (-1, 0, 0), atol=1e-3)
        record = PathFinder(client.navigation()).closest_obstacle_surface_point((-1, 0, 2))
        self.assertAlmostEqual(record.hit_dist, 0.6, delta=0.01)
        self.assertAlmostEqual(record.hit_pos[0], -0.1, places=3)


class BuildingTest(unittest.TestCase):
    def test_go_rides_the_lift_up_and_down_through_its_doors(self):
        server = enfilade.serve(os.environ["ENFILADE_BUILDING"])
        self.addCleanup(server.stop)
        client = server.connect(timeout=120)  # building the mesh takes seconds
        self.addCleanup(client.close)
        client.lockstep()
        client.subscribe(contacts=True)
        below, above = (41, 0, -5), (38.3, 4.2, -4.5)
        ann = client.spawn("ann", at=below)
        for start, goal in ((below, above), (above, below)):
            path = client.navigation(doors="open").path(start, goal, lifts=True)
            legs = [(leg.kind, leg.name) for leg in path.legs]
            self.assertIn(("lift", "lift/cabin"), legs)
            self.assertEqual(sum(kind == "door" for kind, _ in legs), 4, "both leaves of both storeys")
            self.assertEqual(ann.go_and_wait(goal, doors="open", lifts=True), "arrived")
            feet = client.step(1, avatars=True).avatars["ann"].feet
            self.assertLess(np.linalg.norm(np.subtract(feet, goal)), 0.02)
        touched = {one.b_name for one in client.contacts() if one.a_name == "ann"}
        self.assertIn("lift/cabin", touched)
        self.assertFalse([name for name in touched if "door" in name])


if __name__ == "__main__":
    unittest.main()
