"""./mros bench [NAME ...]: runs the benchmarks, shows them beside their peers, writes results/bench.json.

A module of this folder offers `run() -> list[dict]` with the keys name, value, unit, peer, peer_value, ratio, samples.
"""

from __future__ import annotations

import importlib.util
import json
import os
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

HERE = Path(__file__).parent
KEYS = {"name", "value", "unit", "peer", "peer_value", "ratio", "samples"}


def modules(names: list[str]) -> list[Path]:
    """Return the benchmark modules that the names select: all without names, else those whose name it starts with."""
    files = sorted(path for path in HERE.glob("*.py") if path.stem != "run")
    if not names:
        return files
    unknown = [name for name in names if not any(name.startswith(path.stem) for path in files)]
    if unknown:
        known = ", ".join(path.stem for path in files)
        sys.stderr.write(f"mros: bench: no benchmark {', '.join(unknown)}; there are: {known}\n")
        sys.exit(2)
    return [path for path in files if any(name.startswith(path.stem) for name in names)]


def run(path: Path) -> list[dict]:
    """Run a benchmark module and check the shape of what it returns."""
    spec = importlib.util.spec_from_file_location(f"bench_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    entries = module.run()
    for entry in entries:
        if set(entry) != KEYS:
            raise ValueError(f"{path.name}: an entry has the keys {sorted(entry)}, not {sorted(KEYS)}")
    return entries


def main() -> None:
    """Run what the command line names."""
    names = sys.argv[1:]
    console = Console(width=None if sys.stdout.isatty() else 110)
    entries: list[dict] = []
    for path in modules(names):
        console.print(f"[dim]{path.stem} ...[/dim]")
        entries += [entry for entry in run(path) if not names or entry["name"] in names or path.stem in names]
    table = Table("name", "ours", "unit", "peer", "its value", "ratio", "samples")
    for entry in entries:
        cells = (entry[key] for key in ("name", "value", "unit", "peer", "peer_value", "ratio", "samples"))
        table.add_row(
            *("-" if cell is None else f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in cells)
        )
    console.print(table)
    results = Path(os.environ["MROS_ROOT"]) / "results"
    results.mkdir(exist_ok=True)
    target = results / "bench.json"
    target.write_text(json.dumps(entries, indent=1) + "\n")
    console.print(f"written to {target}")


if __name__ == "__main__":
    main()
