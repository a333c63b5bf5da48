"""What is looked at before a first start, as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ros_model.graph.snapshot import GraphSnapshot


@dataclass(frozen=True)
class ObserverFacts:
    """An observer that metacontrol.yaml names.

    Attributes:
        name: as it stands there.
        problem: why the monitor can't load it; empty if it can.
        topics: (topic, `package/Type`) that it listens to.
        outputs: topics that it publishes.
    """

    name: str
    problem: str = ""
    topics: tuple[tuple[str, str], ...] = ()
    outputs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Launched:
    """How a node was started.

    Attributes:
        file: the launch file; empty if it is not known.
        respawn: whether roslaunch starts it again when it ends.
        required: whether roslaunch ends all of its nodes when this one ends.
        arguments: what the launch file gives the program (`args`).
    """

    file: str = ""
    respawn: bool = False
    required: bool = False
    arguments: str = ""


@dataclass(frozen=True)
class PackageFacts:
    """The project on this machine.

    Attributes:
        folder: where rospack finds the package of the project; None: nowhere.
        expected: the folder that holds the models.
        outdated: generated files that the models would give another content.
        missing: files that the models would give and that are not there.
        generator: why generated files could not be compared; empty if they were.
        missing_types: types of goals that can't be imported, with the reason.
        java: why Pellet can't run; empty if it can, or is not wanted.
        other_clone: where rospack finds rosgraph_monitor, if that is not below MROS_ROOT; else empty.
        observers: those of metacontrol.yaml.
        initial: launch files of the package, and the configurations to begin with that each names, with commas.
    """

    folder: str | None
    expected: str
    outdated: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    generator: str = ""
    missing_types: Mapping[str, str] = field(default_factory=dict)
    java: str = ""
    other_clone: str = ""
    observers: tuple[ObserverFacts, ...] = ()
    initial: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class SystemFacts:
    """The running system, by resolved names.

    Attributes:
        snapshot: what the master lists.
        namespace: where the robot lives.
        dead: nodes at whose address nobody listens.
        silent: nodes that listen and do not answer.
        lost: node -> its host, whose name does not resolve here.
        launched: how the nodes that variants bring were started, where that is known.
        address: why others can't reach nodes that are started in this shell; empty if they can.
        arrivals: topic -> when messages came on it, s of ROS time, where that was listened to.
    """

    snapshot: GraphSnapshot
    namespace: str = "/"
    dead: frozenset[str] = frozenset()
    silent: frozenset[str] = frozenset()
    lost: Mapping[str, str] = field(default_factory=dict)
    launched: Mapping[str, Launched] = field(default_factory=dict)
    address: str = ""
    arrivals: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
