"""The Python client against the real server."""

import math
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest
import warnings
from pathlib import Path

import numpy as np

import enfilade
from enfilade import messages
from room import COLUMN, FLOOR, WALL, RoomCase


class Walking(RoomCase):
    def test_a_walk_to_the_wall_ends_at_the_wall(self):
        ann = self.client.spawn("ann", at=(0, 0.01, 0))
        self.assertEqual(ann.enter().name, "ann")
        tag = ann.walk((8, 0, 0))
        end = self.client.run_until_idle()
        # The prism's edge rests at epsilon from the wall.
        self.assertAlmostEqual(end.avatars["ann"].feet[0], 5 - 0.3 - 0.0005, delta=0.03)
        blocked = [one for one in self.client.notices() if one.kind == "blocked"]
        self.assertEqual([one.tag for one in blocked], [tag])
        self.assertEqual(blocked[0].obstacle_name, "wall")
        touched = [one for one in self.client.contacts() if one.b == WALL and one.kind == "begin"]
        self.assertEqual(len(touched), 1)
        self.assertEqual(touched[0].verdict, "separated")
        self.assertGreater(touched[0].normal[0], 0.9)
        self.assertEqual(touched[0].feature_b, "face")  # of the wall

    def test_a_contact_persists_in_each_tick_between_its_begin_and_its_end(self):
        self.client.subscribe(contacts=True, persists=True)
        ann = self.client.spawn("ann", at=(4, 0.01, 0))
        ann.enter()
        ann.walk((8, 0, 0))
        ann.walk((3, 0, 0))
        self.client.run_until_idle()
        persisting = [one for one in self.client.contacts() if one.b == WALL and one.kind != "blocked"]
        self.assertGreater(len(persisting), 100)  # she tries for two seconds
        kinds = ["begin"] + ["persist"] * (len(persisting) - 2) + ["end"]
        self.assertEqual([one.kind for one in persisting], kinds)
        first = persisting[0].tick
        self.assertEqual([one.tick for one in persisting], list(range(first, first + len(persisting))))
        self.assertEqual({one.verdict for one in persisting}, {"separated"})

    def test_a_persist_subscription_without_the_capability_warns(self):
        self.client.welcome.capabilities.remove("persists")
        with self.assertWarnsRegex(UserWarning, "persist"):
            self.client.subscribe(persists=True)

    def test_who_cannot_enter_is_not_taken_for_who_has_its_name(self):
        self.client.subscribe(notices=True)
        self.client.spawn("ann", at=(0, 0, 0)).enter()
        with self.assertRaisesRegex(enfilade.OrderFailed, "already"):
            self.client.spawn("ann", at=(1, 0, 1)).enter()

    def test_a_refused_spawn_is_reported_without_a_notice_subscription(self):
        self.client.subscribe(contacts=True)
        self.client.spawn("ann", at=(0, 0.01, 0)).enter()
        with self.assertRaisesRegex(enfilade.OrderFailed, "already"):
            self.client.spawn("ann", at=(1, 0, 1)).enter()
        with self.assertRaisesRegex(enfilade.OrderFailed, "column"):
            self.client.spawn("bob", at=(0, 0, 6)).enter()
        self.client.spawn("cat", at=(2, 0.01, 0)).enter()
        self.client.step(30)  # she falls a little
        self.assertEqual(list(self.client.notices()), [], "no client subscribed to them")
        self.assertEqual({one.a_name for one in self.client.contacts()}, {"ann", "cat"})

    def test_invalid_points_are_refused_before_anything_is_sent(self):
        for point in ("abc", (1, 2), (1, 2, 3, 4), None, (1, "x", 2)):
            with self.assertRaisesRegex(ValueError, "three numbers"):
                self.client.spawn("ann", at=point)
        with self.assertRaises(ValueError):
            self.client.step(1.5)

    def test_the_same_orders_after_a_restart_give_the_same_hash(self):
        hashes = []
        for _ in range(2):
            self.client.restart()
            ann = self.client.spawn("ann", at=(0, 0.01, 0))
            ann.enter()
            ann.drive((1, 0, 0.3))
            hashes.append(self.client.step(200).state_hash)
        self.assertEqual(*hashes)

    def test_a_restart_reports_the_avatars_that_left(self):
        with self.server.connect() as other:
            other.subscribe(contacts=True, notices=True)
            self.client.spawn("ann", at=(0, 0, 0)).enter()
            self.client.step(30)
            self.client.restart()
            self.assertEqual(self.client.step().tick, 1)
            other.metrics()
            self.assertEqual([one.reason for one in other.contacts() if one.kind == "end"],
                             ["restart"])
            self.assertEqual([one.avatar for one in other.notices() if one.kind == "left"], ["ann"])

    def test_the_clock_runs_freely_and_contacts_are_waited_for(self):
        self.client.spawn("ann", at=(0, 0.3, 0)).enter()
        self.client.free_run(speed=4)
        first = next(self.client.contacts(seconds=10))
        self.assertEqual((first.kind, first.b_name), ("begin", "floor"))
        self.client.subscribe(state=True)
        ticks = [next(self.client.states(seconds=10)).tick for _ in range(3)]
        self.assertEqual(ticks, sorted(set(ticks)))

    def test_a_pipeline_is_answered_in_order(self):
        asked = [{"step": messages.Step(ticks=i)} for i in (1, 2, 3)]
        replies = self.client.pipeline(asked)
        self.assertEqual([reply.step.tick for reply, _ in replies], [1, 3, 6])


class Refusals(RoomCase):
    def test_an_error_carries_code_field_and_remedy(self):
        with self.assertRaises(enfilade.ServerError) as caught:
            self.client.spawn("ann", at=(math.nan, 0, 0))
        error = caught.exception
        self.assertEqual((error.code, error.field), ("ERROR_REFUSED_COMMAND", "spawn.at.x"))
        self.assertIn("at.x is NaN m; give ", error.message)
        self.assertEqual(error.remedy, "", "the message has it")
        self.assertEqual(self.client.step().tick, 1)

    def test_whole_numbers_are_refused_with_name_and_range_before_anything_is_sent(self):
        max_ticks = self.client.limits.max_ticks_per_step
        with self.assertRaisesRegex(ValueError, f"ticks: give a whole number from 1 to {max_ticks}, not -1"):
            self.client.step(-1)
        with self.assertRaisesRegex(ValueError, "ticks: give a whole number, not 1.5"):
            self.client.step(1.5)
        for name, call in (("tick", lambda: self.client.seek(-1)),
                           ("width", lambda: self.client.frame(eye=(0, 1, 0), target=(1, 1, 0), width=-1)),
                           ("tick", lambda: self.client.touching("wall", tick=-1)),
                           ("entity", lambda: self.client.touching(-1)),
                           ("ids", lambda: self.client.names([1, -1])),
                           ("contact_horizon", lambda: self.client.subscribe(contact_horizon=[-1])),
                           ("columns", lambda: self.client.scan(at=(0, 1, 0), columns=2 ** 32)),
                           ("level", lambda: self.client.body("lift", level=-1)),
                           ("approaches", lambda: self.client.subscribe(contact_horizon=True, approaches=-1)),
                           ("seed", lambda: self.client.navigation().random_place(-1)),
                           ("count", lambda: self.client.navigation().islands(-1))):
            with self.assertRaisesRegex(ValueError, f"^{name}: give a whole number from 0 to "):
                call()
        self.assertEqual(self.client.step().tick, 1)

    def test_unknown_names_come_with_the_nearest_one(self):
        self.client.spawn("ann", at=(0, 0.01, 0)).enter()
        self.client.subscribe(notices=True)
        self.client.command("anm", wait=messages.Wait(seconds=1))
        self.client.step()
        self.assertIn("no avatar 'anm' is in the world; did you mean 'ann'?",
                      [one.text for one in self.client.notices()])
        with self.assertRaisesRegex(enfilade.ServerError, "no body named 'door'; the scene has no bodies"):
            self.client.body("door", open=True)

    def test_a_spawn_inside_the_column_says_why(self):
        with self.assertRaisesRegex(enfilade.OrderFailed, "column"):
            self.client.spawn("ann", at=(0, 0, 6)).enter()

    def test_a_server_with_tokens_wants_one(self):
        tokens = self.folder / "tokens"
        tokens.write_text("observe looker-0123456789\n")
        with enfilade.serve(self.scene, "--token-file", str(tokens)) as server:
            with self.assertRaises(enfilade.ServerError) as caught:
                server.connect()
            self.assertEqual(caught.exception.code, "ERROR_UNAUTHENTICATED")
            for connect in (server.connect, lambda **token: enfilade.connect(server.address, **token)):
                with connect(token="looker-0123456789") as looker:
                    self.assertGreaterEqual(looker.metrics().clients, 1)
                    with self.assertRaisesRegex(enfilade.ServerError, "role drive"):
                        looker.step()
                with self.assertRaisesRegex(enfilade.ServerError, "hello.token is unknown"):
                    connect(token="looker-0123456780")

    def test_an_error_names_its_remedy_where_it_applies(self):
        with self.assertRaises(enfilade.ServerError) as caught:
            self.client.create_world("main")
        self.assertIn("another name", caught.exception.message)
        self.assertEqual(str(caught.exception).count("clock"), 0)
        with self.server.connect() as other:
            with self.assertRaisesRegex(enfilade.ServerError, "wait until it leaves"):
                other.step()
        no_field = enfilade.ServerError(messages.ERROR_BAD_MESSAGE, "it is no message")
        self.assertEqual(no_field.remedy, "")

    def test_a_near_miss_subscription_without_near_misses_warns(self):
        with self.assertWarnsRegex(UserWarning, "--near-miss"):
            self.client.subscribe(near_misses=True)
        with enfilade.serve(self.scene, "--near-miss", "0.5") as server, server.connect() as client:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                client.subscribe(near_misses=True)
            client.spawn("ann", at=(4.4, 0.01, 0)).enter()
            self.assertIn("wall", [one.b_name for one in client.contacts() if one.kind == "near"])

    def test_a_second_driver_is_refused(self):
        with self.server.connect() as other, self.assertRaises(enfilade.ServerError) as caught:
            other.step()
        self.assertEqual(caught.exception.code, "ERROR_NOT_ALLOWED")

    def test_the_first_error_of_a_pipeline_leaves_the_others_answered(self):
        with self.assertRaises(enfilade.ServerError):
            self.client.pipeline([{"step": messages.Step(ticks=0)}, {"step": messages.Step(ticks=2)}])
        self.assertEqual(self.client.step().tick, 3)


class Seeing(RoomCase):
    def test_a_frame_has_the_wall_where_it_stands(self):
        self.need_pictures()
        frame = self.client.frame(eye=(0, 1, 0), forward=(1, 0, 0), width=33, height=21,
                                  channels=("rgb", "depth", "ids", "normals", "range"))
        np.testing.assert_allclose(frame.normals[10, 16], (-1, 0, 0), atol=1e-6)
        self.assertGreater(frame.range[10, 20], frame.depth[10, 20])
        self.assertEqual((frame.rgb.shape, frame.rgb.dtype), ((21, 33, 3), np.uint8))
        self.assertEqual((frame.depth.shape, frame.depth.dtype), ((21, 33), np.float32))
        self.assertEqual((frame.ids.shape, frame.ids.dtype), ((21, 33), np.uint32))
        self.assertEqual(frame.ids[10, 16], WALL)
        self.assertAlmostEqual(frame.depth[10, 16], 5, places=3)
        self.assertTrue(frame.depth.flags.aligned and frame.depth.flags.writeable)

    def test_avatars_are_people_or_the_shapes_that_collide(self):
        self.need_pictures()
        ann = self.client.spawn("ann", at=(2, 0.01, 0), facing=90)
        ann.enter()
        look = {"eye": (0, 1, 0), "forward": (1, 0, 0), "width": 64, "height": 64, "channels": ("ids",)}
        person, shape = (self.client.frame(collision_shapes=asked, **look) for asked in (False, True))
        self.assertEqual((person.message.collision_shapes, shape.message.collision_shapes), (False, True))
        self.assertGreater((shape.ids > 3).sum(), 1.5 * (person.ids > 3).sum())

    def test_samples_smooth_the_colour_and_shadows_are_drawn_in_large_pictures(self):
        self.need_pictures()
        look = {"eye": (0, 1, 0), "forward": (1, 0, 0.4), "renderer": "rays", "channels": ("rgb", "ids")}
        one, four = (self.client.frame(samples=n, width=40, height=30, **look) for n in (1, 4))
        self.assertEqual((one.message.samples, four.message.samples), (1, 4))
        np.testing.assert_array_equal(one.ids, four.ids)
        self.assertTrue((one.rgb != four.rgb).any())
        with self.assertRaisesRegex(enfilade.ServerError, "samples: give 1, 4 or 16"):
            self.client.frame(samples=5, width=40, height=30, **look)
        with self.assertRaisesRegex(ValueError, "samples: give 1, 4 or 16"):
            enfilade.Camera("front", samples=2)
        self.assertFalse(one.message.shadows)
        self.assertTrue(self.client.frame(width=320, height=240, **look).message.shadows)
        self.assertFalse(self.client.frame(width=320, height=240, shadows=False, **look).message.shadows)

    def test_eyes_look_along_forward_without_turning_the_avatar(self):
        self.need_pictures()
        ann = self.client.spawn("ann", at=(0, 0.01, 0), facing=0)
        ann.enter()
        side = ann.frame(forward=(0, 0, 3), width=9, height=9, channels=("ids",))
        self.assertEqual(side.ids[4, 4], COLUMN)
        self.assertIsNone(side.rgb)
        self.assertEqual(self.client.step(avatars=True).avatars["ann"].gaze[0], 1)

    def test_a_watch_sends_pictures_as_the_world_moves(self):
        self.need_pictures()
        self.client.watch(2, eye=(0, 1, 0), forward=(1, 0, 0), width=9, height=7,
                          channels=("depth",))
        first = next(self.client.frames(seconds=20))
        self.assertEqual((first.message.watch, first.tick), (2, 0))
        self.client.step()
        self.assertEqual(next(self.client.frames(seconds=20)).tick, 1)
        self.client.unwatch(2)
        self.client.step()
        self.assertEqual(list(self.client.frames(seconds=0.1)), [])

    def test_rays_and_scans_meet_what_is_there(self):
        hits = self.client.rays([(0, 1, 0), (0, 1, 0)], [(2, 0, 0), (-1, 0, 0)])
        self.assertEqual(hits.entity.tolist(), [WALL, 0])
        self.assertEqual(hits.distance[0], 5)
        self.assertTrue(np.isnan(hits.distance[1]))
        np.testing.assert_array_equal(hits.normal[0], (-1, 0, 0))
        self.assertFalse(self.client.sees((0, 1, 0), (8, 1, 0)))
        self.assertTrue(self.client.sees((0, 1, 0), (4.9, 1, 0)))
        scan = self.client.scan(at=(0, 1, 0), columns=4)
        self.assertEqual(scan.distance.shape, (1, 4))
        self.assertIn(WALL, scan.entity)

    def test_packed_rays_meet_what_the_others_meet(self):
        self.client.spawn("ann", at=(3, 0.01, 0)).enter()
        angles = np.linspace(0, 2 * np.pi, 20_001)
        directions = np.stack([np.cos(angles), 0.16 * np.sin(3 * angles), np.sin(angles)], 1)
        origins = np.tile((0.0, 1.0, 0.0), (len(angles), 1))
        packed = self.client.rays(origins, directions, reach=7)
        self.client.welcome.capabilities.remove("packed_rays")
        plain = self.client.rays(origins, directions, reach=7)
        for name in ("entity", "distance", "point", "normal"):
            np.testing.assert_array_equal(getattr(packed, name), getattr(plain, name), name)
        self.assertEqual(packed.names, plain.names)
        self.assertEqual(set(packed.names), {"", "ann", "wall", "floor", "column"})

    def test_a_scan_has_its_angles_where_they_are_said_to_be(self):
        full = self.client.scan(at=(0, 1, 0), columns=8)
        self.assertEqual(full.entity[0].tolist(), [0, 0, 0, 0, WALL, 0, COLUMN, 0])
        self.assertAlmostEqual(full.distance[0, 4], 5, places=5)
        part = self.client.scan(at=(0, 1, 0), width=np.pi, height=2.0, columns=3, rows=3)
        self.assertEqual(part.entity[1].tolist(), [0, WALL, COLUMN], "+Z is to the right")
        down = self.client.scan(at=(0, 1, 0), forward=(1, -1, 0), columns=1, rows=1)
        self.assertAlmostEqual(down.distance[0, 0], 2 ** 0.5, places=5)

    def test_pairs_are_given_by_id_name_and_avatar(self):
        ann = self.client.spawn("ann", at=(0, 0, 0))
        ann.enter()
        wall = self.client.distance("wall", COLUMN)
        self.assertAlmostEqual(wall.distance, (4.75 ** 2 + 1.75 ** 2) ** 0.5, places=6)
        self.assertEqual((wall.a, wall.a_name, wall.b_name), (WALL, "wall", "column"))
        self.assertIn(wall.feature_a, ("vertex", "edge"))  # upright edges of both, side by side
        self.assertIn(wall.feature_b, ("vertex", "edge"))
        first, second = self.client.distances([(ann, WALL), ("ann", "floor")], refined=True)
        self.assertAlmostEqual(first.distance, 4.7, delta=0.02)
        self.assertEqual(second.verdict, "separated")
        self.assertLess(second.distance, 0.01)
        self.assertEqual(len(self.client.distances([(WALL, FLOOR)] * 2001)), 2001)
        self.assertEqual(self.client.distances([]), [])

    def test_the_plan_of_a_storey_has_its_walls(self):
        plan = self.client.floor_plan(0)
        self.assertEqual({shape.entity: shape.kind for shape in plan.shapes}, {WALL: "wall", COLUMN: "wall"})
        wall = next(shape for shape in plan.shapes if shape.entity == WALL)
        self.assertEqual(len(wall.loops), 1)
        np.testing.assert_allclose([wall.loops[0].min(axis=0), wall.loops[0].max(axis=0)], [(5, -4), (5.2, 4)], atol=1e-6)
        self.assertEqual((plan.storey, plan.rooms, plan.north), ("", (), None))
        with self.assertRaisesRegex(enfilade.ServerError, "floor_plan.floor"):
            self.client.floor_plan(math.nan)

    def test_what_is_near_comes_nearest_first(self):
        ann = self.client.spawn("ann", at=(0, 0, 0))
        ann.enter()
        near = self.client.touching(ann, within=5)
        self.assertEqual([one.b_name for one in near.found], ["floor", "wall"])
        self.assertEqual(near.left_out, 0)
        self.assertEqual(near.mounting, [])  # of driven bodies alone
        self.assertEqual([one.b_name for one in self.client.touching(COLUMN).found], ["floor"])

    def test_two_avatars_do_not_touch_before_the_reported_time(self):
        ann = self.client.spawn("ann", at=(0, 0, 0))
        ann.enter()
        ann.drive((2, 0, 0))
        self.client.step(10)
        reply = self.client.cannot_touch_before(ann, "wall")
        self.assertAlmostEqual(reply.before, reply.now.distance / 2, delta=0.02)
        self.assertTrue(reply.proved)
        self.client.step(int(reply.before / self.client.tick_seconds) - 1)
        self.assertEqual(self.client.distance(ann, "wall").verdict, "separated")
        self.assertLess(self.client.distance(ann, "wall").distance, 0.1)
        sooner = self.client.cannot_touch_before(ann, "column", assume="any_command")
        self.assertLess(sooner.before, 0.1)
        self.assertEqual(self.client.cannot_touch_before("wall", "column").before, float("inf"))

    def test_no_contact_begins_before_its_horizon(self):
        with enfilade.serve(self.scene, "--speed-limit", "2") as server, server.connect() as client:
            ann = client.spawn("ann", at=(0, 0.001, 0))
            ann.enter()
            state = client.step(30, avatars=True).avatars["ann"]
            client.subscribe(contacts=True, contact_horizon=[state.id], approaches=16)
            ann.walk((8, 0, 0))
            client.step(300)
            horizons = list(client.horizons())
            self.assertEqual({one.avatar for one in horizons}, {state.id})
            self.assertEqual(horizons[0].touching, (FLOOR,))
            self.assertEqual(horizons[0].unbounded, 0)
            self.assertGreater(horizons[0].not_before, horizons[0].time)
            self.assertEqual(horizons[0].not_before, horizons[0].approaches[0][1])
            wall, = [one for one in client.contacts() if one.kind == "begin"]
            self.assertEqual(wall.b, WALL)
            proved = [time for one in horizons if one.tick < wall.tick
                      for entity, time in one.approaches if entity == WALL]
            self.assertGreater(len(proved), 3)
            self.assertLessEqual(max(proved), wall.time)
            self.assertIn(WALL, horizons[-1].touching)
            self.assertLess(len(horizons), 300)
            client.subscribe(contact_horizon=True)
            client.step()
            self.assertEqual(len(next(client.horizons()).approaches), 1)

    def test_horizons_of_no_avatar_are_refused(self):
        with self.assertRaisesRegex(ValueError, "contact_horizon"):
            self.client.subscribe(contact_horizon=[])
        with self.assertRaises(enfilade.ServerError) as caught:
            self.client.subscribe(contact_horizon=[WALL])
        self.assertEqual(caught.exception.field, "subscribe.contact_horizon.avatars[0]")
        self.client.welcome.capabilities.remove("contact_horizon")
        with self.assertWarnsRegex(UserWarning, "horizon"):
            self.client.subscribe(contact_horizon=True)

    def test_queries_about_unknown_entities_are_refused(self):
        for which in ("unknown", 99):
            with self.assertRaises(enfilade.ServerError) as caught:
                self.client.distance(which, "wall")
            self.assertEqual(caught.exception.code, "ERROR_UNKNOWN_ENTITY")
            self.assertEqual(caught.exception.field, "distances.pairs[0].a")
        with self.assertRaises(enfilade.ServerError) as caught:
            self.client.touching("wall", within=float("nan"))
        self.assertEqual(caught.exception.field, "touching.within")
        with self.assertRaises(ValueError):
            self.client.cannot_touch_before("wall", "column", assume="luck")

    def test_names_come_for_ids(self):
        self.assertEqual(self.client.names([WALL, COLUMN, 99]),
                         {WALL: "wall", COLUMN: "column", 99: ""})


class Connections(RoomCase):
    def test_a_refused_connection_is_reported_with_a_remedy(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            with self.assertRaisesRegex(enfilade.ConnectionFailed, "enfilade serve"):
                enfilade.connect(f"127.0.0.1:{free.getsockname()[1]}")

    def _fake(self, answer):
        listener = socket.create_server(("127.0.0.1", 0))
        self.addCleanup(listener.close)

        def serve():
            peer = listener.accept()[0]
            peer.recv(1000)
            peer.sendall(answer)
            time.sleep(0.05)
            peer.close()

        thread = threading.Thread(target=serve)
        thread.start()
        self.addCleanup(thread.join)
        return f"127.0.0.1:{listener.getsockname()[1]}"

    def test_another_kind_of_server_is_reported(self):
        with self.assertRaisesRegex(enfilade.ConnectionFailed, "does not speak this protocol"):
            enfilade.connect(self._fake(b"HTTP/1.1 400 Bad Request\r\n\r\n"))

    def test_a_message_that_claims_too_much_is_not_waited_for(self):
        with self.assertRaisesRegex(enfilade.ConnectionFailed, "claims 4294967295 bytes"):
            enfilade.connect(self._fake(b"ENF1\xff\xff\xff\xff\x04\0\0\0"))

    def test_half_a_message_and_then_the_end_is_reported(self):
        with self.assertRaises(enfilade.ConnectionFailed):
            enfilade.connect(self._fake(b"ENF1\x20\0\0\0\x16\0\0\0\x08"))

    def test_a_server_that_dies_is_reported_with_its_exit(self):
        with enfilade.serve(self.scene) as server:
            client, stranger = server.connect(), enfilade.connect(server.address)
            server.process.kill()
            with self.assertRaisesRegex(enfilade.ConnectionFailed, "ended by signal 9"):
                client.step()
            with self.assertRaisesRegex(enfilade.ConnectionFailed, "the server ended, was killed, or"):
                stranger.step()
        with enfilade.serve(self.scene) as server:
            client = server.connect()
            server.process.terminate()
            with self.assertRaises(enfilade.ServerError) as caught:
                for _ in range(10_000):
                    client.step()
            self.assertEqual(caught.exception.code, "ERROR_SHUTTING_DOWN")

    def test_a_silent_server_is_given_up_in_time(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            with self.assertRaisesRegex(enfilade.ConnectionFailed, "within 0.1 s"):
                enfilade.connect(f"127.0.0.1:{listener.getsockname()[1]}", timeout=0.1)

    def test_the_end_of_a_server_comes_with_its_reason(self):
        server = enfilade.serve(self.scene)
        client = server.connect()
        self.addCleanup(client.close)
        self.assertEqual(server.stop(), 0)
        with self.assertRaises(enfilade.ServerError) as caught:
            client.step()
        self.assertEqual(caught.exception.code, "ERROR_SHUTTING_DOWN")
        self.assertTrue(caught.exception.fatal)


class Processes(RoomCase):
    def test_a_missing_scene_is_reported_at_once(self):
        with self.assertRaisesRegex(enfilade.StartFailed, "nowhere.glb"):
            enfilade.serve("nowhere.glb")

    def test_a_server_does_not_outlive_the_python_that_started_it(self):
        code = ("import enfilade, os, sys, time\n"
                "server = enfilade.serve(sys.argv[1])\n"
                "print(server.process.pid, flush=True)\n"
                "time.sleep(60)\n")
        python = subprocess.Popen([sys.executable, "-c", code, str(self.scene)],
                                  stdout=subprocess.PIPE)
        server = int(python.stdout.readline())
        python.send_signal(signal.SIGKILL)
        python.communicate()
        for _ in range(1000):
            try:
                stat = Path(f"/proc/{server}/stat").read_text()
            except FileNotFoundError:
                return
            if stat.rpartition(")")[2].split()[0] == "Z":
                return
            time.sleep(0.01)
        self.fail("the server still runs")


class Worlds(RoomCase):
    def test_a_world_is_made_entered_listed_and_dropped(self):
        self.assertEqual((self.client.world, self.client.scenes), ("main", ["room"]))
        made = self.client.create_world("attic")
        self.assertEqual((made.name, made.scene, made.tick, made.clock), ("attic", "room", 0, "lockstep"))
        with self.server.connect(world="attic") as other:
            other.step(3)
            self.assertEqual(self.client.step().tick, 1)
            seen = self.client.worlds()["attic"]
            self.assertEqual((seen.clients, seen.tick, seen.driven), (1, 3, True))
            self.client.drop_world("attic")
            with self.assertRaisesRegex(enfilade.ServerError, "was dropped"):
                other.step()
        self.assertEqual(list(self.client.worlds()), ["main"])

    def test_one_that_is_not_there_cannot_be_entered_or_dropped(self):
        with self.assertRaisesRegex(enfilade.ServerError, "no world 'cellar'.*the worlds are 'main'"):
            self.server.connect(world="cellar")
        with self.assertRaisesRegex(enfilade.ServerError, "no world 'cellar'"):
            self.client.drop_world("cellar")
        with self.assertRaisesRegex(enfilade.ServerError, "name"):
            self.client.create_world("a b")


if __name__ == "__main__":
    unittest.main()
