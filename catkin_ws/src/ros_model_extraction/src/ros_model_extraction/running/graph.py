"""Makes models of the packages and of the system from a snapshot of the running graph."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from ros_model.language.graph_names import ABSOLUTE_TOPICS, resolve
from ros_model.language.library import Library
from ros_model.language.metamodel import (
    Component,
    Connection,
    ConnectionKind,
    Port,
    PortKind,
    PortPath,
    Reference,
    RosParameter,
    RosSystem,
    SystemParameter,
    topic_suffixes,
)
from ros_model.language.packages import (
    Artifact,
    Node,
    Package,
    PackageSet,
    ParameterDeclaration,
    PortDeclaration,
    has_integer,
    remarks_on_types,
)
from ros_model.language.remappings import remark_lines
from ros_model.language.typed_values import fault

from ros_model_extraction import ros_defaults as plumbing
from ros_model_extraction.names import as_seen_from, is_known_type, node_name, split_name
from ros_model_extraction.values import UnwritableValueError, leaves, typed

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from ros_model.graph.snapshot import GraphSnapshot

    from ros_model_extraction.running.details import Details

NO_PACKAGE = "unknown_package"
"""Package of nodes whose executable can't be traced; the artifact is then named as the node."""


@dataclass(frozen=True)
class End:
    """An interface of a running node, by its resolved name.

    Attributes:
        node: full name of the node.
        kind: what it is.
        name: its resolved name.
        type: its type, "" if that is not known.
        declared: its name in the source, where that is known and may be another.
        absolute: the code, or the remapping, has the name with its leading slash: it is in no namespace.
    """

    node: str
    kind: PortKind
    name: str
    type: str = ""
    declared: str = ""
    absolute: bool = False

    @property
    def seen(self) -> str:
        """The name as the node uses it."""
        return self.name if self.absolute else as_seen_from(self.node, self.name)


@dataclass(frozen=True)
class Models:
    """The model of the packages, and that of the system which instantiates them."""

    packages: PackageSet
    system: RosSystem


@dataclass
class Instance:
    """A running node on its way into the models; `declared` is what its source says, where that is known."""

    name: str
    label: str
    namespace: str | None
    reference: Reference
    declared: Node | None = None
    ends: list[End] = field(default_factory=list)
    parameters: list[tuple[str, Any]] = field(default_factory=list)  # relative to the node
    written: Mapping[str, ParameterDeclaration] = field(default_factory=dict)  # parameters in models from source


def models_of(
    snapshot: GraphSnapshot,
    details: Details,
    name: str,
    title: Sequence[str] = (),
    *,
    everything: bool = False,
    sources: Library = Library(),  # noqa: B008 - nobody changes it
) -> Models:
    """Return the models of a running graph.

    Args:
        snapshot: what the master lists.
        details: what the nodes tell.
        name: name of the system.
        title: first lines of both files' comments.
        everything: keep also what ROS makes for every node, the meta-controller's own nodes, and the parameters that
            roslaunch and nodes that have ended leave on the parameter server.
        sources: models from the nodes' source, as far as there are any.
    """
    remarks = _Remarks(snapshot, details, everything)
    ends = [end for end in interfaces(snapshot, details) if everything or not plumbing.is_plumbing(end)]
    living = [node for node in snapshot.nodes if node not in details.dead]
    if not everything:
        living = [node for node in living if node not in plumbing.NODES and node not in remarks.metacontrol]
    instances = _instances(living, details)
    for end in ends:
        if end.node in instances:
            instances[end.node].ends.append(end)
    for node, instance in instances.items():
        origin = details.origins.get(node)
        written = sources.interfaces(instance.reference) or ()
        instance.written = sources.parameters(instance.reference)
        if origin and origin.remaps:
            instance.ends, unused = as_declared(node, instance.ends, origin.remaps, written)
            remarks.unused_remaps[node] = unused
        instance.ends = [
            end if end.declared else replace(end, absolute=_is_absolute(end, written)) for end in instance.ends
        ]
        remarks.unseen[node] = _unseen(instance, written)
    unowned = share_out(snapshot.parameters, instances)
    if not everything:
        gone = (*details.dead, *remarks.metacontrol)
        unowned = [(key, value) for key, value in unowned if _is_robots(key, gone)]
        unowned, remarks.abandoned = _inhabited(unowned, instances.values())
    return assemble(name, instances, unowned, [*title, *remarks.lines()])


def _is_robots(parameter: str, gone: Sequence[str]) -> bool:
    """Return whether a parameter is neither roslaunch's, nor of the meta-controller, nor of a node that is left out."""
    if plumbing.is_bookkeeping_parameter(parameter) or plumbing.is_metacontrol_parameter(parameter):
        return False
    return not any(f"/{parameter}".startswith(f"{node}/") for node in gone)


def _inhabited(
    parameters: Sequence[tuple[str, Any]], instances: Iterable[Instance]
) -> tuple[list[tuple[str, Any]], list[str]]:
    """Return the parameters whose namespaces are in use, and the namespaces of the others.

    The parameter server keeps the parameters of a node that has ended. They look like those of a namespace. So a
    namespace counts only if a living node is in it, or offers a topic, service or action in it.
    """
    places = {place for instance in instances for place in (instance.name, *map(_offered, instance.ends)) if place}
    used = {"", *(place[:end] for place in places for end, mark in enumerate(place) if mark == "/")}
    kept: list[tuple[str, Any]] = []
    abandoned: dict[str, None] = {}
    for name, value in parameters:
        parts = name.split("/")[:-1]
        namespaces = ["", *("/" + "/".join(parts[: end + 1]) for end in range(len(parts)))]
        unused = next((namespace for namespace in namespaces if namespace not in used), None)
        if unused is None:
            kept.append((name, value))
        else:
            abandoned[unused] = None
    return kept, list(abandoned)


def _offered(end: End) -> str:
    """Return the name of an interface that others may use; "" for one that uses others."""
    offers = (PortKind.PUBLISHER, PortKind.SERVICE_SERVER, PortKind.ACTION_SERVER)
    return end.name if end.kind in offers else ""


def assemble(
    name: str, instances: Mapping[str, Instance], unowned: Sequence[tuple[str, Any]], lines: Sequence[str]
) -> Models:
    """Return the models of nodes.

    Args:
        name: name of the system.
        instances: the nodes by their full names, with interfaces and parameters.
        unowned: parameters of no node, by their full names without the leading slash.
        lines: comments at the top of both models; values that can't be written are added to them.
    """
    unwritable: dict[str, str] = {}
    system = RosSystem(
        name,
        tuple(_component(instance, unwritable) for instance in instances.values()),
        tuple(_connections(instances)),
        tuple(_system_parameters(unowned, unwritable)),
    )
    said = [f"Left out: the value of the parameter {name}: {why}." for name, why in sorted(unwritable.items())]
    header = "\n".join([*lines, *said])
    found = PackageSet(_packages(instances.values()), header)
    if not found.is_observed:  # of a running system, all are seen by their values
        found = replace(found, header="\n".join([*lines, *said, *remarks_on_types(found.packages)]))
    return Models(found, replace(system, header=header))


def interfaces(snapshot: GraphSnapshot, details: Details) -> Iterator[End]:
    """Yield all interfaces of all nodes; an action is one, and what else touches its topics is a topic's end."""
    for name, node in snapshot.nodes.items():
        for kind, topics in ((PortKind.PUBLISHER, node.publications), (PortKind.SUBSCRIBER, node.subscriptions)):
            for topic in topics:
                type_name = snapshot.topics[topic].type
                yield End(name, kind, topic, type_name if is_known_type(type_name) else "")
        for service in node.services:
            yield End(name, PortKind.SERVICE_SERVER, service, details.service_types.get(service, ""))
        for kind, actions in (
            (PortKind.ACTION_SERVER, node.action_servers),
            (PortKind.ACTION_CLIENT, node.action_clients),
        ):
            for action in actions:
                yield End(name, kind, action, snapshot.actions[action].type)


def as_declared(
    node: str, ends: Sequence[End], remaps: Sequence[tuple[str, str]], written: Iterable[PortDeclaration] = ()
) -> tuple[list[End], list[tuple[str, str]]]:
    """Return a node's interfaces with their names in its code, where remappings tell these, and the remappings left.

    If several names in the code are remapped to one name in the graph, an interface of that name gets the one that
    the source declares; else one that no other interface has; else one that resolves to something else without the
    remapping, because a remapping for all nodes often only makes a name relative; else one that is not global. Nothing
    proves the last three. The others are left over, and a launch file has all of them.

    Args:
        node: full name of the node.
        ends: its interfaces.
        remaps: from name in its code to name in the graph.
        written: the interfaces that its source declares.
    """
    declared = {(port.kind, resolve(port.name, node)) for port in written}
    unused = list(remaps)
    found = []
    for end in ends:
        suffixes = topic_suffixes(end.kind)
        suffix = suffixes[0]
        fitting = [pair for pair in remaps if resolve(pair[1], node) == end.name + suffix and pair[0].endswith(suffix)]
        name = target = ""
        if fitting:
            inside = {pair: resolve(pair[0], node).removesuffix(suffix) for pair in fitting}
            merits = {
                pair: ((end.kind, full) in declared, pair in unused, full != end.name, pair[0][0] != "/")
                for pair, full in inside.items()
            }
            name, target = max(merits, key=merits.__getitem__)
            name = name.removesuffix(suffix)
            used = {(resolve(name + part, node), end.name + part) for part in suffixes}
            unused = [pair for pair in unused if (resolve(pair[0], node), resolve(pair[1], node)) not in used]
        is_absolute = target.startswith("/") and not split_name(node)[0]
        found.append(replace(end, declared=name, absolute=is_absolute) if name else end)
    return found, unused


def _is_absolute(end: End, written: Iterable[PortDeclaration]) -> bool:
    """Return whether the code has the name of an interface, which is not remapped, with its leading slash.

    Where no source tells, this is so of the topics that libraries open under absolute names.
    """
    names = {port.name for port in written if port.kind is end.kind and resolve(port.name, end.node) == end.name}
    if names:
        return all(name.startswith("/") for name in names)
    return end.kind in (PortKind.PUBLISHER, PortKind.SUBSCRIBER) and end.name in ABSOLUTE_TOPICS


def _unseen(instance: Instance, written: Iterable[PortDeclaration]) -> list[str]:
    """Return the interfaces that the source of a node declares and the node does not have, clients of services aside.

    They are no part of the model, because the monitor would miss them until the node makes them.
    """
    has = {(end.kind, name) for end in instance.ends for name in (end.name, resolve(end.declared, instance.name))}
    return [
        f"{port.kind.value} {port.name}"
        for port in written
        if port.kind is not PortKind.SERVICE_CLIENT
        and "{" not in port.name
        and (port.kind, resolve(port.name, instance.name)) not in has
    ]


def _instances(names: Sequence[str], details: Details) -> dict[str, Instance]:
    """Give every node its label, unique in the system, and the reference to the executable that it runs."""
    found = {}
    for name in names:
        origin = details.origins.get(name)
        package = origin.package if origin else NO_PACKAGE
        label = split_name(name)[1]
        reference = Reference(package, origin.executable if origin else node_name(label), node_name(label))
        found[name] = Instance(name, *label_of(name, names), reference)
    return found


def label_of(name: str, names: Sequence[str]) -> tuple[str, str | None]:
    """Return a node's name and namespace in the model; the whole name where its last part is not unique among all.

    The ends of connections have nothing but that name.
    """
    namespace, label = split_name(name)
    if sum(split_name(other)[1] == label for other in names) > 1:
        return name.strip("/"), None
    return label, namespace or None


def share_out(tree: Mapping[str, Any], instances: Mapping[str, Instance]) -> list[tuple[str, Any]]:
    """Give each node its private parameters; return the others, by their full names without the leading slash."""
    unowned = []
    for name, value in leaves(tree):
        parts = name.split("/")
        owner = next(
            (
                instances[node]
                for end in range(len(parts) - 1, 0, -1)
                if (node := "/" + "/".join(parts[:end])) in instances
            ),
            None,
        )
        if owner:
            owner.parameters.append((f"/{name}".removeprefix(f"{owner.name}/"), value))
        else:
            unowned.append((name, value))
    return unowned


def _component(instance: Instance, unwritable: dict[str, str]) -> Component:
    reference = instance.reference
    ports = tuple(
        Port(end.seen, end.kind, replace(reference, name=end.declared or end.seen))
        for end in sorted(instance.ends, key=_order)
    )
    parameters = []
    for key, raw in instance.parameters:
        try:
            _, value = typed(raw)
        except UnwritableValueError as error:
            unwritable[f"{instance.name}/{key}"] = str(error)
            value = None
        parameters.append(RosParameter(key, replace(reference, name=key), value))
    return Component(instance.label, reference, instance.namespace, ports, tuple(parameters))


def _order(end: End) -> tuple[int, str]:
    return list(PortKind).index(end.kind), end.name


def _connections(instances: Mapping[str, Instance]) -> Iterator[Connection]:
    """Connect interfaces of the same name: publishers and subscribers, action servers and clients.

    The name of a connection keeps its slash where all its ends have one: it is in no namespace.
    """
    for kind, source_kind, target_kind in (
        (ConnectionKind.TOPIC, PortKind.PUBLISHER, PortKind.SUBSCRIBER),
        (ConnectionKind.ACTION, PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT),
    ):
        sources, targets = (_paths(instances.values(), end) for end in (source_kind, target_kind))
        for name in sorted(sources.keys() & targets.keys()):
            is_absolute = all(end.port.startswith("/") for end in (*sources[name], *targets[name]))
            shown = name if is_absolute else name.lstrip("/")
            yield Connection(shown, kind, tuple(sources[name]), tuple(targets[name]))


def _paths(instances: Iterable[Instance], kind: PortKind) -> dict[str, list[PortPath]]:
    found: dict[str, list[PortPath]] = defaultdict(list)
    for instance in instances:
        for end in instance.ends:
            if end.kind is kind and "{" not in end.name:
                found[end.name].append(PortPath(instance.label, end.seen))
    return found


def _system_parameters(parameters: Iterable[tuple[str, Any]], unwritable: dict[str, str]) -> Iterator[SystemParameter]:
    for name, raw in parameters:
        try:
            kind, value = typed(raw)
        except UnwritableValueError as error:
            unwritable[f"/{name}"] = str(error)
            continue
        yield SystemParameter(name, kind, value)


def _packages(instances: Iterable[Instance]) -> tuple[Package, ...]:
    """Declare what the instances refer to; instances of one node of one executable share its declaration."""
    declared: dict[str, dict[str, dict[str, _Declaration]]] = defaultdict(lambda: defaultdict(dict))
    for instance in instances:
        reference = instance.reference
        nodes = declared[reference.package][reference.artifact]
        declaration = nodes.setdefault(reference.node, _Declaration({}, {}))
        for port in instance.declared.ports if instance.declared else ():
            declaration.ports.setdefault((port.kind, port.name), port)
        for parameter in instance.declared.parameters if instance.declared else ():
            declaration.parameters.setdefault(parameter.name, parameter)
        for end in sorted(instance.ends, key=_order):
            name = end.declared or end.seen
            declaration.ports.setdefault((end.kind, name), PortDeclaration(name, end.kind, end.type))
        for key, raw in instance.parameters:
            declaration.parameters.setdefault(key, _parameter(key, raw, instance.written.get(key)))
    return tuple(
        Package(
            package,
            tuple(
                Artifact(
                    artifact,
                    tuple(
                        Node(node, tuple(found.ports.values()), tuple(found.parameters.values()))
                        for node, found in sorted(nodes.items())
                    ),
                )
                for artifact, nodes in sorted(artifacts.items())
            ),
        )
        for package, artifacts in sorted(declared.items())
    )


def _parameter(key: str, raw: Any, written: ParameterDeclaration | None) -> ParameterDeclaration:
    """Return the declaration of a parameter by its value; a Double of the source is one, too, if it has no point."""
    try:
        kind, value = typed(raw)
    except UnwritableValueError:
        return ParameterDeclaration(key)
    if not has_integer(kind):
        return ParameterDeclaration(key, kind)
    if written and written.type and not written.is_by_value and fault(value, written.type) is None:
        return ParameterDeclaration(key, replace(written.type, default=None))
    return ParameterDeclaration(key, kind, is_by_value=True)


@dataclass
class _Declaration:
    ports: dict[tuple[PortKind, str], PortDeclaration]
    parameters: dict[str, ParameterDeclaration]


class _Remarks:
    """What the models leave out or can't know, for the comments at their top."""

    def __init__(self, snapshot: GraphSnapshot, details: Details, everything: bool) -> None:
        self._snapshot = snapshot
        self._details = details
        self._everything = everything
        self.metacontrol = [
            node
            for node in snapshot.nodes
            if plumbing.is_metacontrol(node, details.origins[node].package if node in details.origins else None)
        ]
        self.abandoned: list[str] = []
        self.unused_remaps: dict[str, list[tuple[str, str]]] = {}
        self.unseen: dict[str, list[str]] = {}

    def lines(self) -> Iterator[str]:
        """Yield the lines."""
        yield "Not known, because a ROS 1 master doesn't: who calls which service."
        snapshot, details = self._snapshot, self._details
        if silent := [name for name in snapshot.services if not details.service_types.get(name) and self._alive(name)]:
            yield f"Not known, because their nodes don't answer: the types of the services {', '.join(silent)}."
        if untyped := [topic.name for topic in snapshot.topics.values() if not is_known_type(topic.type)]:
            yield f"Not known, because nobody publishes them: the types of the topics {', '.join(untyped)}."
        for node, why in sorted(details.unknown.items()):
            if self._everything or node not in plumbing.NODES:
                yield f"Not known: the package and executable of {node}: {why}."
        yield from remark_lines(self.unused_remaps)
        for node, unseen in sorted(self.unseen.items()):
            if unseen:
                yield (
                    f"Left out, because {node} does not have them now, though its source declares them: "
                    f"{', '.join(unseen)}. Use every function of the robot once, then take the snapshot again."
                )
        for node, origin in sorted(details.origins.items()):
            if origin.arguments and node not in details.dead and (self._everything or node not in self.metacontrol):
                yield (
                    f"Left out: the arguments of {node}: {' '.join(origin.arguments)}. Models hold none. If variants "
                    "bring the node, give them under `arguments` in metacontrol.yaml."
                )
        if details.dead:
            yield f"Left out: {', '.join(sorted(details.dead))}: the master lists them, but nobody listens there."
        if not self._everything:
            if self.metacontrol:
                yield f"Left out: {', '.join(self.metacontrol)}: the meta-controller's nodes, with their parameters."
            if self.abandoned:
                yield (
                    f"Left out: the parameters below {', '.join(self.abandoned)}: no running node is there, or offers "
                    "anything there. Nodes that have ended may have left them. `rosmodel snapshot --all` keeps them."
                )
            yield plumbing.REMARK

    def _alive(self, service: str) -> bool:
        return not set(self._snapshot.services[service].servers) <= self._details.dead
