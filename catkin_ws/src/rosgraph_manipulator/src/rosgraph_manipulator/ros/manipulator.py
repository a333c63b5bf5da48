"""Node rosgraph_manipulator: deploys configurations on request and keeps the pending action goal."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import actionlib
import rospy
import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_msgs.msg import (
    ActiveConfiguration,
    FunctionGrounding,
    LauncherState,
    MvpReconfigurationAction,
    MvpReconfigurationResult,
    Phase,
)
from node_kit.io.master_watch import MasterWatch
from node_kit.ros.lifetime import Lifetime

from rosgraph_manipulator.change.deployment import CancelledError, DeploymentError, Outcome, Result, Stopwatch, deploy
from rosgraph_manipulator.change.journal import Journal, Resumption, parse_journal, resume
from rosgraph_manipulator.change.request_queue import Policy, RequestQueue
from rosgraph_manipulator.change.tactics import Plan, Tactic, TacticError, load_tactics, plan_change
from rosgraph_manipulator.configuration.configuration_file import (
    Configuration,
    ConfigurationError,
    Settings,
    parse_settings,
)
from rosgraph_manipulator.configuration.parameters import SettingError, choice, number
from rosgraph_manipulator.io.master import MasterError, set_parameters
from rosgraph_manipulator.ros.executor import RosExecutor
from rosgraph_manipulator.ros.goal import PendingGoal

KEYS = ("configurations", "kill_nodes", "save_action", "goal_msg_type", "reconfiguration_action_name")
HEARTBEAT_PERIOD = 2.0  # s, wall
ACQUAINTANCE_DELAY = 2.0  # s, wall, after a change: nodes may offer dynamic_reconfigure later than all else


class Manipulator:
    """The action server, and what is known to run; one thread carries out everything, one thing after the other."""

    def __init__(self, settings: Settings, tactics: Mapping[str, Tactic], initial: str) -> None:
        get = rospy.get_param
        self._settings = settings
        self._tactics = tactics
        self._probation = number("~probation", get("~probation", 5.0), low=0.0)  # s, wall
        policy = choice("~concurrency", get("~concurrency", Policy.WAIT.value), [policy.value for policy in Policy])
        # No SimpleQueue: Python 3.11's waits for ever when a signal comes while it waits for a time.
        self._work: queue.Queue[Callable[[], None]] = queue.Queue()
        self._requests = RequestQueue(Policy(policy))
        self._handles: dict[str, actionlib.ServerGoalHandle] = {}
        self._lock = threading.Lock()  # requests, handles, interruption
        self._interruption: CancelledError | None = None
        self._running: Configuration | None = None
        self._last_good: Configuration | None = None
        self._previous: Configuration | None = None  # what the present one has replaced
        self._recovering = False
        self._deployed_at = -self._probation  # time.monotonic()
        self._journal = Journal()
        self._journal_lock = threading.Lock()
        self._active = rospy.Publisher(
            "rosgraph_manipulator/active_configuration", ActiveConfiguration, queue_size=10, latch=True
        )
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self._resumption = self._find_resumption(initial, number("~launcher_timeout", get("~launcher_timeout", 10.0)))
        self._server = actionlib.ActionServer(
            settings.reconfiguration_action_name,
            MvpReconfigurationAction,
            self._on_goal,
            self._on_cancel,
            auto_start=False,
        )

    def _find_resumption(self, initial: str, launcher_timeout: float) -> Resumption:
        """Look what the launcher runs and what an earlier manipulator has left, and begin to follow both."""
        get = rospy.get_param
        journal = parse_journal(get("~journal", None))
        try:
            state = rospy.wait_for_message("rosgraph_launcher/state", LauncherState, launcher_timeout)
        except rospy.ROSException:
            state = LauncherState()
            rospy.logwarn("rosgraph_launcher is not there; start it beside this node: nothing can be deployed without")
        known = self._settings.configurations
        launched = state.configuration if state.configuration in known else ""
        failed = state.state == LauncherState.FAILED
        resumption = resume(journal, launched, failed, initial, time.time())
        goal = None
        if self._settings.save_action:
            goal = PendingGoal(
                self._settings.save_action,
                str(self._settings.action_type),
                adopt=resumption.keep_goal,
                changing=bool(resumption.deploy),
            )
        self._executor = RosExecutor(
            self._settings,
            goal,
            ready_timeout=number("~ready_timeout", get("~ready_timeout", 15.0), low=0.1),
            settle_time=number("~settle_time", get("~settle_time", 0.5), low=0.0),
            launcher_timeout=launcher_timeout,
            on_state=lambda _state: self._work.put(self._follow_launcher),
        )
        self._executor.check = self._check
        self._executor.launcher = self._executor.launcher or state
        return resumption

    # -- life -----------------------------------------------------------------------------------------------------

    def run(self, watch: MasterWatch) -> None:
        """Take over what runs, else deploy; then serve requests until the node ends, or the master that is watched."""
        known = self._settings.configurations
        running = known.get(self._resumption.running)
        wanted = known.get(self._resumption.deploy)
        self._last_good = known.get(self._resumption.last_good)
        watch.heartbeat = self._heartbeat
        rospy.on_shutdown(lambda: self._note(ended=True))
        if running:
            self._running = self._last_good = running
            self._note()
            self._announce(running, FunctionGrounding.STABLE)
            rospy.loginfo("took over the running configuration %s", running.name)
        elif wanted:
            self._deploy(wanted)
        self._server.start()
        while not rospy.is_shutdown():
            try:
                work = self._work.get(timeout=0.2)
            except queue.Empty:
                continue
            work()

    def _heartbeat(self) -> None:
        if time.time() - self._journal.alive > HEARTBEAT_PERIOD:
            self._note()

    def _note(self, wanted: str | None = None, ended: bool = False) -> None:
        """Write the journal."""
        with self._journal_lock:
            if self._journal.ended:
                return  # the last word
            self._journal = replace(
                self._journal,
                configuration=self._last_good.name if self._last_good else "",
                wanted=self._journal.wanted if wanted is None else wanted,
                alive=time.time(),
                ended=ended,
            )
            with contextlib.suppress(MasterError):  # without a master there is nobody to read it
                set_parameters({rospy.resolve_name("~journal"): self._journal.as_parameter()})

    # -- requests -------------------------------------------------------------------------------------------------

    def _on_goal(self, handle: actionlib.ServerGoalHandle) -> None:
        name = handle.get_goal().desired_configuration_name
        if name not in self._settings.configurations:
            message = f"unknown configuration '{name}'; known are: {', '.join(sorted(self._settings.configurations))}"
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
        self._work.put(self._next_request)

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
            outcome = self._deploy(self._settings.configurations[handle.get_goal().desired_configuration_name])
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
        watch = Stopwatch(time.monotonic)
        began = time.monotonic()
        last_good = self._last_good if self._last_good != wanted else None
        self._announce(wanted, FunctionGrounding.RECONFIGURING)
        self._note(wanted=wanted.name)
        try:
            with watch.phase("plan"):
                found = self._plans(wanted)
            outcome = deploy(self._executor, wanted, found, last_good or self._running, watch)
        except (DeploymentError, rospy.ROSException, OSError) as error:
            outcome = self._untouched(wanted, " ".join(str(error).split()))
        self._take(wanted, outcome, watch, began)
        return outcome

    def _plans(self, wanted: Configuration) -> list[Plan]:
        executor = self._executor
        found, problems = plan_change(executor.running(), executor.describe(wanted), executor.nodes, self._tactics)
        for problem in problems:
            rospy.logwarn("%s", problem)
        return found

    def _untouched(self, wanted: Configuration, reason: str) -> Outcome:
        """What becomes of a request that failed before anything was touched."""
        if self._running is None:
            return Outcome(Result.GENERAL_ERROR, None, f"{wanted.name}: {reason}")
        return Outcome(Result.FAILED, self._running, f"{wanted.name}: {reason}; {self._running.name} runs on")

    def _take(self, wanted: Configuration, outcome: Outcome, watch: Stopwatch, began: float) -> None:
        """Take in how a change ended, and tell it."""
        phases = watch.phases
        if "change" in phases and outcome.result is Result.OK:
            phases = {}
            for name, duration in watch.phases.items():
                phases.update(self._executor.launcher_phases if name == "change" else {name: duration})
        phases["total"] = time.monotonic() - began
        self._running, self._recovering = outcome.running, False
        if outcome.running:
            replaced = self._last_good if outcome.result is Result.OK and self._last_good != outcome.running else None
            self._previous, self._last_good = replaced, outcome.running
            self._deployed_at = time.monotonic()
            self._announce(outcome.running, FunctionGrounding.STABLE, outcome, phases)
            acquaintance = threading.Timer(ACQUAINTANCE_DELAY, self._executor.get_to_know)
            acquaintance.daemon = True
            acquaintance.start()
        elif outcome.result is Result.GENERAL_ERROR:
            self._executor.stop_robot()
            self._announce(wanted, FunctionGrounding.FAILED, outcome, phases)
        self._note(wanted="")
        durations = ", ".join(f"{name} {duration:.3f}" for name, duration in phases.items())
        log = rospy.loginfo if outcome.result is Result.OK else rospy.logerr
        log("%s (s: %s)", outcome.message, durations)
        self._diagnose(outcome.result is Result.OK, outcome.message, wanted.name)

    # -- the launcher's part --------------------------------------------------------------------------------------

    def _follow_launcher(self) -> None:
        """See whether what runs is what should run; the launcher has said something new."""
        state, running = self._executor.launcher, self._running
        if state is None or running is None or state.state == LauncherState.CHANGING:
            return
        if state.configuration != running.name:
            rospy.logwarn("rosgraph_launcher runs %s: deploying %s", state.configuration or "nothing", running.name)
            self._running = None
            self._deploy(running)
        elif state.state == LauncherState.FAILED:
            self._give_up(running, state.message)
        elif state.state == LauncherState.RECOVERING and not self._recovering:
            self._recover(running, state.message)
        elif state.state == LauncherState.STABLE and self._recovering:
            self._end_recovery(running)

    def _recover(self, running: Configuration, reason: str) -> None:
        previous = self._previous
        if previous is not None and time.monotonic() - self._deployed_at < self._probation:
            rospy.logerr("%s soon after the change: %s: going back to %s", running.name, reason, previous.name)
            self._diagnose(False, f"{running.name}: {reason}; {previous.name} is restored", running.name)
            self._running = self._last_good = None
            self._deploy(previous)
            return
        self._recovering = True
        self._executor.node_died()
        self._announce(running, FunctionGrounding.RECOVERING, Outcome(Result.OK, running, reason))
        self._diagnose(False, reason, running.name)

    def _end_recovery(self, running: Configuration) -> None:
        try:
            self._executor.recovered()
        except DeploymentError as error:
            rospy.logwarn("%s", error)
            return  # the launcher will say how it goes on
        self._recovering = False
        self._announce(running, FunctionGrounding.STABLE, Outcome(Result.OK, running, "recovered", "recovery"))
        self._diagnose(True, "recovered", running.name)

    def _give_up(self, running: Configuration, reason: str) -> None:
        self._running = self._last_good = None
        self._recovering = False
        self._executor.stop_robot()
        self._note(wanted="")
        rospy.logerr("%s has failed: %s", running.name, reason)
        self._announce(running, FunctionGrounding.FAILED, Outcome(Result.GENERAL_ERROR, None, reason))
        self._diagnose(False, reason, running.name)

    # -- what is told ---------------------------------------------------------------------------------------------

    def _announce(
        self,
        configuration: Configuration,
        state: str,
        outcome: Outcome | None = None,
        phases: Mapping[str, float] | None = None,
    ) -> None:
        message = ActiveConfiguration(functions=[FunctionGrounding(configuration.function, configuration.name, state)])
        message.header.stamp = rospy.Time.now()
        if outcome:
            message.tactic, message.message = outcome.tactic, outcome.message
            message.phases = [Phase(*phase) for phase in (phases or {}).items()]
        self._active.publish(message)

    def _diagnose(self, ok: bool, message: str, configuration: str) -> None:
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if ok else DiagnosticStatus.ERROR,
            name="rosgraph_manipulator",
            message=message,
            values=[KeyValue("configuration", configuration)],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)


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


def read_file(name: str) -> dict[str, Any]:
    """Return the keys of a configuration file.

    Raises:
        ConfigurationError: it can't be read.
    """
    try:
        with open(name, encoding="utf-8") as file:
            content = yaml.safe_load(file)
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"{name}: cannot be read: {error}") from error
    except yaml.YAMLError as error:
        raise ConfigurationError(f"{name}: is not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise ConfigurationError(f"{name}: expected keys such as 'configurations', found none")
    return content


def main() -> None:
    """Run the node; exit status 2 when its configuration cannot be used."""
    with Lifetime("rosgraph_manipulator", ConfigurationError, SettingError, TacticError) as life:
        life.start()
        settings = parse_settings(read_parameters(rospy.myargv()[1:]))
        initial = str(rospy.get_param("~initial_configuration", ""))
        if initial and initial not in settings.configurations:
            known = ", ".join(sorted(settings.configurations))
            raise ConfigurationError(f"parameter '~initial_configuration' is '{initial}'; known are: {known}")
        manipulator = Manipulator(settings, load_tactics(), initial)
        manipulator.run(life.watch)
