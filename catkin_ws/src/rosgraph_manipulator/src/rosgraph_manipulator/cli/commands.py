"""The commands `plan`, `request` and `status`."""

from __future__ import annotations

import argparse
import sys
from typing import Any

import actionlib
import rosgraph
import rospy
from actionlib_msgs.msg import GoalStatus
from metacontrol_msgs.msg import (
    ActiveConfiguration,
    LauncherState,
    MvpReconfigurationAction,
    MvpReconfigurationGoal,
    ReconfigurationResult,
)
from ros_model.errors import ModelError
from ros_model.io.files import resolve

from rosgraph_manipulator.change.tactics import NoRunningNodes, TacticError, load_tactics, plan_change
from rosgraph_manipulator.configuration.configurations import KEYS, ConfigurationError
from rosgraph_manipulator.configuration.description import SystemDescription, compare
from rosgraph_manipulator.io.configuration_file import options_from, read_file
from rosgraph_manipulator.io.launch_files import LaunchFileError, read_launch_file, read_model
from rosgraph_manipulator.ros.reconfigure_client import ReconfigureClient

FIND_TIMEOUT = 5.0  # s, wall, to find the manipulator
NODE = "rosgraph_manipulator"


class CommandError(Exception):
    """The command can't do what it is asked; the message says why."""


def plan_main() -> None:
    """Print how one configuration would be changed into another."""
    parser = argparse.ArgumentParser(prog="plan", description="Print how configuration A would be changed into B.")
    parser.add_argument("a", metavar="A", help="name of a configuration, launch file or .rossystem file; '': nothing")
    parser.add_argument("b", metavar="B", help="the same")
    parser.add_argument("--config", help="YAML file with the configurations; else the running manipulator's are taken")
    options = parser.parse_args(rospy.myargv()[1:])
    _run(lambda: _plan(options.a, options.b, options.config))


def request_main() -> None:
    """Ask the manipulator for a configuration, and wait for the result."""
    parser = argparse.ArgumentParser(prog="request", description="Have the manipulator deploy a configuration.")
    parser.add_argument("name", metavar="NAME", help="the configuration")
    options = parser.parse_args(rospy.myargv()[1:])
    _run(lambda: _request(options.name))


def status_main() -> None:
    """Print what runs, and how the last change went."""
    argparse.ArgumentParser(prog="status", description="Print what runs.").parse_args(rospy.myargv()[1:])
    _run(_status)


def _run(command: Any) -> None:
    try:
        sys.exit(command())
    except (CommandError, ConfigurationError, LaunchFileError, ModelError, TacticError) as error:
        sys.stderr.write(f"{' '.join(str(error).split())}\n")
        sys.exit(2)


def _plan(a: str, b: str, config: str | None) -> int:
    online = rosgraph.is_master_online()
    if online:
        rospy.init_node("plan", anonymous=True, disable_signals=True)
    running, wanted = (_system(name, config, online) for name in (a, b))
    nodes = ReconfigureClient() if online else NoRunningNodes()
    found, problems = plan_change(running, wanted, nodes, load_tactics())
    for problem in problems:
        _say(problem)
    if not online and compare(running, wanted).parameters:
        _say("no ROS master: nodes are not asked what they take by dynamic_reconfigure")
    for number, plan in enumerate(found):
        _say(f"{'' if number == 0 else 'else '}{plan}")
    return 0


def _system(name: str, config: str | None, online: bool) -> SystemDescription:
    if not name:
        return SystemDescription()
    if name.endswith(".rossystem"):
        return read_model(resolve(name)).system
    if name.endswith(".launch"):
        return read_launch_file(resolve(name)).system
    if config is not None:
        options = options_from(read_file(config))
    elif online:
        options = options_from({key: rospy.get_param(f"{NODE}/{key}", rospy.get_param(key, None)) for key in KEYS})
    else:
        raise CommandError(f"{name}: no ROS master knows the configurations: start the manipulator or give --config")
    configuration = options.configurations.get(name)
    if configuration is None:
        raise CommandError(f"unknown configuration '{name}'; known are: {', '.join(sorted(options.configurations))}")
    return read_launch_file(configuration.launch_file, configuration.args).system


def _request(name: str) -> int:
    _join("request")
    action = rospy.get_param(f"{NODE}/reconfiguration_action_name", "rosgraph_manipulator_action_server")
    client = actionlib.SimpleActionClient(action, MvpReconfigurationAction)
    if not client.wait_for_server(rospy.Duration.from_sec(FIND_TIMEOUT)):
        raise CommandError(f"no manipulator answers at {rospy.resolve_name(action)}: start rosgraph_manipulator")
    client.send_goal(MvpReconfigurationGoal(name))
    try:
        client.wait_for_result()
    except KeyboardInterrupt:
        client.cancel_goal()
        client.wait_for_result()
    result = client.get_result()
    _say(client.get_goal_status_text())
    if client.get_state() == GoalStatus.SUCCEEDED:
        _status_lines(_latest(f"{NODE}/active_configuration", ActiveConfiguration))
        return 0
    return 1 if result is not None and result.result == ReconfigurationResult.FAILED else 2


def _status() -> int:
    _join("status")
    active = _latest(f"{NODE}/active_configuration", ActiveConfiguration)
    launcher = _latest("rosgraph_launcher/state", LauncherState)
    if active is None and launcher is None:
        raise CommandError("neither manipulator nor launcher answers: start manipulator.launch")
    if active is not None:
        for grounding in active.functions:
            _say(f"{grounding.function}: {grounding.configuration} {grounding.state}")
        _status_lines(active)
    if launcher is not None:
        _say(f"processes: {launcher.configuration or 'none'} {launcher.state}")
        for node in launcher.nodes:
            _say(f"  {node}{' (dead)' if node in launcher.dead else ''}")
        if launcher.message:
            _say(f"  {launcher.message}")
    return 0


def _status_lines(active: ActiveConfiguration | None) -> None:
    if active is None:
        return
    if active.message:
        _say(f"  {active.message}")
    for phase in active.phases:
        _say(f"  {phase.name:<9} {phase.duration:.3f} s")


def _join(name: str) -> None:
    if not rosgraph.is_master_online():
        raise CommandError(f"no ROS master at {rosgraph.get_master_uri()}: start roscore or set ROS_MASTER_URI")
    rospy.init_node(name, anonymous=True, disable_signals=True)


def _latest(topic: str, kind: Any) -> Any:
    try:
        return rospy.wait_for_message(topic, kind, FIND_TIMEOUT)
    except rospy.ROSException:
        return None


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
