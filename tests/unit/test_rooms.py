"""Files are touched in rooms that say so; ruff and import-linter hold the other rules of the rooms (pyproject.toml)."""

import ast
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[2] / "catkin_ws" / "src"
REACHING_OUT = {"io", "ros", "cli", "pellet"}
"""Rooms that may touch files, in any package."""
ALSO = {
    "metacontrol_bags/bag_file.py": "reads a bag",
    "node_kit/plugins.py": "reads the package.xml of all packages",
    "ros_model/generators": "generators write files, and ask what is there already",
    "ros_model/language/parser.py": "reads the grammars of its own package",
    "ros_model/project/schema_check.py": "reads the schema of its own package",
    "ros_model_extraction/packages": "looks through the folders of packages",
}
CALLS = {
    *("open", "read_text", "read_bytes", "write_text", "write_bytes", "iterdir", "glob", "rglob"),
    *("mkdir", "unlink", "is_file", "is_dir", "exists"),
}
MODULES = sorted(
    path for path in SOURCES.glob("*/src/*/**/*.py") if not REACHING_OUT & set(path.relative_to(SOURCES).parts)
)


def test_there_are_modules_of_the_core():
    assert len(MODULES) > 150


@pytest.mark.parametrize("module", MODULES, ids=lambda path: str(path.relative_to(SOURCES)).partition("/src/")[2])
def test_core_touches_no_file(module):
    name = str(module.relative_to(SOURCES)).partition("/src/")[2]
    if any(name == allowed or name.startswith(f"{allowed}/") for allowed in ALSO):
        return
    called = [node.func for node in ast.walk(ast.parse(module.read_text())) if isinstance(node, ast.Call)]
    found = [
        f"{name}:{function.lineno}"
        for function in called
        if (isinstance(function, ast.Attribute) and function.attr in CALLS)
        or (isinstance(function, ast.Name) and function.id == "open")
    ]
    assert found == []
