"""The choice between kinds of missions: each has options of its own."""

from __future__ import annotations

from typing import Any

import click

from metacontrol_experiments.pyramid.scenarios import MANIPULATION

NAVIGATION = "navigation"
_OPTION = "--mission"


def mission_option() -> click.Option:
    """Return the option that chooses; it is heeded before the command's own options are read."""
    return click.Option(
        [_OPTION],
        type=click.Choice([NAVIGATION, MANIPULATION]),
        default=NAVIGATION,
        show_default=True,
        expose_value=False,
        help="D2 drives to a goal (navigation), D1 builds a pyramid (manipulation).",
    )


class ByMission(click.Command):
    """A command that hands over to another one where that mission is asked for."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        """Add the option."""
        super().__init__(*arguments, **options)
        self.params.insert(0, mission_option())

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        """Return the context of the command that the arguments ask for."""
        from metacontrol_experiments.cli.build import build

        if _asked(args) == MANIPULATION:
            return build.make_context(info_name, args, parent, **extra)
        return super().make_context(info_name, args, parent, **extra)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command of a context."""
        return super().invoke(ctx) if ctx.command is self else ctx.command.invoke(ctx)


def _asked(arguments: list[str]) -> str:
    """Return what the last option --mission says; empty where there is none."""
    asked = ""
    for word, following in zip(arguments, [*arguments[1:], ""], strict=True):
        if word == _OPTION:
            asked = following
        elif word.startswith(f"{_OPTION}="):
            asked = word.partition("=")[2]
    return asked
