"""Knowledge bases are saved where the node's user wants them, and nowhere else: any host can ask for that."""

import pytest
from mros1_reasoner.io.ontology_files import place_to_save, save_knowledge_base
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBaseError
from node_kit.parameters import ParameterError


def test_folder_of_its_own_in_ros_home_is_the_default(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    assert Parameters({}).save_folder == tmp_path.resolve() / "knowledge_bases"
    assert Parameters({"save_folder": str(tmp_path / "mine")}).save_folder == tmp_path.resolve() / "mine"


@pytest.mark.parametrize("folder", ["~nobody_of_that_name/x", "a\0b"])
def test_folder_that_can_be_none_is_refused(folder):
    with pytest.raises(ParameterError, match="~save_folder"):
        Parameters({"save_folder": folder}).save_folder  # noqa: B018


def test_folder_is_made_for_the_first_file(tmp_path):
    path = place_to_save(tmp_path / "knowledge_bases", "now.owl")
    assert path == tmp_path.resolve() / "knowledge_bases" / "now.owl"
    assert path.parent.is_dir()


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("rosgraph_launcher.key", "does not end in .owl"),
        (".", "does not end in .owl"),
        ("a.owl/..", "does not end in .owl"),
        ("\0", "does not end in .owl"),
        ("../now.owl", "is not in"),
        ("/etc/now.owl", "is not in"),
        ("a\0.owl", "is not in"),
        ("not/there/now.owl", "no such folder: make it first"),
        (f"{'a' * 300}/now.owl", "give another file, or set ~save_folder"),
        ("link.owl", "does not end in .owl"),
        ("out.owl", "is not in"),
    ],
)
def test_name_that_leads_elsewhere_is_refused(tmp_path, name, said):
    folder = tmp_path / "saved"
    folder.mkdir()
    (folder / "secret.key").write_text("secret")
    (folder / "link.owl").symlink_to(folder / "secret.key")
    (folder / "out.owl").symlink_to(tmp_path / "other.owl")
    with pytest.raises(KnowledgeBaseError, match=said) as caught:
        place_to_save(folder, name)
    assert "\n" not in str(caught.value)


def test_file_that_can_not_be_written_stays_as_it_was(tmp_path, knowledge_base, monkeypatch):
    path = tmp_path / "saved.owl"
    path.write_text("before")

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(KnowledgeBaseError, match=r"saved\.owl: No space left on device: give another file"):
        save_knowledge_base(path, knowledge_base)
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir() if file.name != "app.owl"] == [
        ("saved.owl", "before")
    ]
