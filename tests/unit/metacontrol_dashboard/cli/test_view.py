"""The command view finds bags, and says in one line what is wrong."""

import pytest
from click.testing import CliRunner
from metacontrol_bags.bag_file import BagError
from metacontrol_dashboard.cli.view import found_bags, view
from metacontrol_dashboard.io.page import PageError, page_folder


def touch(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("")
    return path


def test_bags_of_a_folder_have_names_that_tell_them_apart(tmp_path):
    for name in ("a/mission.bag", "b/mission.bag", "b/other.bag", "c/a/mission.bag"):
        touch(tmp_path / name)
    assert set(found_bags((tmp_path,))) == {"a", "b", "other", "c-a"}


def test_bag_that_is_named_twice_is_shown_once(tmp_path):
    path = touch(tmp_path / "x.bag")
    assert found_bags((path, tmp_path)) == {"x": path}


def test_folder_without_bags_is_refused(tmp_path):
    with pytest.raises(BagError, match="no bag in it"):
        found_bags((tmp_path,))


@pytest.mark.parametrize("arguments", [["nothing.bag"], ["nothing.bag", "--export", "x.html"]])
def test_missing_bag_is_told_in_one_line(tmp_path, arguments, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(view, arguments)
    assert (result.exit_code, result.output.count("\n")) == (2, 1)


def test_run_is_exported_as_one_file(bag, tmp_path):
    try:
        page_folder()
    except PageError as error:
        pytest.skip(str(error))
    target = tmp_path / "run.html"
    result = CliRunner().invoke(view, [str(bag()), "--export", str(target)])
    assert (result.exit_code, result.output) == (0, f"{target}\n")
    assert "camera_slow" in target.read_text()
