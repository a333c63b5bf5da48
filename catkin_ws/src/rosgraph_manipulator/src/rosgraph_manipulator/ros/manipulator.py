"""Node rosgraph_manipulator: deploys configurations on request and keeps the pending action goal."""

from __future__ import annotations

import contextlib
import functools
import threading
import time
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import rospy
from metacontrol_msgs.msg import FunctionGrounding
from node_kit.io.inbox import Inbox
from node_kit.io.master_watch import MasterWatch
from node_kit.io.xml_rpc import CallError
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.plugins import PluginError
from node_kit.ros.lifetime import Lifetime
from node_kit.ros.parts import watch_parts
from rosgraph_launcher.launching.report import FAILED, LauncherReport

from rosgraph_manipulator.change.deployment import (
    DeploymentError,
    Outcome,
    Result,
    Stopwatch,
    deploy,
    durations,
    release,
)
from rosgraph_manipulator.change.journal import Journal, Resumption, begin_journal, parse_journal, resume
from rosgraph_manipulator.change.parameters import OverwrittenParameters
from rosgraph_manipulator.change.reactions import DeployedConfigurations, Reaction
from rosgraph_manipulator.change.request_queue import Policy
from rosgraph_manipulator.change.tactics import Plan, Tactic, load_tactics, plan_change
from rosgraph_manipulator.configuration.configurations import (
    KEYS,
    Configuration,
    ConfigurationError,
    ManipulatorOptions,
)
from rosgraph_manipulator.io.configuration_file import options_from, read_file
from rosgraph_manipulator.io.master import set_parameters
from rosgraph_manipulator.ros.announcer import Announcer
from rosgraph_manipulator.ros.executor import RosExecutor
from rosgraph_manipulator.ros.goal import PendingGoal
from rosgraph_manipulator.ros.launchers import Launchers
from rosgraph_manipulator.ros.repairs import RepairServer
from rosgraph_manipulator.ros.requests import Order, RequestServer
from rosgraph_manipulator.ros.running_system import Comparison
from rosgraph_manipulator.ros.standby import Standby

ASK_DELAY = 2.0  # s, wall, after a change: nodes may offer dynamic_reconfigure later than all else


class Manipulator:
    """The functions that run, and the requests to change them. One thread carries out one thing after the other."""

    def __init__(self, options: ManipulatorOptions, tactics: Mapping[str, Tactic], initial: Mapping[str, str]) -> None:
        """Look what the launcher runs and what an earlier manipulator has left, and begin to follow both.

        Args:
            options: what can be deployed.
            tactics: the tactics, by name.
            initial: the configuration to begin with, by function.
        """
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        self._options = options
        self._tactics = tactics
        policy = parameters.choice("concurrency", Policy.WAIT.value, [policy.value for policy in Policy])
        self._inbox = Inbox()
        probation = parameters.number("probation", 5.0, low=0.0)
        self._deployments = {name: DeployedConfigurations(probation) for name in options.all_functions}
        self._journal_lock = threading.Lock()
        self._announcer = Announcer()
        launcher_timeout = parameters.number("launcher_timeout", 10.0)
        launchers = Launchers(launcher_timeout, parameters.number("host_timeout", 3.0, low=0.1))
        if not launchers.find():
            rospy.logwarn("rosgraph_launcher is not there; start it beside this node: nothing can be deployed without")
        journal = parse_journal(parameters.value("journal"))
        self._resumptions = self._resume(journal, launchers.reports(), initial)
        self._journal = begin_journal(self._resumptions.values())
        self._executor = RosExecutor(
            options,
            {name: goal for name in options.all_functions if (goal := self._pending_goal(name))},
            OverwrittenParameters.from_parameter(parameters.value("overwritten")),
            ready_timeout=parameters.number("ready_timeout", 15.0, low=0.1),
            settle_time=parameters.number("settle_time", 0.5, low=0.0),
            launchers=launchers,
            on_report=lambda: self._inbox.put(self._follow_launcher),
        )
        self._requests = RequestServer(options, Policy(policy), self._inbox, self._carry_out)
        self._executor.check = self._requests.check
        self._standby = Standby(options, launchers)
        repair_timeout = parameters.number("repair_timeout", 15.0, low=0.1)
        self._repairs = RepairServer(options, self._inbox, self._executor, repair_timeout)

    def _resume(
        self, journal: Journal, reports: Mapping[str, LauncherReport], initial: Mapping[str, str]
    ) -> dict[str, Resumption]:
        """Return how to begin with each function. A change that was under way comes first."""
        known = {name: configuration.function for name, configuration in self._options.configurations.items()}
        found = {}
        for function in sorted(self._options.all_functions, key=lambda name: name != known.get(journal.wanted)):
            report = reports.get(function, LauncherReport(function))
            launched = report.configuration if known.get(report.configuration) == function else ""
            failed = report.state == FAILED
            found[function] = resume(journal, known, function, launched, failed, initial.get(function, ""), time.time())
        return found

    def _pending_goal(self, function: str) -> PendingGoal | None:
        options, resumption = self._options.of(function), self._resumptions[function]
        if options.save_action is None:
            return None
        return PendingGoal(
            options.save_action,
            str(options.action_type),
            adopt=resumption.keep_goal,
            changing=bool(resumption.deploy),
        )

    # -- life -----------------------------------------------------------------------------------------------------

    def run(self, watch: MasterWatch) -> None:
        """Resume or deploy configurations, then serve requests until the node or the watched master ends."""
        known = self._options.configurations
        for function, resumption in self._resumptions.items():
            last_good = known.get(resumption.last_good)
            self._deployments[function].resume(known.get(resumption.running), last_good, resumption.failure)
        watch.heartbeat = self._heartbeat
        rospy.on_shutdown(lambda: self._note(ended=True))
        states = {}
        for resumption in self._resumptions.values():
            running, wanted = known.get(resumption.running), known.get(resumption.deploy)
            if running:
                self._executor.adopt(running)
                states[running] = FunctionGrounding.STABLE
                rospy.loginfo("took over the running configuration %s", running.name)
            elif wanted:
                states[wanted] = FunctionGrounding.RECONFIGURING
        self._note()  # a death from now on counts as one during the change: nobody has heard of it before
        self._announcer.begin(states)
        for resumption in self._resumptions.values():
            wanted, refused = known.get(resumption.deploy), known.get(resumption.refused)
            if wanted:
                self._deploy(wanted)
            if refused:
                self._refuse(refused, resumption.reason)
        self._requests.start()
        self._repairs.start()
        while not rospy.is_shutdown():
            self._inbox.do_next(wait_s=0.2)
            if not self._inbox:
                self._standby.look()

    def _refuse(self, refused: Configuration, reason: str) -> None:
        """Tell that the change that was under way is not begun again, and what runs instead."""
        running = self._deployments[refused.function].running
        message = (
            f"{refused.name} is not deployed again: {reason}: see the node's log, correct the "
            f"configuration, then request it; {running.name if running else 'nothing'} runs"
        )
        rospy.logerr("%s", message)
        self._deployments[refused.function].refuses(message)
        self._note()
        outcome = Outcome(Result.FAILED if running else Result.GENERAL_ERROR, running, message)
        state = FunctionGrounding.STABLE if running else FunctionGrounding.FAILED
        self._announcer.announce(running or refused, state, outcome)
        self._announcer.diagnose(False, message, refused.name)

    def _heartbeat(self) -> None:
        if self._journal.needs_heartbeat(time.time()):
            self._note()

    def _note(self, wanted: str | None = None, ended: bool = False) -> None:
        """Write the journal."""
        last_good = {name: d.last_good.name for name, d in self._deployments.items() if d.last_good}
        failures = {name: d.failure for name, d in self._deployments.items() if d.failure}
        with self._journal_lock:
            self._write(self._journal.noted(last_good, time.time(), wanted, ended, failures))

    def _write(self, journal: Journal) -> None:
        """Publish a journal as a parameter, where it differs from the present one."""
        if journal is self._journal:
            return
        self._journal = journal
        with contextlib.suppress(CallError):  # without a master there is nobody to read it
            set_parameters({rospy.resolve_name("~journal"): journal.as_parameter()})

    # -- changes --------------------------------------------------------------------------------------------------

    def _carry_out(self, order: Order) -> Outcome:
        if order.configuration:
            return self._deploy(self._options.configurations[order.configuration], order.restart)
        return self._release(order.function)

    def _deploy(self, wanted: Configuration, restart: tuple[str, ...] = ()) -> Outcome:
        """Deploy a configuration. An error that nobody expects ends the node; the next one does not begin it again."""
        self._note(wanted=wanted.name)
        try:
            return self._change_to(wanted, restart)
        except (Exception, SystemExit) as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            with self._journal_lock:
                self._write(self._journal.broken(reason, time.time()))
            raise

    def _change_to(self, wanted: Configuration, restart: tuple[str, ...]) -> Outcome:
        watch = Stopwatch(time.monotonic)
        began = time.monotonic()
        deployments = self._deployments[wanted.function]
        self._announcer.announce(wanted, FunctionGrounding.RECONFIGURING)
        try:
            with watch.phase("plan"):
                plans = self._plans(found := self._executor.system.compare(wanted, restart))
            outcome = deploy(self._executor, wanted, plans, deployments.fallback(wanted), watch, found.remark)
        except (DeploymentError, rospy.ROSException, OSError) as error:
            outcome = deployments.refused(wanted, " ".join(str(error).split()))
        phases = durations(watch.phases, self._executor.launcher_phases, outcome.result is Result.OK)
        self._finish(wanted, outcome, {**phases, "total": time.monotonic() - began})
        return outcome

    def _plans(self, found: Comparison) -> list[Plan]:
        # Several tactics ask the same.
        nodes = SimpleNamespace(adjustable=functools.cache(self._executor.system.nodes.adjustable))
        plans, problems = plan_change(
            found.running, found.wanted, nodes, self._tactics, found.shared, tuple(found.drifted)
        )
        for problem in problems:
            rospy.logwarn("%s", problem)
        return plans

    def _finish(self, wanted: Configuration, outcome: Outcome, phases: Mapping[str, float]) -> None:
        """Note how a change ended, and tell it."""
        self._deployments[wanted.function].finished(outcome, time.monotonic())
        if outcome.running:
            self._announcer.announce(outcome.running, FunctionGrounding.STABLE, outcome, phases)
            ask = threading.Timer(ASK_DELAY, self._executor.system.ask_for_adjustable)
            ask.daemon = True
            ask.start()
        elif outcome.result is Result.GENERAL_ERROR:
            self._executor.stop_robot(wanted.function)
            self._announcer.announce(wanted, FunctionGrounding.FAILED, outcome, phases)
        self._note(wanted="")
        self._standby.changed()
        self._tell(outcome, wanted.name, phases)

    def _release(self, function: str) -> Outcome:
        """Stop what only one function needs."""
        watch = Stopwatch(time.monotonic)
        deployments = self._deployments[function]
        try:
            outcome = release(self._executor, function, deployments.running, watch, deployments.failure)
        except (rospy.ROSException, OSError) as error:
            outcome = Outcome(Result.GENERAL_ERROR, None, f"{function} could not be released: {error}")
        if outcome.result is Result.OK:
            self._executor.forget_goal(function)
            deployments.released()
            self._announcer.announce_release(function, outcome, watch.phases)
            self._note(wanted="")
        self._tell(outcome, function, watch.phases)
        return outcome

    def _tell(self, outcome: Outcome, what: str, phases: Mapping[str, float]) -> None:
        log = rospy.loginfo if outcome.result is Result.OK else rospy.logerr
        log("%s (s: %s)", outcome.message, ", ".join(f"{name} {duration:.3f}" for name, duration in phases.items()))
        self._announcer.diagnose(outcome.result is Result.OK, outcome.message, what)

    # -- the launcher's part --------------------------------------------------------------------------------------

    def _follow_launcher(self) -> None:
        """React to the launchers' last reports."""
        for function in self._deployments:
            self._executor.clear(function)
            deaths = self._executor.take_deaths(function)
            if deaths is not None:
                self._follow_function(function, deaths)
            self._follow_function(function, self._executor.report(function))
        self._repairs.follow_launcher()

    def _follow_function(self, function: str, report: LauncherReport | None) -> None:
        deployments = self._deployments[function]
        running, previous = deployments.running, deployments.previous
        reaction = deployments.react(report, time.monotonic())
        if reaction is Reaction.RETURN and deployments.waiting:
            rospy.logwarn("%s: deploying it again, because its hosts are back", deployments.waiting.name)
            self._deploy_unasked(deployments.waiting)
        if report is None or running is None:
            return
        if reaction is Reaction.DEPLOY_AGAIN:
            found = report.configuration or "not all of it"
            rospy.logwarn("rosgraph_launcher runs %s: deploying %s", found, running.name)
            deployments.lost()
            self._deploy_unasked(running)
        elif reaction is Reaction.GIVE_UP:
            self._give_up(running, report.message)
        elif reaction is Reaction.GO_BACK and previous is not None:
            message = f"{running.name}: {report.message}; {previous.name} is restored"
            rospy.logerr("%s soon after the change: %s: going back to %s", running.name, report.message, previous.name)
            self._announcer.diagnose(False, message, running.name)
            deployments.failed(message)
            self._deploy_unasked(previous)
        elif reaction is Reaction.BEGIN_RECOVERY:
            self._begin_recovery(running, report)
        elif reaction is Reaction.END_RECOVERY:
            self._end_recovery(running)

    def _deploy_unasked(self, wanted: Configuration) -> None:
        """Deploy a configuration that nobody asks for now; if a host is lost during that, wait for it."""
        losses = self._executor.losses
        self._deploy(wanted)
        if self._deployments[wanted.function].running is None and self._executor.losses != losses:
            self._executor.adopt(wanted)
            self._deployments[wanted.function].wait_for(wanted)

    def _begin_recovery(self, running: Configuration, report: LauncherReport) -> None:
        self._deployments[running.function].begin_recovery()
        self._executor.begin_recovery(report)
        self._announcer.announce(running, FunctionGrounding.RECOVERING, Outcome(Result.OK, running, report.message))
        self._announcer.diagnose(False, report.message, running.name)

    def _end_recovery(self, running: Configuration) -> None:
        try:
            self._executor.end_recovery(running.function)
        except DeploymentError as error:
            rospy.logwarn("%s", error)
            return  # the launcher's next report tells how it goes on
        self._deployments[running.function].end_recovery()
        outcome = Outcome(Result.OK, running, "recovered", "recovery")
        self._announcer.announce(running, FunctionGrounding.STABLE, outcome)
        self._announcer.diagnose(True, outcome.message, running.name)

    def _give_up(self, running: Configuration, reason: str) -> None:
        waits = bool(self._executor.lost_hosts(running.function))
        self._deployments[running.function].failed(f"{running.name}: {reason}", waits)
        self._executor.stop_rest(running.function)
        self._executor.stop_robot(running.function)
        self._note(wanted="")
        rospy.logerr("%s has failed: %s", running.name, reason)
        outcome = Outcome(Result.GENERAL_ERROR, None, reason)
        self._announcer.announce(running, FunctionGrounding.FAILED, outcome)
        self._announcer.diagnose(False, reason, running.name)


def read_parameters(arguments: list[str]) -> dict[str, Any]:
    """Read the configuration from the file named by the first argument, else from parameters.

    As published, a file's keys become parameters of the node's namespace too. Those of an earlier file are removed:
    the commands read them.

    Raises:
        ConfigurationError: the file can't be read.
    """
    if arguments:
        content = read_file(arguments[0])
        set_parameters(
            {rospy.resolve_name(key): value for key, value in content.items()},
            delete=[rospy.resolve_name(key) for key in KEYS if key not in content],
        )
        return content
    return {key: rospy.get_param(f"~{key}", rospy.get_param(key, None)) for key in KEYS}


def main() -> None:
    """Run the node; exit status 2 when its configuration cannot be used."""
    with Lifetime("rosgraph_manipulator", ConfigurationError, ParameterError, PluginError) as life:
        life.start()
        options = options_from(read_parameters(rospy.myargv()[1:]))
        for configuration in (*options.configurations.values(), *options.drivers.values()):
            if configuration.problem:
                rospy.logwarn("%s is refused when it is requested: %s", configuration.name, configuration.problem)
        initial = options.one_per_function(rospy.get_param("~initial_configuration", ""), "~initial_configuration")
        manipulator = Manipulator(options, load_tactics(), initial)
        watch_parts("manipulator")
        manipulator.run(life.watch)
