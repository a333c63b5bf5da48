"""A first metacontrol.yaml, with its tables, for a base system: it checks clean, and comments say what may go where."""

from __future__ import annotations

import csv
import fnmatch
import io
import re
from collections import Counter
from dataclasses import dataclass, field
from itertools import count, zip_longest
from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.language.metamodel import PortKind
from ros_model.project.schema_check import load_schema
from ros_model.project.settings import FILE_NAME
from ros_model.project.tables import NAME, typed_cell
from ros_model.project.yaml_file import flow

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from ros_model.language.metamodel import Component, Reference, RosParameter, RosSystem

TABLE = "variants.csv"
LEVELS = "qa.csv"
UTILITY = "performance"
_FEW = 8
"""Parameters that are all columns if nobody says which: a table that still fits a screen."""
_SHOWN = 5  # names in a remark
_GRAPH_NAME = re.compile(load_schema("metacontrol")["$defs"]["graph_name"]["pattern"])

_TEMPLATE = """\
# What can't be read off the models of {system}. CHANGE marks guesses and examples; all of it may be changed.
# Then: rosmodel check {folder}     rosmodel generate all {folder} -o PACKAGE

# The catkin package whose folder models/ holds this file, and into which the rest is generated.
package: {package}
# The system as it runs before a variant is chosen.
base: {base}

variants:
  # CHANGE: the component that the variants bring, in place of the base's.
  component: {component}
  # One row for each variant; its name is that of its launch file and of its function design.
  table: {table}
  # Its expected level of each quality attribute, measured or estimated.
  qa: {levels}
  # Column of the table -> parameters that it sets. {{name: PARAMETER, factor: 0.5}} scales the column, and
  # {{name: PARAMETER, component: NAME}} sets it on another component.
  parameters:{parameters}
  # Column -> its value -> publishers or servers (COMPONENT.PORT) that the component is connected to.
  # {{from: COMPONENT.PORT, to: COMPONENT.PORT}} names the port at the other end, too.
  # connections:
  #   sensor:
  #     laser: [{example_port}]
  #     none: []
  # Column of true and false -> components that are there or not.
  # components:
  #   has_filter: [scan_filter]
  # Column -> its value -> the node that the component is then, PACKAGE.EXECUTABLE.NODE.
{nodes}

# What the robot can do, and which variants (all, or a list of names) do it. CHANGE the name.
# requires: [FUNCTION] names functions that must be provided too.
functions:
  {function}: {{designs: all}}

# What is measured. The direction says which end is better; levels run over the range.
quality_attributes:
{qualities}
# Among variants that meet all requirements, the best in this one is taken.
utility: {utility}

# What is asked of the robot: a function, with required levels. CHANGE: e.g. nfrs: {{safety: 0.6}}
objectives:
  {objective}: {{function: {function}, nfrs: {{}}}}

# Components, and the node that each is in the running graph. A design requires those that feed it, as the connections
# of the models say; `rosmodel check {folder}` shows which, and by which way. Where that is wrong, say so here:
#   NAME: {{node: NAME, required_by: [VARIANT, FUNCTION], not_required_by: all}}
components:{components}

# Observers that the monitor starts. `rosmodel generate observer` asks for one, and adds it here.
observers: []

# What the manipulator does while the configuration changes. With several functions, put it under functions/NAME.
manipulator:
  # CHANGE: an action whose pending goal is kept while the configuration changes, and its type.
{action}
  # Nodes that a change may have to stop although it did not start them.
  kill_nodes: [{kill}]

# Parameters of the reasoner. calm: how long, in s, the cause of a violation must be gone before a better variant comes
# back. Make it longer where a change costs much, as one of a node that builds a map.
reasoner: {{calm: 10.0}}

# Parameter -> value -> the component that a variant with this value needs, beside those that feed it.
# requires:
#   observation_sources: {{scan: front_laser}}
"""


@dataclass(frozen=True)
class Choices:
    """What a first project needs to know beside the base; None: it is guessed.

    Attributes:
        package: the package of the models.
        component: what varies.
        qualities: quality attributes, beside performance.
        vary: shell patterns of the parameters that become columns, `NODE/PARAMETER` or `PARAMETER` of the component
            that varies; None: all of that component if they are few, else none.
        alternatives: nodes of other executables that become variants, too, and the parameters that each declares.
        ranges: of parameters, in words, by package and parameter.
    """

    package: str
    component: str | None = None
    qualities: tuple[str, ...] = ()
    vary: tuple[str, ...] | None = None
    alternatives: Mapping[Reference, frozenset[str]] = field(default_factory=dict)
    ranges: Mapping[tuple[str, str], str] = field(default_factory=dict)


@dataclass(frozen=True)
class FirstProject:
    """A first project.

    Attributes:
        texts: of metacontrol.yaml and its two tables, by the names of the files.
        remarks: what the project leaves to the user, one line each.
        variant: the name of the variant that is as the base.
    """

    texts: dict[str, str]
    remarks: tuple[str, ...] = ()
    variant: str = ""


def first_project(base: RosSystem, file: str, folder: str, choices: Choices) -> FirstProject:
    """Return the first project of a base system.

    Args:
        base: the system.
        file: name of its file.
        folder: name of the folder, for the comments.
        choices: what the user said.

    Raises:
        ModelError: the base has no component that could vary, or not the one chosen.
    """
    component = varying(base, choices.component)
    columns = _columns(base, component, choices.vary)
    variant = re.sub(r"[^A-Za-z0-9_]+", "_", base.name).strip("_").lower() or "base"
    what = re.sub(r"\W+", "_", component.name, flags=re.ASCII).strip("_")
    qualities = dict.fromkeys((*choices.qualities, UTILITY))
    nodes_of = _values([component.executable, *choices.alternatives] if choices.alternatives else [])
    chooser = what if what not in columns else f"{what}_node"
    others = {key: name for key, name in _nodes(base).items() if name != component.graph_name}
    nodes = {key: {"node": name} for key, name in others.items() if _GRAPH_NAME.search(key) and "\n" not in key}
    action = next((p.name for p in component.ports if p.kind is PortKind.ACTION_SERVER), None)
    text = _TEMPLATE.format(
        system=base.name.replace("\n", " "),
        folder=folder,
        package=flow(choices.package),
        base=flow(file),
        component=flow(component.name),
        table=TABLE,
        levels=LEVELS,
        parameters=_lines({column: [chosen.entry(component)] for column, chosen in columns.items()}),
        nodes=_node_lines(chooser, nodes_of),
        example_port=_example_port(base, component),
        function=f"f_{what}",
        objective=f"o_{what}",
        qualities="".join(f"  {name}: {_quality(name)}\n" for name in qualities),
        utility=UTILITY,
        components=_lines(nodes, indent=2),
        action=f"  # save_action: {action or 'ACTION'}\n  # goal_msg_type: PACKAGE.msg.TYPEAction",
        kill=flow(component.graph_name),
    )
    values = [_cell(chosen.parameter) for chosen in columns.values()]
    names = [f"{variant}_default", *(f"{variant}_{value}" for value in [*nodes_of][1:])]
    rows = []
    for name, value in zip_longest(names, nodes_of, fillvalue=""):
        declared = choices.alternatives.get(nodes_of[value]) if value else None
        cells = [
            cell if declared is None or chosen.component is not component or chosen.parameter.key in declared else ""
            for cell, chosen in zip(values, columns.values(), strict=True)
        ]
        rows.append([name, *([value] if value else []), *cells])
    texts = {
        FILE_NAME: text,
        TABLE: _csv([NAME, *([chooser] if nodes_of else []), *columns], *rows),
        LEVELS: _csv([NAME, *qualities, "source"], *([name, *["0.5"] * len(qualities), "estimated"] for name in names)),
    }
    unnamed = [name for key, name in others.items() if key not in nodes]
    remarks = (*_left_out(component, columns, choices), *_copies(base, component), *_unnamed(unnamed))
    return FirstProject(texts, remarks, f"{variant}_default")


def parameters_of(component: Component) -> list[RosParameter]:
    """Return the parameters of a component whose values a cell of a table can hold."""
    return [parameter for parameter in component.parameters if _fits_cell(parameter)]


def default_columns(component: Component) -> list[RosParameter]:
    """Return the parameters that become columns if nobody says which: all, if they are few, else none."""
    found = parameters_of(component)
    return found if len(found) <= _FEW else []


@dataclass(frozen=True)
class _Column:
    component: Component
    parameter: RosParameter

    def entry(self, varied: Component) -> str | dict[str, str]:
        """Return what stands under `parameters` in metacontrol.yaml."""
        if self.component is varied:
            return self.parameter.key
        return {"name": self.parameter.key, "component": self.component.name}


def _values(nodes: Sequence[Reference | None]) -> dict[str, Reference]:
    """Return nodes by short names, which are those of their executables where that is clear."""
    found: dict[str, Reference] = {}
    for node in nodes:
        if node is not None:
            short = re.sub(r"[^A-Za-z0-9_]+", "_", node.artifact.partition(".")[0]).strip("_").lower()
            found[short if short and short not in found else f"{node.package}_{short}_{len(found)}"] = node
    return found


def _node_lines(column: str, nodes: Mapping[str, Reference]) -> str:
    if not nodes:
        return "  # nodes:\n  #   detector: {fine: my_robot.fine_detector.detector, coarse: my_robot.coarse.detector}"
    choices = "\n".join(f"      {flow(short)}: {flow(str(node))}" for short, node in nodes.items())
    return f"  nodes:\n    {flow(column)}:\n{choices}"


def _left_out(component: Component, columns: Mapping[str, _Column], choices: Choices) -> Iterator[str]:
    """Yield which parameters are columns, which are not, and how to add one."""
    package = component.executable.package if component.executable else ""
    for name, column in columns.items():
        if told := choices.ranges.get((package, column.parameter.key.rpartition("/")[2])):
            yield f"column {name}: {told}"
    chosen = {id(column.parameter) for column in columns.values()}
    rest = [parameter.key for parameter in parameters_of(component) if id(parameter) not in chosen]
    if rest:
        shown = ", ".join(rest[:_SHOWN]) + (", ..." if len(rest) > _SHOWN else "")
        count = f"{len(rest)} parameters" if len(rest) != 1 else "1 parameter"
        yield (
            f"{count} of {component.graph_name} {'is' if len(rest) == 1 else 'are'} no column: {shown}. "
            f"To vary one, add a column to {TABLE} and its name to `parameters`, or start again "
            f"with --vary '{component.graph_name}/{rest[0]}'"
        )


def _nodes(base: RosSystem) -> dict[str, str]:
    """Return the name of each component's node, by the component's name; by the node's if two have that name."""
    names = Counter(component.name for component in base.components)
    return {
        component.name if names[component.name] == 1 else component.graph_name: component.graph_name
        for component in base.components
    }


def _copies(base: RosSystem, component: Component) -> Iterator[str]:
    """Yield that other components run the executable of the one that varies."""
    copies = [
        other.graph_name
        for other in base.components
        if other.graph_name != component.graph_name and other.executable == component.executable
    ]
    if copies:
        yield (
            f"{', '.join(copies)} run{'s' * (len(copies) == 1)} the same executable as {component.graph_name}. Only "
            f"{component.graph_name} varies: add a family with a table for each other one, or choose with --component"
        )


def _unnamed(nodes: Sequence[str]) -> Iterator[str]:
    if nodes:
        yield f"{', '.join(nodes)}: no name that ROS allows, so it is not among the components: rename it in the model"


def varying(base: RosSystem, name: str | None) -> Component:
    """Return the component that is to vary: the one chosen, by its name or that of its node, else the likeliest.

    Actions, parameters and inputs tell how likely.

    Raises:
        ModelError: the base has no component that could vary, or not the one chosen.
    """
    candidates = [component for component in base.components if component.executable and component.executable.node]
    if name is not None:
        named = [component for component in candidates if name in {component.name, component.graph_name}]
        chosen = named[0] if named else None
        if chosen is None:
            known = ", ".join(component.name for component in candidates)
            raise ModelError(f"{name!r} is no component with a FromRosNode; there are {known}", base.position)
        return chosen
    if not candidates:
        raise ModelError("has no component with a FromRosNode that could vary: add one", base.position)

    def likeness(component: Component) -> tuple[bool, int, int]:
        acts = any(port.kind is PortKind.ACTION_SERVER for port in component.ports)
        inputs = sum(end.component == component.name for c in base.connections for end in c.targets)
        return acts, len(component.parameters), inputs

    return max(candidates, key=likeness)


def _columns(base: RosSystem, component: Component, patterns: Sequence[str] | None) -> dict[str, _Column]:
    """Return a column for each parameter that varies, named by the last part of its name.

    Raises:
        ModelError: a pattern fits no parameter.
    """
    if patterns is None:
        chosen = [_Column(component, parameter) for parameter in default_columns(component)]
    else:
        chosen = _chosen(base, component, patterns)
    keys = {entry.parameter.key for entry in chosen}
    found: dict[str, _Column] = {}
    for entry in chosen:
        found[next(name for name in _column_names(entry, keys) if name not in {NAME, "", *found})] = entry
    return found


def _column_names(entry: _Column, keys: Collection[str]) -> Iterator[str]:
    """Yield names that a column may have, the shortest first; a short name is that of the parameter called so."""
    key = entry.parameter.key
    short = key.rpartition("/")[2]
    if short == key or short not in keys:
        yield short
    yield key
    whole = f"{entry.component.name}/{key}"
    yield whole
    yield from (f"{whole}_{number}" for number in count(2))


def _chosen(base: RosSystem, component: Component, patterns: Sequence[str]) -> list[_Column]:
    others = [other for other in base.components if other is not component and other.executable]
    candidates = [
        (_Column(owner, parameter), names)
        for owner in (component, *others)
        for parameter in parameters_of(owner)
        if (names := _names(owner, parameter, is_varied=owner is component))
    ]
    found: dict[int, _Column] = {}
    for pattern in patterns:
        fitting = [c for c, names in candidates if any(fnmatch.fnmatchcase(name, pattern.strip("/")) for name in names)]
        if not fitting:
            known = [f"{owner.component.graph_name}/{owner.parameter.key}" for owner, _ in candidates[:_SHOWN]]
            there = ", ".join(known) + (", ..." if len(candidates) > _SHOWN else "") or "none"
            raise ModelError(f"--vary {pattern!r} fits no parameter that a table can hold; there are {there}")
        found |= {id(column.parameter): column for column in fitting}
    return list(found.values())


def _names(component: Component, parameter: RosParameter, *, is_varied: bool) -> tuple[str, ...]:
    names = (f"{component.graph_name}/{parameter.key}", f"{component.name}/{parameter.key}")
    return (*names, parameter.key) if is_varied else names


def _fits_cell(parameter: RosParameter) -> bool:
    again = typed_cell(_cell(parameter))
    return parameter.value is not None and again == parameter.value and type(again) is type(parameter.value)


def _cell(parameter: RosParameter) -> str:
    return str(parameter.value).lower() if isinstance(parameter.value, bool) else str(parameter.value)


def _example_port(base: RosSystem, component: Component) -> str:
    ports = (
        f"{other.name}.{port.name}"
        for other in base.components
        for port in other.ports
        if other.name != component.name and port.kind is PortKind.PUBLISHER
    )
    return next(ports, "front_laser.scan").replace("\n", " ")


def _quality(name: str) -> str:
    direction = "higher_is_better" if name == UTILITY else "lower_is_better"
    return f"{{direction: {direction}, range: [0.0, 1.0]}}"


def _lines(entries: Mapping[str, object], indent: int = 4) -> str:
    if not entries:
        return " {}"
    return "".join(f"\n{' ' * indent}{flow(name)}: {flow(value)}" for name, value in entries.items())


def _csv(*rows: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
