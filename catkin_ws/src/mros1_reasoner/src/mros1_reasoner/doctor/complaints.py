"""Judges a package and a running system before the meta-controller's first start. Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, assert_never

from metacontrol_bags.ownership import is_of_another, robots_inside
from ros_model.language.metamodel import PortKind
from rosgraph_monitor.graph.comparison import Scope, compare
from rosgraph_monitor.graph.findings import (
    NO_NODE,
    AdditionalNode,
    AdditionalPort,
    MissingConnection,
    MissingNode,
    MissingPort,
    WrongParameter,
    WrongType,
)
from rosgraph_monitor.graph.names import COMMON_TOPICS, instance, relative, resolved

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from ros_model.language.metamodel import RosSystem
    from ros_model.project.project import Project
    from rosgraph_monitor.graph.findings import Finding

    from mros1_reasoner.doctor.facts import PackageFacts, SystemFacts

_META_CONTROLLER = ("rosgraph_monitor", "rosgraph_manipulator", "rosgraph_launcher", "reasoner")
_ITS_TOPICS = ("rosgraph_", "mros1_reasoner/")
"""How topics begin that the meta-controller publishes: nobody does before it starts."""
_GENERATE = "rosmodel generate all"


@dataclass(frozen=True)
class Complaint:
    """One thing that is missing or odd.

    Attributes:
        where: the file, node, topic, ... that it is about.
        what: what is wrong.
        remedy: what to do.
        is_note: whether it is good to know and no hindrance.
    """

    where: str
    what: str
    remedy: str
    is_note: bool = False

    def __str__(self) -> str:
        """Return all of it on one line."""
        return f"{'note: ' if self.is_note else ''}{self.where}: {self.what}: {self.remedy}"


def package_complaints(project: Project, facts: PackageFacts) -> list[Complaint]:
    """Return what is wrong with a project that needs no running system to be seen."""
    return [*_package(project, facts), *_files(facts), *_begins(project, facts), *_unusable(facts)]


def system_complaints(project: Project, package: PackageFacts, system: SystemFacts, scope: Scope) -> list[Complaint]:
    """Return what is wrong with a running system, or does not fit the project.

    Args:
        project: the project.
        package: of its observers.
        system: what runs.
        scope: types and defaults of the nodes' source; its namespace is not heeded.
    """
    return [
        *_network(system),
        *_nodes_on_the_master(system),
        *_clock(system),
        *_leftovers(system),
        *_graph(project, system, replace(scope, namespace=system.namespace)),
        *_managed(project, system),
        *_actions(project, system),
        *_components(project, system),
        *_observed(project, package, system),
    ]


def managed_nodes(project: Project) -> frozenset[str]:
    """Return the graph names, relative to the robot's namespace, of the nodes that variants bring."""
    return frozenset(component.graph_name for variant in project.variants for component in variant.components)


def _package(project: Project, facts: PackageFacts) -> Iterator[Complaint]:
    if facts.folder is None:
        remedy = "source the workspace that holds it, or add the folder above it to ROS_PACKAGE_PATH"
        yield Complaint(f"package {project.package}", "rospack does not find it", remedy)
    elif facts.folder != facts.expected:
        what = f"rospack finds it in {facts.folder}, and the models are in {facts.expected}"
        yield Complaint(
            f"package {project.package}", what, "put that copy first on ROS_PACKAGE_PATH, or correct `package`"
        )


def _files(facts: PackageFacts) -> Iterator[Complaint]:
    remedy = f"{_GENERATE} {facts.expected}/models -o {facts.expected}"
    if facts.generator:
        yield Complaint("generated files", f"not all can be compared: {facts.generator}", f"then: {remedy}")
    for names, what in ((facts.missing, "not generated yet"), (facts.outdated, "older than the models")):
        if names:
            yield Complaint(_listed(names), f"{'is' if len(names) == 1 else 'are'} {what}", remedy)


def _begins(project: Project, facts: PackageFacts) -> Iterator[Complaint]:
    known = [variant.name for variant in project.variants]
    for file, named in facts.initial:
        if unknown := [name for name in map(str.strip, named.split(",")) if name and name not in known]:
            what = f"initial_configuration names {_listed(unknown)}, which is no variant"
            yield Complaint(file, what, f"name one of {', '.join(known)}, there or at each launch", is_note=True)


def _unusable(facts: PackageFacts) -> Iterator[Complaint]:
    for observer in facts.observers:
        if observer.problem:
            remedy = "export it in package.xml, then build and source the workspace that holds it"
            yield Complaint(f"observer {observer.name}", observer.problem, remedy)
    for name, why in facts.missing_types.items():
        yield Complaint(f"goal_msg_type {name}", why, "correct it, or install and source the package of the action")
    if facts.other_clone:
        what = f"rospack finds rosgraph_monitor in {facts.other_clone}, which is not below MROS_ROOT"
        yield Complaint("ROS_PACKAGE_PATH", what, "build the robot's workspace anew after sourcing this clone only")
    if facts.java:
        yield Complaint("reasoner", facts.java, "then run this command again")


def _network(system: SystemFacts) -> Iterator[Complaint]:
    if system.address:
        yield Complaint("network", system.address, "set ROS_IP to an address of this host that the robot can reach")
    hosts: dict[str, list[str]] = {}
    for node, host in sorted(system.lost.items()):
        hosts.setdefault(host, []).append(node)
    for host, nodes in hosts.items():
        what = f"the name does not resolve here, and {_listed(nodes)} run{'s' * (len(nodes) == 1)} there"
        yield Complaint(f"host {host}", what, "add it to /etc/hosts, or set ROS_IP on that host and restart its nodes")


def _nodes_on_the_master(system: SystemFacts) -> Iterator[Complaint]:
    for node in sorted(system.dead - system.lost.keys()):
        yield Complaint(node, "the master lists it, and nobody listens at its address", "rosnode cleanup")
    for node in sorted(system.silent):
        yield Complaint(node, "does not answer: it hangs or its host is unreachable", "restart it")


def _clock(system: SystemFacts) -> Iterator[Complaint]:
    publishers = set(_publishers(system, "/clock"))
    simulated = _parameter(system, "/use_sim_time")
    if simulated is True and not publishers:
        remedy = "start the simulator or the bag's player (--clock), or rosparam set use_sim_time false"
        yield Complaint("/use_sim_time", "is true, and nobody publishes /clock: time stands still", remedy)
    elif simulated is not True and publishers:
        what = f"is not true, and {_listed(sorted(publishers))} publish{'es' * (len(publishers) == 1)} /clock"
        yield Complaint("/use_sim_time", what, "rosparam set use_sim_time true before any node starts")


def _leftovers(system: SystemFacts) -> Iterator[Complaint]:
    for name in _META_CONTROLLER:
        node = resolved(name, system.namespace)
        if node in _alive(system):
            what = "a node of the meta-controller runs already"
            yield Complaint(node, what, f"rosnode kill {node}, or end the roslaunch that started it")


def _graph(project: Project, system: SystemFacts, scope: Scope) -> Iterator[Complaint]:
    """Yield what the monitor would report of the base; nodes of variants may run or not."""
    managed = managed_nodes(project)
    base = replace(project.base, components=tuple(c for c in project.base.components if c.graph_name not in managed))
    dead = dict.fromkeys(system.dead, ("dead", "nobody listens at its address"))
    found = compare(system.snapshot, base, dead=dead, idle=managed, scope=scope)
    elsewhere = _elsewhere(project, system)
    if elsewhere:
        yield _other_namespace(elsewhere, system)
    moved = {name for names in elsewhere.values() for name in names.values()}
    for finding in found:
        if elsewhere and isinstance(finding, MissingNode):
            if not any(finding.node in names for names in elsewhere.values()):
                yield _told(finding, system.namespace)
        elif not (isinstance(finding, AdditionalNode) and resolved(finding.node, system.namespace) in moved):
            yield _told(finding, system.namespace)


def _elsewhere(project: Project, system: SystemFacts) -> dict[str, dict[str, str]]:
    """Return, by namespace, which nodes of the models run there and not in the robot's namespace."""
    found: dict[str, dict[str, str]] = {}
    alive = _alive(system)
    others = robots_inside(system.namespace, system.snapshot.nodes)
    names = {component.graph_name for component in project.base.components} | managed_nodes(project)
    if any(instance(resolved(name, system.namespace), alive) for name in names):
        return {}
    for name in sorted(names):
        for node in sorted(alive):
            if node.endswith(f"/{name}") and not is_of_another(node, others):
                found.setdefault(node.removesuffix(name).rstrip("/") or "/", {})[name] = node
    return found


def _other_namespace(elsewhere: Mapping[str, Mapping[str, str]], system: SystemFacts) -> Complaint:
    best = max(elsewhere, key=lambda namespace: (len(elsewhere[namespace]), namespace))
    what = f"no node of the models runs there, and {_listed(sorted(elsewhere[best].values()))} run{_s(elsewhere[best])}"
    others = [namespace for namespace in sorted(elsewhere) if namespace != best]
    remedy = f"export ROS_NAMESPACE={best} before this command and roslaunch"
    if others:
        remedy += f"; {_listed(others)} would fit, too"
    return Complaint(f"namespace {system.namespace}", what, remedy)


def _s(several: Mapping[str, str]) -> str:
    return "s" if len(several) == 1 else ""


def _told(finding: Finding, namespace: str) -> Complaint:
    """Return what the comparison of graph and model found, with a remedy."""
    where = resolved(finding.name if isinstance(finding, MissingConnection) else finding.node, namespace)
    remedy = "correct the model, or the remapping where the robot is launched"
    match finding:
        case MissingNode(_, _, reason):
            what = f"the base has it, and it does not run: {reason}"
            remedy = "start it, or take it out of the base"
        case AdditionalNode():
            what, remedy = "runs, and no model has it", "add it to the base, or end it"
        case WrongParameter(node, parameter, expected, actual):
            where = resolved(parameter, namespace) if node == NO_NODE else f"{where}/{parameter}"
            what = f"is {actual}, and the base says {expected}"
            remedy = "set it where the robot is launched and restart the node, or change the base"
        case MissingPort(_, kind, name):
            what = f"has no {kind} {name}, and the base has it"
            remedy = "use it once, if the node makes it on demand, or take it out of the base"
        case AdditionalPort(_, kind, name):
            what, remedy = f"has a {kind} {name} that the base lacks", "add it to the base, or leave it"
        case WrongType(_, name, expected, actual):
            what = f"{name} is of type {actual}, and the models say {expected}"
        case MissingConnection(_, source, target, actual):
            what = f"{source} and {target} do not share this connection: {actual}"
        case _:
            assert_never(finding)
    return Complaint(where, what, remedy, is_note=isinstance(finding, AdditionalPort))


def _managed(project: Project, system: SystemFacts) -> Iterator[Complaint]:
    for name in sorted(managed_nodes(project)):
        node = instance(resolved(name, system.namespace), _alive(system))
        launched = system.launched.get(node or "")
        if node is None or launched is None:
            continue
        if launched.arguments and name not in project.arguments:
            what = f"runs with the arguments {launched.arguments!r}, and variants bring it without any"
            yield Complaint(node, what, f"add to metacontrol.yaml: arguments: {{{name}: {launched.arguments!r}}}")
        where = f"in {launched.file}" if launched.file else "in the launch file that starts it"
        if launched.respawn:
            what = "variants bring this node, and roslaunch starts its own again (respawn)"
            yield Complaint(node, what, f"remove respawn, or the node, {where}")
        elif launched.required:
            what = "variants bring this node, and roslaunch ends all others when its own ends (required)"
            yield Complaint(node, what, f"remove required, or the node, {where}")
        elif launched.file:
            what = "variants bring this node, so the first configuration replaces the one that runs"
            yield Complaint(node, what, f"nothing to do; to have it started once only, remove it {where}", is_note=True)


def _actions(project: Project, system: SystemFacts) -> Iterator[Complaint]:
    """Yield actions whose goal is to be kept, and which nobody offers, or of another type."""
    for function, entry in _functions(project):
        action = entry.get("save_action")
        if not action:
            continue
        keys = f"save_action {action} of {function}"
        running = system.snapshot.actions.get(resolved(action, system.namespace))
        if running and set(running.servers) - system.dead:
            wanted = entry.get("goal_msg_type", "").replace(".msg.", "/")
            if wanted and wanted != running.type:
                yield Complaint(keys, f"is of type {running.type}", f"set goal_msg_type: {_dotted(running.type)}")
        elif not any(
            component.resolved(port.name) == f"/{action.strip('/')}"
            for modelled in (project.base, *project.designs(function))
            for component in modelled.components
            for port in component.ports
            if port.kind is PortKind.ACTION_SERVER
        ):
            yield Complaint(
                keys, "no node offers it, and no model has its server", "correct the name, or remove the key"
            )


def _functions(project: Project) -> Iterator[tuple[str, Mapping[str, str]]]:
    functions = project.settings["functions"]
    general = project.settings.get("manipulator", {}) if len(functions) == 1 else {}
    for name, entry in functions.items():
        yield str(name), {**{key: general[key] for key in ("save_action", "goal_msg_type") if key in general}, **entry}


def _components(project: Project, system: SystemFacts) -> Iterator[Complaint]:
    """Yield what stands for components, or is watched, and is not there."""
    alive = _alive(system)
    managed = managed_nodes(project)
    modelled = managed | {component.graph_name for component in project.whole_base.components}
    later = _topics_of_variants(project)
    for name, entry in project.components.items():
        where = f"components/{name}"
        node = str(entry.get("node", "")).strip("/")
        if node and node not in modelled and not instance(resolved(node, system.namespace), alive):
            yield Complaint(where, f"node {node} does not run, and no model has it", "correct its name")
        topic = entry.get("topic")
        if topic and not _publishers(system, resolved(topic, system.namespace)) and topic.strip("/") not in later:
            yield Complaint(where, f"nobody publishes its topic {topic}", "start its node, or correct the topic")
    for topic in project.settings.get("topics", {}):
        if not _publishers(system, resolved(topic, system.namespace)) and topic.strip("/") not in later:
            yield Complaint(f"topics/{topic}", "nobody publishes it", "start its publisher, or correct the name")
    services = {name for name, state in system.snapshot.services.items() if set(state.servers) - system.dead}
    for name, repair in project.repairs.items():
        service = repair.get("service")
        if service and resolved(service, system.namespace) not in services:
            yield Complaint(
                f"components/{name}/repair", f"nobody offers {service}", "start its node, or correct the name"
            )


def _observed(project: Project, package: PackageFacts, system: SystemFacts) -> Iterator[Complaint]:
    """Yield topics of observers that nobody publishes, or that have another type."""
    made = {name.strip("/") for observer in package.observers for name in observer.outputs}
    made |= _topics_of_variants(project)
    for observer in package.observers:
        where = f"observer {observer.name}"
        for topic, wanted in observer.topics:
            name, plain = resolved(topic, system.namespace), topic.strip("/")
            state = system.snapshot.topics.get(name)
            is_expected = plain not in made and name not in COMMON_TOPICS and not plain.startswith(_ITS_TOPICS)
            if state and state.publishers and state.type not in ("", "*", wanted):
                remedy = "correct the topic or the type of the observer"
                yield Complaint(where, f"{name} is of type {state.type}, not {wanted}", remedy)
            elif is_expected and not _publishers(system, name):
                yield Complaint(where, f"nobody publishes {name}", _hint(topic, wanted, system))


def _hint(topic: str, wanted: str, system: SystemFacts) -> str:
    """Return a remedy that names the topics that have the type."""
    like = [
        relative(name, system.namespace) or name
        for name, state in system.snapshot.topics.items()
        if state.type == wanted and set(state.publishers) - system.dead
    ]
    if like:
        return f"start its publisher, or correct the name: {_listed(like)} ha{'s' if len(like) == 1 else 've'} its type"
    return f"start its publisher, or correct the name {topic}"


def _topics_of_variants(project: Project) -> set[str]:
    """Return the topics, relative, that nodes of variants publish: they need not be there before a variant runs."""

    def published(system: RosSystem) -> Iterable[str]:
        for component in system.components:
            for port in component.ports:
                if port.kind is PortKind.PUBLISHER:
                    yield component.resolved(port.name).strip("/")
                    yield port.name.strip("/")

    return {topic for variant in project.variants for topic in published(variant)}


def _alive(system: SystemFacts) -> frozenset[str]:
    return frozenset(system.snapshot.nodes) - system.dead


def _publishers(system: SystemFacts, topic: str) -> tuple[str, ...]:
    state = system.snapshot.topics.get(topic)
    return tuple(node for node in state.publishers if node not in system.dead) if state else ()


def _parameter(system: SystemFacts, name: str) -> object:
    try:
        return system.snapshot.parameter(name)
    except KeyError:
        return None


def _dotted(action: str) -> str:
    return action.replace("/", ".msg.", 1)


def _listed(names: Iterable[str], most: int = 4) -> str:
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
