"""The command `metacontrol run`."""

from __future__ import annotations

import json
import shlex
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from metacontrol_bags.bag import BagError, read_whole
from metacontrol_bags.decision import DECIDED
from metacontrol_bags.gaps import gaps
from metacontrol_bags.metrics import DEFAULT_THRESHOLDS, TIMEOUT_S, MetricsError, summarise
from metacontrol_bags.timeline import Timeline
from mros1_reasoner.loop.settings import setting_names
from node_kit.io.output_files import write_file

from metacontrol_experiments.cli.figure import draw_figure
from metacontrol_experiments.cli.missions import ByMission
from metacontrol_experiments.cli.options import MAPPING, Number, ground_options, run_options
from metacontrol_experiments.cli.summary import write_summary
from metacontrol_experiments.contingency.contingency import Contingency, Kind, Moment
from metacontrol_experiments.contingency.parsing import (
    DEFAULT_SHARE,
    ComponentError,
    ContingencyError,
    node_of,
    parse_contingency,
)
from metacontrol_experiments.io.code_version import current_commit
from metacontrol_experiments.io.display import Display, refusing
from metacontrol_experiments.io.ground_files import read_ground, read_routes
from metacontrol_experiments.io.input_files import (
    PackageError,
    read_components,
    read_contingencies,
    simulation_package,
)
from metacontrol_experiments.io.processes import RunError
from metacontrol_experiments.managers.manager import AS_PUBLISHED, MROS, NONE, ManagerError, find_manager
from metacontrol_experiments.mission.mission import MissionError, Outcome
from metacontrol_experiments.mission.routes import RouteError
from metacontrol_experiments.mission.settings import (
    BAG_NAME,
    ENGINES,
    FIGURE_NAME,
    LOCKSTEP,
    LOG_NAME,
    RESULTS,
    ROS,
    SUMMARY_NAME,
    Settings,
)
from metacontrol_experiments.ros.runner import run_mission

if TYPE_CHECKING:
    from collections.abc import Callable

    from metacontrol_bags.record import MissionRecord
    from metacontrol_bags.timeline import Report

    from metacontrol_experiments.io.processes import ProcessTree
    from metacontrol_experiments.mission.mission import State
    from metacontrol_experiments.ros.mission import NavigationMission

_BAD_INPUT = (
    BagError,
    ComponentError,
    ContingencyError,
    ManagerError,
    MetricsError,
    PackageError,
    RouteError,
    RunError,
)
_FAILED = 1
"""Exit status of a mission that did not reach its goal."""


@click.command(cls=ByMission)
@click.option(
    "--engine",
    type=click.Choice(ENGINES),
    default=ROS,
    show_default=True,
    help="lockstep: in one process without ROS, as fast as it can, the same bytes for a seed.",
)
@click.option(
    "--manager",
    default=MROS,
    show_default=True,
    help="What adapts: mros, as_published, none, random, rules, respawn, or one that a package exports.",
)
@click.option(
    "--parameters",
    type=MAPPING,
    default="",
    help="YAML mapping of parameters of the reasoner, in place of those that it has, e.g. '{cool_down: 3}'.",
)
@click.option("--no-metacontrol", is_flag=True, help="The baseline, everything but the reasoner: --manager none.")
@click.option("--no-environment", is_flag=True, help="Nothing observes the surroundings, such as the light.")
@click.option(
    "--no-spares", is_flag=True, help="What adapts does not know variants with spares, such as the rear laser."
)
@click.option(
    "--seed", type=click.IntRange(0), default=1, show_default=True, help="Of everything random in the simulation."
)
@click.option("--route", default="r1", show_default=True, help="One of the routes.")
@click.option(
    "--initial-configuration",
    default=Settings.initial_configuration,
    show_default=True,
    help="The variant deployed first.",
)
@click.option(
    "--failure", help="Component whose node is killed, or none.  [default: front_laser, without other contingencies]"
)
@click.option(
    "--failure-at",
    type=Number(0, 1),
    default=DEFAULT_SHARE,
    show_default=True,
    help="Share of the way done at which --failure and --power-factor strike.",
)
@click.option("--power-factor", type=Number(0), default=1.0, show_default=True, help="Of the power load, from then on.")
@click.option(
    "--contingency",
    "contingencies",
    multiple=True,
    metavar="KIND:WHAT[@WHEN]",
    help="What goes wrong, any number of times: kill:, stop:, unplug:, freeze:, thaw:, repeat: or jump:COMPONENT, "
    "power:FACTOR, clutter:NUMBER, light:0..1; at share:0..1 of the way, time:SECONDS or place:X,Y. Clutter is there "
    "from the start.",
)
@click.option("--timeline", type=click.Path(path_type=Path), help="YAML file of contingencies.")
@ground_options
@click.option(
    "--timeout", type=Number(0, min_open=True), default=TIMEOUT_S, show_default=True, help="Simulated seconds."
)
@click.option(
    "--nfr-safety", type=Number(0, 1), default=DEFAULT_THRESHOLDS["safety"], show_default=True, help="Required level."
)
@click.option(
    "--nfr-energy", type=Number(0, 1), default=DEFAULT_THRESHOLDS["energy"], show_default=True, help="Required level."
)
@run_options
@click.option("--rviz", is_flag=True, help="Show RViz.")
def run(quiet: bool, output: Path, **options: Any) -> None:
    """Run a mission and leave its bag, summary and figure in a folder.

    For the options of another kind of mission: run --mission manipulation --help.

    Exit status: 0 the goal was reached, 1 it was not, 2 bad input, a system that did not start or a bag that is not
    whole, 130 interrupted.
    """
    engine = options["engine"]
    with refusing(*_BAD_INPUT):
        settings = _settings(output, options)
        with Display(quiet) as display:
            if engine == LOCKSTEP:
                if options["gui"] or options["rviz"]:
                    raise RunError("--engine lockstep has no window; leave --gui and --rviz out")
                state, record = _run_lockstep(settings, display)
            else:
                state = _run_on_ros(settings, display)
                found = read_whole(output / BAG_NAME)
                record = found.record
                if missing := gaps(found):
                    display.say(f"{output / BAG_NAME}: {'; '.join(missing)}")
        summary = summarise(record)
        write_summary(summary, output / SUMMARY_NAME)
        draw_figure(record, output / FIGURE_NAME)
    display.summary(summary)
    for name in (LOG_NAME if engine == LOCKSTEP else BAG_NAME, SUMMARY_NAME, FIGURE_NAME):
        display.say(str(output / name))
    if engine != LOCKSTEP:
        display.say(f"as a page: metacontrol view {shlex.quote(str(output / BAG_NAME))}")
    raise click.exceptions.Exit(0 if state.outcome is Outcome.REACHED else _FAILED)


def _settings(output: Path, options: dict[str, Any]) -> Settings:
    """Return the mission that the options ask for.

    Raises:
        PackageError: metacontrol_sim is missing.
        RunError: it has no such configuration.
        RouteError: there is no such world or route, or the robot cannot stand at its ends.
        ContingencyError, ComponentError: what is to go wrong makes no sense.
        ManagerError: there is no such manager.
    """
    simulation = simulation_package()
    name = options["initial_configuration"]
    variants = sorted(path.stem for path in (simulation / "launch" / "variants").glob("*.launch"))
    if name not in variants:
        known = ", ".join(variants) or "none generated yet"
        raise RunError(f"--initial-configuration: no configuration {name!r}; there are {known}")
    manager = _manager(options["manager"], baseline=options["no_metacontrol"])
    _check_parameters(options["parameters"], manager)
    components = read_components(simulation / "models" / "metacontrol.yaml")
    ground = read_ground(options["world"], options["routes"])
    return Settings(
        route=read_routes(ground, [options["route"]])[options["route"]],
        output=output,
        manager=manager,
        parameters=options["parameters"],
        environment=not options["no_environment"],
        spares=not options["no_spares"],
        seed=options["seed"],
        initial_configuration=name,
        contingencies=_contingencies(options, components),
        components=components,
        world=options["world"],
        real_time_factor=options["real_time_factor"],
        timeout_s=options["timeout"],
        thresholds={"safety": options["nfr_safety"], "energy": options["nfr_energy"]},
        gui=options["gui"],
        rviz=options["rviz"],
        port=options["port"],
        commit=current_commit(),
    )


def _manager(asked: str, *, baseline: bool) -> str:
    """Return the manager that is asked for.

    Raises:
        ManagerError: no package exports one of that name.
        RunError: two are asked for.
    """
    if baseline and asked not in (MROS, NONE):
        raise RunError(f"--no-metacontrol is --manager none, and --manager is {asked}: leave one of them out")
    find_manager(asked)
    return NONE if baseline else asked


def _check_parameters(text: str, manager: str) -> None:
    """Check that the reasoner is what adapts, and that it has these parameters.

    Raises:
        RunError: it is not, or it lacks one.
    """
    if text and manager not in (MROS, AS_PUBLISHED):
        raise RunError(f"--parameters are those of the reasoner, and --manager is {manager}: leave one of them out")
    known = setting_names()
    for name in json.loads(text or "{}"):
        if name not in known:
            raise RunError(f"--parameters: no parameter {name!r}; there are {', '.join(known)}")


def _run_on_ros(settings: Settings, display: Display) -> State:
    """Run a mission on ROS and leave its bag.

    Raises:
        RunError: the system did not come up, the mission cannot be run as asked for, or its bag is not whole.
    """

    def make(tree: ProcessTree, display: Display, check: Callable[[], None]) -> NavigationMission:
        from metacontrol_experiments.ros.mission import NavigationMission  # rospy reads the environment when imported

        return NavigationMission(settings, tree, display, check)

    return run_mission(settings, display, make).state


def _run_lockstep(settings: Settings, display: Display) -> tuple[State, MissionRecord]:
    """Run a mission in lockstep and leave its log.

    Raises:
        RunError: it cannot be run in lockstep.
    """
    from metacontrol_experiments.io.lockstep_setup import set_up  # PyBullet takes a while to import
    from metacontrol_experiments.lockstep.recorder import with_wall_time
    from metacontrol_experiments.lockstep.system import LockstepError

    began = time.monotonic()
    try:
        outcome = set_up(settings).run()
    except (LockstepError, MissionError) as error:
        raise RunError(str(error)) from error
    settings.output.mkdir(parents=True, exist_ok=True)
    for name in RESULTS:  # of an earlier run
        (settings.output / name).unlink(missing_ok=True)
    write_file(settings.output / LOG_NAME, outcome.log)
    told = Timeline(settings.thresholds)
    display.start(outcome.state.started_s)
    record = outcome.record
    closed = [decision for decision in record.decisions if decision.state != DECIDED]
    decided = [decision for decision in record.decisions if decision.state == DECIDED]
    reports: list[Report] = [*record.events, *record.components, *record.observed]  # as they follow in one moment
    reports += [*decided, *record.configurations, *closed]
    for report in sorted(reports, key=lambda report: report.stamp):
        for entry in told.tell(report):
            display.entry(entry)
    return outcome.state, with_wall_time(record, time.monotonic() - began)


def _contingencies(options: dict[str, Any], components: dict[str, str]) -> tuple[Contingency, ...]:
    """Return the contingencies of all options that ask for some.

    Raises:
        ContingencyError: one of them makes no sense.
        ComponentError: one hits a component that nobody knows.
    """
    listed = read_contingencies(options["timeline"]) if options["timeline"] else ()
    given = (*listed, *map(parse_contingency, options["contingencies"]))
    failure = options["failure"] or ("none" if given else "front_laser")
    when = Moment(share=options["failure_at"])
    short: list[Contingency] = []
    if failure != "none":
        short.append(Contingency(Kind.KILL, when, target=failure))
    if options["power_factor"] != 1.0:
        short.append(Contingency(Kind.POWER, when, value=options["power_factor"]))
    for contingency in (*given, *short):
        if contingency.kind.hits_component:
            node_of(contingency.target, components)
    return (*given, *short)
