"""The example of a cell that picks parts: what is generated from its models is what the repository holds."""

from pathlib import Path

import pytest
from ros_model.cli.rosmodel import main

PACKAGE = Path(__file__).parents[4] / "examples" / "pick_cell"


def test_committed_artefacts_are_those_of_the_models(tmp_path, capsys):
    with pytest.raises(SystemExit) as done:
        main(["generate", "all", str(PACKAGE / "models"), "-o", str(tmp_path)])
    assert done.value.code == 0, capsys.readouterr().err
    folders = ("config", "launch", "models")
    generated = [path.relative_to(tmp_path) for name in folders for path in (tmp_path / name).rglob("*.*")]
    assert len(generated) == 11
    assert [path for path in generated if (PACKAGE / path).read_bytes() != (tmp_path / path).read_bytes()] == []
