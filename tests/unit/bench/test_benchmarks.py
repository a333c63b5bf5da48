"""Every benchmark can begin: what it measures has moved before, and nobody noticed."""

import subprocess
import sys
from pathlib import Path

import pytest

BENCH = Path(__file__).parents[2] / "bench"
MODULES = sorted(path.relative_to(BENCH).with_suffix("") for path in BENCH.rglob("*.py"))


@pytest.mark.parametrize("module", [".".join(path.parts) for path in MODULES])
def test_benchmark_is_imported(module):
    """In a process of its own: the benchmarks' folder has modules of common names."""
    code = f"import importlib; module = importlib.import_module({module!r}); print(hasattr(module, 'run'))"
    done = subprocess.run([sys.executable, "-c", code], cwd=BENCH, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    is_benchmark = "." not in module
    assert done.stdout.split()[-1:] == [str(is_benchmark)]
