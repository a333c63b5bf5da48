"""The command `metacontrol`: a group with a module for each of its commands."""

from __future__ import annotations

import importlib

import click

from metacontrol_experiments.io.display import CONSOLE

_OWN = ("run", "summary", "figure", "calibrate", "variants", "compare", "delays", "campaign", "report", "yardstick")
_MODULES = {name: f"metacontrol_experiments.cli.{name}" for name in _OWN} | {
    "bag": "metacontrol_bags.cli.main",
    "view": "metacontrol_dashboard.cli.view",
}


class _Commands(click.Group):
    """A group that imports a command when it is asked for: drawing and statistics take long to import."""

    def list_commands(self, _context: click.Context) -> list[str]:
        return sorted(_MODULES)

    def get_command(self, _context: click.Context, name: str) -> click.Command | None:
        if name not in _MODULES:
            return None
        command: click.Command = getattr(importlib.import_module(_MODULES[name]), name)
        return command


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
def metacontrol() -> None:
    """Missions of a robot that adapts, and what their bags tell."""


def main() -> None:
    """Run the command."""
    try:
        metacontrol(prog_name="metacontrol")
    finally:
        CONSOLE.finish()


if __name__ == "__main__":
    main()
