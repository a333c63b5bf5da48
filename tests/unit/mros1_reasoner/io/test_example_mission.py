"""The example of a mission: what is generated from its models is what the repository holds."""

from pathlib import Path

import pytest
from mros1_reasoner.io.parameters import Parameters
from ros_model.cli.rosmodel import main

PACKAGE = Path(__file__).parents[4] / "examples" / "example_mission"


def test_committed_artefacts_are_those_of_the_models(tmp_path, capsys):
    with pytest.raises(SystemExit) as done:
        main(["generate", "all", str(PACKAGE / "models"), "-o", str(tmp_path)])
    assert done.value.code == 0, capsys.readouterr().err
    generated = sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file())
    assert len(generated) == 10
    assert [path for path in generated if (PACKAGE / path).read_bytes() != (tmp_path / path).read_bytes()] == []


def test_model_without_objectives_has_none_until_tasks_ask():
    parameters = Parameters({"model_file": str(PACKAGE / "models" / "crawler.owl"), "default_objectives": False})
    assert parameters.objectives(parameters.knowledge_base()) == ()
