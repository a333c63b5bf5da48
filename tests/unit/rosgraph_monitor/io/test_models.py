"""The desired model of files, some of which can't be read for a while."""

import pytest
from ros_model.errors import ModelError
from rosgraph_monitor.graph.desired import Grounding
from rosgraph_monitor.io import models
from rosgraph_monitor.io.models import desired_model


def text(name, *components):
    parts = ", ".join(f'ComponentInterface {{ name "{component}" }}' for component in components)
    return f"RosSystem {{ Name {name} RosComponents ( {parts} ) }}"


@pytest.fixture
def cell(tmp_path):
    """Return the desired model of a cell whose function f_look runs, its variants' folder, and the warnings."""
    folder, warnings = tmp_path / "variants", []
    folder.mkdir()
    (tmp_path / "cell.rossystem").write_text(text("cell", "conveyor", "camera", "gripper"))
    (folder / "look.rossystem").write_text(text("look", "camera"))
    (folder / "pick.rossystem").write_text("RosSystem {")
    return desired_model(str(tmp_path / "cell.rossystem"), str(folder), warnings.append), folder, warnings


def test_variant_that_is_whole_later_is_read_then_and_told_once_before(cell):
    model, folder, warnings = cell
    model.follow([Grounding("f_look", "look", "STABLE")])
    for _ in range(3):
        assert model.look_again().idle_nodes == set()
    assert len(warnings) == 1
    assert str(folder / "pick.rossystem") in warnings[0]
    (folder / "pick.rossystem").write_text(text("pick", "gripper"))
    assert model.look_again().idle_nodes == {"gripper"}
    assert len(warnings) == 1


def test_model_that_was_read_is_kept(cell):
    model, folder, warnings = cell
    model.follow([])
    (folder / "look.rossystem").write_text("RosSystem {")
    (folder / "pick.rossystem").write_text(text("pick", "gripper"))
    assert model.look_again().idle_nodes == {"camera", "gripper"}
    assert len(warnings) == 1


def test_folder_that_can_not_be_listed_for_a_while_is_listed_later(cell, monkeypatch):
    model, folder, warnings = cell
    (folder / "pick.rossystem").write_text(text("pick", "gripper"))

    def refused(_):
        raise OSError(24, "Too many open files")

    with monkeypatch.context() as patch:
        patch.setattr(models.os, "listdir", refused)
        model.follow([Grounding("f_look", "look", "STABLE")])
        assert model.look_again().idle_nodes == set()
    assert len(warnings) == 1
    assert "Too many open files" in warnings[0]
    assert model.look_again().idle_nodes == {"gripper"}


@pytest.mark.parametrize("gone", ["pick.rossystem", "."])
def test_variants_that_are_not_there_for_a_while_are_read_later_and_then_kept(cell, gone):
    model, folder, warnings = cell
    (folder / "pick.rossystem").write_text(text("pick", "gripper"))
    away = folder / gone if gone != "." else folder
    aside = folder.parent / "aside"
    away.rename(aside)
    model.follow([])
    assert model.look_again().idle_nodes == ({"camera"} if gone != "." else set())
    aside.rename(away)
    assert model.look_again().idle_nodes == {"camera", "gripper"}
    (folder / "pick.rossystem").unlink()
    assert model.look_again().idle_nodes == {"camera", "gripper"}
    assert warnings == []


def test_base_must_be_readable(tmp_path):
    with pytest.raises(ModelError):
        desired_model(str(tmp_path / "none.rossystem"), "", print)
