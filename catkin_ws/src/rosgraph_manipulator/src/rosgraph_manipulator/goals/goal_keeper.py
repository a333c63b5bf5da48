"""Keeps the pending goal of an action while its server is replaced.

It works with action messages of any type: it reads only the goal ids and states that actionlib defines.
"""

from __future__ import annotations

import copy
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from actionlib_msgs.msg import GoalStatus

from rosgraph_manipulator.goals.clients import Client

AT_WORK = frozenset({GoalStatus.PENDING, GoalStatus.ACTIVE})
TERMINAL = frozenset(
    {GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.REJECTED, GoalStatus.RECALLED}
)
# What a server says of a goal that it drops because it is being shut down.
DROPPED_BY_SHUTDOWN = frozenset({GoalStatus.PREEMPTED, GoalStatus.ABORTED, GoalStatus.RECALLED})
REMEMBERED = 1000  # ids of goals that have ended: many more than can be told twice
SEND_PERIOD = 0.1  # s, after which a goal is sent again: the first one is mostly lost, before the server listens
REPEATS = 3
"""How often a goal is repeated after its server died although nobody is known to wait: as often as the launcher starts
a node again by default, before the configuration fails and the next one gets the goal."""
NEVER_TAKEN = frozenset({GoalStatus.REJECTED, GoalStatus.RECALLED})  # the server goes on with what it had
CONFIRMATIONS = 3  # statuses, every 0.2 s: more than a server needs to show in them what it does with a message
LONGEST_WAIT = 2.0  # s, wall, for these statuses: where the clock stands still, they do not come
ENDS_OF_THE_NEWEST = frozenset({GoalStatus.REJECTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED})
"""How a goal ends by itself; the others are replaced or cancelled."""
MOST_EARLIER = 10  # goals that the server may go back to: it has one at work, and rejects a goal within milliseconds
LATE_STATUSES = 5  # every 0.2 s: the message of a goal does not come later than that after its end
UNNAMED_STATUSES = 15
"""Statuses, every 0.2 s, that list nothing that a goal could be that came without an id. Its end was told before it
came then, on a busy machine. Else it would wait for ever, and be taken for the next goal."""


@dataclass
class _Earlier:
    """A goal that a newer one came after, and that the server may go back to.

    Attributes:
        goal: the message.
        client: who waits for it; None: nobody who is known.
        doubted: whether it is over unless the server's next status lists it.
    """

    goal: Any
    client: Client | None
    doubted: bool


class GoalKeeper:
    """Knows the newest goal of an action that is neither finished nor cancelled."""

    def __init__(self) -> None:
        self._goal: Any = None
        self._client: Client | None = None
        self._repeats = 0  # how often the goal was repeated after a death, with nobody who is known to wait for it
        self._is_repeat = False  # whether sending it to the next server counts as such
        self._finished: OrderedDict[str, None] = OrderedDict()
        self._replaced: OrderedDict[str, None] = OrderedDict()
        # Until their end is told. Where the server does not take the newer one, it goes on with what it had.
        self._earlier: OrderedDict[str, _Earlier] = OrderedDict()
        self._accepted: str | None = None  # the newest goal that was told to be active, and has not ended
        self._died_with: str | None = None  # the goal that the next server was to begin with when one died last
        # Goals of which the end has come, but no message yet, with how many statuses may come before it. One without an
        # id can't be told from others by its message.
        self._nameless: OrderedDict[str, int] = OrderedDict()
        self._unnamed = 0  # statuses since the pending goal came without an id
        self._guessed = ""  # the id that such a goal was given by a status: maybe that of a goal whose message is late
        self._has_status = False  # whether a status has come: what ended before is known
        self._changing = False
        self._doubted = False  # the goal was known to an earlier keeper: the server has to confirm it
        self._listed: frozenset[str] = frozenset()  # what the last status has at work
        self._active: frozenset[str] = frozenset()  # what it told to be active
        # The goal that was cancelled last, and who waits for it, until the server's status shows that it was.
        self._cancelled: tuple[Any, Client | None] | None = None
        self._confirmations = 0  # statuses since then that have it at work
        self._sent = "", float("-inf")  # the goal that was sent to the present server last, and when
        self._statuses = 0  # since the pending goal came
        self._waits_since: float | None = None  # when an older goal was to be sent to the present server, but waited

    @property
    def pending(self) -> Any:
        """A copy of the pending action goal message, or None."""
        return copy.deepcopy(self._goal)

    @property
    def pending_id(self) -> str | None:
        """Id of the pending goal, or None."""
        return self._goal.goal_id.id if self._goal is not None else None

    @property
    def client(self) -> Client | None:
        """Who waits for the pending goal; None: nobody who is known."""
        return self._client if self._goal is not None else None

    @property
    def clients(self) -> frozenset[Client]:
        """Who waits for the pending goal, or for one that the server may go back to."""
        known = (self.client, *(earlier.client for earlier in self._earlier.values()))
        return frozenset(client for client in known if client is not None)

    @property
    def first_for_next_server(self) -> tuple[Any, Client | None]:
        """The goal that the next server begins with, or None, and who waits for it.

        That is the one at work, also where a newer one has come of which the server has not told whether it takes it.
        The newer one is sent afterwards: the next server rejects it, or replaces the other one by it, as this one would
        have done.
        """
        goal, client = self._first
        return copy.deepcopy(goal), client

    @property
    def first_id(self) -> str | None:
        """Id of the goal that the next server begins with, or None."""
        goal, _ = self._first
        return goal.goal_id.id if goal is not None else None

    @property
    def kept(self) -> list[tuple[Any, Client | None]]:
        """What another keeper must adopt, in this order, to go on: the goals, and who waits for each.

        The pending goal is the last one. Without it there is none.
        """
        return [(copy.deepcopy(goal), client) for goal, client in self._kept]

    @property
    def kept_ids(self) -> tuple[str, ...]:
        """Ids of the goals of `kept`."""
        return tuple(goal.goal_id.id for goal, _ in self._kept)

    @property
    def _kept(self) -> list[tuple[Any, Client | None]]:
        if self._goal is None:
            return []
        ids = [*self._earlier, self._goal.goal_id.id]
        over = ids.index(self._accepted) if self._accepted in ids else 0  # what the one at work has replaced
        earlier = [self._earlier[goal_id] for goal_id in ids[over:-1]]
        return [*((one.goal, one.client) for one in earlier), (self._goal, self._client)]

    @property
    def _first(self) -> tuple[Any, Client | None]:
        at_work = self._earlier.get(self._accepted or "")
        return (at_work.goal, at_work.client) if at_work and self._goal is not None else (self._goal, self.client)

    @property
    def is_at_work(self) -> bool:
        """Whether the server's last status lists the pending goal as PENDING or ACTIVE."""
        return self.pending_id in self._listed

    @property
    def strays(self) -> frozenset[str]:
        """Goals that the server works at although they were cancelled or replaced while it was being started.

        A goal that is not known yet is none: the server may have heard of it earlier. Nor is one that the server may go
        on with, since it has not taken the newer one yet.
        """
        over = self._finished.keys() | self._replaced.keys()
        undecided = frozenset() if self.pending_id == self._accepted else self._earlier.keys()
        return self._listed & over - undecided - {self.pending_id}

    @property
    def missed(self) -> frozenset[str]:
        """Goals that the server works at, although no message of them has come: they can't be kept."""
        if self._goal is not None:
            return frozenset()
        return self._listed - self._finished.keys() - self._replaced.keys()

    @property
    def server_is_changing(self) -> bool:
        """Whether the server is being replaced."""
        return self._changing

    def adopt(self, goal: Any, client: Client | None = None) -> None:
        """Begin with a goal of an earlier keeper, unless the server's next status shows that it has ended.

        Of several goals, the first is taken for the one at work, and the last is the pending one.
        """
        if self._goal is None:
            self._accepted = goal.goal_id.id
        self._set_aside()
        self._goal, self._client, self._doubted = copy.deepcopy(goal), client, True

    def keep_for_next_server(self, why_gone: Mapping[Client, str], died: bool) -> list[str]:
        """Decide which goals the next server gets; drop the others, and return why, a line for each.

        A client that waits keeps the goal alive, as long as no gap shows: the server takes the goal over. A goal that
        had to be sent again is lost for its client, and one without a client has nobody who waits. Both are repeated
        after every change that somebody asks for, but only a few times after a death, which they may have caused.

        Args:
            why_gone: why `clients` do not wait any more; empty, or none given: they do.
            died: whether the server has died, and is not replaced on request.
        """
        dropped = []
        self._forget_replaced()
        for goal_id, earlier in [*self._earlier.items()]:
            if earlier.client and why_gone.get(earlier.client):
                self._finish(goal_id)
                dropped.append(_not_sent(goal_id, why_gone[earlier.client]))
        if died:
            if self.first_id == self._died_with:
                self._accepted = None  # servers may die of it: the newest goal comes first
            self._died_with = self.first_id
        if self._goal is None:
            return dropped
        reason = why_gone.get(self._client, "") if self._client else ""
        if not reason and died and self._repeats >= REPEATS:
            reason = f"its server has died {REPEATS + 1} times while it was pending, and nobody is known to wait for it"
        if reason:
            dropped.append(_not_sent(self._goal.goal_id.id, reason))
            self.give_up(self._goal.goal_id.id)
        else:
            self._repeats += died and self._client is None
            self._is_repeat = died and self._client is not None
        return dropped

    def server_changes(self, changing: bool) -> None:
        """Note whether the server is being replaced. A goal that it drops meanwhile stays pending.

        The next server confirms nothing: it lacks the goal until it gets it.
        """
        self._changing, self._cancelled, self._sent, self._waits_since = changing, None, ("", float("-inf")), None
        self._doubted = self._doubted and changing
        if not changing:
            self._doubt_earlier(False)
            if self._goal is None:
                self._earlier.clear()

    @property
    def is_delivered(self) -> bool:
        """Whether the server has the pending goal, or no goal is pending."""
        return self._goal is None or self.is_at_work

    def to_send(self, now: float) -> tuple[Any, Client | None]:
        """Return the goal that must be sent again at `now` (s, a clock that never goes back), and who waits for it.

        The first one for this server comes before the pending one, once the server has shown that it has not heard of
        that one itself: the older goal would replace it then. Both are None where nothing is to be sent.

        A server may publish its status before it receives goals, and a goal sent too early is lost. So the goal is sent
        repeatedly. A server that has the goal already ignores it.
        """
        goal, client = self._next
        if goal is None or (goal.goal_id.id == self._sent[0] and now - self._sent[1] <= SEND_PERIOD):
            return None, None
        if goal is not self._goal and self._statuses < CONFIRMATIONS:
            self._waits_since = now if self._waits_since is None else self._waits_since
            if now - self._waits_since < LONGEST_WAIT:
                return None, None
        self._sent = goal.goal_id.id, now
        if goal is self._goal:
            self._repeats += self._is_repeat
            self._is_repeat = False
        return copy.deepcopy(goal), client

    @property
    def next_id(self) -> str | None:
        """Id of the goal that the server gets next, or None. It may have changed since `to_send`."""
        goal, _ = self._next
        return goal.goal_id.id if goal is not None else None

    @property
    def _next(self) -> tuple[Any, Client | None]:
        if self.is_delivered:
            return None, None
        goal, client = self._first
        return (self._goal, self.client) if goal.goal_id.id in self._listed else (goal, client)

    def on_goal(self, goal: Any, client: Client | None = None) -> None:
        """Process a message of the topic `goal`; a newer goal replaces the pending one, unless the server rejects it.

        Args:
            goal: the message.
            client: who waits for it; None: nobody who is known, or it is a goal that was sent before.
        """
        goal_id = goal.goal_id.id
        if goal_id and goal_id in self._finished:
            self._nameless.pop(goal_id, None)
            return
        if goal_id in self._earlier:  # a repetition, of which the server takes no notice
            earlier = self._earlier[goal_id]
            earlier.client = client or earlier.client
            return
        if not goal_id and self._nameless:
            self._nameless.popitem(last=False)  # the server has named it, and told its end, before it came here
            return
        if goal_id and goal_id == self._guessed == self.pending_id and goal.goal != self._goal.goal:
            self._goal = None  # what came without an id had ended before
        is_newer = not goal_id or goal_id != self.pending_id
        if self._goal is None and self._changing:
            self._earlier.clear()  # what they were replaced by is over
        if is_newer:
            self._set_aside()
        if is_newer or client:
            self._client, self._repeats, self._is_repeat = client, 0, False
        if is_newer:
            self._goal, self._unnamed, self._statuses, self._guessed = copy.deepcopy(goal), 0, 0, ""
        self._doubted, self._cancelled = False, None
        self._note_accepted()

    def _set_aside(self) -> None:
        """Remember the pending goal, since a newer one takes its place; forget others where there are many."""
        if not self.pending_id:
            return
        _remember(self._replaced, self.pending_id)
        self._earlier[self.pending_id] = _Earlier(self._goal, self._client, self._doubted)
        if len(self._earlier) > MOST_EARLIER:
            # The first is the one at work, as far as is known.
            kept = self._accepted if self._accepted in self._earlier else next(iter(self._earlier))
            self._earlier.pop(next(one for one in self._earlier if one != kept))

    def on_status(self, status: Any) -> None:
        """Process a message of the topic `status`: goals end, and a goal that was sent without an id gets one."""
        self._listed = frozenset(entry.goal_id.id for entry in status.status_list if entry.status in AT_WORK)
        self._active = frozenset(one.goal_id.id for one in status.status_list if one.status == GoalStatus.ACTIVE)
        self._nameless = OrderedDict((goal_id, left - 1) for goal_id, left in self._nameless.items() if left > 1)
        for entry in status.status_list:
            goal_id, state = entry.goal_id.id, entry.status
            if state in TERMINAL:
                self._end(goal_id, state)
                continue
            if self._is_without_id and state in AT_WORK and not self._is_known(goal_id):
                # The server made up an id for a goal that came without one.
                self._goal.goal_id.id, self._goal.goal_id.stamp = goal_id, entry.goal_id.stamp
                self._guessed = goal_id
        self._note_accepted()
        self._has_status = True
        self._statuses += 1
        self._give_up_unnamed()
        self._doubt_cancellation()
        if not self._changing:
            self._end_doubts()
            if self._goal is None:  # an older goal may be at work again, or still
                self._go_back()

    def _note_accepted(self) -> None:
        """Note which of the known goals the server has accepted last."""
        if self.pending_id in self._active:
            self._accepted = self.pending_id
        else:
            self._accepted = next((one for one in reversed(self._earlier) if one in self._active), self._accepted)

    def _end_doubts(self) -> None:
        """Drop what is doubted and not listed; doubt the rest no longer."""
        if self._doubted and not self.is_at_work:
            self._goal = None
        self._doubted = False
        for goal_id, earlier in [*self._earlier.items()]:
            if earlier.doubted and goal_id not in self._listed:
                self._earlier.pop(goal_id)
        self._doubt_earlier(False)

    def _doubt_earlier(self, doubted: bool) -> None:
        for earlier in self._earlier.values():
            earlier.doubted = doubted

    def _give_up_unnamed(self) -> None:
        """Go back from a goal that came without an id, where the server has shown for long that it has none such."""
        self._unnamed = self._unnamed + 1 if self._is_without_id and not self._changing else 0
        if self._unnamed > UNNAMED_STATUSES:
            self._goal = None
            self._go_back()

    def _doubt_cancellation(self) -> None:
        """Make a cancelled goal pending again where the server still works at it.

        A client may cancel all goals and then send a new one, on two topics. The two messages may arrive here in
        another order than at the server.
        """
        if self._cancelled is None:
            return
        goal, client = self._cancelled
        goal_id = goal.goal_id.id
        if goal_id not in self._listed:
            self._cancelled = None
            return
        self._confirmations += 1
        if self._confirmations >= CONFIRMATIONS:
            self._set_aside()
            self._goal, self._client, self._cancelled = goal, client, None
            self._finished.pop(goal_id, None)

    def on_result(self, result: Any) -> None:
        """Process a message of the topic `result`."""
        if result.status.status in TERMINAL:
            self._end(result.status.goal_id.id, result.status.status)

    def on_cancel(self, cancel: Any) -> None:
        """Process a message of the topic `cancel`, by actionlib's rules: by id, up to a time, or all."""
        for goal_id, earlier in [*self._earlier.items()]:
            if _is_cancelled(earlier.goal.goal_id, cancel):
                self._finish(goal_id)
        if self._goal is not None and _is_cancelled(self._goal.goal_id, cancel):
            # Who replaces its own goal, and cancels the new one, wants neither; nor does a server that has taken it.
            for goal_id, earlier in [*self._earlier.items()]:
                if self.is_at_work or earlier.client == self._client:
                    self._finish(goal_id)
            self._cancelled, self._confirmations = None if self._changing else (self._goal, self._client), 0
            self._finish(self._goal.goal_id.id)

    def drop(self) -> None:
        """Let the pending goal be over, and all that the server may go back to."""
        for goal_id in [*self._earlier]:
            self._finish(goal_id)
        if self._goal is not None:
            self._finish(self._goal.goal_id.id)

    def give_up(self, goal_id: str) -> None:
        """Let a goal be over; where it is the pending one, and the server has not taken it, go back to what it had."""
        goes_back = goal_id == self.pending_id != self._accepted
        if goes_back:
            self._goal = None
        self._finish(goal_id)
        if goes_back:
            self._go_back()

    def client_is_gone(self, client: Client | None) -> None:
        """Give up the goals of a client while they are sent: also what the server has at work for it.

        The server has that one only since it was replaced: its client wanted the newer goal in its place.
        """
        self._forget_replaced()
        for goal_id, earlier in [*self._earlier.items()]:
            if earlier.client == client:
                self._finish(goal_id)
        if self._goal is not None and self._client == client:
            self.give_up(self._goal.goal_id.id)

    def _forget_replaced(self) -> None:
        """Forget what the goal at work has replaced: its end may have been told while the server was being replaced."""
        ids = [*self._earlier, self.pending_id or ""]
        for goal_id in ids[: ids.index(self._accepted) if self._accepted in ids else 0]:
            if goal_id not in self._listed:
                self._earlier.pop(goal_id)

    @property
    def _is_without_id(self) -> bool:
        """Whether the pending goal came without an id, and the server has not told yet which one it gave it."""
        return self._goal is not None and not self._goal.goal_id.id

    def _end(self, goal_id: str, state: int) -> None:
        if self._changing and state in DROPPED_BY_SHUTDOWN:
            return
        if self._has_status and state in ENDS_OF_THE_NEWEST and not self._is_known(goal_id):
            if self._is_without_id:
                self._goal.goal_id.id = goal_id
            else:
                _remember(self._nameless, goal_id, LATE_STATUSES)
        # Also one not known yet: a result may arrive here before its goal.
        if state in NEVER_TAKEN:
            self.give_up(goal_id)
        else:
            self._finish(goal_id)

    def _go_back(self) -> None:
        """Have the goal pending again that the last one had replaced, which the server did not take: it goes on."""
        if self._earlier:
            _, earlier = self._earlier.popitem()
            self._goal, self._client, self._doubted = earlier.goal, earlier.client, earlier.doubted
            self._repeats, self._is_repeat = 0, False

    def _is_known(self, goal_id: str) -> bool:
        """Tell whether a message of a goal has come, or its end."""
        return goal_id == self.pending_id or goal_id in self._replaced or goal_id in self._finished

    def _finish(self, goal_id: str) -> None:
        self._earlier.pop(goal_id, None)
        if goal_id == self._accepted:
            self._accepted = None
        if goal_id == self.pending_id:
            self._goal = None
            self._doubt_earlier(True)  # it has replaced them, unless the server's next status shows that it has not
        _remember(self._finished, goal_id)


def _not_sent(goal_id: str, reason: str) -> str:
    return f"goal {goal_id} is not sent to the next server: {reason}"


def _is_cancelled(goal_id: Any, cancel: Any) -> bool:
    """Tell whether a cancellation is of a goal, by actionlib's rules."""
    by_time = not cancel.stamp.is_zero() and goal_id.stamp <= cancel.stamp
    return bool(by_time or (cancel.id == goal_id.id if cancel.id else cancel.stamp.is_zero()))


def _remember(ids: OrderedDict[str, Any], goal_id: str, what: Any = None) -> None:
    """Add an id, with what is known of it; the oldest ones are forgotten."""
    ids[goal_id] = what
    if len(ids) > REMEMBERED:
        ids.popitem(last=False)
