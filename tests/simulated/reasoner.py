"""The reasoner's process: its real loop, with the rule engine, and its real requests to the manipulator."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from metacontrol_bags.decision import DECIDED, Decision
from metacontrol_msgs.msg import FunctionGrounding
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop import entries, journal
from mros1_reasoner.loop.asked import Asked, carry_out
from mros1_reasoner.loop.diagnostics import DiagnosticsReader
from mros1_reasoner.loop.entries import ActiveFact, Entry, Released, Result, Step
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.remembered import remembered, to_remember
from mros1_reasoner.loop.requesting import Answer, Requesting, Wanted
from mros1_reasoner.loop.settings import Settings
from rosgraph_manipulator.change.deployment import Outcome

from simulated.host import Host
from simulated.kernel import Inbox, Process
from simulated.manipulator import ManipulatorPart
from simulated.network import Topic
from simulated.systems import System

PERIOD = 1.0  # s, of heartbeats
DEADLINE = 60.0  # s, for a request
STATUS = 0.2  # s, between two statuses of an action server


class BrokenError(Exception):
    """A part has done what it must not."""


@dataclass
class Goal:
    """A goal at the manipulator, as its server and its client know it.

    Attributes:
        wanted: what is asked for.
        server: the manipulator that has it.
        told: what the server has told of it, in order.
        done: is called with the answer.
        heard: whether its client has heard of it from the server.
    """

    wanted: Wanted
    server: ManipulatorPart
    done: Callable[[Answer], object]
    told: list[str] = field(default_factory=list)
    answered: bool = False
    heard: bool = False


class Goals:
    """All goals at manipulators; connects their clients with their servers."""

    def __init__(self, host: Host, manipulator: Callable[[], ManipulatorPart | None]) -> None:
        self._host, self._manipulator = host, manipulator
        self.all: list[Goal] = []
        self._count = 0

    def is_there(self) -> bool:
        """Tell whether a manipulator serves."""
        server = self._manipulator()
        return server is not None and server.serves and server.process.alive

    def send(self, client: Process, wanted: Wanted, done: Callable[[Answer], object], put: Any) -> Any:
        """Send a goal for a client; `done` is called by its inbox."""
        server = self._manipulator()
        assert server is not None
        self._count += 1
        name, kernel = f"goal {self._count}", self._host.kernel

        def answered(answer: Answer) -> None:
            if client.alive and not goal.answered:
                goal.answered = True
                put(lambda: done(answer))

        goal = Goal(wanted, server, answered)
        self.all.append(goal)
        kernel.after(kernel.uniform(0.001, 0.02), lambda: server.process.call(lambda: self._arrive(goal, name)))
        return _ClientHandle(goal, name, kernel)

    def lost(self, server: ManipulatorPart) -> None:
        """Have the clients of a manipulator that has died find their goals lost, once the next one tells its status.

        So does actionlib, but for a goal of which the former one has told nothing.
        """
        for goal in self.all:
            if goal.server is server and not goal.answered and goal.heard:
                self._tell_lost(goal)

    def _tell_lost(self, goal: Goal) -> None:
        if self.is_there():
            goal.done(Answer(False, "", None))
        else:
            self._host.kernel.after(0.2, lambda: self._tell_lost(goal))

    def _tell_status(self, goal: Goal) -> None:
        """Have the server list a goal, unless it has died or hangs."""
        if goal.server.process.alive:
            goal.server.process.call(lambda: setattr(goal, "heard", True))

    def _arrive(self, goal: Goal, name: str) -> None:
        requests, wanted = goal.server.requests, goal.wanted
        if requests is None:
            return
        if wanted.needs_more:
            order, problem = requests.order_of_function(wanted.function, wanted.configuration, wanted.restart)
        else:
            order, problem = requests.order_for(wanted.configuration)
        handle = _ServerHandle(goal, self._host)
        self._host.kernel.after(self._host.kernel.uniform(0.001, STATUS), lambda: self._tell_status(goal))
        if order is None:
            requests.refuse(handle, problem, _result)
        else:
            requests.take(name, order, handle, _result)


def _result(outcome: Outcome) -> int:
    return int(outcome.result)


class _ClientHandle:
    def __init__(self, goal: Goal, name: str, kernel: Any) -> None:
        self._goal, self._name, self._kernel = goal, name, kernel

    def is_acknowledged(self) -> bool:
        return self._goal.heard

    def cancel(self) -> None:
        server, name = self._goal.server, self._name

        def take_back() -> None:
            if server.requests is not None:
                server.requests.take_back(name)

        self._kernel.after(0.01, lambda: server.process.call(take_back))


class _ServerHandle:
    """Notes what the manipulator tells of a goal, and passes on how it ends."""

    def __init__(self, goal: Goal, host: Host) -> None:
        self._goal, self._host = goal, host

    def set_accepted(self) -> None:
        self._tell("accepted")

    def set_rejected(self, result: int, text: str) -> None:
        self._tell("rejected", result, text)

    def set_succeeded(self, result: int, text: str) -> None:
        self._tell("succeeded", result, text)

    def set_aborted(self, result: int, text: str) -> None:
        self._tell("aborted", result, text)

    def set_canceled(self, result: int, text: str) -> None:
        self._tell("canceled", result, text)

    def _tell(self, state: str, result: int | None = None, text: str = "") -> None:
        self._goal.server.process.check()
        self._goal.told.append(state)
        if state != "accepted":
            answer = Answer(state == "succeeded", text, result)
            self._host.kernel.after(self._host.kernel.uniform(0.001, 0.02), lambda: self._goal.done(answer))


class ReasonerPart:
    """One process of the reasoner."""

    def __init__(
        self,
        process: Process,
        host: Host,
        system: System,
        topics: Mapping[str, Topic],
        goals: Goals,
        settings: Settings,
    ) -> None:
        """Begin; an engine that has loaded the ontology is there from the start."""
        self.process, self._host, self._system, self._goals = process, host, system, goals
        self.kernel = host.kernel
        self._inbox = Inbox(process)
        engine = RuleEngine()
        engine.load(system.knowledge.ontology)
        self.core = Mape(
            system.knowledge,
            engine,
            system.objectives,
            settings,
            clock=host.ros_time,
            wall=lambda: self.kernel.now,
            name=f"reasoner-{self.kernel.steps}",
        )
        qualities = {*system.knowledge.qualities, *system.knowledge.environment}
        self._reader = DiagnosticsReader(qualities, system.knowledge.components, system.components)
        self._node_of = {component: node for node, component in system.components.items()}
        self._asked = Asked.from_parameter(host.parameters.get("/reasoner/asked"))
        client = _Client(self)
        self._requests = Requesting(
            client,
            client,
            DEADLINE,
            lambda: self.kernel.now,
            self._report,
            lambda function: self._take(Released(function)),
            lambda line: None,
            lambda failures, reason: None,
        )
        topics["active"].subscribe(process, lambda active: self._inbox.put(lambda: self._take_active(active)))
        topics["diagnostics"].subscribe(process, lambda statuses: self._inbox.put(lambda: self._read(statuses)), 100)
        process.start(self._run)

    def command(self, command: entries.Command) -> None:
        """Take in an operator's command."""
        self._inbox.put(lambda: self._apply_command(command))

    def _apply_command(self, command: entries.Command) -> None:
        try:
            self._announce(self._applied(command))
        except (MapeError, KnowledgeBaseError, ReasonerError):
            return
        self._host.heed_operator(command, self.core.objectives)
        self._asked.heed(command, self.core.objectives)
        self._keep_asked()

    def _keep_asked(self) -> None:
        self._host.parameters["/reasoner/asked"] = self._asked.as_parameter()

    def _run(self) -> None:
        for fact in remembered(self._host.parameters.get("/reasoner/remembered")):
            self._take(fact)
        carry_out(self._asked.commands, lambda command: self._announce(self._applied(command)))
        self._check_locks()
        heartbeat = self.kernel.now
        while True:
            now = self.kernel.now
            is_heartbeat = now >= heartbeat
            if is_heartbeat:
                heartbeat = now + PERIOD
            self._inbox.drain()
            self._requests.look()
            self._take(Step(is_heartbeat))
            view = self.core.view
            if self._asked.settle(view.locked, {*view.objectives, *view.foreseen()}):
                self._keep_asked()
            self._check_locks()
            self._host.parameters["/reasoner/remembered"] = to_remember(view, {})
            self._requests.release(self.core.released)
            until = min(heartbeat, self._next_look())
            self._inbox.wait(max(0.0, until - self.kernel.now))

    def _check_locks(self) -> None:
        """Tell that a lock is lost: no operator has taken it back, and no objective is asked for no longer."""
        if forgotten := self._host.held - self.core.view.locked:
            raise BrokenError(f"a reasoner has forgotten that an operator has locked {', '.join(sorted(forgotten))}")

    def _next_look(self) -> float:
        ros_now, request = self._host.ros_time(), self._requests.next_look
        due = self.core.due(ros_now)
        return request if due is None else min(request, self.kernel.now + max(0.02, (due - ros_now) / 10.0))

    def _take(self, content: entries.Content) -> bool:
        try:
            self._announce(self._applied(content))
        except (MapeError, KnowledgeBaseError, ReasonerError):
            return False
        return True

    def _applied(self, content: entries.Content) -> list[Decision]:
        return journal.apply(self.core, Entry(self._host.ros_time(), content))

    def _read(self, statuses: Any) -> None:
        for fact in self._reader.read(statuses, self._host.ros_time()).facts:
            self._take(fact)

    def _take_active(self, active: Any) -> None:
        running = [function for function in active if function.configuration]
        for name in sorted(set(self.core.active) - {function.function for function in running}):
            self._take(ActiveFact(name, "", ""))
        for function in running:
            taken = self._take(ActiveFact(function.function, function.configuration, function.state))
            if taken and function.state != FunctionGrounding.FAILED:
                self._requests.keep_what_runs(function.function)

    def _announce(self, decisions: list[Decision]) -> None:
        for decision in decisions:
            self.process.check()
            if decision.state == DECIDED and self._is_held(decision):
                held = "pauses it" if self._host.is_paused else f"has locked {decision.objective}"
                raise BrokenError(f"decided, although the operator {held}: {decision.explanation}")
            if decision.repair:
                if decision.state == DECIDED:
                    self._report(decision.id, False, "nobody repairs here", blame=False)
            elif decision.state == DECIDED:
                self._requests.ask(decision.id, self._wanted(decision))

    def _is_held(self, decision: Decision) -> bool:
        """Tell whether an operator forbids a decision; a lock forbids no repair, which leaves the configuration."""
        return self._host.is_paused or (not decision.repair and decision.objective in self._host.held)

    def _wanted(self, decision: Decision) -> Wanted:
        namespace = self._system.namespace
        nodes = (self._node_of.get(component, component) for component in self.core.nodes_to_restart(decision))
        return Wanted(
            self.core.objectives[decision.objective].function,
            decision.to_configuration,
            tuple(f"{namespace}{node}" for node in nodes),
            self.core.is_first(decision),
        )

    def _report(self, decision: str, ok: bool, message: str = "", *, blame: bool = True) -> None:
        self._take(Result(decision, ok, message, blame))
        self._inbox.put()


class _Client:
    """The manipulator's actions, as the reasoner sees them."""

    name = "/rosgraph_manipulator_action_server"

    def __init__(self, part: ReasonerPart) -> None:
        self._part = part

    def is_there(self) -> bool:
        self._part.process.check()
        return self._part._goals.is_there()

    def send(self, wanted: Wanted, done: Callable[[Answer], object]) -> Any:
        return self._part._goals.send(self._part.process, wanted, done, self._part._inbox.put)
