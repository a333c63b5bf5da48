"""Keeps the pending goal of an action while its server is replaced.

It works with action messages of any type: it reads only the goal ids and states that actionlib defines.
"""

from __future__ import annotations

import copy
from collections import OrderedDict
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
CONFIRMATIONS = 3  # statuses with a goal at work, every 0.2 s: more than a server needs to heed a cancellation
ENDS_OF_THE_NEWEST = frozenset({GoalStatus.REJECTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED})
"""How a goal ends by itself; the others are replaced or cancelled."""
MOST_EARLIER = 10  # goals that the server may go back to: it has one at work, and rejects a goal within milliseconds
LATE_STATUSES = 5  # every 0.2 s: the message of a goal does not come later than that after its end
UNNAMED_STATUSES = 15
"""Statuses, every 0.2 s, that list nothing that a goal could be that came without an id. Its end was told before it
came then, on a busy machine. Else it would wait for ever, and be taken for the next goal."""


class GoalKeeper:
    """Knows the newest goal of an action that is neither finished nor cancelled."""

    def __init__(self) -> None:
        self._goal: Any = None
        self._client: Client | None = None
        self._repeats = 0  # how often the goal was repeated after a death, with nobody who is known to wait for it
        self._is_repeat = False  # whether sending it to the next server counts as such
        self._finished: OrderedDict[str, None] = OrderedDict()
        self._replaced: OrderedDict[str, None] = OrderedDict()
        # Goals that were replaced, with their clients and whether they are doubted, until the newer one is at work.
        # Where the server rejects that, it goes on with what it had.
        self._earlier: OrderedDict[str, tuple[Any, Client | None, bool]] = OrderedDict()
        # Goals of which the end has come, but no message yet, with how many statuses may come before it. One without an
        # id can't be told from others by its message.
        self._nameless: OrderedDict[str, int] = OrderedDict()
        self._unnamed = 0  # statuses since the pending goal came without an id
        self._guessed = ""  # the id that such a goal was given by a status: maybe that of a goal whose message is late
        self._has_status = False  # whether a status has come: what ended before is known
        self._changing = False
        self._doubted = False  # the goal was known to an earlier keeper: the server has to confirm it
        self._listed: frozenset[str] = frozenset()
        self._cancelled: Any = None  # the goal that was cancelled last, until the server's status shows that it was
        self._confirmations = 0  # statuses since then that have it at work
        self._sent_at = float("-inf")  # when the pending goal was sent to the present server

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
    def is_at_work(self) -> bool:
        """Whether the server's last status lists the pending goal as PENDING or ACTIVE."""
        return self.pending_id in self._listed

    @property
    def strays(self) -> frozenset[str]:
        """Goals that the server works at although they were cancelled or replaced while it was being started.

        A goal that is not known yet is none: the server may have heard of it earlier.
        """
        return self._listed & (self._finished.keys() | self._replaced.keys()) - {self.pending_id}

    @property
    def missed(self) -> frozenset[str]:
        """Goals that the server works at, although no message of them has come: they can't be kept."""
        return frozenset() if self._goal is not None else self._listed - self._finished.keys()

    @property
    def server_is_changing(self) -> bool:
        """Whether the server is being replaced."""
        return self._changing

    def adopt(self, goal: Any, client: Client | None = None) -> None:
        """Begin with the pending goal of an earlier keeper, unless the server's next status shows that it has ended."""
        self._goal, self._client, self._doubted = copy.deepcopy(goal), client, True

    def keep_for_next_server(self, why_gone: str, died: bool) -> str:
        """Decide whether the next server gets the pending goal; else drop it, and return why.

        A client that waits keeps the goal alive, as long as no gap shows: the server takes the goal over. A goal that
        had to be sent again is lost for its client, and one without a client has nobody who waits. Both are repeated
        after every change that somebody asks for, but only a few times after a death, which they may have caused.

        Args:
            why_gone: why the client does not wait any more; empty: it does, or there is none.
            died: whether the server has died, and is not replaced on request.
        """
        if self._goal is None:
            return ""
        reason = why_gone
        if not reason and died and self._repeats >= REPEATS:
            reason = f"its server has died {REPEATS + 1} times while it was pending, and nobody is known to wait for it"
        if reason:
            goal_id = self.pending_id
            self.drop()
            return f"goal {goal_id} is not sent to the next server: {reason}"
        self._repeats += died and self._client is None
        self._is_repeat = died and self._client is not None
        return ""

    def server_changes(self, changing: bool) -> None:
        """Note whether the server is being replaced. A goal that it drops meanwhile stays pending.

        The next server confirms nothing: it lacks the goal until it gets it.
        """
        self._changing, self._cancelled, self._sent_at = changing, None, float("-inf")
        self._doubted = self._doubted and changing

    @property
    def is_delivered(self) -> bool:
        """Whether the server has the pending goal, or no goal is pending."""
        return self._goal is None or self.is_at_work

    def to_send(self, now: float) -> Any:
        """Return the goal that must be sent again at `now` (s, a clock that never goes back); None: send nothing.

        A server may publish its status before it receives goals, and a goal sent too early is lost. So the goal is sent
        repeatedly. A server that has the goal already ignores it.
        """
        if self.is_delivered or now - self._sent_at <= SEND_PERIOD:
            return None
        self._sent_at = now
        self._repeats += self._is_repeat
        self._is_repeat = False
        return self.pending

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
        if not goal_id and self._nameless:
            self._nameless.popitem(last=False)  # the server has named it, and told its end, before it came here
            return
        if goal_id and goal_id == self._guessed == self.pending_id and goal.goal != self._goal.goal:
            self._goal = None  # what came without an id had ended before
        is_newer = not goal_id or goal_id != self.pending_id
        if is_newer and self.pending_id:
            _remember(self._replaced, self.pending_id)
            self._earlier[self.pending_id] = self._goal, self._client, self._doubted
            if len(self._earlier) > MOST_EARLIER:
                at_work = self._listed & self._earlier.keys()
                self._earlier.pop(next(one for one in self._earlier if one not in at_work or len(at_work) > 1))
        if is_newer or client:
            self._client, self._repeats, self._is_repeat = client, 0, False
        if is_newer:
            self._earlier.pop(goal_id, None)
            self._goal, self._unnamed, self._guessed = copy.deepcopy(goal), 0, ""
        self._doubted, self._cancelled = False, None

    def on_status(self, status: Any) -> None:
        """Process a message of the topic `status`: goals end, and a goal that was sent without an id gets one."""
        self._listed = frozenset(entry.goal_id.id for entry in status.status_list if entry.status in AT_WORK)
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
            if state == GoalStatus.ACTIVE and goal_id == self.pending_id:
                self._earlier.clear()
        self._has_status = True
        self._give_up_unnamed()
        self._doubt_cancellation()
        if self._doubted and not self._changing:
            if not self.is_at_work:
                self._goal = None
            self._doubted = False

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
        goal_id = self._cancelled.goal_id.id
        if goal_id not in self._listed:
            self._cancelled = None
            return
        self._confirmations += 1
        if self._confirmations >= CONFIRMATIONS:
            self._goal, self._cancelled = self._cancelled, None
            self._finished.pop(goal_id, None)

    def on_result(self, result: Any) -> None:
        """Process a message of the topic `result`."""
        if result.status.status in TERMINAL:
            self._end(result.status.goal_id.id, result.status.status)

    def on_cancel(self, cancel: Any) -> None:
        """Process a message of the topic `cancel`, by actionlib's rules: by id, up to a time, or all."""
        for goal, *_ in [*self._earlier.values()]:
            if _is_cancelled(goal.goal_id, cancel):
                self._finish(goal.goal_id.id)
        if self._goal is not None and _is_cancelled(self._goal.goal_id, cancel):
            self._cancelled, self._confirmations = None if self._changing else self._goal, 0
            self._finish(self._goal.goal_id.id)

    def drop(self) -> None:
        """Let the pending goal be over."""
        if self._goal is not None:
            self._finish(self._goal.goal_id.id)

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
        is_rejected = state == GoalStatus.REJECTED and goal_id == self.pending_id
        self._finish(goal_id, is_rejected)  # also one not known yet: a result may arrive here before its goal
        if is_rejected:
            self._go_back()

    def _go_back(self) -> None:
        """Have the goal pending again that the last one had replaced, which the server did not take: it goes on."""
        if self._earlier:
            self._goal, self._client, self._doubted = self._earlier.popitem()[1]
            self._repeats, self._is_repeat = 0, False

    def _is_known(self, goal_id: str) -> bool:
        """Tell whether a message of a goal has come, or its end."""
        return goal_id == self.pending_id or goal_id in self._replaced or goal_id in self._finished

    def _finish(self, goal_id: str, is_rejected: bool = False) -> None:
        self._earlier.pop(goal_id, None)
        if goal_id == self.pending_id:
            self._goal = None
            if not is_rejected:
                self._earlier.clear()
        _remember(self._finished, goal_id)


def _is_cancelled(goal_id: Any, cancel: Any) -> bool:
    """Tell whether a cancellation is of a goal, by actionlib's rules."""
    by_time = not cancel.stamp.is_zero() and goal_id.stamp <= cancel.stamp
    return bool(by_time or (cancel.id == goal_id.id if cancel.id else cancel.stamp.is_zero()))


def _remember(ids: OrderedDict[str, Any], goal_id: str, what: Any = None) -> None:
    """Add an id, with what is known of it; the oldest ones are forgotten."""
    ids[goal_id] = what
    if len(ids) > REMEMBERED:
        ids.popitem(last=False)
