"""An avatar and the orders that its client gives it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional, Sequence, Tuple, Union

from . import messages
from .errors import OrderFailed
from .arguments import whole
from .query_messages import Point, doors_value, vec
from .results import AvatarState, Frame

if TYPE_CHECKING:
    from .client import Client

WAIT_TICKS = 15  # between two looks at the notices
ENTRY_TICKS = 3  # maximum of enter(): an earlier avatar of the name leaves in the first


class Avatar:
    """An avatar of this client. Orders are queued and executed as ticks run."""

    def __init__(self, client: Client, name: str) -> None:
        self._client = client
        self.name = name
        self.entry = 0  # the tag of its spawn

    def enter(self) -> AvatarState:
        """Runs ticks, in lockstep, until the avatar is in the world: one, or two if an earlier
        avatar of this name is about to leave. Raises OrderFailed if it cannot enter."""
        with self._client._with_notices():
            for _ in range(ENTRY_TICKS):
                state = self._client.step(1, avatars=True).avatars.get(self.name)
                # Checked before the state, which may belong to another avatar of the same name.
                why = [one.text for one in self._client._notices
                       if one.tag == self.entry and one.avatar == self.name and
                       one.kind == "refused"]
                if why:
                    raise OrderFailed(f"avatar {self.name!r} did not enter: {why[-1]}")
                if state is not None:
                    return state
        raise OrderFailed(f"avatar {self.name!r} did not enter within {ENTRY_TICKS} ticks; did "
                          "another call set the clock or drop its spawn?")

    def walk(self, *along: Point, speed: Optional[float] = None, opens: Sequence[str] = (),
             opens_from: int = 0, rides: Sequence[Tuple[int, str, int]] = (),
             from_floor: bool = False) -> int:
        """Walks to each of the points in turn. Opens the doors `opens` when they are in its way, after it has
        reached `opens_from` points. `rides`: before point number WAYPOINT a LIFT must stand at a LEVEL; it
        is called. `from_floor`: if the avatar falls, the walk begins when it stands, as that of go() does."""
        order = messages.Walk(
            along=[vec(point) for point in along], opens=opens, opens_from=whole(opens_from, "opens_from"),
            from_floor=from_floor,
            rides=[messages.Walk.Ride(waypoint=whole(waypoint, "rides: the waypoint"), lift=lift,
                                      level=whole(level, "rides: the level"))
                   for waypoint, lift, level in rides])
        if speed is not None:
            order.speed = speed
        return self._client.command(self.name, walk=order)

    def go(self, to: Union[Point, str], *, speed: Optional[float] = None,
           doors: str = "as_they_are", max_drop: float = 0.0, lifts: bool = False) -> int:
        """Walks along a path to a point, or to a room, storey, object or body by name. With doors="open" it
        opens those on the path. It may jump down by `max_drop` metres, and ride `lifts`. Raises ServerError
        with the reason if there is no path."""
        place = messages.NavigationPlace(name=to) if isinstance(to, str) else \
            messages.NavigationPlace(point=vec(to))
        return self._client.command(self.name, go=messages.Go(
            to=place, speed=speed, doors=doors_value(doors), max_drop=max_drop, lifts=lifts,
            progress=True))  # each message restarts the wait for the reply

    def walk_and_wait(self, *along: Point, **options: Any) -> str:
        """walk(), then ticks in lockstep until it ends. Returns "arrived", or "blocked by NAME"."""
        return self._wait_for(self.walk(*along, **options))

    def go_and_wait(self, to: Union[Point, str], **options: Any) -> str:
        """go(), then ticks in lockstep until it ends; as walk_and_wait()."""
        return self._wait_for(self.go(to, **options))

    def _wait_for(self, tag: int) -> str:
        with self._client._with_notices():
            while True:
                self._client.step(WAIT_TICKS)
                for one in self._client._notices:
                    if one.avatar != self.name or one.tag != tag:
                        continue
                    if one.kind == "arrived":
                        return "arrived"
                    if one.kind == "blocked":
                        return f"blocked by {one.obstacle_name}" if one.obstacle_name else one.text
                    if one.kind in ("refused", "dropped"):
                        raise OrderFailed(f"avatar {self.name!r}: {one.text}")

    def turn(self, by: Optional[float] = None, *, facing: Optional[float] = None,
             rate: Optional[float] = None) -> int:
        """Turns the view, parts and links `by` DEGREES to the left, or to a facing, at `rate` degrees
        a second."""
        if (by is None) == (facing is None):
            raise ValueError("turn: give either by or facing, in degrees")
        return self._client.command(self.name, turn=messages.Turn(by=by, facing=facing, rate=rate))

    def teleport(self, at: Point, *, facing: Optional[float] = None) -> int:
        """Places it elsewhere, if it has room there."""
        return self._client.command(self.name, teleport=messages.Teleport(at=vec(at), facing=facing))

    def look(self, at: Point) -> int:
        """Looks at a point; while driven, until the next drive() or walk()."""
        return self._client.command(self.name, look=messages.Look(at=vec(at)))

    def wait(self, seconds: float) -> int:
        return self._client.command(self.name, wait=messages.Wait(seconds=seconds))

    def drive(self, velocity: Point) -> int:
        """Moves at this velocity from now on and drops the queue. Zero stops."""
        return self._client.command(self.name, drive=messages.Drive(velocity=vec(velocity)))

    def jump(self, height: Optional[float] = None) -> int:
        return self._client.command(self.name, jump=messages.Jump(height=height))

    def fly(self, on: bool = True) -> int:
        return self._client.command(self.name, fly=messages.Fly(on=on))

    def crouch(self, height: Optional[float] = None) -> int:
        return self._client.command(self.name, crouch=messages.Crouch(height=height))

    def drive_joints(self, values: Sequence[Optional[float]], *, speed: Optional[float] = None,
                     at_once: bool = False) -> int:
        """Moves the joints to these values, one per link; None leaves a joint unchanged."""
        target = messages.DriveJoints.Target
        return self._client.command(self.name, drive_joints=messages.DriveJoints(
            to=[target(value=value) for value in values], speed=speed, at_once=at_once))

    def leave(self) -> int:
        return self._client.command(self.name, leave=messages.Leave())

    def frame(self, **options: Any) -> Frame:
        """Returns a picture from its eyes; options as for Client.frame()."""
        return self._client.frame(self.name, **options)
