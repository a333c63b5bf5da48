"""./mros bench [NAME ...]: runs the benchmarks, shows them beside their peers, writes results/bench.json.

A module of this folder offers `run() -> list[dict]`, whose figures are made by `support.figures.entry`.
"""

from __future__ import annotations

import importlib.util
import json
import multiprocessing
import os
import sys
import traceback
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from rich.console import Console
from rich.table import Column, Table
from support.figures import KEYS

HERE = Path(__file__).parent


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
        if tuple(entry) != KEYS:
            raise ValueError(f"{path.name}: an entry has the keys {list(entry)}, not {list(KEYS)}")
    return entries


def run_apart(path: Path) -> list[dict]:
    """Run a benchmark module in a process of its own: a process can be a node of one master only."""
    with ProcessPoolExecutor(max_workers=1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(run, path).result()


def table(entries: list[dict]) -> Table:
    """Return what is shown of the figures."""
    shown = Table(Column("name", no_wrap=True), "ours", "unit", "peer", "its value", "ratio", "samples")
    for entry in entries:
        cells = (entry[key] for key in KEYS)
        shown.add_row(
            *("-" if cell is None else f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in cells)
        )
    return shown


def main() -> None:
    """Run what the command line names; one that fails does not take the others' figures with it."""
    names = sys.argv[1:]
    console = Console(width=None if sys.stdout.isatty() else 110)
    entries: list[dict] = []
    failed: list[str] = []
    for path in modules(names):
        console.print(f"[dim]{path.stem} ...[/dim]")
        try:
            found = run_apart(path)
        except Exception:  # whatever it is, it is shown
            traceback.print_exc()
            failed.append(path.stem)
            continue
        entries += [entry for entry in found if not names or entry["name"] in names or path.stem in names]
    console.print(table(entries))
    target = Path(os.environ["MROS_ROOT"]) / "results" / "bench.json"
    target.parent.mkdir(exist_ok=True)
    target.write_text(json.dumps(entries, indent=1) + "\n")
    console.print(f"written to {target}", soft_wrap=True)
    if failed:
        sys.exit(f"mros: bench: failed, see above: {', '.join(failed)}")


if __name__ == "__main__":
    main()
