"""The functions that run, and their changes: on request, at the start, and after what the launchers report."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Protocol

from metacontrol_msgs.msg import FunctionGrounding
from rosgraph_launcher.launching.report import FAILED, LauncherReport

from rosgraph_manipulator.change.deployment import (
    DeploymentError,
    Outcome,
    Result,
    Stopwatch,
    deploy,
    durations,
    go_back,
    release,
)
from rosgraph_manipulator.change.execution import Execution
from rosgraph_manipulator.change.journal import Journal, Resumption, resume
from rosgraph_manipulator.change.reactions import DeployedConfigurations, Reaction
from rosgraph_manipulator.change.requests import Order
from rosgraph_manipulator.change.running_system import Comparison
from rosgraph_manipulator.change.surroundings import Surroundings
from rosgraph_manipulator.change.tactics import Plan, Tactic, plan_change
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions

NO_LAUNCHER = "rosgraph_launcher has ended, and its nodes with it"


class Announcer(Protocol):
    """Tells others what is deployed, and how changes ended."""

    def begin(self, states: Mapping[Configuration, str]) -> None:
        """Tell what runs and what is being deployed when the manipulator starts, all functions at once."""

    def announce(
        self,
        configuration: Configuration,
        state: str,
        outcome: Outcome | None = None,
        phases: Mapping[str, float] | None = None,
    ) -> None:
        """Tell which configuration is active for its function, and in which state."""

    def announce_release(self, function: str, outcome: Outcome, phases: Mapping[str, float]) -> None:
        """Tell that nothing runs for a function any more."""

    def diagnose(self, ok: bool, message: str, configuration: str) -> None:
        """Tell whether all is well with a configuration or a function, and why not."""


class JournalKeeper(Protocol):
    """Keeps the journal for the next manipulator; several threads may write it."""

    def update(self, change: Callable[[Journal, float], Journal]) -> None:
        """Replace the journal by what a function returns for it and the present time, s since the epoch."""


def resumptions(
    options: ManipulatorOptions,
    journal: Journal,
    reports: Mapping[str, LauncherReport],
    initial: Mapping[str, str],
    now: float,
    supervisor: str,
) -> dict[str, Resumption]:
    """Return how to begin with each function. A change that was under way comes first.

    Args:
        options: what can be deployed.
        journal: the journal of the last manipulator.
        reports: what the launchers report, by function.
        initial: the configuration to begin with, by function.
        now: s since the epoch.
        supervisor: who has started the manipulator that begins.
    """
    known = {name: configuration.function for name, configuration in options.configurations.items()}
    found = {}
    for function in sorted(options.all_functions, key=lambda name: name != known.get(journal.wanted)):
        report = reports.get(function, LauncherReport(function))
        launched = report.configuration if known.get(report.configuration) == function else ""
        failed = report.state == FAILED
        first = initial.get(function, "")
        found[function] = resume(journal, known, function, launched, failed, first, now, supervisor)
    return found


class Manipulation:
    """Decides about changes and has them made. One thread calls it; only `heartbeat` and `end` may come in others."""

    def __init__(
        self,
        options: ManipulatorOptions,
        tactics: Mapping[str, Tactic],
        probation: float,
        executor: Execution,
        announcer: Announcer,
        journal: JournalKeeper,
        around: Surroundings,
        changed: Callable[[bool], object],
    ) -> None:
        """Begin with nothing deployed.

        Args:
            options: what can be deployed.
            tactics: the tactics, by name.
            probation: the time after a change in which the death of a node takes the change back, s, wall.
            executor: makes the changes.
            announcer: tells others of them.
            journal: keeps what the next manipulator must know.
            around: the clock, and the log.
            changed: is called after each change, with whether something runs.
        """
        self._options, self._tactics, self._executor = options, tactics, executor
        self._announcer, self._journal, self._around, self._changed = announcer, journal, around, changed
        self._log = around.log
        self._failures: tuple[type[Exception], ...] = (DeploymentError, *around.failures)
        self._deployments = {name: DeployedConfigurations(probation) for name in options.all_functions}

    def begin(self, resumptions: Mapping[str, Resumption]) -> None:
        """Take over what runs, and deploy what should."""
        known = self._options.configurations
        for function, resumption in resumptions.items():
            last_good = known.get(resumption.last_good)
            self._deployments[function].resume(known.get(resumption.running), last_good, resumption.failure)
        states = {}
        for resumption in resumptions.values():
            running, wanted = known.get(resumption.running), known.get(resumption.deploy)
            if running:
                self._executor.adopt(running)
                states[running] = FunctionGrounding.STABLE
                self._log.info(f"took over the running configuration {running.name}")
            elif wanted:
                states[wanted] = FunctionGrounding.RECONFIGURING
        self._note()  # a death from now on counts as one during the change: nobody has heard of it before
        self._announcer.begin(states)
        for resumption in resumptions.values():
            wanted, refused = known.get(resumption.deploy), known.get(resumption.refused)
            if wanted:
                self._deploy(wanted)
            if refused:
                self._refuse(refused, resumption.reason)

    def heartbeat(self) -> None:
        """Note in the journal, where it is due, that the manipulator lives."""

        def beat(journal: Journal, now: float) -> Journal:
            return self._noted(journal, now) if journal.needs_heartbeat(now) else journal

        self._journal.update(beat)

    def end(self) -> None:
        """Note in the journal that the manipulator ends because it was told to."""
        self._note(ended=True)

    def _refuse(self, refused: Configuration, reason: str) -> None:
        """Tell that the change that was under way is not begun again, and what runs instead."""
        running = self._deployments[refused.function].running
        message = (
            f"{refused.name} is not deployed again: {reason}: see the node's log, correct the "
            f"configuration, then request it; {running.name if running else 'nothing'} runs"
        )
        self._log.error(message)
        self._deployments[refused.function].refuses(message)
        self._note()
        outcome = Outcome(Result.FAILED if running else Result.GENERAL_ERROR, running, message)
        state = FunctionGrounding.STABLE if running else FunctionGrounding.FAILED
        self._announcer.announce(running or refused, state, outcome)
        self._announcer.diagnose(False, message, refused.name)

    def _note(self, wanted: str | None = None, ended: bool = False) -> None:
        """Write the journal."""
        self._journal.update(lambda journal, now: self._noted(journal, now, wanted, ended))

    def _noted(self, journal: Journal, now: float, wanted: str | None = None, ended: bool = False) -> Journal:
        last_good = {name: d.last_good.name for name, d in self._deployments.items() if d.last_good}
        failures = {name: d.failure for name, d in self._deployments.items() if d.failure}
        return journal.noted(last_good, now, wanted, ended, failures)

    # -- changes --------------------------------------------------------------------------------------------------

    def carry_out(self, order: Order) -> Outcome:
        """Make the change that an order asks for."""
        if order.configuration:
            return self._deploy(self._options.configurations[order.configuration], order.restart)
        return self._release(order.function)

    def make_whole(self, function: str) -> None:
        """Restore a function whose change was given up for a request that was taken back before its turn."""
        deployments = self._deployments[function]
        if deployments.torn and deployments.last_good:
            self._deploy_unasked(deployments.last_good)
        elif deployments.torn:
            self._release(function)

    def _deploy(self, wanted: Configuration, restart: tuple[str, ...] = ()) -> Outcome:
        """Deploy a configuration. An error that nobody expects ends the node; the next one does not begin it again."""
        self._note(wanted=wanted.name)
        try:
            return self._change_to(wanted, restart)
        except (Exception, SystemExit) as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            self._journal.update(lambda journal, now: journal.broken(reason, now))
            raise

    def _change_to(self, wanted: Configuration, restart: tuple[str, ...]) -> Outcome:
        watch = Stopwatch(self._around.now)
        began = self._around.now()
        deployments = self._deployments[wanted.function]
        self._announcer.announce(wanted, FunctionGrounding.RECONFIGURING)
        try:
            with watch.phase("plan"):
                plans = self._plans(found := self._executor.system.compare(wanted, restart))
                self._executor.require_launchers(wanted)
        except self._failures as error:
            outcome = deployments.refused(wanted, " ".join(str(error).split()))
            if outcome.running is None and (deployments.torn or self._executor.has_nodes(wanted.function)):
                outcome = self._clear_away(wanted, outcome.message, watch)
        else:
            last_good, runs = deployments.fallback(wanted), deployments.running is not None
            try:
                outcome = deploy(
                    self._executor,
                    wanted,
                    plans,
                    last_good,
                    watch,
                    found.remark,
                    runs,
                    # Nobody wants it any more: the next manipulator must not finish it.
                    undoing=lambda: self._note(wanted=last_good.name if last_good else ""),
                )
            except self._failures as error:
                outcome = self._clear_away(wanted, f"{wanted.name}: {' '.join(str(error).split())}", watch)
        phases = durations(watch.phases, self._executor.launcher_phases, outcome.result is Result.OK)
        self._finish(wanted, outcome, {**phases, "total": self._around.now() - began})
        return outcome

    def _clear_away(self, wanted: Configuration, reason: str, watch: Stopwatch) -> Outcome:
        """Restore what ran before, or stop what is left, where a change fails and no whole configuration runs."""
        try:
            last_good = self._deployments[wanted.function].fallback(wanted)
            return go_back(self._executor, wanted.function, last_good, reason, watch)
        except self._failures as error:
            return Outcome(Result.GENERAL_ERROR, None, f"{reason}; {' '.join(str(error).split())}")

    def _plans(self, found: Comparison) -> list[Plan]:
        # Several tactics ask the same.
        nodes = SimpleNamespace(adjustable=functools.cache(self._executor.system.nodes.adjustable))
        plans, problems = plan_change(
            found.running, found.wanted, nodes, self._tactics, found.shared, tuple(found.drifted)
        )
        for problem in problems:
            self._log.warn(problem)
        return plans

    def _finish(self, wanted: Configuration, outcome: Outcome, phases: Mapping[str, float]) -> None:
        """Note how a change ended, and tell it."""
        deployments = self._deployments[wanted.function]
        deployments.finished(wanted, outcome, self._around.now())
        if outcome.running:
            state = FunctionGrounding.RECOVERING if deployments.recovers else FunctionGrounding.STABLE
            self._announcer.announce(outcome.running, state, outcome, phases)
        elif outcome.result is Result.GENERAL_ERROR:
            self._executor.expect_nothing(wanted.function)
            self._executor.stop_robot(wanted.function)
            self._announcer.announce(wanted, FunctionGrounding.FAILED, outcome, phases)
        self._note(wanted="")
        self._changed(outcome.running is not None)
        self._tell(outcome, wanted.name, phases)

    def _release(self, function: str) -> Outcome:
        """Stop what only one function needs."""
        watch = Stopwatch(self._around.now)
        deployments = self._deployments[function]
        try:
            outcome = release(self._executor, function, deployments.running, watch, deployments.failure)
        except self._failures as error:
            outcome = Outcome(Result.GENERAL_ERROR, None, f"{function} could not be released: {error}")
        if outcome.result is Result.OK:
            self._executor.forget_goal(function)
            deployments.released()
            self._announcer.announce_release(function, outcome, watch.phases)
            self._note(wanted="")
        elif deployments.torn and not outcome.cancelled:  # nothing whole runs, and maybe nobody asks again
            self._finish(deployments.torn, outcome, watch.phases)
            return outcome
        self._tell(outcome, function, watch.phases)
        return outcome

    def _tell(self, outcome: Outcome, what: str, phases: Mapping[str, float]) -> None:
        told = self._log.info if outcome.result is Result.OK else self._log.error
        told(f"{outcome.message} (s: {', '.join(f'{name} {duration:.3f}' for name, duration in phases.items())})")
        self._announcer.diagnose(outcome.result is Result.OK, outcome.message, what)

    # -- the launcher's part --------------------------------------------------------------------------------------

    def follow_launcher(self) -> None:
        """React to the launchers' last reports."""
        for function in self._deployments:
            self._executor.clear(function)
            self._look_for_launcher(function)
            deaths = self._executor.take_deaths(function)
            if deaths is not None:
                self._follow_function(function, deaths)
            self._follow_function(function, self._executor.report(function))

    def look(self) -> None:
        """See what nobody reports: whether the launcher has ended, or answers again; call it now and then."""
        self._executor.catch_up()
        for function in self._deployments:
            self._executor.clear(function)
            self._look_for_launcher(function)

    def _look_for_launcher(self, function: str) -> None:
        deployments = self._deployments[function]
        has_ended = deployments.running is not None and self._executor.launcher_has_ended(function)
        if deployments.lacks_launcher(has_ended, self._around.now()) and (running := deployments.running):
            self._log.error(f"{running.name}: {NO_LAUNCHER}: start it again")
            self._executor.stop_robot(function)
            self._announcer.announce(running, FunctionGrounding.RECOVERING, Outcome(Result.OK, running, NO_LAUNCHER))
            self._announcer.diagnose(False, NO_LAUNCHER, running.name)

    def _follow_function(self, function: str, report: LauncherReport | None) -> None:
        deployments = self._deployments[function]
        running, previous, dead = deployments.running, deployments.previous, deployments.dead
        reaction = deployments.react(report, self._around.now())
        if reaction is Reaction.RETURN and deployments.waiting:
            self._log.warn(f"{deployments.waiting.name}: deploying it again, because its hosts are back")
            self._deploy_unasked(deployments.waiting)
        if report is None or running is None:
            return
        if reaction is Reaction.DEPLOY_AGAIN:
            found = report.configuration or "not all of it"
            self._log.warn(f"rosgraph_launcher runs {found}: deploying {running.name}")
            deployments.lost()
            self._deploy_unasked(running)
        elif reaction is Reaction.GIVE_UP:
            self._give_up(running, report.message)
        elif reaction is Reaction.GO_BACK and previous is not None:
            message = f"{running.name}: {report.message}; {previous.name} is restored"
            self._log.error(f"{running.name} soon after the change: {report.message}: going back to {previous.name}")
            self._announcer.diagnose(False, message, running.name)
            deployments.failed(message)
            self._deploy_unasked(previous)
        elif reaction is Reaction.BEGIN_RECOVERY:
            self._begin_recovery(running, report)
        elif reaction is Reaction.GO_ON_RECOVERING:
            others = tuple(node for node in report.dead if node not in dead)
            self._executor.begin_recovery(replace(report, dead=others), goes_on=True)
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
            self._log.warn(str(error))
            if not self._executor.hears_more(running.function):
                self._log.warn(f"nodes of {running.name} hang since they were started again: deploying it again")
                self._deployments[running.function].lost()
                self._deploy_unasked(running)
            return  # else the launcher's next report tells how it goes on
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
        self._log.error(f"{running.name} has failed: {reason}")
        outcome = Outcome(Result.GENERAL_ERROR, None, reason)
        self._announcer.announce(running, FunctionGrounding.FAILED, outcome)
        self._announcer.diagnose(False, reason, running.name)
