"""Roles that one of several components fills, or k of n, and which of them each design is deployed with."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ros_model.project.requirements import REQUIRED, words

if TYPE_CHECKING:
    from ros_model.errors import ModelError
    from ros_model.project.project import Project


@dataclass(frozen=True)
class Role:
    """A role of designs.

    Attributes:
        name: unique; that of metacontrol.yaml where all of its components can fill it.
        kind: class of its components.
        fillers: components that can fill it, in the order of metacontrol.yaml.
        least: how many of them must work.
        is_bound: each of its designs is deployed with a certain one of them.
    """

    name: str
    kind: str
    fillers: tuple[str, ...]
    least: int
    is_bound: bool = False

    @property
    def has_spares(self) -> bool:
        """Return whether one of its components may fail."""
        return self.least < len(self.fillers)


@dataclass(frozen=True)
class Roles:
    """The roles of a project.

    Attributes:
        all: every role of a design, by its name.
        of_designs: names of the roles of each design.
        filled: component that a design is deployed with, by design and name of the role. A role that is not among them
            is filled by whatever works.
        components: what each design requires beside its roles.
        wrong: what does not fit together.
    """

    all: Mapping[str, Role] = field(default_factory=dict)
    of_designs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    filled: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    components: Mapping[str, frozenset[str]] = field(default_factory=dict)
    wrong: tuple[ModelError, ...] = ()


def roles_of(project: Project) -> Roles:
    """Return the roles of a project's designs: from the section `roles`, the wiring, and the section `spares`.

    A design that the wiring feeds by several components of a role needs as many of them as the role says. A design that
    it feeds by one is deployed with this one; those of its spares that are fed by another one are the same design with
    other components in its roles. Without spares, a component of several is required like any other. So are components
    by whose `required_by` a design needs more of a role than the role says: it is the design that knows better.
    """
    required = project.required_components()
    demanded = words(project, REQUIRED)
    given: Mapping[str, Mapping[str, Any]] = project.settings.get("roles", {})
    spares: Mapping[str, str] = project.settings.get("spares", {})
    parts = {
        role: tuple(dict.fromkeys(part for name in entry["of"] for part in _names(project, name)))
        for role, entry in given.items()
    }
    groups: dict[str, list[str]] = {variant.name: [] for variant in project.variants if variant.name not in spares}
    wrong: list[ModelError] = []
    for spare, design in spares.items():
        if spare not in required or design not in groups:
            wrong.append(_unknown(project, spare, design))
        else:
            groups[design].append(spare)

    def fed_by(name: str, role: str) -> list[str]:
        if len(set(parts[role]).intersection(demanded.get(name, ()))) > max(1, given[role].get("least", 1)):
            return []
        return [part for part in parts[role] if role in required[name] or part in required[name]]

    def shares(name: str, role: str) -> bool:
        return role in required[name] or len(fed_by(name, role)) > max(1, given[role].get("least", 1))

    shared = {role for role in given if any(shares(design, role) for design in groups)}
    found: dict[str, Role] = {}
    of_designs: dict[str, tuple[str, ...]] = {}
    filled: dict[str, dict[str, str]] = defaultdict(dict)
    components = dict(required)
    for design, others in groups.items():
        group = [design, *others]
        own: list[str] = []
        for role, entry in given.items():
            least, kind = entry.get("least", 1), str(entry.get("class", f"{role}_class"))
            fed = {name: fed_by(name, role) for name in group}
            is_shared = shares(design, role) and all(some == fed[design] for some in fed.values())
            is_bound = least == 1 and all(len(some) == 1 and role not in required[name] for name, some in fed.items())
            union = {part for some in fed.values() for part in some}
            fillers = tuple(part for part in parts[role] if part in union)
            if not fillers or not (is_shared or (is_bound and (len(fillers) > 1 or len(parts[role]) == 1))):
                continue
            is_whole = fillers == parts[role] and (is_shared or role not in shared)
            name = role if is_whole else f"{role}_of_{'_or_'.join(fillers)}"
            found[name] = Role(name, kind, fillers, min(least, len(fillers)), is_bound=is_bound)
            own.append(name)
            for member in group:
                components[member] -= {role, *fed[member]}
                if is_bound:
                    filled[member][name] = fed[member][0]
        for member in group:
            of_designs[member] = tuple(own)
        wrong += _misfits(project, group, components, filled)
    return Roles(found, of_designs, dict(filled), components, tuple(wrong))


def role_lines(project: Project) -> Iterator[str]:
    """Yield lines that say which components fill the roles, and of which designs."""
    roles = project.roles
    for name, role in roles.all.items():
        spare = len(role.fillers) - role.least
        count = f"{role.least} of {len(role.fillers)}" if spare else "all"
        yield f"role {name}: {count} must work: {', '.join(role.fillers)}"
        for part in role.fillers:
            designs = [design for design, parts in roles.filled.items() if parts.get(name) == part]
            if designs:
                yield f"  {part} fills it in {', '.join(designs)}"


def _names(project: Project, component: str) -> list[str]:
    return sorted(project.names_of(component))


def _unknown(project: Project, spare: str, design: str) -> ModelError:
    names = {variant.name for variant in project.variants}
    lacking = next((name for name in (spare, design) if name not in names), "")
    if lacking:
        return project.source.error(f"{lacking!r} is none of the {len(names)} variants", "spares", spare)
    return project.source.error(f"{design} is a spare's design itself: name the design that it is", "spares", spare)


def _misfits(
    project: Project,
    group: list[str],
    components: Mapping[str, frozenset[str]],
    filled: Mapping[str, Mapping[str, str]],
) -> Iterator[ModelError]:
    """Yield why variants are not the same design with other components in its roles."""
    design, *others = group
    for other in others:
        if project.function_of(other) != project.function_of(design):
            yield project.source.error(f"solves another function than {design}", "spares", other)
        differing = sorted(components[other] ^ components[design])
        if differing:
            yield project.source.error(
                f"{other} and {design} differ in {', '.join(differing)}, of which none fills a role of both alone: "
                "give them a role of which one must work",
                *("spares", other),
            )
        elif filled.get(other) == filled.get(design):
            yield project.source.error(
                f"{other} requires the same components as {design}: take it out", "spares", other
            )
