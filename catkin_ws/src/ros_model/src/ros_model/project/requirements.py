"""The components that each design requires: by its wiring, by values of its parameters, by words of the modeller."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ros_model.project.wiring import wiring_of

if TYPE_CHECKING:
    from ros_model.language.metamodel import RosSystem
    from ros_model.project.project import Project
    from ros_model.project.wiring import Feed

REQUIRED, NOT_REQUIRED = "required_by", "not_required_by"
WORDS = (REQUIRED, NOT_REQUIRED)
"""Words of an entry of `components` that add a requirement to designs, and take it from them."""
ALL = "all"
_SHOWN = 3  # designs of a group that are named


@dataclass(frozen=True)
class Requirements:
    """What a design requires.

    Attributes:
        components: name of the component in the running system -> why it is required.
        others: components that feed the design or what it requires, but are not required -> why not.
        needless: (word, component) where a word of metacontrol.yaml changes nothing: the design brings the component,
            or does not require it anyway.
    """

    components: Mapping[str, str]
    others: Mapping[str, str]
    needless: frozenset[tuple[str, str]] = frozenset()


def requirements_of(project: Project) -> dict[str, Requirements]:
    """Return what each variant of a project requires."""
    added, removed = (words(project, word) for word in WORDS)
    foreign = _foreign(project)
    found = {}
    for variant in project.variants:
        components, others = _found(project, variant, foreign[variant.name])
        own = {name for component in variant.components for name in project.names_of(component.graph_name)}
        needless = {(REQUIRED, name) for name in added[variant.name] if name in own}
        needless |= {(NOT_REQUIRED, name) for name in removed[variant.name] if name not in components}
        for name in removed[variant.name]:
            if reason := components.pop(name, ""):
                others[name] = f"{reason}: {NOT_REQUIRED} takes it out"
        for name in added[variant.name]:
            if name not in own:
                components.setdefault(name, f"{REQUIRED} adds it")
                others.pop(name, None)
        found[variant.name] = Requirements(components, others, frozenset(needless))
    return found


def words(project: Project, word: str) -> dict[str, list[str]]:
    """Return, for each variant, the components and roles whose entries have a word that means it."""
    found: dict[str, list[str]] = defaultdict(list)
    roles = project.settings.get("roles", {})
    for component, entry in (*project.settings["components"].items(), *roles.items()):
        for design in dict.fromkeys(design for name in named(entry, word) for design in designs_of(project, name)):
            found[design] += sorted(project.names_of(str(component)))
    return found


def named(entry: Mapping[str, Any], word: str) -> list[str]:
    """Return the functions and variants that an entry of `components` names after a word; `all` stands for itself."""
    given = entry.get(word, [])
    return [ALL] if given == ALL else list(given)


def designs_of(project: Project, name: str) -> list[str]:
    """Return the names of the variants that a word means: all, those of a function, or one; none if it is unknown."""
    if name == ALL:
        return [variant.name for variant in project.variants]
    if name in project.settings["functions"]:
        return [variant.name for variant in project.designs(name)]
    return [variant.name for variant in project.variants if variant.name == name]


def requirement_lines(project: Project) -> Iterator[str]:
    """Yield lines that say what each design requires and by which way; designs that require the same share theirs."""
    groups = defaultdict(list)
    for design, found in project.requirements.items():
        groups[tuple(found.components.items()), tuple(found.others.items())].append(design)
    for (components, others), designs in groups.items():
        listed = ", ".join(designs[:_SHOWN])
        more = f" and {len(designs) - _SHOWN} more" if len(designs) > _SHOWN else ""
        verb = "requires" if len(designs) == 1 else "require"
        yield f"{listed}{more} {verb}{':' if components else ' no component'}"
        yield from (_line(name, reason) for name, reason in components)
        if others:
            yield "and not:" if components else "not:"
            yield from (_line(name, reason) for name, reason in others)


def _line(name: str, reason: str) -> str:
    return f"  {reason}" if reason.startswith(f"{name} -> ") else f"  {name}: {reason}"


def _found(project: Project, variant: RosSystem, foreign: frozenset[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the components that the models say are required, and those that are not, each with the reason."""
    wiring = wiring_of(project.base, variant, foreign)
    components = {name: _chain(feeds) for source, feeds in wiring.chains.items() for name in project.names_of(source)}
    for source, reason in _by_parameters(variant, project.settings["requires"]):
        for name in project.names_of(source):
            components.setdefault(name, reason)
    others = {
        name: f"{_chain((feed,))}: {why.value}"
        for source, (feed, why) in wiring.uncounted.items()
        for name in project.names_of(source)
        if name not in components
    }
    return components, others


def _foreign(project: Project) -> dict[str, frozenset[str]]:
    """Return, for each variant, the components that are deployed only by functions which it does not solve."""
    families = [project.designs(function) for function in project.settings["functions"]]
    solving = [frozenset(design.name for design in designs) for designs in families]
    deployed = [frozenset(part.name for design in designs for part in design.components) for designs in families]
    found = {}
    for variant in project.variants:
        own = [variant.name in names for names in solving]
        theirs = (parts for parts, is_own in zip(deployed, own, strict=True) if not is_own)
        ours = (parts for parts, is_own in zip(deployed, own, strict=True) if is_own)
        found[variant.name] = frozenset[str]().union(*theirs) - frozenset[str]().union(*ours)
    return found


def _chain(feeds: tuple[Feed, ...]) -> str:
    """Return `laser -> scan -> filter -> clean -> nav` for two feeds."""
    return " -> ".join([feeds[0].source, *(part for feed in feeds for part in (feed.connection, feed.target))])


def _by_parameters(variant: RosSystem, requires: Mapping[str, Mapping[str, str]]) -> Iterator[tuple[str, str]]:
    """Yield the components that a variant's parameter values ask for, and the reason.

    Args:
        variant: the system.
        requires: parameter (its key, or the key's last part) -> value -> component. A value of the variant may be
            several, separated by blanks, as in costmap_2d's observation_sources.
    """
    for component in variant.components:
        for parameter in component.parameters:
            choices = requires.get(parameter.key) or requires.get(parameter.key.rsplit("/", 1)[-1]) or {}
            for value in str(parameter.value).split():
                if value in choices:
                    yield choices[value], f"{parameter.key} is {value}"
