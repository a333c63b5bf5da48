"""What a change leaves on the parameter server for the next manipulator."""

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import pytest
from node_kit.io.xml_rpc import SilentError
from rosgraph_launcher.description import NodeDescription, SystemDescription
from rosgraph_launcher.launching.report import RECOVERING, LauncherReport
from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.change.execution import Execution
from rosgraph_manipulator.change.parameters import OverwrittenParameters
from rosgraph_manipulator.change.tactics import Plan
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions
from rosgraph_manipulator.io.launch_files import LaunchFile

FAST = Configuration("fast", "f", "fast.launch")


class Around:
    """A parameter server, and launch files that set one parameter and start nothing."""

    def __init__(self, server):
        self.server, self.silent = server, False
        self.log = SimpleNamespace(info=lambda line: None, warn=lambda line: None)

    def now(self):
        return 0.0

    def news(self):
        return nullcontext()

    def drivers(self):
        return set()

    def halt(self):
        pass

    def resolve(self, name):
        return name.replace("~", "/rosgraph_manipulator/")

    def launch_file(self, configuration):
        return LaunchFile(SystemDescription({}, {"/speed": 2}))

    def parameters(self, names):
        return {name: self.server[name] for name in names if name in self.server}

    def set_parameters(self, values, delete=()):
        if self.silent:
            raise SilentError("the master does not answer", "timed out")
        for name in delete:
            self.server.pop(name, None)
        self.server.update(values)

    def wait_for_news(self, condition, timeout):
        return True


@pytest.fixture
def around():
    return Around({"/speed": 1})


@pytest.fixture
def execution(around):
    launchers = SimpleNamespace(
        reports=dict,
        is_here=lambda node: True,
        require=lambda function, nodes: None,
        change=lambda *_, **__: SimpleNamespace(number=1, phases={}),
    )
    return execution_of(
        around, launchers, lambda *_: SimpleNamespace(begin=lambda: None, see_takers=lambda nodes: None)
    )


def execution_of(around, launchers, make_names, *more, goals=None):
    """Return what carries out changes to FAST and other configurations."""
    return Execution(
        ManipulatorOptions({configuration.name: configuration for configuration in (FAST, *more)}),
        goals or {},
        OverwrittenParameters(),
        ready_timeout=1.0,
        settle_time=0.0,
        launchers=launchers,
        on_report=lambda: None,
        around=around,
        adjusting=None,
        make_names=make_names,
    )


def change(execution):
    execution.begin(FAST, Plan("restart", 1.0, ()))
    execution.change_processes((), ())


def test_former_values_are_handed_over_although_the_master_was_silent_when_they_were_first(execution, around):
    around.silent = True
    with pytest.raises(DeploymentError, match="does not answer"):
        change(execution)
    around.silent = False
    change(execution)
    assert around.server["/speed"] == 2
    left = OverwrittenParameters.from_parameter(around.server["/rosgraph_manipulator/overwritten"])
    assert left.transition({}) == ({"/speed": 1}, [])


def test_function_is_released_although_the_master_is_silent_and_its_parameters_are_restored_later(around):
    execution = execution_of(around, Launchers(), all_up)
    change(execution)
    around.silent = True
    assert execution.release("f") == frozenset()
    execution.catch_up()
    around.silent = False
    assert around.server["/speed"] == 2
    execution.catch_up()
    assert around.server["/speed"] == 1
    around.server["/speed"] = 3  # by somebody else
    execution.catch_up()
    assert around.server["/speed"] == 3


def test_successor_does_not_restore_again_what_was_restored(around):
    execution = execution_of(around, Launchers(), all_up)
    change(execution)
    execution.release("f")
    left = OverwrittenParameters.from_parameter(around.server["/rosgraph_manipulator/overwritten"])
    assert left.transition({}) == ({}, [])


def test_what_could_not_be_handed_over_after_a_restoration_is_later(around, failing):
    execution = execution_of(around, Launchers(), all_up)
    change(execution)
    error = SilentError("the master does not answer", "timed out")
    failing(around, "set_parameters", error, lambda values, **_: "/speed" not in values, times=1)
    execution.release("f")
    around.server["/speed"] = 3  # by somebody else
    execution.catch_up()
    left = OverwrittenParameters.from_parameter(around.server["/rosgraph_manipulator/overwritten"])
    assert left.transition({}) == ({}, [])
    assert around.server["/speed"] == 3


# -- recovery


class Launchers:
    """A launcher that makes each change at once."""

    answers = True

    def __init__(self):
        self.reported, self.number = {}, 0

    def reports(self):
        return self.reported

    def is_here(self, node):
        return True

    def unconnected(self, function):
        return ""

    def adopt(self, function, nodes):
        pass

    def require(self, function, nodes):
        if not self.answers:
            raise DeploymentError("the launcher does not answer")

    def change(self, function, configuration, nodes, stop, start, found):
        self.number += 1
        self.report(LauncherReport(function, configuration, self.number, nodes=tuple(node.name for node in nodes)))
        return SimpleNamespace(number=self.number, phases={})

    def report(self, report):
        self.reported = {**self.reported, report.function: report}
        self.on_reports()


class LaunchFiles(Around):
    """Launch files that start one node each, of the configuration's name."""

    is_ending = False
    gone = ()

    def launch_file(self, configuration):
        if configuration.name in self.gone:
            raise DeploymentError(f"{configuration.launch_file}: no such file")
        name = f"/{configuration.name}"
        return LaunchFile(SystemDescription({name: NodeDescription(name, "/", "p", "x")}))


LOOK = Configuration("look", "f_look", "look.launch")


def all_up(describe, has_finished):
    """Return names of which all are up."""
    return SimpleNamespace(
        begin=lambda: None, see_takers=lambda nodes: None, contested=(), is_up=describe, conflict=lambda node: ""
    )


@pytest.mark.parametrize("is_adopted", [False, True])
def test_function_recovers_although_its_launch_file_can_not_be_read_just_then(is_adopted):
    around, launchers = LaunchFiles({}), Launchers()
    execution = execution_of(around, launchers, all_up, LOOK)
    for configuration in (FAST, LOOK):
        execution.begin(configuration, Plan("restart", 1.0, ()))
        execution.change_processes((), (f"/{configuration.name}",))
        execution.wait_until_ready()
    if is_adopted:  # by the next manipulator
        execution = execution_of(around, launchers, all_up, LOOK)
        for configuration in (FAST, LOOK):
            execution.adopt(configuration)
    around.gone = ("fast",)
    runs = launchers.reported["f"]
    launchers.report(replace(runs, state=RECOVERING, dead=("/fast",)))
    execution.begin_recovery(launchers.reported["f"])
    launchers.report(runs)
    execution.end_recovery("f")
    with pytest.raises(DeploymentError, match="no such file"):
        change(execution)  # by what the file says now


class Goal:
    """A kept goal whose server is /fast."""

    status_topic = "/fast/status"
    is_between_servers, server_is_new, stops = False, True, 0

    def server_stops(self, leaving=(), died=False, is_back=False):
        self.is_between_servers, self.stops = True, self.stops + 1

    def server_started(self):
        self.is_between_servers = False

    def deliver(self):
        return True


@pytest.mark.parametrize("first", ["/fast", "/other"])
def test_goal_is_handed_over_whichever_node_of_a_recovery_was_its_server(first):
    around, launchers, goal = LaunchFiles({}), Launchers(), Goal()
    around.publishers = lambda topic: {"/fast"}
    execution = execution_of(around, launchers, all_up, goals={"f": goal})
    change(execution)
    runs = launchers.reported["f"]
    second = "/other" if first == "/fast" else "/fast"
    execution.begin_recovery(replace(runs, state=RECOVERING, dead=(first,)))
    execution.begin_recovery(replace(runs, state=RECOVERING, dead=(second,)), goes_on=True)
    assert (goal.stops, goal.is_between_servers) == (1, True)
    execution.end_recovery("f")
    assert not goal.is_between_servers


def test_parameters_of_a_died_node_are_put_back_once_the_master_answers():
    around, launchers = LaunchFiles({}), Launchers()
    around.launch_file = lambda configuration: LaunchFile(
        SystemDescription({"/fast": NodeDescription("/fast", "/", "p", "x", parameters={"speed": 2})})
    )
    execution = execution_of(around, launchers, all_up)
    change(execution)
    around.server["/fast/speed"] = 1
    around.silent = True
    execution.begin_recovery(replace(launchers.reported["f"], state=RECOVERING, dead=("/fast",)))
    execution.catch_up()
    assert around.server["/fast/speed"] == 1
    around.silent = False
    execution.catch_up()
    assert around.server["/fast/speed"] == 2
    around.server["/fast/speed"] = 3  # set for the node that runs
    execution.catch_up()
    assert around.server["/fast/speed"] == 3


def test_driver_is_not_ended_where_none_can_be_started():
    around, launchers = LaunchFiles({}), Launchers()
    execution = execution_of(around, launchers, all_up, LOOK)
    ended = []
    around.end_node, around.why_not_started = ended.append, lambda node: ""
    launchers.answers = False
    with pytest.raises(DeploymentError, match="does not answer"):
        execution.start_driver(LOOK)
    assert (ended, launchers.number) == ([], 0)
    launchers.answers = True
    execution.start_driver(LOOK)
    assert (ended, launchers.number) == (["/look"], 1)
