"""The settings of a mission of D1."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

from metacontrol_experiments.pyramid.record import TOPICS
from metacontrol_experiments.pyramid.scenarios import Scenario, draw

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True)
class PyramidSettings:
    """One mission.

    Attributes:
        output: folder for bag, summary, figure and logs.
        scenario: number of what goes wrong.
        seed: of the scenario's moments and places, of where the blocks lie, and of all noise.
        metacontrol: whether the reasoner runs; without it nothing else is different.
        parameters: of the reasoner, in place of those that the system has; JSON of a mapping, empty for none.
        configurations: deployed at the start, by commas, in place of those of the scenario; empty: as the scenario has.
        real_time_factor: simulated per wall second, 0 for as fast as it can.
        gui: show the simulator's window.
        port: of the master; None for a free one.
        commit: of the code that runs.
    """

    output: Path
    scenario: int = 2
    seed: int = 1
    metacontrol: bool = True
    parameters: str = ""
    configurations: str = ""
    real_time_factor: float = 1.0
    gui: bool = False
    port: int | None = None
    commit: str = "unknown"

    topics: ClassVar[tuple[str, ...]] = TOPICS
    """What is recorded."""

    @property
    def drawn(self) -> Scenario:
        """The scenario, as the seed has drawn it."""
        drawn = draw(self.scenario, self.seed)
        return replace(drawn, configurations=self.configurations) if self.configurations else drawn

    @property
    def windows(self) -> list[str]:
        """Options that open a window."""
        return ["--gui"] * self.gui

    @property
    def decider(self) -> str:
        """Name of the node that decides on ROS; empty for the baseline."""
        return "reasoner" if self.metacontrol else ""

    def launch_command(self, port: int) -> list[str]:
        """Return the roslaunch command of the whole system, with a master on this port."""
        drawn = self.drawn
        arguments = {
            "reasoner": _boolean(self.metacontrol),
            "initial_configuration": drawn.configurations,
            "stopped_arm": drawn.stopped_arm,
            "light": repr(drawn.light),
            "seed": str(self.seed),
            "gui": _boolean(self.gui),
            "real_time_factor": repr(self.real_time_factor),
        }
        if self.parameters:
            arguments["reasoner_parameters"] = self.parameters
        given = [f"{name}:={value}" for name, value in arguments.items()]
        return ["roslaunch", "-p", str(port), "metacontrol_manipulation", "cell.launch", *given]

    def describe(self) -> dict[str, str]:
        """Return the values of the event MISSION_START, by which the bag alone tells what was run."""
        drawn = self.drawn
        return {
            "mission": "D1",
            "scenario": str(self.scenario),
            "seed": str(self.seed),
            "metacontrol": _boolean(self.metacontrol),
            "initial_configuration": drawn.configurations,
            "light": repr(drawn.light),
            "stopped_arm": drawn.stopped_arm,
            "strikes": " ".join(map(str, drawn.strikes)),
            "can_be_built": _boolean(drawn.can_be_built),
            "real_time_factor": repr(self.real_time_factor),
            "commit": self.commit,
        } | ({"parameters": self.parameters} if self.parameters else {})


def _boolean(value: bool) -> str:
    return "true" if value else "false"
