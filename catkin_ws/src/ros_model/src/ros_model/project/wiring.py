"""The components that feed a variant, by its wiring: which of them it requires, by which way, and which not."""

from __future__ import annotations

import enum
from collections import defaultdict, deque
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

from ros_model.language.metamodel import Connection, ConnectionKind, PortPath, RosSystem, compose

_SHARED = frozenset(["bond", "diagnostics", "diagnostics_agg", "diagnostics_toplevel_state", "tf", "tf_static"])
"""Last parts of the names of topics on which any node may publish, in the namespace of any robot."""
_SHARED_BY_ALL = frozenset(["clock", "rosout", "rosout_agg", "statistics"])
"""Topics of ROS itself, which are in no namespace."""
_COMMANDS = frozenset(["cmd", "cmds", "command", "commands", "setpoint", "setpoints"])
"""Words in the names of topics that carry commands, by the conventions of ros_control, mobile bases and mavros."""
_ANSWERS = frozenset(["echo", "feedback", "result", "state", "states", "status"])
"""Words in the last part of the name of a topic that tells of a command: arm/command_status."""


class Uncounted(enum.Enum):
    """Why a variant does not require a component that feeds it, or that feeds a component that it requires."""

    SHARED = "any node may publish there"
    COMMAND = "it commands, and who obeys can do without it"
    GOAL = "it sets goals, and who pursues them can do without it"
    PLANT = "the variant commands that component itself"
    FUNCTION = "another function deploys it"


@dataclass(frozen=True)
class Feed:
    """A connection by which one component feeds another: a publisher its subscriber, a server its client."""

    source: str
    connection: str
    target: str


@dataclass(frozen=True)
class Wiring:
    """What the wiring of a system says of a variant.

    Attributes:
        chains: required component -> the feeds that lead from it to a component of the variant, the shortest way.
        uncounted: component that feeds the variant or what this requires, but is not required itself -> the feed, and
            why it does not count.
    """

    chains: Mapping[str, tuple[Feed, ...]] = field(default_factory=dict)
    uncounted: Mapping[str, tuple[Feed, Uncounted]] = field(default_factory=dict)


def wiring_of(base: RosSystem, variant: RosSystem, foreign: Collection[str] = ()) -> Wiring:
    """Return the components of the base that feed the variant's, directly or through others.

    The plant is what the variant commands, itself or through a server that it uses, or through a node that passes
    commands on: a robot's base takes the velocity and gives the odometry. These feeds do not count:

    - topics that carry commands or goals: as the server of an action needs none of its clients, a driver needs none of
      the nodes that command it;
    - topics on which any node may publish, such as /tf: they do not tell who needs whom;
    - what else acts on the plant: the variant requires the plant if that feeds it, but not what feeds the plant;
    - all of a component that another function deploys: a variant that needs this function says so, and what feeds the
      component is a matter of that function.

    On topics of the first two kinds, components of the plant do count: they close the loop of the variant. But if only
    another function commands them for it, they close the loop of that one.

    Args:
        base: the system without the variant.
        variant: what it brings.
        foreign: components that other functions deploy.
    """
    system = compose(base, variant)
    own = [component.name for component in variant.components]
    feeds = defaultdict(list)
    for connection in system.connections:
        for feed, why in _feeds(connection, system):
            feeds[feed.target].append((feed, why))
    foreign = frozenset(foreign) - {*own}
    plant = _plant(system, frozenset(own))
    own_plant = _plant(system, frozenset(own), foreign) if foreign else plant
    chains: dict[str, tuple[Feed, ...]] = {}
    uncounted: dict[str, tuple[Feed, Uncounted]] = {}
    waiting = deque(own)
    while waiting:
        name = waiting.popleft()
        for feed, why in feeds[name]:
            if feed.source in own or feed.source in chains:
                continue
            if feed.source in foreign:
                uncounted.setdefault(feed.source, (feed, Uncounted.FUNCTION))
            elif not why and name in plant:
                uncounted.setdefault(feed.source, (feed, Uncounted.PLANT))
            elif why and feed.source not in own_plant:
                uncounted.setdefault(feed.source, (feed, why))
            else:
                chains[feed.source] = (feed, *chains.get(name, ()))
                waiting.append(feed.source)
    return Wiring(chains, {name: found for name, found in uncounted.items() if name not in chains})


def _feeds(connection: Connection, system: RosSystem) -> Iterator[tuple[Feed, Uncounted | None]]:
    """Yield who feeds whom by a connection, and why that does not count, where it does not."""
    for target in connection.targets:
        for source in connection.sources:
            why = None
            if connection.kind is ConnectionKind.TOPIC:
                names = {connection.name, *_names(source, system), *_names(target, system)}
                if any(is_shared(name) for name in names):
                    why = Uncounted.SHARED
                elif any(_is_goal(name) for name in names):
                    why = Uncounted.GOAL
                elif any(_is_command(name) for name in names):
                    why = Uncounted.COMMAND
            yield Feed(source.component, connection.name, target.component), why


def _names(end: PortPath, system: RosSystem) -> Iterator[str]:
    """Yield the names of a port: in the model, and in the node's code."""
    yield end.port
    component = system.component(end.component)
    port = component.port(end.port) if component else None
    if port and port.reference:
        yield port.reference.name


def is_shared(name: str) -> bool:
    """Return whether a topic is one on which any node may publish; libraries open most of these for a node."""
    name = name.strip("/")
    return name in _SHARED_BY_ALL or name.rpartition("/")[2] in _SHARED


def _is_goal(name: str) -> bool:
    return name.rpartition("/")[2] == "goal"


def _is_command(name: str) -> bool:
    parts = [part.split("_") for part in name.strip("~/").lower().split("/")]
    return any(not _COMMANDS.isdisjoint(words) for words in parts) and _ANSWERS.isdisjoint(parts[-1])


def _plant(system: RosSystem, own: frozenset[str], foreign: frozenset[str] = frozenset()) -> frozenset[str]:
    """Return the components that the variant commands, itself, through servers that it uses, or through one another.

    Nothing is commanded through the foreign components.
    """
    commands = defaultdict(set)
    for connection in system.connections:
        for feed, why in _feeds(connection, system):
            if why is Uncounted.COMMAND:
                commands[feed.source].add(feed.target)
    plant: set[str] = set()
    waiting = [*own, *_servers(system, own, foreign)]
    while waiting:
        reached = commands[waiting.pop()] - plant - own - foreign
        plant |= reached
        waiting += reached
    return frozenset(plant)


def _servers(system: RosSystem, own: frozenset[str], foreign: frozenset[str]) -> set[str]:
    """Return the components whose services and actions the variant uses, and those that these use in turn.

    The foreign components are not among them, nor is what only these use.
    """
    calls = [connection for connection in system.connections if connection.kind is not ConnectionKind.TOPIC]
    used: set[str] = set()
    waiting = list(own)
    while waiting:
        client = waiting.pop()
        for connection in calls:
            if any(end.component == client for end in connection.targets):
                servers = {end.component for end in connection.sources} - used - own - foreign
                used |= servers
                waiting += servers
    return used
