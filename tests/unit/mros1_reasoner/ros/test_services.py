"""The services of the node, of which any host on the network can ask anything."""

from types import SimpleNamespace as Thing

import pytest
import rospy
from mros1_reasoner.knowledge.model import Analysis, Facts
from mros1_reasoner.ros.services import Services


@pytest.fixture
def services(monkeypatch, tmp_path, knowledge_base):
    """Return a function: the answer of a service of a node that saves in a folder of `tmp_path`."""
    offered = {}
    monkeypatch.setattr(rospy, "Service", lambda name, _kind, answer: offered.update({name: answer}))
    core = Thing(known=Facts(), analysis=Analysis())
    node = Thing(knowledge_base=knowledge_base, core=core, ask=lambda work: work())
    Services(node, tmp_path / "saved")
    return lambda name, **request: offered[name](Thing(**request))


def test_knowledge_base_is_saved(services, tmp_path):
    answer = services("~save_knowledge_base", path="")
    assert (answer.ok, answer.message) == (True, str(tmp_path.resolve() / "saved" / "knowledge_base.owl"))


def test_secret_beside_is_not_overwritten(services, tmp_path):
    (tmp_path / "saved").mkdir()
    secret = tmp_path / "saved" / "rosgraph_launcher.key"
    secret.write_text("secret")
    answer = services("~save_knowledge_base", path="rosgraph_launcher.key")
    assert not answer.ok
    assert "does not end in .owl: give a file that does" in answer.message
    assert secret.read_text() == "secret"


def test_name_that_is_too_long_is_answered(services):
    answer = services("~save_knowledge_base", path=f"{'a' * 300}.owl")
    assert not answer.ok
    assert "File name too long: give another file" in answer.message
