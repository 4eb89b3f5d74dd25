"""Queries of a client about its world, at the last tick or an earlier one."""

from __future__ import annotations

import warnings
from typing import Any, Dict, Iterable, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import messages, results
from .arguments import optional_whole, whole
from .avatar import Avatar
from .errors import EnfiladeError
from .exchange import Exchange
from .plans import FloorPlan, floor_plan
from .query_messages import Point, cannot_touch_query, entity, frame_request, points, vec
from .results import Apart, Frame, Hits, Pair, Scan, Touching

Entity = Union[int, str, Avatar]  # an id, a name or a path


class WorldQueries(Exchange):
    """The part of a Client that asks for pictures, rays, distances, contacts and names. No query
    changes the world."""

    # ---- pictures ---------------------------------------------------------------------------

    def frame(self, avatar: str = "", *, eye: Optional[Point] = None,
              target: Optional[Point] = None, forward: Optional[Point] = None,
              up: Optional[Point] = None, width: int = 640, height: int = 480,
              fov_y: Optional[float] = None, intrinsics: Optional[Sequence[float]] = None,
              height_y: Optional[float] = None, near: Optional[float] = None,
              far: Optional[float] = None, channels: Sequence[str] = ("rgb",), glass: str = "",
              renderer: str = "", shadows: Optional[bool] = None, lens: str = "",
              distortion: Sequence[float] = (), depth_noise: Union[None, int, Mapping[str, Any]] = None,
              flow_from: Optional[int] = None, flow_forward: Optional[Point] = None,
              collision_shapes: bool = False, samples: int = 1, tick: Optional[int] = None) -> Frame:
        """Returns a picture of the last tick. It is taken from the eyes of `avatar` (along `forward`
        if given), or from `eye` towards `target` or along `forward`; `avatar` is then invisible.
        `up` (with an eye) must not be parallel to the view: straight down needs one. The lens:
        `fov_y` radians, or `intrinsics` (fx, fy, cx, cy) in pixels from the top left corner, or,
        with an eye, `height_y` metres of an orthographic picture. `channels`: some of "rgb", "depth", "ids",
        "normals", "range", "class", "thing", "flow". `glass`: "clear" or "solid". `renderer`: "gl" or "rays".
        `shadows`: of the sun, in the colour; None: where they cost little. `lens`: "fisheye" (OpenCV's model;
        `fov_y` is then the angle of the whole width, default pi, or `intrinsics` replace it; `distortion`
        k1 to k4) or "equirectangular", which has neither. `depth_noise`: the seed of a structured-light
        camera's noise in "depth", or {"model": "redwood", "seed":, "scale":, "distortion": FILE}, see
        load_distortion(). `flow_from`: the earlier tick of the channel "flow", of the last 32, and
        `flow_forward` the direction in which the avatar looked then, if `forward` is given. `collision_shapes`
        draws avatars as these, not as people. `samples`: 1, 4 or 16 of the colour in each pixel."""
        query = frame_request(avatar, eye=eye, target=target, forward=forward, up=up, width=width,
                              height=height, fov_y=fov_y, intrinsics=intrinsics, height_y=height_y,
                              near=near, far=far, channels=channels, glass=glass,
                              renderer=renderer, shadows=shadows, lens=lens, distortion=distortion,
                              depth_noise=depth_noise, flow_from=flow_from,
                              flow_forward=flow_forward, collision_shapes=collision_shapes,
                              samples=samples, tick=tick)
        if samples != 1 and "samples" not in self.welcome.capabilities:
            warnings.warn("frame: this server draws one sample a pixel; start a newer one", stacklevel=2)
        if shadows and "shadows" not in self.welcome.capabilities:
            warnings.warn("frame: this server draws no shadows; start a newer one", stacklevel=2)
        reply, attachment = self.request(frame=query)
        return results.frame(reply.frame, attachment)

    def watch(self, number: int = 1, avatar: str = "", *, rate: float = 0.0, **view: Any) -> None:
        """Subscribes to pictures: one at once, then as ticks run, at most `rate` per second of
        simulated time (0: one per tick). `view` as for frame(). frames() takes them, the latest
        only."""
        self.request(watch_frames=messages.WatchFrames(
            watch=whole(number, "number"), rate=rate, frame=frame_request(avatar, **view)))

    def unwatch(self, number: int = 1) -> None:
        self.request(watch_frames=messages.WatchFrames(watch=whole(number, "number")))

    def frames(self, seconds: float = 0.0) -> Iterator[Frame]:
        """Takes the pictures of watches: Frame.message.watch names the watch, and .dropped counts
        the omitted pictures."""
        return self._taken(self._frames, seconds)

    # ---- rays -------------------------------------------------------------------------------

    def rays(self, origins: Any, directions: Any, *, reach: float = 0.0, through_avatar: str = "",
             through_glass: bool = False) -> Hits:
        """Returns the first hit of each ray, within `reach` metres (0: unlimited); N x 3 numbers
        each. limits.max_rays determines the number of requests."""
        origins, directions = points(origins, "origins"), points(directions, "directions")
        if len(origins) != len(directions):
            raise ValueError(f"rays: {len(origins)} origins and {len(directions)} directions")
        page = min(self.limits.max_rays, (self.limits.max_message - 512) // results.RAY_BYTES)
        packed = "packed_rays" in self.welcome.capabilities
        replies: List[Hits] = []
        for start in range(0, max(1, len(origins)), page):
            options = messages.RayQuery(through_avatar=through_avatar, through_glass=through_glass, packed=packed)
            query = results.RayRequest(next(self._ids), origins[start:start + page],
                                       directions[start:start + page], reach, options)
            self._send([query])
            reply, attachment = self.take([query.request_id])[0]
            replies.append(results.packed_hits(reply.rays, attachment) if packed else
                           results.hits(reply.rays))
        if replies[0].tick != replies[-1].tick:
            raise EnfiladeError(f"rays: the clock advanced between the requests, from tick "
                                f"{replies[0].tick} to {replies[-1].tick}: pause() first, or give "
                                f"at most {page}")
        return results.joined(replies)

    def sees(self, origin: Point, target: Point, *, through_avatar: str = "") -> bool:
        """Returns whether the line between two points (x, y, z), in metres of the scene's frame, is
        free. Avatars block it, also this client's own, except `through_avatar`. From an avatar's
        eyes: origin = AvatarState.eyes. There is no angle of view: the target may lie behind it."""
        direction = [t - o for o, t in zip(origin, target)]
        reach = sum(d * d for d in direction) ** 0.5
        ray = messages.Ray(origin=vec(origin), direction=vec(direction), reach=reach)
        reply, _ = self.request(rays=messages.RayQuery(
            rays=[ray], only_blocked=True, through_avatar=through_avatar))
        return not reply.rays.hits[0].met

    def scan(self, avatar: str = "", *, at: Optional[Point] = None, forward: Optional[Point] = None,
             up: Optional[Point] = None, width: float = 6.283185307179586, height: float = 0.0,
             columns: int = 360, rows: int = 1, reach: float = 0.0, through_avatar: str = "",
             through_glass: bool = False) -> Scan:
        """Returns a range scan over `width` x `height` radians, from an avatar's eyes along its view
        direction, or from `at` along +X; `forward` replaces either as angle 0. Column c has the angle
        -width/2 + c * width / (columns - 1), from left to right. In a full turn, the default, it is
        -pi + c * 2 pi / columns: column 0 looks backwards and column columns/2 ahead. Row r has
        height/2 - r * height / (rows - 1), from the top. Angles are about `up` (default +Y); only
        its component perpendicular to forward counts. From (1, 0, 0), +Z is to the right."""
        if (at is None) == (not avatar):
            raise ValueError("scan: give either an avatar or at")
        scan = messages.RangeScan(width=width, height=height, columns=whole(columns, "columns"),
                                  rows=whole(rows, "rows"), reach=reach)
        if at is not None:
            scan.at.CopyFrom(vec(at))
        else:
            scan.avatar = avatar
        if forward is not None:
            scan.forward.CopyFrom(vec(forward))
        if up is not None:
            scan.up.CopyFrom(vec(up))
        reply, attachment = self.request(rays=messages.RayQuery(
            scan=scan, through_avatar=through_avatar, through_glass=through_glass))
        return results.scan(reply.rays, attachment)

    # ---- distances and contacts -------------------------------------------------------------

    def distance(self, a: Entity, b: Entity, refined: bool = False, *,
                 tick: Optional[int] = None) -> Pair:
        """Returns the exact relation of two entities, each an id, a name, a path or an Avatar.
        `refined`: within 1e-15 of the distance, and with the penetration depth."""
        return self.distances([(a, b)], refined, tick=tick)[0]

    def distances(self, pairs: Sequence[Tuple[Entity, Entity]], refined: bool = False, *,
                  tick: Optional[int] = None) -> List[Pair]:
        """distance() of many pairs at one tick, in their order. limits.max_pairs determines the
        number of requests."""
        found: List[Pair] = []
        page = self.limits.max_pairs
        for start in range(0, len(pairs), page):
            query = messages.DistanceQuery(refined=refined, tick=optional_whole(tick, "tick"), pairs=[
                messages.DistanceQuery.Pair(a=entity(a), b=entity(b))
                for a, b in pairs[start:start + page]])
            reply = self.request(distances=query)[0].distances
            found += [results.pair(one, reply.tick) for one in reply.pairs]
        if found and found[0].tick != found[-1].tick:
            raise EnfiladeError(f"distances: the clock advanced between the requests, from tick "
                                f"{found[0].tick} to {found[-1].tick}: pause() first, or give at "
                                f"most {page}")
        return found

    def touching(self, which: Entity, within: float = 0.0, *,
                 tick: Optional[int] = None) -> Touching:
        """Returns the entities that touch or penetrate one, and those closer than `within` metres."""
        reply, _ = self.request(touching=messages.TouchingQuery(
            entity=entity(which), within=within, tick=optional_whole(tick, "tick")))
        return results.touching(reply.touching)

    def cannot_touch_before(self, a: Entity, b: Entity, *, assume: str = "present_motion",
                            least: float = 0.0, tick: Optional[int] = None) -> Apart:
        """Returns a time before which two entities cannot touch: if the "present_motion" continues, or under
        "any_command" to avatars and bodies. `least`: the shortest useful waiting time (seconds)."""
        return results.apart(self.request(cannot_touch=cannot_touch_query(a, b, assume, least, tick))[0].cannot_touch)

    # ---- the scene --------------------------------------------------------------------------

    def floor_plan(self, floor: float) -> FloorPlan:
        """Returns the plan of the storey whose floor is at a height (metres): what a plane cuts 1.2 m above."""
        return floor_plan(self.request(floor_plan=messages.FloorPlanRequest(floor=floor))[0].floor_plan)

    def names(self, ids: Union[np.ndarray, Iterable[int]]) -> Dict[int, str]:
        """Returns the path of an object or the name of an avatar, by entity id; "" for an unknown
        id. An array may have any shape: names(picture.ids)."""
        if isinstance(ids, np.ndarray):
            ids = np.unique(ids).tolist()
        wanted = list(dict.fromkeys(whole(one, "ids") for one in ids))
        found: Dict[int, str] = {}
        page = 4096
        for start in range(0, len(wanted), page):
            reply, _ = self.request(
                describe=messages.DescribeEntities(ids=wanted[start:start + page]))
            found.update((one.id, one.name) for one in reply.names.entities)
        return found

    def objects(self) -> List[results.ObjectInfo]:
        """Returns all objects of the scene, in the order of their ids, with path, class, thing, box,
        storey and material."""
        count, page = self.welcome.scene.objects, 8192
        found: List[results.ObjectInfo] = []
        for first in range(1, count + 1, page):
            ids = range(first, min(first + page, count + 1))
            reply, _ = self.request(describe=messages.DescribeEntities(ids=ids, details=True))
            found += [results.object_info(one) for one in reply.names.entities]
        return found

    def metrics(self) -> Any:
        return self.request(metrics=messages.MetricsRequest())[0].metrics
