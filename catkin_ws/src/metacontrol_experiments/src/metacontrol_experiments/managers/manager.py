"""The interface of managers: facts come in, decisions come out.

A package offers a manager in its package.xml:
`<export><metacontrol_experiments manager="NAME" function="MODULE:FUNCTION"/></export>`.
The function takes a `Situation` and returns a `Manager`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from metacontrol_bags.decision import Decision
from node_kit.plugins import Plugin, find

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
    from mros1_reasoner.knowledge.model import Objective
    from mros1_reasoner.loop.entries import Fact

PACKAGE = "metacontrol_experiments"
NONE, MROS, AS_PUBLISHED = "none", "mros", "as_published"
"""The baseline, the meta-controller, and the meta-controller that behaves as the published one does."""


class ManagerError(ValueError):
    """There is no such manager, or what it needs; the message has the remedy."""


@dataclass(frozen=True)
class Situation:
    """What a manager is made for.

    Attributes:
        configuration: deployed at the start.
        seed: of the mission; a manager that draws numbers draws the same ones for it.
        knowledge: the models; None for a manager that observes nothing.
        objectives: what is needed, with the limits of the mission.
        parameters: of the reasoner's node.
        starts_take_time: whether a driver that is started again takes its time to come up, as processes do; in lockstep
            it is there at once.
    """

    configuration: str
    seed: int
    knowledge: KnowledgeBase | None = None
    objectives: tuple[Objective, ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    starts_take_time: bool = False


@dataclass(frozen=True)
class Restart:
    """Start the driver of a component again."""

    component: str


class Manager:
    """Decides nothing: the baseline. Others override what they need. Times are s of ROS time.

    Attributes:
        observes: whether the monitor and its observers run for it; only then it gets facts and a knowledge base.
        reconfiguration_s: how long each of its reconfigurations takes in lockstep, with a restart of navigation; None:
            as long as those of this project's manipulator, which restarts only what it has to.
    """

    observes: ClassVar[bool] = False
    reconfiguration_s: ClassVar[float | None] = None

    def take(self, now: float, fact: Fact) -> None:
        """Take in what the monitor, an observer or the manipulator says."""

    def ended(self, now: float, component: str) -> None:
        """Take in that the process of a component's driver has ended, which its parent process knows at once."""

    def step(self, now: float, *, heartbeat: bool) -> Sequence[Decision | Restart]:  # noqa: ARG002
        """Return what to do now.

        Args:
            now: present time.
            heartbeat: whether the reasoner's period is over; it looks at new levels only then.
        """
        return ()

    def executed(self, now: float, decision: str) -> Decision:
        """Take in that the decision of this id was carried out, and return it as it is now."""
        raise NotImplementedError(f"{type(self).__name__} decides nothing, so {decision} is not its own ({now:.2f} s)")

    def failed(self, now: float, decision: str, reason: str) -> Decision:
        """Take in that the decision of this id could not be carried out, and return it as it is now."""
        raise NotImplementedError(
            f"{type(self).__name__} decides nothing, {decision} is not its own ({reason}, {now:.2f} s)"
        )

    def close(self) -> None:
        """End what was started for it."""


def make_manager(name: str, situation: Situation, *passing: type[Exception]) -> Manager:
    """Return the manager of a name.

    Args:
        name: of the plug-in.
        situation: what it is made for.
        passing: errors of the plug-in that blame the situation, and are raised as they are.

    Raises:
        ManagerError: no package exports one of that name.
        PluginError: it cannot be loaded or made.
    """
    plugin = find_manager(name)
    make = plugin.load()
    with plugin.guard(*passing):
        manager = make(situation)
    if not isinstance(manager, Manager):
        raise plugin.error(f"returned {manager!r}", "return a metacontrol_experiments Manager")
    return manager


def find_manager(name: str) -> Plugin:
    """Return the plug-in that makes a manager; the function that it loads takes a Situation.

    Raises:
        ManagerError: no package exports one of that name.
    """
    known = find(PACKAGE, "manager")
    if name not in known:
        raise ManagerError(
            f"no manager {name!r}; there are {', '.join(sorted(known)) or 'none'}; a package exports one as "
            f'<{PACKAGE} manager="NAME" function="MODULE:FUNCTION"/>'
        )
    return known[name]
