"""Draws the hierarchy of a project: functions, the designs that solve them, and what these require, with graphviz."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ros_model.io.drawing import quoted

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from ros_model.project.project import Project

_HEAD = """    rankdir=TB; fontname="Helvetica"; nodesep=0.3; ranksep=0.55; labelloc=t;
    node [fontname="Helvetica", fontsize=11]; edge [fontname="Helvetica", fontsize=9, arrowsize=0.7, color="#445566"];
"""
_OBJECTIVE = 'shape=note, style=filled, fillcolor="#f7e6ef", color="#9c3f6f"'
_FUNCTION = 'shape=box, style="filled,bold", fillcolor="#dbe9f6", color="#2b5d8c"'
_DESIGN = 'shape=ellipse, style=filled, fillcolor="#fdf6e3", color="#b08a2e"'
_COMPONENT = 'shape=component, style=filled, fillcolor="#eaf5ea", color="#3f7f3f"'
_ROLE = 'shape=component, style="filled,dashed", fillcolor="#eaf5ea", color="#3f7f3f"'
_ENVIRONMENT = 'shape=cds, style=filled, fillcolor="#eeeeee", color="#666666"'
_NAMED = 3
"""Designs of a group that are named; the others are counted."""


@dataclass(frozen=True)
class _Needs:
    """What designs of one function require; those that require the same are drawn as one."""

    function: str
    functions: tuple[str, ...]
    components: frozenset[str]
    roles: tuple[str, ...]
    surroundings: tuple[tuple[str, str], ...]


def hierarchy(project: Project) -> str:
    """Return the hierarchy of a project as graphviz reads it."""
    groups: dict[_Needs, list[str]] = {}
    for function in project.settings["functions"]:
        for design in project.designs(function):
            groups.setdefault(_needs(project, function, design.name), []).append(design.name)
    lines = [f"digraph {quoted(project.package)} {{", f"{_HEAD}    label={quoted(project.package)};"]
    lines += _objectives(project)
    for function in project.settings["functions"]:
        lines.append(f"    {_id('function', function)} [label={quoted(function)}, {_FUNCTION}];")
    lines += _things(project, list(groups))
    for number, (needs, designs) in enumerate(groups.items()):
        lines += _group(f"design{number}", needs, designs)
    return "\n".join([*lines, "}"]) + "\n"


def _needs(project: Project, function: str, design: str) -> _Needs:
    roles = project.roles
    surroundings = []
    for name, entry in project.settings.get("environment", {}).items():
        wanted = entry.get("required_by", {}).get(design)
        if wanted:
            surroundings.append((name, _wanted(wanted)))
    return _Needs(
        function,
        project.required_functions(design),
        roles.components.get(design, frozenset()),
        roles.of_designs.get(design, ()),
        tuple(surroundings),
    )


def _objectives(project: Project) -> Iterator[str]:
    for name, entry in project.settings["objectives"].items():
        limits = [f"{quality}: {_limit(limit)}" for quality, limit in entry.get("nfrs", {}).items()]
        when = ["when required"] if entry.get("when_required") else []
        yield f"    {_id('objective', name)} [label={quoted(_rows(name, *when, *limits))}, {_OBJECTIVE}];"
        yield f"    {_id('objective', name)} -> {_id('function', entry['function'])} [label=needs];"


def _limit(limit: object) -> str:
    return " to ".join(f"{part:g}" for part in limit) if isinstance(limit, list) else f"{limit:g}"


def _things(project: Project, groups: list[_Needs]) -> Iterator[str]:
    """Yield what designs require beside functions, each once."""
    components = frozenset().union(*(needs.components for needs in groups))
    for name in sorted(components):
        yield f"    {_id('component', name)} [label={quoted(name)}, {_COMPONENT}];"
    for name in dict.fromkeys(role for needs in groups for role in needs.roles):
        role = project.roles.all[name]
        count = f"{role.least} of {', '.join(role.fillers)}"
        yield f"    {_id('role', name)} [label={quoted(_rows(name, count))}, {_ROLE}];"
    for name, entry in project.settings.get("environment", {}).items():
        yield f"    {_id('environment', name)} [label={quoted(name)}, {_ENVIRONMENT}];"
        for needing, wanted in entry.get("required_by", {}).items():
            for component in sorted(components.intersection(project.names_of(needing))):
                yield f"    {_id('component', component)} -> {_needs_of(name, _wanted(wanted))}"


def _group(number: str, needs: _Needs, designs: list[str]) -> Iterator[str]:
    named = designs if len(designs) <= _NAMED else [*designs[: _NAMED - 1], f"and {len(designs) - _NAMED + 1} more"]
    yield f"    {number} [label={quoted(_rows(*named))}, {_DESIGN}];"
    yield f"    {_id('function', needs.function)} -> {number} [dir=back, label=solves];"
    for function in needs.functions:
        yield f"    {number} -> {_id('function', function)} [label=requires];"
    for component in sorted(needs.components):
        yield f"    {number} -> {_id('component', component)} [style=dashed];"
    for role in needs.roles:
        yield f"    {number} -> {_id('role', role)} [style=dashed];"
    for name, wanted in needs.surroundings:
        yield f"    {number} -> {_needs_of(name, wanted)}"


def _needs_of(surroundings: str, wanted: str) -> str:
    return f"{_id('environment', surroundings)} [style=dotted, label={quoted(wanted)}];"


def _wanted(limits: Mapping[str, float]) -> str:
    return ", ".join(f"{word} {value:g}" for word, value in limits.items())


def _rows(*texts: str) -> str:
    return "\n".join(texts)


def _id(kind: str, name: str) -> str:
    return quoted(f"{kind} {name}")
