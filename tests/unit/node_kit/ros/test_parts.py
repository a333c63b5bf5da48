"""What a part takes from the topic of the signs of life, and what it finds out about a part that gives none."""

import socket
from types import SimpleNamespace

import pytest
from bad_input.unconnected import unconnected
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from helpers.ports import QUIET_HOST
from node_kit.io.xml_rpc import DeniedError, SilentError
from node_kit.parts import Answer, Sign
from node_kit.ros import parts as module
from node_kit.ros.parts import TOPIC, PartsWatch

REASONER = "/cell/reasoner"


@pytest.fixture
def heard():
    """Return what a part knows once it has heard signs, each as (sender, level)."""

    def hear(*signs):
        with unconnected() as ros:
            watch = PartsWatch("monitor")
            for sender, level in signs:
                values = [KeyValue("uri", "http://cell:1"), KeyValue("started", "100.0")]
                sign = DiagnosticStatus(level, REASONER, "", "", values)
                sign._connection_header = {"callerid": sender}
                ros.listening(f"/{TOPIC}")[0].give(sign)
        watch._inbox.drain()
        return list(watch._parts.known)

    return hear


def test_sign_counts_only_from_the_node_itself(heard):
    alive, ends = DiagnosticStatus.OK, DiagnosticStatus.STALE
    assert heard(("/stranger", alive)) == []
    assert heard((REASONER, alive), ("/stranger", ends)) == [REASONER]
    assert heard((REASONER, alive), (REASONER, ends)) == []


@pytest.mark.parametrize(
    ("error", "answer"), [(DeniedError("unknown node"), Answer.UNKNOWN), (SilentError("no answer"), Answer.SILENT)]
)
def test_master_is_asked_about_a_silent_part(monkeypatch, error, answer):
    class Master(SimpleNamespace):
        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def call(self, *_):
            raise error

    usual = module.Client
    master = "http://master"
    monkeypatch.setattr(module.rosgraph, "get_master_uri", lambda: master)
    monkeypatch.setattr(module, "Client", lambda uri, *words: Master() if uri == master else usual(uri, *words))
    with socket.create_server((QUIET_HOST, 0)) as silent:
        uri = f"http://{QUIET_HOST}:{silent.getsockname()[1]}"
        assert module._ask(Sign(REASONER, "reasoner", uri, 100.0)) is answer
