"""`rosmodel extract` of several folders."""

import pytest

PACKAGE = (
    "<package format='2'><name>NAME</name><version>0.1.0</version><description>x</description>"
    "<maintainer email='a@b.example'>a</maintainer><license>x</license></package>"
)


@pytest.fixture
def folders(tmp_path):
    """Two packages in folders of their own."""
    for name in ("crane", "ferry"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "package.xml").write_text(PACKAGE.replace("NAME", name))
        (tmp_path / name / "CMakeLists.txt").write_text("")
    return tmp_path


def test_several_folders_are_extracted_one_after_the_other(run, folders):
    out = folders / "out"
    assert run("extract", folders / "crane", folders / "ferry", "-o", out)[0] == 0
    assert sorted(path.name for path in out.iterdir()) == ["crane.ros", "ferry.ros"]


def test_folder_that_is_missing_does_not_hinder_the_others(run, folders):
    out = folders / "out"
    status, _, err = run("extract", folders / "gone", folders / "ferry", "-o", out)
    assert (status, "gone: no such folder" in err) == (2, True)
    assert [path.name for path in out.iterdir()] == ["ferry.ros"]


@pytest.mark.parametrize(
    ("more", "message"),
    [("a.launch", "give folders only, or one launch file"), ("a:=b", "arguments are for a launch file")],
)
def test_launch_file_or_argument_beside_a_folder_is_refused(run, folders, more, message):
    (folders / "a.launch").write_text("<launch/>")
    status, _, err = run("extract", folders / "crane", folders / more if "." in more else more, "-o", folders / "out")
    assert (status, message in err) == (2, True)
    assert not (folders / "out").exists()
