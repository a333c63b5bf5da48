"""The kit runs on robots with Python 3.8."""

import ast
from pathlib import Path

import node_kit
import pytest

MODULES = sorted(Path(node_kit.__file__).parent.rglob("*.py"))


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_module_has_the_syntax_of_python_3_8(path):
    tree = ast.parse(path.read_text(encoding="utf-8"), feature_version=(3, 8))
    annotated = any(isinstance(node, (ast.arg, ast.AnnAssign, ast.FunctionDef)) for node in ast.walk(tree))
    future = any(isinstance(node, ast.ImportFrom) and node.module == "__future__" for node in tree.body)
    assert future or not annotated
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in {"isinstance", "issubclass"}:
            assert not isinstance(node.args[1], ast.BinOp), f"line {node.lineno}: X | Y"
        assert getattr(node, "attr", "") not in {"removeprefix", "removesuffix"}, f"line {node.lineno}: Python 3.9"
