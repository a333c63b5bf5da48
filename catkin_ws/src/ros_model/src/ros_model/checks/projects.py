"""Checks of a project: names that refer to nothing or to two things, levels out of range."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.findings import WARNING, Finding
from ros_model.project.repairs import REPAIR
from ros_model.project.requirements import ALL, REQUIRED, WORDS, designs_of, named
from ros_model.project.schema_check import dotted

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ros_model.project.project import Project
    from ros_model.project.tables import Table


def wrong_names(project: Project) -> Iterator[ModelError]:
    """Yield variants of one name, and designs and components that are not there."""
    source = project.source
    known = Counter(variant.name for variant in project.variants)
    for name in sorted(name for name, count in known.items() if count > 1):
        yield source.error(f"two variants bear the name {name!r}: rename one", "variants")
    for name, function in project.settings["functions"].items():
        for number, design in enumerate(function["designs"] if function["designs"] != "all" else ()):
            if design not in known:
                keys = ("functions", name, "designs", number)
                yield source.error(f"{design!r} is none of the {len(project.variants)} variants", *keys)
        if isinstance(function.get("requires"), dict):
            solving = {design.name for design in project.designs(name)}
            for design in function["requires"]:
                if design not in solving:
                    keys = ("functions", name, "requires", design)
                    yield source.error(f"{design!r} is none of the designs of {name}", *keys)
    roles = set(project.settings.get("roles", {}))
    components = {component.name for component in project.whole_base.components} | set(project.settings["components"])
    for parameter, choices in project.settings["requires"].items():
        for value, component in choices.items():
            if component not in components | roles:
                yield source.error(
                    f"{component!r} is a component neither of the base nor of components, and no role: add it to one",
                    *("requires", parameter, value),
                )


def wrong_surroundings(project: Project) -> Iterator[ModelError]:
    """Yield entries of `environment` that are about a component or a variant that is not there."""
    components = {component.name for component in project.whole_base.components} | set(project.settings["components"])
    variants = {variant.name for variant in project.variants}
    for attribute, entry in project.settings.get("environment", {}).items():
        for name in entry["required_by"]:
            if name not in components | variants | set(project.nodes):
                keys = ("environment", attribute, "required_by", name)
                yield project.source.error(f"{name!r} is no component and none of the {len(variants)} variants", *keys)


def wrong_roles(project: Project) -> Iterator[ModelError]:
    """Yield roles of components that are not there, of too few, or of designs that are not there, and wrong spares."""
    known = {*project.nodes, *project.settings["components"]}
    is_wrong = False
    for role, entry in project.settings.get("roles", {}).items():
        for number, component in enumerate(entry["of"]):
            if component not in known:
                is_wrong = True
                yield project.source.error(f"{component!r} is no component", "roles", role, "of", number)
        number = len({part for name in entry["of"] for part in project.names_of(name)})
        if entry.get("least", 1) > number:
            yield project.source.error(
                f"is {entry['least']}, and only {number} components can fill the role", "roles", role, "least"
            )
        for number, other in enumerate(named(entry, REQUIRED)):
            if other != ALL and not designs_of(project, other) and other not in project.settings["functions"]:
                keys = ("roles", role, REQUIRED, number)
                yield project.source.error(f"{other!r} is no function and none of the variants", *keys)
    if not is_wrong:
        yield from project.roles.wrong


def wrong_requirements(project: Project) -> Iterator[ModelError]:
    """Yield entries of `components` that stand for nothing, or say of designs what can't be meant."""
    for name, entry in project.settings["components"].items():
        if name not in project.components and name not in project.nodes:
            yield project.source.error(
                "is no component of the base or of a variant: correct the name, or add its node or topic",
                *("components", name),
            )
        meant: dict[str, str] = {}
        for word in WORDS:
            for number, other in enumerate(named(entry, word)):
                keys = ("components", name, word, *(() if other == ALL else (number,)))
                if other != ALL and not designs_of(project, other) and other not in project.settings["functions"]:
                    yield project.source.error(f"{other!r} is no function and none of the variants", *keys)
                twice = [design for design in designs_of(project, other) if meant.setdefault(design, word) != word]
                if twice:
                    yield project.source.error(
                        f"{twice[0]} is meant by {meant[twice[0]]}, too: take it out of one", *keys
                    )


def wrong_repairs(project: Project) -> Iterator[ModelError]:
    """Yield repairs of components that designs bring, or of which it is not clear which one they repair."""
    bringing: dict[str, str] = {}
    for variant in project.variants:
        for component in variant.components:
            for name in project.names_of(component.graph_name) if component.executable else ():
                bringing.setdefault(name, variant.name)
    known: dict[str, str] = {}
    for component, entry in project.settings["components"].items():
        if REPAIR not in entry:
            continue
        keys = ("components", component, REPAIR)
        names = sorted(project.names_of(component))
        if len(names) > 1:
            yield project.source.error(f"may be of {' or '.join(names)}: give each of them an entry of its own", *keys)
        for name in names:
            if name in bringing:
                yield project.source.error(
                    f"{bringing[name]} brings {name} itself, and what a design brings is started again without a "
                    "repair: take it out",
                    *keys,
                )
            if name in known:
                yield project.source.error(f"{known[name]} has a repair of {name}, too: take one out", *keys)
            known[name] = component


def needless_words(project: Project) -> Iterator[Finding]:
    """Yield words of `components` that change nothing for any design that they mean."""
    for name, entry in project.settings["components"].items():
        for word in WORDS:
            designs = [design for other in named(entry, word) for design in designs_of(project, other)]
            meant = {(word, other) for other in project.names_of(name)}
            if designs and all(meant <= project.requirements[design].needless for design in designs):
                why = (
                    "the designs bring it themselves" if word == REQUIRED else "none of the designs requires it anyway"
                )
                keys = ("components", name, word)
                text = f"{dotted(keys)}: {why}: take it out, or correct the name"
                yield Finding(text, project.source.at(*keys), "requirement", WARNING)


def wrong_levels(project: Project) -> Iterator[ModelError]:
    """Yield expected levels of no quality attribute that is there, and those outside its range."""
    known = project.settings["quality_attributes"]
    for variant in project.variants:
        for parameter in variant.parameters:
            quality, level = parameter.name.removeprefix("qa_"), parameter.value
            if quality == parameter.name:
                continue
            if quality not in known:
                wrong = f"which is none of quality_attributes: {', '.join(sorted(known))}"
                yield ModelError(
                    f"{variant.name} expects a level of {quality!r}, {wrong}", parameter.position, rule="level"
                )
                continue
            lowest, highest = known[quality].get("range", (-math.inf, math.inf))
            if isinstance(level, (int, float)) and not lowest <= level <= highest:
                yield ModelError(
                    f"{variant.name} expects {level:g} of {quality!r}, whose range is [{lowest:g}, {highest:g}]: "
                    "correct one of them",
                    parameter.position,
                    rule="level",
                )


def levels_of_nothing(project: Project, tables: Iterable[Table]) -> Iterator[ModelError]:
    """Yield rows of expected levels that belong to no variant; families may share a table of levels."""
    known = {variant.name for variant in project.variants}
    for table in tables:
        for row in table.rows:
            if row.name not in known:
                yield ModelError(
                    f"{row.name!r} is none of the {len(known)} variants: take the row out, or add the variant",
                    row.position,
                    rule="table",
                )


def two_meanings(project: Project) -> Iterator[ModelError]:
    """Yield names that mean two things: in the ontology they would be one."""
    settings, seen = project.settings, dict[str, str]()
    values = [
        *(f"{variant.name}_{quality}" for variant in project.variants for quality in variant.expected_qas),
        *(f"{name}_{quality}" for name, entry in settings["objectives"].items() for quality in entry.get("nfrs", {})),
    ]
    meanings = {
        "a function": settings["functions"],
        "a quality attribute": settings["quality_attributes"],
        "a property of the surroundings": settings.get("environment", {}),
        "an objective": settings["objectives"],
        "a component": {
            *settings["components"],
            *(component.name for component in project.base.components),
            *(component.graph_name for variant in project.variants for component in variant.components),
        },
        "a variant": [variant.name for variant in project.variants],
        "a role": settings.get("roles", {}),
        "a class of components": {entry["class"] for entry in settings.get("roles", {}).values() if "class" in entry},
        "an expected or required level": values,
        "a repair": [f"{REPAIR}_of_{name}" for name in project.repairs],
    }
    for meaning, names in meanings.items():
        for name in names:
            if name in seen:
                yield project.source.error(f"{name!r} names {seen[name]} and {meaning}: rename one")
            seen[name] = meaning
