"""The keeper beside servers that are replaced: whatever comes when, the goal at work is that of a server that stays."""

from collections import deque

import genpy
from actionlib import msg
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from hypothesis import given, settings
from hypothesis import strategies as st
from rosgraph_manipulator.goals.goal_keeper import MOST_EARLIER, GoalKeeper

AT_WORK = (GoalStatus.PENDING, GoalStatus.ACTIVE)


class Server:
    """A server with one goal at work: it rejects some, and may give up those that are older than that one."""

    def __init__(self, tell, compares_stamps):
        self._tell = tell  # gets each status and result
        self._compares_stamps = compares_stamps
        self.states = {}
        self.active = None

    def take(self, goal):
        goal_id = goal.goal_id.id
        if goal_id in self.states:
            return
        if goal.goal.goal < 0:
            self._set(goal_id, GoalStatus.REJECTED)
        elif self._compares_stamps and self.active and goal.goal_id.stamp < self.active.goal_id.stamp:
            self._set(goal_id, GoalStatus.RECALLED)
        else:
            former, self.active = self.active, goal
            self._set(goal_id, GoalStatus.ACTIVE)
            if former:
                self._set(former.goal_id.id, GoalStatus.PREEMPTED)

    def cancel(self, goal_id):
        if self.active and goal_id == self.active.goal_id.id:
            self.end(GoalStatus.PREEMPTED)

    def end(self, state):
        goal, self.active = self.active, None
        self._set(goal.goal_id.id, state)

    def _set(self, goal_id, state):
        self.states[goal_id] = state
        if state not in AT_WORK:
            self._tell(msg.TestActionResult(status=GoalStatus(goal_id=GoalID(id=goal_id), status=state)))
        self.tell_status()

    def tell_status(self):
        listed = [GoalStatus(goal_id=GoalID(id=name), status=state) for name, state in self.states.items()]
        self._tell(GoalStatusArray(status_list=listed))


class World:
    """A keeper, the present server, one that stays for comparison, and messages on their way."""

    def __init__(self, draw):
        self._draw = draw
        self.keeper = GoalKeeper()
        self.way = {"goal": deque(), "status": deque(), "result": deque(), "server": deque()}
        self.compares_stamps = draw(st.booleans())
        self.server = Server(self._told, self.compares_stamps)
        self.stays = Server(lambda _: None, self.compares_stamps)
        self.count = 0
        self.heard = set()  # goals of which the message has come
        self.seen = set()  # those that the last status that came told to be active

    def _told(self, message):
        self.way["status" if isinstance(message, GoalStatusArray) else "result"].append(message)

    def deliver_one(self, among):
        name = self._draw(st.sampled_from(sorted(among)))
        message = self.way[name].popleft()
        if name == "server":
            self.server.take(message)
        else:
            getattr(self.keeper, f"on_{name}")(message)
        if name == "goal":
            self.heard.add(message.goal_id.id)
        if name == "status":
            self.seen = {entry.goal_id.id for entry in message.status_list if entry.status == GoalStatus.ACTIVE}

    def deliver(self, most=None):
        """Let messages come, each connection's in their order; `most`: so many at most."""
        while most is None or most > 0:
            waiting = [name for name, messages in self.way.items() if messages]
            if not waiting:
                return
            self.deliver_one(waiting)
            most = None if most is None else most - 1

    def send(self, value, is_old=False):
        """Send a goal; an old one is given up by the server, for the one that it has at work."""
        if is_old:
            self.settle()
            is_old = self.stays.active is not None
        self.count += 1
        stamp = genpy.Time(1 if is_old else 1 + self.count)
        goal = msg.TestActionGoal(goal_id=GoalID(id=f"g{self.count}", stamp=stamp))
        goal.goal.goal = value
        self.way["goal"].append(goal)
        self.way["server"].append(goal)
        self.stays.take(goal)

    def settle(self):
        self.deliver()
        self.server.tell_status()
        self.deliver()

    def cancel(self):
        """Cancel what is at work, when all is at rest: the order of messages on two topics is nobody's."""
        self.settle()
        if self.stays.active:
            goal_id = self.stays.active.goal_id.id
            self.stays.cancel(goal_id)
            self.keeper.on_cancel(GoalID(id=goal_id))
            self.server.cancel(goal_id)
            self.settle()

    def reach(self):
        self.settle()
        if self.stays.active:
            self.stays.end(GoalStatus.SUCCEEDED)
            self.server.end(GoalStatus.SUCCEEDED)
            self.settle()

    def restart(self, changing=False):
        """Replace the keeper: what the server tells meanwhile is lost for it, and it knows which goals were stored."""
        for name in ("goal", "server"):
            while self.way[name]:
                self.deliver_one([name])
        self.way["status"].clear()
        self.way["result"].clear()
        former, self.keeper = self.keeper, GoalKeeper()
        self.keeper.server_changes(changing)
        for goal, client in former.kept:
            self.keeper.adopt(goal, client)
        if not changing:
            self.settle()

    def change(self, takes_over, drops, goals, heard, restarts):
        """Replace the server; goals come meanwhile, and some when the next server listens."""
        assert self.keeper.keep_for_next_server({}, died=False) == []
        self.keeper.server_changes(True)
        self.deliver(self._draw(st.integers(0, 5)))
        self.way["server"].clear()  # what the former server had not heard
        at_work = self.server.active.goal_id.id if self.server.active else None
        is_known = at_work in self.seen & self.heard
        if drops and self.server.active:
            self.server.end(GoalStatus.ABORTED)
        for value in goals:
            self.send(value)
            self.way["server"].clear()
        self.deliver(self._draw(st.integers(0, 10)))
        if restarts:
            self.restart(changing=True)
        first, _ = self.keeper.first_for_next_server
        if is_known:
            assert self.keeper.first_id == at_work, "its client would see a gap"
        self.server = Server(self._told, self.compares_stamps)
        if takes_over and first is not None:
            self.server.take(first)
        self.server.tell_status()
        self.deliver()
        for value in heard:
            self.send(value)
            self.deliver(self._draw(st.integers(0, 3)))
        self.keeper.server_changes(False)
        for goal_id in self.keeper.strays:
            self.server.cancel(goal_id)
        now = 0.0
        self.settle()  # what is sent just when a client sends a newer goal may come after that one
        while not self.keeper.is_delivered:
            now += 1.0
            assert now < 10 * MOST_EARLIER, "it is never delivered"
            sent, _ = self.keeper.to_send(now)
            if sent is not None:
                self.server.take(sent)
                self.keeper.on_goal(sent)  # it comes back on the topic
            self.settle()


VALUES = st.sampled_from([-1, 1])
STEPS = st.one_of(
    st.tuples(st.just("send"), st.tuples(VALUES, st.booleans())),
    st.tuples(st.just("deliver"), st.tuples(st.integers(1, 5))),
    st.tuples(st.just("cancel"), st.just(())),
    st.tuples(st.just("reach"), st.just(())),
    st.tuples(st.just("restart"), st.just(())),
    st.tuples(
        st.just("change"),
        st.tuples(
            st.booleans(), st.booleans(), st.lists(VALUES, max_size=3), st.lists(VALUES, max_size=2), st.booleans()
        ),
    ),
)


@settings(max_examples=400)
@given(st.lists(STEPS, max_size=12), st.data())
def test_goal_at_work_is_that_of_a_server_that_is_never_replaced(steps, data):
    world = World(data.draw)
    for name, arguments in steps:
        getattr(world, name)(*arguments)
    world.settle()
    wanted = world.stays.active and world.stays.active.goal_id.id
    assert (world.server.active and world.server.active.goal_id.id) == wanted
    assert world.keeper.pending_id == wanted
