"""Node rosgraph_manipulator: deploys configurations on request and keeps the pending action goal."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Mapping
from typing import Any

import actionlib
import rospy
from metacontrol_msgs.msg import (
    FunctionGrounding,
    LauncherState,
    MvpReconfigurationAction,
    MvpReconfigurationResult,
)
from node_kit.io.inbox import Inbox
from node_kit.io.master_watch import MasterWatch
from node_kit.io.xml_rpc import CallError
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.plugins import PluginError
from node_kit.ros.lifetime import Lifetime

from rosgraph_manipulator.change.deployment import (
    CancelledError,
    DeploymentError,
    Outcome,
    Result,
    Stopwatch,
    deploy,
    durations,
)
from rosgraph_manipulator.change.journal import Journal, Resumption, parse_journal, resume
from rosgraph_manipulator.change.reactions import DeployedConfigurations, Reaction
from rosgraph_manipulator.change.request_queue import Policy, RequestQueue
from rosgraph_manipulator.change.tactics import Plan, Tactic, load_tactics, plan_change
from rosgraph_manipulator.configuration.configurations import (
    KEYS,
    Configuration,
    ConfigurationError,
    ManipulatorOptions,
)
from rosgraph_manipulator.io.configuration_file import options_from, read_file
from rosgraph_manipulator.io.master import set_parameters
from rosgraph_manipulator.launching.report import FAILED
from rosgraph_manipulator.ros.announcer import Announcer
from rosgraph_manipulator.ros.executor import RosExecutor
from rosgraph_manipulator.ros.goal import PendingGoal
from rosgraph_manipulator.ros.launcher_client import report_from

ASK_DELAY = 2.0  # s, wall, after a change: nodes may offer dynamic_reconfigure later than all else


class Manipulator:
    """The action server. One thread carries out everything, one thing after the other."""

    def __init__(self, options: ManipulatorOptions, tactics: Mapping[str, Tactic], initial: str) -> None:
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        self._options = options
        self._tactics = tactics
        policy = parameters.choice("concurrency", Policy.WAIT.value, [policy.value for policy in Policy])
        self._inbox = Inbox()
        self._requests = RequestQueue(Policy(policy))
        self._handles: dict[str, actionlib.ServerGoalHandle] = {}
        self._lock = threading.Lock()  # requests, handles, interruption
        self._interruption: CancelledError | None = None
        self._deployments = DeployedConfigurations(parameters.number("probation", 5.0, low=0.0))
        self._journal_lock = threading.Lock()
        self._announcer = Announcer()
        self._resumption = self._find_resumption(initial, parameters)
        self._server = actionlib.ActionServer(
            options.reconfiguration_action_name,
            MvpReconfigurationAction,
            self._on_goal,
            self._on_cancel,
            auto_start=False,
        )

    def _find_resumption(self, initial: str, parameters: ParameterTree) -> Resumption:
        """Look what the launcher runs and what an earlier manipulator has left, and begin to follow both."""
        launcher_timeout = parameters.number("launcher_timeout", 10.0)
        journal = parse_journal(parameters.value("journal"))
        try:
            state = rospy.wait_for_message("rosgraph_launcher/state", LauncherState, launcher_timeout)
        except rospy.ROSException:
            state = LauncherState()
            rospy.logwarn("rosgraph_launcher is not there; start it beside this node: nothing can be deployed without")
        report = report_from(state)
        launched = report.configuration if report.configuration in self._options.configurations else ""
        resumption = resume(journal, launched, report.state == FAILED, initial, time.time())
        self._journal = Journal(wanted=resumption.deploy, attempts=resumption.attempts)
        goal = None
        if self._options.save_action:
            goal = PendingGoal(
                self._options.save_action,
                str(self._options.action_type),
                adopt=resumption.keep_goal,
                changing=bool(resumption.deploy),
            )
        self._executor = RosExecutor(
            self._options,
            goal,
            ready_timeout=parameters.number("ready_timeout", 15.0, low=0.1),
            settle_time=parameters.number("settle_time", 0.5, low=0.0),
            launcher_timeout=launcher_timeout,
            on_report=lambda: self._inbox.put(self._follow_launcher),
        )
        self._executor.check = self._check
        self._executor.suppose(report)
        return resumption

    # -- life -----------------------------------------------------------------------------------------------------

    def run(self, watch: MasterWatch) -> None:
        """Resume or deploy a configuration, then serve requests until the node or the watched master ends."""
        known = self._options.configurations
        running = known.get(self._resumption.running)
        wanted = known.get(self._resumption.deploy)
        self._deployments.resume(running, known.get(self._resumption.last_good))
        watch.heartbeat = self._heartbeat
        rospy.on_shutdown(lambda: self._note(ended=True))
        if running:
            self._note()
            self._announcer.announce(running, FunctionGrounding.STABLE)
            rospy.loginfo("took over the running configuration %s", running.name)
        elif wanted:
            self._deploy(wanted)
        else:
            self._note(wanted="")
        refused = known.get(self._resumption.refused)
        if refused:
            self._refuse(refused)
        self._server.start()
        while not rospy.is_shutdown():
            self._inbox.do_next(wait_s=0.2)

    def _refuse(self, refused: Configuration) -> None:
        """Tell that the change that was under way is not begun again, and what runs instead."""
        running = self._deployments.running
        message = (
            f"{refused.name} is not deployed again: {self._resumption.reason}: see the node's log, correct the "
            f"configuration, then request it; {running.name if running else 'nothing'} runs"
        )
        rospy.logerr("%s", message)
        outcome = Outcome(Result.FAILED if running else Result.GENERAL_ERROR, running, message)
        state = FunctionGrounding.STABLE if running else FunctionGrounding.FAILED
        self._announcer.announce(running or refused, state, outcome)
        self._announcer.diagnose(False, message, refused)

    def _heartbeat(self) -> None:
        if self._journal.needs_heartbeat(time.time()):
            self._note()

    def _note(self, wanted: str | None = None, ended: bool = False) -> None:
        """Write the journal."""
        last_good = self._deployments.last_good
        with self._journal_lock:
            self._write(self._journal.noted(last_good.name if last_good else "", time.time(), wanted, ended))

    def _write(self, journal: Journal) -> None:
        """Publish a journal as a parameter, where it differs from the present one."""
        if journal is self._journal:
            return
        self._journal = journal
        with contextlib.suppress(CallError):  # without a master there is nobody to read it
            set_parameters({rospy.resolve_name("~journal"): journal.as_parameter()})

    # -- requests -------------------------------------------------------------------------------------------------

    def _on_goal(self, handle: actionlib.ServerGoalHandle) -> None:
        name = handle.get_goal().desired_configuration_name
        if name not in self._options.configurations:
            message = f"unknown configuration '{name}'; known are: {', '.join(sorted(self._options.configurations))}"
            rospy.logerr("%s", message)
            handle.set_accepted()
            handle.set_aborted(MvpReconfigurationResult(Result.UNKNOWN), message)
            return
        request = handle.get_goal_id().id
        with self._lock:
            arrival = self._requests.arrive(request)
            dropped = [self._handles.pop(old) for old in arrival.dropped]
            if arrival.accepted:
                self._handles[request] = handle
            if arrival.interrupts:
                self._interruption = CancelledError(f"given up for {name}", superseded=True)
        for old in dropped:
            old.set_canceled(MvpReconfigurationResult(Result.FAILED), f"given up for {name}")
        if not arrival.accepted:
            handle.set_rejected(MvpReconfigurationResult(Result.FAILED), "another change is under way")
            return
        handle.set_accepted()
        self._inbox.put(self._next_request)

    def _on_cancel(self, handle: actionlib.ServerGoalHandle) -> None:
        request = handle.get_goal_id().id
        with self._lock:
            waited = self._requests.take_back(request)
            if waited:
                self._handles.pop(request, None)
            elif self._requests.running == request and self._interruption is None:
                self._interruption = CancelledError("the request was taken back")
        if waited:
            handle.set_canceled(MvpReconfigurationResult(Result.FAILED), "taken back before its turn came")

    def _next_request(self) -> None:
        with self._lock:
            request = self._requests.next()
            handle = self._handles.pop(request, None) if request else None
            self._interruption = None
        if handle is None:
            return
        try:
            outcome = self._deploy(self._options.configurations[handle.get_goal().desired_configuration_name])
        finally:
            with self._lock:
                self._requests.finish()
                self._interruption = None
        result = MvpReconfigurationResult(int(outcome.result))
        if outcome.result is Result.OK:
            handle.set_succeeded(result, outcome.message)
        elif outcome.cancelled:
            handle.set_canceled(result, outcome.message)
        else:
            handle.set_aborted(result, outcome.message)

    def _check(self) -> None:
        interruption = self._interruption
        if interruption is not None:
            raise interruption

    # -- changes --------------------------------------------------------------------------------------------------

    def _deploy(self, wanted: Configuration) -> Outcome:
        """Deploy a configuration. An error that nobody expects ends the node; the next one does not begin it again."""
        self._note(wanted=wanted.name)
        try:
            return self._change_to(wanted)
        except (Exception, SystemExit) as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            with self._journal_lock:
                self._write(self._journal.broken(reason, time.time()))
            raise

    def _change_to(self, wanted: Configuration) -> Outcome:
        watch = Stopwatch(time.monotonic)
        began = time.monotonic()
        self._announcer.announce(wanted, FunctionGrounding.RECONFIGURING)
        try:
            with watch.phase("plan"):
                found = self._plans(wanted)
            outcome = deploy(self._executor, wanted, found, self._deployments.fallback(wanted), watch)
        except (DeploymentError, rospy.ROSException, OSError) as error:
            outcome = self._deployments.refused(wanted, " ".join(str(error).split()))
        phases = durations(watch.phases, self._executor.launcher_phases, outcome.result is Result.OK)
        self._finish(wanted, outcome, {**phases, "total": time.monotonic() - began})
        return outcome

    def _plans(self, wanted: Configuration) -> list[Plan]:
        executor = self._executor
        found, problems = plan_change(executor.running(), executor.describe(wanted), executor.nodes, self._tactics)
        for problem in problems:
            rospy.logwarn("%s", problem)
        return found

    def _finish(self, wanted: Configuration, outcome: Outcome, phases: Mapping[str, float]) -> None:
        """Note how a change ended, and tell it."""
        self._deployments.finished(outcome, time.monotonic())
        if outcome.running:
            self._announcer.announce(outcome.running, FunctionGrounding.STABLE, outcome, phases)
            ask = threading.Timer(ASK_DELAY, self._executor.ask_for_adjustable)
            ask.daemon = True
            ask.start()
        elif outcome.result is Result.GENERAL_ERROR:
            self._executor.stop_robot()
            self._announcer.announce(wanted, FunctionGrounding.FAILED, outcome, phases)
        self._note(wanted="")
        log = rospy.loginfo if outcome.result is Result.OK else rospy.logerr
        log("%s (s: %s)", outcome.message, ", ".join(f"{name} {duration:.3f}" for name, duration in phases.items()))
        self._announcer.diagnose(outcome.result is Result.OK, outcome.message, wanted)

    # -- the launcher's part --------------------------------------------------------------------------------------

    def _follow_launcher(self) -> None:
        """React to the launcher's last report."""
        report, running, previous = self._executor.report, self._deployments.running, self._deployments.previous
        reaction = self._deployments.react(report, time.monotonic())
        if report is None or running is None:
            return
        if reaction is Reaction.DEPLOY_AGAIN:
            rospy.logwarn("rosgraph_launcher runs %s: deploying %s", report.configuration or "nothing", running.name)
            self._deployments.lost()
            self._deploy(running)
        elif reaction is Reaction.GIVE_UP:
            self._give_up(running, report.message)
        elif reaction is Reaction.GO_BACK and previous is not None:
            rospy.logerr("%s soon after the change: %s: going back to %s", running.name, report.message, previous.name)
            self._announcer.diagnose(False, f"{running.name}: {report.message}; {previous.name} is restored", running)
            self._deployments.failed()
            self._deploy(previous)
        elif reaction is Reaction.BEGIN_RECOVERY:
            self._begin_recovery(running, report.message)
        elif reaction is Reaction.END_RECOVERY:
            self._end_recovery(running)

    def _begin_recovery(self, running: Configuration, reason: str) -> None:
        self._deployments.begin_recovery()
        self._executor.begin_recovery()
        self._announcer.announce(running, FunctionGrounding.RECOVERING, Outcome(Result.OK, running, reason))
        self._announcer.diagnose(False, reason, running)

    def _end_recovery(self, running: Configuration) -> None:
        try:
            self._executor.end_recovery()
        except DeploymentError as error:
            rospy.logwarn("%s", error)
            return  # the launcher's next report tells how it goes on
        self._deployments.end_recovery()
        outcome = Outcome(Result.OK, running, "recovered", "recovery")
        self._announcer.announce(running, FunctionGrounding.STABLE, outcome)
        self._announcer.diagnose(True, outcome.message, running)

    def _give_up(self, running: Configuration, reason: str) -> None:
        self._deployments.failed()
        self._executor.stop_robot()
        self._note(wanted="")
        rospy.logerr("%s has failed: %s", running.name, reason)
        outcome = Outcome(Result.GENERAL_ERROR, None, reason)
        self._announcer.announce(running, FunctionGrounding.FAILED, outcome)
        self._announcer.diagnose(False, reason, running)


def read_parameters(arguments: list[str]) -> dict[str, Any]:
    """Read the configuration from the file named by the first argument, else from parameters.

    As published, a file's keys become parameters of the node's namespace too.

    Raises:
        ConfigurationError: the file can't be read.
    """
    if arguments:
        content = read_file(arguments[0])
        for key, value in content.items():
            rospy.set_param(key, value)
        return content
    return {key: rospy.get_param(f"~{key}", rospy.get_param(key, None)) for key in KEYS}


def main() -> None:
    """Run the node; exit status 2 when its configuration cannot be used."""
    with Lifetime("rosgraph_manipulator", ConfigurationError, ParameterError, PluginError) as life:
        life.start()
        options = options_from(read_parameters(rospy.myargv()[1:]))
        for configuration in options.configurations.values():
            if configuration.problem:
                rospy.logwarn("%s is refused when it is requested: %s", configuration.name, configuration.problem)
        initial = str(rospy.get_param("~initial_configuration", ""))
        if initial and initial not in options.configurations:
            known = ", ".join(sorted(options.configurations))
            raise ConfigurationError(f"parameter '~initial_configuration' is '{initial}'; known are: {known}")
        manipulator = Manipulator(options, load_tactics(), initial)
        manipulator.run(life.watch)
