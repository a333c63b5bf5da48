"""Starts the node reasoner, without what it does not need."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the node; exit status 2 when it can't start.

    Pellet's process starts while this one imports the rest. It asks nobody whether it is needed: a master that hangs
    must not hold up the node's end.
    """
    from mros1_reasoner.pellet.spawning import spawn_early

    early = spawn_early()
    _import_genpy_without_numpy()
    from mros1_reasoner.ros.run import run

    run(early)


def _import_genpy_without_numpy() -> None:
    """Import genpy as where there is no numpy. It would import that only to know the names of its types.

    That saves 12 MB, and 0.05 s until the node is ready. Others may import numpy afterwards.
    """
    if "numpy" in sys.modules:
        return
    sys.modules["numpy"] = None  # type: ignore[assignment]
    try:
        import genpy  # noqa: F401
    finally:
        del sys.modules["numpy"]
