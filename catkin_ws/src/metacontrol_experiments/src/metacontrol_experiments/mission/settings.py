"""The settings of a mission."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from metacontrol_bags.bag import TOPICS
from metacontrol_bags.metrics import DEFAULT_THRESHOLDS, TIMEOUT_S

from metacontrol_experiments.contingency.contingency import Contingency, Kind, with_seed
from metacontrol_experiments.managers.manager import AS_PUBLISHED, MROS, NONE
from metacontrol_experiments.mission.mission import Plan

if TYPE_CHECKING:
    from pathlib import Path

    from metacontrol_experiments.mission.routes import Route

ENGINES = LOCKSTEP, ROS = "lockstep", "ros"
"""What drives a mission."""
MANAGER_NODE = "mission_manager"
"""Name of the node that runs a manager on ROS."""
BAG_NAME, SUMMARY_NAME, FIGURE_NAME, LOG_NAME = "mission.bag", "summary.json", "mission.png", "mission.log"
"""Files that a mission leaves in its folder: a bag on ROS, a log in lockstep."""
RESULTS = BAG_NAME, SUMMARY_NAME, FIGURE_NAME, LOG_NAME


@dataclass(frozen=True)
class Settings:
    """One mission.

    Attributes:
        route: where it starts and goes.
        output: folder for bag, summary, figure and logs.
        manager: name of what adapts.
        parameters: of the reasoner, in place of those that the system has; JSON of a mapping, empty for none.
        environment: whether the robot observes its surroundings, such as the light.
        spares: whether what adapts may take variants with spares.
        seed: of everything random in the simulation.
        initial_configuration: name of the variant deployed first.
        contingencies: what goes wrong, and when.
        components: name -> node, of what contingencies may hit.
        world: file of the world or map; None for the factory.
        real_time_factor: simulated per wall second, 0 for as fast as it can.
        timeout_s: simulated seconds after which the mission has failed.
        thresholds: QA name -> level that must not be exceeded.
        gui: show the simulator's window.
        rviz: start RViz.
        port: of the master; None for a free one.
        commit: of the code that runs.
    """

    route: Route
    output: Path
    manager: str = MROS
    parameters: str = ""
    environment: bool = True
    spares: bool = True
    seed: int = 1
    initial_configuration: str = "f2_v2_r2"
    contingencies: tuple[Contingency, ...] = ()
    components: dict[str, str] = field(default_factory=dict)
    world: Path | None = None
    real_time_factor: float = 1.0
    timeout_s: float = TIMEOUT_S
    thresholds: dict[str, float] = field(default_factory=lambda: dict(DEFAULT_THRESHOLDS))
    gui: bool = False
    rviz: bool = False
    port: int | None = None
    commit: str = "unknown"

    launch_package: ClassVar[str] = "metacontrol_sim"
    """Has the launch files of the whole system."""
    topics: ClassVar[tuple[str, ...]] = TOPICS
    """What is recorded on ROS."""

    @property
    def metacontrol(self) -> bool:
        """Whether anything adapts; the baseline is without it."""
        return self.manager != NONE

    @property
    def observes_environment(self) -> bool:
        """Whether the surroundings are observed; the published meta-controller knows nothing of them."""
        return self.environment and self.manager != AS_PUBLISHED

    @property
    def knows_spares(self) -> bool:
        """Whether what adapts knows variants with spares; the published meta-controller has none."""
        return self.spares and self.manager not in (NONE, AS_PUBLISHED)

    @property
    def plan(self) -> Plan:
        """The mission's core."""
        return Plan(
            goal_x=self.route.goal.x,
            goal_y=self.route.goal.y,
            contingencies=with_seed(self.contingencies, self.seed),
            timeout_s=self.timeout_s,
        )

    @property
    def windows(self) -> list[str]:
        """Options that open a window."""
        return ["--gui"] * self.gui + ["--rviz"] * self.rviz

    @property
    def launch_file(self) -> str:
        """Name of the launch file of the whole system, in `launch_package`."""
        return "metacontrol_sim_reasoner.launch" if self.metacontrol else "MVP_metacontrol_world.launch"

    @property
    def launch_arguments(self) -> list[str]:
        """Arguments of the launch file, each NAME:=VALUE."""
        start = self.route.start
        arguments = {
            "gui": _boolean(self.gui),
            "rviz": _boolean(self.rviz),
            "nav_profile": self.initial_configuration,
            "initial_pose_x": repr(start.x),
            "initial_pose_y": repr(start.y),
            "initial_pose_a": repr(start.yaw),
            "seed": str(self.seed),
            "real_time_factor": repr(self.real_time_factor),
            "environment": _boolean(self.observes_environment),
        }
        if self.world is not None:
            arguments["world"] = str(self.world.resolve())
        if self.metacontrol:
            arguments |= {f"nfr_{name}": repr(level) for name, level in self.thresholds.items()}
            arguments["spares"] = _boolean(self.knows_spares)
        if self.manager == AS_PUBLISHED:
            arguments["as_published"] = "true"
        if self.parameters:
            arguments["reasoner_parameters"] = self.parameters
        return [f"{name}:={value}" for name, value in arguments.items()]

    @property
    def decider(self) -> str:
        """Name of the node that decides on ROS; empty for the baseline."""
        return {NONE: "", MROS: "reasoner", AS_PUBLISHED: "reasoner"}.get(self.manager, MANAGER_NODE)

    def launch_command(self, port: int) -> list[str]:
        """Return the roslaunch command of the whole system, with a master on this port."""
        file = [self.launch_package, self.launch_file]
        arguments = self.launch_arguments
        if self.decider == MANAGER_NODE:
            file = ["metacontrol_experiments", "managed.launch"]
            arguments += [f"manager:={self.manager}"]
        return ["roslaunch", "-p", str(port), *file, *arguments]

    def describe(self) -> dict[str, str]:
        """Return the values of the event MISSION_START, by which the bag alone tells what was run."""
        goal = self.route.goal
        broken = [entry for entry in self.contingencies if entry.kind.breaks_component]
        power = [entry.value for entry in self.contingencies if entry.kind is Kind.POWER]
        other = {} if self.manager in (NONE, MROS) else {"manager": self.manager}
        other |= {"parameters": self.parameters} if self.parameters else {}
        other |= {"environment": "true"} if self.observes_environment else {}
        other |= {"spares": "true"} if self.knows_spares else {}
        return {
            "mission": "D2",
            "route": self.route.name,
            "goal": f"{goal.x:g} {goal.y:g} {goal.yaw:g}",
            "metacontrol": _boolean(self.metacontrol),
            **other,
            "seed": str(self.seed),
            "initial_configuration": self.initial_configuration,
            "world": str(self.world) if self.world else "factory",
            "clutter": str(sum(entry.obstacles for entry in self.contingencies)),
            "failure": broken[0].target if broken else "none",
            "power_factor": repr(power[-1] if power else 1.0),
            "contingencies": " ".join(map(str, self.contingencies)),
            "real_time_factor": repr(self.real_time_factor),
            "timeout_s": repr(self.timeout_s),
            **{f"nfr_{name}": repr(level) for name, level in self.thresholds.items()},
            "commit": self.commit,
        }


def _boolean(value: bool) -> str:
    return "true" if value else "false"
