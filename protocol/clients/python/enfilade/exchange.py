"""The messages of one client: requests and their replies, and what comes unsolicited."""

from __future__ import annotations

import contextlib
import itertools
import time
import warnings
from collections import deque
from typing import Any, Callable, Deque, Dict, Iterable, Iterator, List, Optional, Tuple, Union

from . import messages, results
from .arguments import whole
from .connection import Received, raise_refusal, server_error
from .errors import ConnectionFailed, EnfiladeError, ServerError
from .query_messages import avatar_ids
from .results import Contact, Frame, Horizon, Notice, Replay, State

KEPT_FRAMES = 16  # of watches, until frames() takes them; the oldest are dropped first
MAX_AT_ONCE = 10_000  # messages that are received without waiting, before their content is returned

Reply = Tuple[Any, memoryview]  # a message and its attachment


class Exchange:
    """The part of a Client that sends requests and takes their replies and the events in between."""

    def _start(self, connection: Any) -> None:
        self._connection = connection
        self.welcome: Any = None  # the server's reply to Hello
        self._ids = itertools.count(1)
        self._tags = itertools.count(1)
        self._contacts: Deque[Contact] = deque()
        self._notices: Deque[Notice] = deque()
        self._horizons: Deque[Horizon] = deque()
        self._states: Deque[State] = deque(maxlen=1)
        self._frames: Deque[Frame] = deque(maxlen=KEPT_FRAMES)
        self._replay: Optional[Replay] = None  # as last reported
        self._subscribed: Any = messages.Subscribe()
        self._sequence = 0  # of the last events
        self._answered = 0  # the request of the last reply taken
        self._show_progress: Optional[Callable[[float], None]] = None  # of navigation meshes

    # ---- the server --------------------------------------------------------------------------

    @property
    def tick_seconds(self) -> float:
        return self.welcome.policies.tick

    @property
    def limits(self) -> Any:
        return self.welcome.limits

    @property
    def capabilities(self) -> List[str]:
        return list(self.welcome.capabilities)

    @property
    def renderer(self) -> str:
        """The renderer's name; empty if the server cannot draw."""
        return self.welcome.renderer

    @property
    def bodies(self) -> Dict[str, Any]:
        """Doors, lifts and all other bodies, by name."""
        return {body.name: body for body in self.welcome.scene.bodies}

    # ---- requests ---------------------------------------------------------------------------

    def pipeline(self, requests: Iterable[Dict[str, Any]]) -> List[Reply]:
        """Sends several requests in one write and takes their replies, in order. A request is
        {"step": messages.Step(ticks=1)}. After all replies, the first failure is raised."""
        return self.take(self.post(requests))

    def post(self, requests: Iterable[Dict[str, Any]]) -> List[int]:
        """The first half of pipeline(): sends without waiting. Returns the request ids."""
        batch = [messages.ClientMessage(**body) for body in requests]
        posted = self._post(batch)
        for one in batch:
            if one.HasField("subscribe"):
                self._subscribed = one.subscribe
        return posted

    def _post(self, batch: List[Any]) -> List[int]:
        """Numbers and sends ClientMessages, which the caller may use again."""
        posted = [next(self._ids) for _ in batch]
        for one, number in zip(batch, posted):
            one.request_id = number
        self._send(batch)
        return posted

    def _send(self, batch: List[Any]) -> None:
        try:
            self._connection.send(batch)
        except ConnectionFailed:
            self._raise_final_error()
            raise

    def take(self, posted: List[int]) -> List[Reply]:
        """The second half: returns the replies to the posted requests, in their order. After all
        replies, the first refusal is raised."""
        replies = self.replies(posted)
        for reply, _ in replies:
            raise_refusal(reply)
        return replies

    def replies(self, posted: List[int]) -> List[Reply]:
        """As take(), but does not raise refusals: see raise_refusal()."""
        return [self._reply_to(one) for one in posted]

    def request(self, **body: Any) -> Reply:
        """Sends one request, as step=messages.Step(ticks=1). Returns the reply and its attachment."""
        return self.pipeline([body])[0]

    def _raise_final_error(self) -> None:
        """Raises the server's final error, if any: it says more than a broken pipe."""
        try:
            while self._await_events(0.0):
                pass
        except ConnectionFailed:
            pass

    def _reply_to(self, request_id: int) -> Reply:
        if request_id <= self._answered:
            raise EnfiladeError(f"the reply to request {request_id} was discarded: a later one was "
                                "taken first")
        while True:
            received = self._connection.next()
            assert received is not None  # None only with a time limit
            if received.message.reply_to == request_id:
                self._answered = request_id
                self._connection.done(received)
                return received.message, received.attachment
            self._keep(received, request_id)

    def _keep(self, received: Received, awaited: int = 0) -> None:
        """Keeps a message that does not reply to `awaited`. An interrupted call can be repeated."""
        message = received.message
        body = message.WhichOneof("body")
        if message.reply_to != 0:
            # Replies come in order: an earlier one belongs to an interrupted request.
            if awaited and message.reply_to > awaited:
                raise self._connection._failed(f"it replies to request {message.reply_to}, not to "
                                               f"request {awaited}")
        elif body == "events":
            self._keep_events(received)
        elif body == "state":
            self._states.append(results.state(message.state))
        elif body == "replay":
            self._replay = results.replay(message.replay)
        elif body == "navigation_progress" and self._show_progress:
            self._show_progress(message.navigation_progress.share)
        elif body == "frame":
            if not self._frames or self._frames[-1].message != message.frame:
                self._frames.append(results.frame(message.frame, received.attachment))
        elif body == "error":
            self._connection.broken = message.error.message
            self._connection.done(received)
            raise server_error(message.error, fatal=True)
        elif body == "bye":
            self._connection.broken = f"the server ended the connection: {message.bye.reason}"
            self._connection.done(received)
            raise ServerError(message.bye.code, message.bye.reason, fatal=True)
        self._connection.done(received)

    def _keep_events(self, received: Received) -> None:
        events = received.message.events
        if received.marks is None:
            received.marks = (self._sequence + 1, len(self._contacts), len(self._notices), len(self._horizons))
        sequence, contacts, notices, horizons = received.marks
        if events.sequence != sequence:
            raise self._connection._failed(
                f"received events {events.sequence} instead of {sequence}")
        for kept, length in ((self._contacts, contacts), (self._notices, notices),
                             (self._horizons, horizons)):
            while len(kept) > length:  # of an interrupted attempt
                kept.pop()
        self._contacts.extend([results.contact(one) for one in events.contacts])
        self._notices.extend([results.notice(one) for one in events.notices])
        self._horizons.extend([results.horizon(one, events) for one in events.horizons])
        self._sequence = sequence

    def _await_events(self, seconds: float) -> bool:
        """Receives one unsolicited message; False if none came in time."""
        received = self._connection.next(seconds)
        if received is not None:
            self._keep(received)
        return received is not None

    # ---- events -----------------------------------------------------------------------------

    def subscribe(self, *, contacts: bool = False, near_misses: bool = False, notices: bool = False,
                  state: bool = False, state_rate: float = 0.0,
                  persists: bool = False,
                  contact_horizon: Union[bool, Iterable[int]] = False,
                  approaches: int = 1) -> List[Contact]:
        """Selects the unsolicited messages, instead of the previous selection. Returns the active
        contacts, as they began (with contacts=True). All contacts and notices are kept until they
        are taken. With `persists` contacts() also has each continuing contact in every tick between
        its beginning and its end, with the values of that tick. `contact_horizon`: True for all
        avatars, or entity ids of avatars (Notice.id, AvatarState.id). horizons() then has a proved
        time before which each comes into contact with nothing; `approaches` (1 to 16) is the
        maximum number of entities in it."""
        if near_misses and self.welcome.policies.near_miss <= 0:
            warnings.warn("subscribe: this server reports no near misses; start it with --near-miss "
                          "METRES", stacklevel=2)
        if persists and "persists" not in self.welcome.capabilities:
            warnings.warn("subscribe: this server does not report that contacts persist; start a "
                          "newer one", stacklevel=2)
        wanted = messages.Subscribe(contacts=contacts, near_misses=near_misses, notices=notices,
                                    state=state, state_rate=state_rate, persists=persists)
        if contact_horizon is not False:
            if "contact_horizon" not in self.welcome.capabilities:
                warnings.warn("subscribe: this server computes no contact horizons; start a newer "
                              "one", stacklevel=2)
            wanted.contact_horizon.approaches = whole(approaches, "approaches")
            if contact_horizon is not True:
                wanted.contact_horizon.avatars.extend(avatar_ids(contact_horizon))
        reply, _ = self.request(subscribe=wanted)
        return [results.contact(one) for one in reply.subscribe.live]

    @contextlib.contextmanager
    def _with_notices(self) -> Iterator[None]:
        """Subscribes to notices meanwhile; they are dropped afterwards if they were not subscribed."""
        before = self._subscribed
        if before.notices:
            yield
            return
        kept = len(self._notices)
        for_now = messages.Subscribe()
        for_now.CopyFrom(before)
        for_now.notices = True
        try:
            self.request(subscribe=for_now)
            yield
        finally:
            if not self._connection.broken:
                self.request(subscribe=before)
            while len(self._notices) > kept:
                self._notices.pop()

    def contacts(self, seconds: float = 0.0) -> Iterator[Contact]:
        """Takes the contact events, in order. With `seconds` it waits at most this long for each
        next one, as needed with a free-running clock. Call subscribe(contacts=True) first."""
        return self._taken(self._contacts, seconds)

    def notices(self, seconds: float = 0.0) -> Iterator[Notice]:
        """Takes the outcomes of orders, in order. Call subscribe(notices=True) first."""
        return self._taken(self._notices, seconds)

    def horizons(self, seconds: float = 0.0) -> Iterator[Horizon]:
        """Takes the contact horizons of avatars, in order: all of them after the first tick, then
        those that changed. One holds until its time for the entities of its tick, whatever
        clients command, unless one of the two steps onto a dynamic body. A later one of the same
        avatar replaces it; restart() and seek(), by any client, void all. Call
        subscribe(contact_horizon=True) first, on a server with a low --speed-limit."""
        return self._taken(self._horizons, seconds)

    def states(self, seconds: float = 0.0) -> Iterator[State]:
        """Takes the states of all avatars, the latest only. Call subscribe(state=True) first."""
        return self._taken(self._states, seconds)

    def _taken(self, kept: Deque[Any], seconds: float) -> Iterator[Any]:
        while True:
            for _ in range(MAX_AT_ONCE):
                if not self._await_events(0.0):
                    break
            if not kept and not self._waited_for(kept, seconds):
                return
            while kept:
                yield kept.popleft()
            if seconds <= 0:
                return

    def _waited_for(self, kept: Deque[Any], seconds: float) -> bool:
        deadline = time.monotonic() + seconds
        while not kept:
            left = deadline - time.monotonic()
            if left <= 0 or not self._await_events(left):
                return False
        return True

    def _kept_contacts(self) -> List[Contact]:
        """Takes the contacts that came with replies, which are all in lockstep."""
        return [self._contacts.popleft() for _ in range(len(self._contacts))]
