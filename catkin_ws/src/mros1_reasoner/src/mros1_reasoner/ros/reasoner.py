"""Node reasoner: R2 and R3 of the loop around the pure core, and the request for R4."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, TypeVar

import rospy
from actionlib_msgs.msg import GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray
from metacontrol_bags import ownership
from metacontrol_bags.decision import DECIDED, Decision
from metacontrol_msgs import msg as messages
from node_kit.io.inbox import Inbox
from node_kit.ros.connections import latest
from node_kit.ros.kept_parameter import KeptParameter
from std_msgs.msg import Bool

from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.knowledge.reasoner import Reasoner, ReasonerError
from mros1_reasoner.loop import entries, journal
from mros1_reasoner.loop.asked import Asked, carry_out
from mros1_reasoner.loop.diagnostics import DiagnosticsReader, Reading, Remark
from mros1_reasoner.loop.entries import ActiveFact, Entry, LevelFact, Released, Result, StaleFact, Step, TaskFact
from mros1_reasoner.loop.entry_text import kind_of, values_of
from mros1_reasoner.loop.goals import Goals
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.remembered import remembered, remembered_goals, to_remember
from mros1_reasoner.loop.requesting import Wanted
from mros1_reasoner.loop.task_goals import TaskGoals
from mros1_reasoner.ros.decisions import DecisionTopic
from mros1_reasoner.ros.journal import JournalTopic
from mros1_reasoner.ros.log import Log
from mros1_reasoner.ros.objectives import ObjectiveAction
from mros1_reasoner.ros.repairs import RepairRequests
from mros1_reasoner.ros.requests import Requests
from mros1_reasoner.ros.services import Services

_TIMER_PERIOD = 0.02  # s, wall, the shortest between two looks at ROS time while the core waits for a moment
_FASTEST = 10.0  # ROS time may run so much faster than wall time
_LONGEST_WAIT = 1.0  # s, wall, until it is seen that somebody has asked the node to end
_QUEUE = 1000  # diagnostics that wait at most
_ANSWER_DEADLINE = 60.0  # s, wall, for a service; an analysis may have to start Pellet again
_TASKS_RETURN = 60.0  # s, wall, in which tasks ask a new reasoner again for what they have asked the one before it
_KEEP_DEADLINE = 1.0  # s, wall, for which an operator's command waits until it is kept

_T = TypeVar("_T")


class ReasonerNode:
    """Reads facts from topics, lets the core decide, publishes decisions and has them carried out.

    Callbacks only queue what they get; everything else happens in the thread that calls `run`.
    """

    def __init__(
        self,
        parameters: Parameters,
        knowledge_base: KnowledgeBase,
        objectives: tuple[Objective, ...],
        reasoner: Reasoner,
    ) -> None:
        """Offer and listen to all topics and services.

        Args:
            parameters: the node's.
            knowledge_base: of its models.
            objectives: those asked for from the start.
            reasoner: one that has loaded the knowledge base.

        Raises:
            ParameterError, KnowledgeBaseError, ReasonerError: the node can't work.
        """
        self._period = parameters.period
        self.knowledge_base = knowledge_base
        settings = parameters.settings(knowledge_base)
        name = f"{rospy.get_name().strip('/')}-{int(time.time())}"
        self.core = Mape(knowledge_base, reasoner, objectives, settings, clock=rospy.get_time, name=name)
        self._inbox = Inbox()
        self._reader = DiagnosticsReader(
            {*knowledge_base.qualities, *knowledge_base.environment}, knowledge_base.components, parameters.nodes
        )
        self._node_of = {component: node for node, component in parameters.nodes.items()}
        self._log = Log()
        self._taken_over: set[str] = set()
        self._task_goals = TaskGoals(remembered_goals(parameters.remembered))
        at_start = frozenset(self.core.roots)
        self._journal = JournalTopic(name, parameters, knowledge_base.files, at_start)
        self._decisions = DecisionTopic()
        self._decisions.offer_last()
        self._requests = None
        self._repairs = None
        if parameters.asks and not settings.dry_run:
            if knowledge_base.repairs:
                self._repairs = RepairRequests(self._inbox.put, self._report)
            self._requests = Requests(
                parameters.action,
                parameters.execution_deadline,
                self._inbox.put,
                self._report,
                lambda function: self._take(Released(function)),
                lambda text: self._log.warn("manipulator", text),
            )
        self._listen(parameters.task_actions)
        self._services = Services(self, parameters.save_folder)
        self._asked = Asked.from_parameter(parameters.asked, at_start)
        self._kept_asked, self._kept_memory = KeptParameter("~asked"), KeptParameter("~remembered")
        self._memory: dict[str, Any] = {}
        self._goals_asked = Goals(self.core, self._command_of_task)
        self._tasks = ObjectiveAction(self._goals_asked, self._inbox.put, self._log.tell)
        for objective in objectives:
            self._log.tell_objective(objective)
        for fact in remembered(parameters.remembered):
            self._take(fact)
        self._take_up_what_was_asked()
        self._tasks_are_back = time.monotonic() + _TASKS_RETURN
        self._log.tell("Reasoner Initialization Ok")

    def _listen(self, task_actions: dict[str, str]) -> None:
        active = "rosgraph_manipulator/active_configuration"
        rospy.Subscriber(active, messages.ActiveConfiguration, latest(self._on_active))
        self._namespace = rospy.get_namespace()
        self._diagnostics = rospy.resolve_name(ownership.TOPIC)  # it may be remapped
        rospy.Subscriber(ownership.TOPIC, DiagnosticArray, self._on_diagnostics, queue_size=100)
        rospy.Subscriber("obj_error", Bool, self._on_obj_error)
        for objective, action in task_actions.items():
            listen = partial(self._on_task_status, objective, action)
            rospy.Subscriber(f"{action}/status", GoalStatusArray, listen)

    def run(self) -> None:
        """Work until the node is shut down."""
        heartbeat = time.monotonic()
        while not rospy.is_shutdown():
            now = time.monotonic()
            is_heartbeat = now >= heartbeat
            if is_heartbeat:
                heartbeat = now + self._period
            self._inbox.drain()
            self._take_up_the_rest(now)
            if self._repairs:
                self._repairs.look()
            if self._requests:
                self._requests.look()
                if is_heartbeat:
                    self._requests.tell_trouble()
            self._take(Step(is_heartbeat))
            self._leave()
            self._tasks.look()
            if self._requests:
                self._requests.release(self.core.released)
            self._journal.flush()
            until = min(heartbeat, now + _LONGEST_WAIT, self._next_look())
            self._inbox.wait(max(0.0, until - time.monotonic()))

    def _next_look(self) -> float:
        """Return the wall time of the next look at what the core or a request waits for."""
        ros_now, request = rospy.get_time(), self._requests.next_look if self._requests else math.inf
        request = min(request, self._repairs.next_look if self._repairs else math.inf)
        times = [moment for moment in (self.core.due(ros_now), self._goals_asked.due()) if moment is not None]
        if not times:
            return request
        return min(request, time.monotonic() + max(_TIMER_PERIOD, (min(times) - ros_now) / _FASTEST))

    # What comes in

    def ask(self, work: Callable[[], _T]) -> _T:
        """Have the loop's thread do some work, and return its result.

        Raises:
            TimeoutError: the loop is busy for too long.
            Exception: as `work` does.
        """
        return self._inbox.call(work, _ANSWER_DEADLINE)

    def _take_up_what_was_asked(self) -> None:
        """Carry out what was asked of a reasoner of this name that has died."""
        self._carry_out_again(
            command
            for command in self._asked.commands
            if not isinstance(command, entries.RemoveObjective) or command.name in self.core.roots
        )

    def _take_up_the_rest(self, now: float) -> None:
        """Carry out what waits for objectives that tasks have asked for anew; `now` in wall s."""
        self._carry_out_again(self._asked.due(self.core.objectives))
        if now > self._tasks_are_back and self._asked.wait_no_longer():
            self._kept_asked.set(self._asked.as_parameter())

    def _carry_out_again(self, commands: Iterable[entries.Command]) -> None:
        """Carry out what was asked of a reasoner before; it is kept already."""
        for command, error in carry_out(commands, partial(self.command, lasts=False)):
            if not self._asked.put_off(command, self.core.objectives):
                self._log.warn(kind_of(command), f"asked of the reasoner before, left out: {error}")

    def _command_of_task(self, command: entries.Command) -> None:
        """Carry out a command of a task's goal, which ends with its server."""
        self.command(command, lasts=False)
        if isinstance(command, entries.Pursue):
            self._carry_out_again(self._asked.asked_anew(command.name))

    def _leave(self) -> None:
        """Keep what a reasoner that takes this one's place has to know."""
        view = self.core.view
        if self._asked.settle(view.locked, {*view.objectives, *view.foreseen()}):
            self._kept_asked.set(self._asked.as_parameter())
        memory = to_remember(view, self._task_goals.at_work)
        if memory != self._memory:
            self._memory = memory
            self._kept_memory.set(memory)

    def command(self, command: entries.Command, *, lasts: bool = True) -> None:
        """Apply an operator's command in the loop's thread.

        Args:
            command: what to do.
            lasts: whether it holds also for a reasoner that takes this one's place; a goal ends with its server.

        Raises:
            MapeError, ReasonerError: it does not fit.
        """
        self._announce(self._applied(command))
        if lasts:
            self._asked.heed(command, self.core.objectives)
            self._kept_asked.set(self._asked.as_parameter(), _KEEP_DEADLINE)
        self._log.tell(f"operator: {' '.join((kind_of(command), *values_of(command)))}".strip())
        if isinstance(command, entries.AddObjective):
            self._log.tell_objective(self.core.objectives[command.name])
        elif isinstance(command, entries.SetNfr):
            self._goals_asked.heed_limit(command.objective, command.quality, command.limit)

    def _on_diagnostics(self, array: DiagnosticArray) -> None:
        publisher = array._connection_header.get("callerid", "")
        own = ownership.own(array.status, self._namespace, publisher, self._diagnostics)
        reading = self._reader.read(own, array.header.stamp.to_sec())
        if not reading.facts and not reading.remarks:
            return
        if not self._inbox.put(lambda: self._take_reading(reading), at_most=_QUEUE):
            lost = Remark("queue", "diagnostics come faster than they can be read: some are lost")
            self._inbox.put(lambda: self._log.tell_remark(lost), at_most=_QUEUE + 1)

    def _on_active(self, active: messages.ActiveConfiguration) -> None:
        self._inbox.put(lambda: self._take_active(active))

    def _on_obj_error(self, message: Bool) -> None:
        self._inbox.put(lambda: self._take(TaskFact("", message.data, message="reported on obj_error")))

    def _on_task_status(self, objective: str, action: str, statuses: GoalStatusArray) -> None:
        """Note the state of the newest goal of an objective's action, if it has changed."""
        failed = self._task_goals.take(objective, statuses)
        if failed is not None:
            self._inbox.put(lambda: self._take_task(objective, action, failed))

    def _take_task(self, objective: str, action: str, failed: bool) -> None:
        """Take in whether a goal of an action has failed; it is that of no other objective, if its own one is gone."""
        message = f"a goal of {action} was aborted"
        if journal.is_pursued(self.core, objective):
            self._take(TaskFact(objective, failed, message=message))
        elif failed:
            self._log.warn("task", f"{message}, but {objective} is not asked for: left out")

    def _take(self, content: entries.Content) -> bool:
        """Apply an input and announce what follows; log what is wrong if the input does not fit."""
        try:
            self._announce(self._applied(content))
        except (MapeError, KnowledgeBaseError) as error:
            self._log.warn(kind_of(content), str(error))
        except ReasonerError as error:
            self._log.warn("analysis", f"analysis failed: {error}")
        else:
            return True
        return False

    def _applied(self, content: entries.Content) -> list[Decision]:
        entry = Entry(rospy.get_time(), content)
        decisions = journal.apply(self.core, entry)
        for item in (entry, *journal.brought(entry.now, decisions)):
            self._journal.append(item, self.core.objectives)
        return decisions

    def _take_reading(self, reading: Reading) -> None:
        for remark in reading.remarks:
            self._log.tell_remark(remark)
        for fact in reading.facts:
            taken = self._take(fact)
            if isinstance(fact, LevelFact) and taken:
                self._log.tell_level(fact)
            elif isinstance(fact, StaleFact) and not self.core.is_in_reserve(fact.quality):
                self._log.tell_stale(fact)

    def _take_active(self, active: messages.ActiveConfiguration) -> None:
        running = [function for function in active.functions if function.configuration]
        for name in set(self.core.active) - {function.function for function in running}:
            self._take(ActiveFact(name, "", ""))
            self._log.tell(f"{name} runs no more")
        for function in running:
            taken = self._take(ActiveFact(function.function, function.configuration, function.state))
            if taken and self._requests and function.state != messages.FunctionGrounding.FAILED:
                self._requests.keep_what_runs(function.function)
            if taken and function.function not in self._taken_over:
                self._taken_over.add(function.function)
                say = f"{function.function} runs {function.configuration} ({function.state}): taken over as it is"
                self._log.tell(say)

    # What goes out

    def _announce(self, decisions: list[Decision]) -> None:
        """Publish decisions, and have carried out those that need it."""
        for decision in decisions:
            self._decisions.publish(decision)
            self._goals_asked.heed_decision(decision)
            self._log.tell_decision(decision)
            if decision.repair:
                self._heed_repair(decision)
            elif decision.state != DECIDED:
                continue
            elif self._requests:
                self._requests.ask(decision.id, self._wanted(decision))
            else:
                self._report(decision.id, True)

    def _heed_repair(self, decision: Decision) -> None:
        """Ask for a repair, or for nothing more where it has ended."""
        if decision.state == DECIDED and self._repairs:
            self._repairs.ask(decision.id, decision.repair)
        elif decision.state == DECIDED:
            self._report(decision.id, True)
        elif self._repairs:
            self._repairs.give_up(decision.id)
        self._inbox.put(lambda: None)  # decide at once what follows

    def _wanted(self, decision: Decision) -> Wanted:
        """Return what to ask the manipulator for."""
        nodes = (self._node_of.get(component, component) for component in self.core.nodes_to_restart(decision))
        return Wanted(
            self.core.objectives[decision.objective].function,
            decision.to_configuration,
            tuple(rospy.resolve_name(node) for node in nodes),
            self.core.is_first(decision),
        )

    def _report(self, decision: str, ok: bool, message: str = "", *, blame: bool = True) -> None:
        """Note the outcome of a decision."""
        self._take(Result(decision, ok, message, blame))
        self._inbox.put(lambda: None)  # look at once at what happened meanwhile
