"""Names of files: plain paths and package:// names."""

import shutil

import pytest
from ros_model.errors import ModelError
from ros_model.file_names import safe_file_name
from ros_model.io.files import resolve
from ros_model.io.models import read_sources
from ros_model.language.metamodel import Reference


@pytest.fixture
def package(tmp_path, monkeypatch):
    folder = tmp_path / "arm_models"
    folder.mkdir()
    (folder / "package.xml").write_text(
        "<package format='2'><name>arm_models</name><version>0.0.1</version><description>x</description>"
        "<maintainer email='a@b.example'>a</maintainer><license>x</license></package>"
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    return folder


def test_package_name_is_resolved(package):
    assert resolve("package://arm_models/models/a.rossystem") == package / "models" / "a.rossystem"


def test_package_that_is_made_or_moved_later_is_found(package, tmp_path):
    assert resolve("package://arm_models/a") == package / "a"
    shutil.copytree(package, tmp_path / "later")
    manifest = tmp_path / "later" / "package.xml"
    manifest.write_text(manifest.read_text().replace("arm_models", "gripper_models"))
    assert resolve("package://gripper_models/a") == tmp_path / "later" / "a"
    package.rename(tmp_path / "moved")
    assert resolve("package://arm_models/a") == tmp_path / "moved" / "a"


def test_plain_path_is_made_absolute(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert resolve("a.rossystem") == tmp_path / "a.rossystem"


@pytest.mark.parametrize("relative", ["../secret", "models/../../secret", "/etc/passwd", ""])
def test_path_that_leaves_the_package_is_refused(package, relative):
    with pytest.raises(ModelError, match="must name a file inside the package"):
        resolve(f"package://arm_models/{relative}")


def test_link_that_leaves_the_package_is_refused(package, tmp_path):
    (package / "link").symlink_to(tmp_path)
    with pytest.raises(ModelError, match="must name a file inside the package"):
        resolve("package://arm_models/link/secret")


@pytest.mark.parametrize("package_name", ["nowhere", "", ".."])
def test_unknown_package_is_refused(package, package_name):
    with pytest.raises(ModelError, match="no package"):
        resolve(f"package://{package_name}/a")


@pytest.mark.parametrize("uri", ["http://x/y", "", "a\0b"])
def test_other_names_are_refused(uri):
    with pytest.raises(ModelError):
        resolve(uri)


@pytest.mark.parametrize("name", ["", ".", "..", "../x", "a/b", ".hidden", "a b", "a\n"])
def test_name_that_is_no_file_name_is_refused(name):
    with pytest.raises(ModelError, match="can't name a file"):
        safe_file_name(name, "variant")


def test_models_of_source_are_read_without_those_of_running_systems_and_without_broken_ones(tmp_path):
    text = "PackageSet { CatkinPackage carts { Artifact %s { Node { name n Publishers { Publisher { name x } } } } } }"
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "source.ros").write_text("// Written by rosmodel extract.\n" + text % "written")
    (tmp_path / "snapshot.ros").write_text("// A robot. Written by rosmodel snapshot.\n" + text % "seen")
    (tmp_path / "broken.ros").write_text("PackageSet {")
    library, unread = read_sources(tmp_path)
    known = {name: library.interfaces(Reference("carts", name, "n")) for name in ("written", "seen")}
    assert [port.name for port in known["written"] or ()] == ["x"]
    assert known["seen"] is None
    assert [str(error).startswith(f"{tmp_path}/broken.ros:") for error in unread] == [True]
    assert read_sources(tmp_path / "nothing")[1] == []
