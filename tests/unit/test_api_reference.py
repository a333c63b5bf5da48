"""The API reference that `./mros docs` builds."""

import ast
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "catkin_ws" / "src").glob("*/src"))
DEADLINE_S = 600  # on a loaded machine; alone it takes half a minute


def public(body):
    """Return the public functions and classes of a module: those in `__all__` where it has one."""
    found = [node.name for node in body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    for node in body:
        if isinstance(node, ast.Assign) and [ast.unparse(target) for target in node.targets] == ["__all__"]:
            return [name for name in found if name in ast.literal_eval(node.value)]
    return [name for name in found if not name.startswith("_")]


def modules():
    """Yield (name of the page, public functions and classes) of every module."""
    for source in SOURCES:
        for file in source.rglob("*.py"):
            module = file.relative_to(source).with_suffix("")
            page = module.parent if module.name == "__init__" else module
            yield f"{page}.html", public(ast.parse(file.read_text(encoding="utf-8")).body)


def test_reference_has_every_public_function_and_class(tmp_path):
    built = subprocess.run(
        [ROOT / "mros", "docs", tmp_path / "site"], capture_output=True, text=True, timeout=DEADLINE_S, check=False
    )
    assert built.returncode == 0, built.stderr[-3000:]
    lacking = []
    for page, names in modules():
        path = tmp_path / "site" / "api" / page
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        lacking += [page] if not text else [f"{page}: {name}" for name in names if f'id="{name}"' not in text]
    assert not lacking
