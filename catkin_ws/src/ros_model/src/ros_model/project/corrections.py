"""Which variants a correction of expected levels holds for: all, or those that are the same in what is named."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ros_model.language.metamodel import compose

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ros_model.errors import ModelError
    from ros_model.language.metamodel import RosSystem
    from ros_model.project.project import Project


def correction_groups(project: Project) -> dict[str, dict[str, str]]:
    """Return, by quality attribute and variant, what the variant is like in all that `correction: {same: ...}` names.

    A correction that was learnt of one variant holds for those with the same text. A quality attribute without such an
    entry is left out: what is learnt of it holds for all variants.
    """
    found: dict[str, dict[str, str]] = {}
    for quality, entry in project.settings["quality_attributes"].items():
        names = entry.get("correction", {}).get("same", ())
        if names:
            found[quality] = {
                variant.name: ", ".join(_likeness(project, variant, name) for name in names)
                for variant in project.variants
            }
    return found


def wrong_corrections(project: Project) -> Iterator[ModelError]:
    """Yield what `correction` names although neither the base nor a variant has it."""
    for quality, entry in project.settings["quality_attributes"].items():
        for number, name in enumerate(entry.get("correction", {}).get("same", ())):
            if not _is_known(project, name):
                yield _unknown(project, name, "quality_attributes", quality, "correction", "same", number)


def _is_known(project: Project, name: str) -> bool:
    component, dot, parameter = name.partition(".")
    components = [c for system in (project.whole_base, *project.variants) for c in system.components]
    parameters = {p.key for c in components if c.name == component for p in c.parameters}
    return (
        parameter in parameters if dot else name in {c.name for c in components} | set(project.settings["components"])
    )


def _unknown(project: Project, name: str, *keys: str | int) -> ModelError:
    kind = "parameter of a component" if "." in name else "component"
    return project.source.error(
        f"{name!r} is no {kind} of the base or of a variant: name a component, or COMPONENT.PARAMETER", *keys
    )


def _likeness(project: Project, variant: RosSystem, name: str) -> str:
    """Return what a variant has of a component or of a parameter."""
    component, dot, parameter = name.partition(".")
    if not dot:
        own = variant.component(name)
        uses = own is not None or not project.names_of(name).isdisjoint(project.required_components()[variant.name])
        return f"{name}: {own.executable if own else uses}"
    owner = compose(project.base, variant).component(component)
    values = [p.value for p in owner.parameters if p.key == parameter] if owner else []
    return f"{name}: {values[0] if values else None}"
