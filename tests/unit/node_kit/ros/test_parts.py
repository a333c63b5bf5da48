"""What a part takes from the topic of the signs of life, and what it finds out about a part that gives none."""

import itertools
import socket
from contextlib import nullcontext
from types import SimpleNamespace

import pytest
from bad_input.unconnected import Publisher, unconnected
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from helpers.ports import QUIET_HOST
from hypothesis import example, given
from hypothesis import strategies as st
from node_kit.io.inbox import Inbox
from node_kit.io.xml_rpc import DeniedError, GoneError, SilentError
from node_kit.parts import Answer, Sign
from node_kit.ros import parts as module
from node_kit.ros.parts import TOPIC, PartsWatch

REASONER = "/cell/reasoner"


LIMIT_S = 2.0
"""Simulated s within which a part whose process has ended is on /diagnostics, where the master answers quickly."""


class Watching:
    """A part that watches two others, on a simulated clock: both die right after a sign of life, the reasoner at 0 s.

    Attributes:
        now: s.
        told: the first message on /diagnostics about the reasoner, and when it came.
    """

    def __init__(self, monkeypatch, earlier, wakes, answer_s):
        self.now, self.told, self._wakes, self._answer_s = 0.0, None, itertools.cycle(wakes), answer_s
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: self.now, time=lambda: 200.0))
        monkeypatch.setattr(module, "Client", self._client)
        monkeypatch.setattr(module.rosgraph, "get_master_uri", lambda: "master")
        monkeypatch.setattr(Inbox, "do_next", self._wait)
        monkeypatch.setattr(Publisher, "publish", lambda _, message: self._publish(message))
        with unconnected():
            watch = PartsWatch("monitor")
            for node, heard in ((REASONER, self.now), ("/cell/launcher", self.now - earlier)):
                watch._parts.hear(Sign(node, "", "http://cell:1", 100.0), heard)
            while not self.told and self.now < 10.0:
                watch._look()

    def _wait(self, wait_s):
        """Wait for signs of others, which come whenever they like, at most for so long."""
        self.now += min(wait_s, next(self._wakes))

    def _client(self, uri, *_):
        def call(_method, *_arguments):
            if uri != "master":
                raise GoneError("nobody listens", "refused")
            self.now += self._answer_s
            return "http://cell:1"  # the master still knows it

        return nullcontext(SimpleNamespace(call=call))

    def _publish(self, message):
        for status in message.status if isinstance(message, DiagnosticArray) else ():
            if status.name == REASONER and self.told is None:
                self.told = self.now, status.level, status.values[0].value


@given(
    earlier=st.floats(0.0, 2.0),
    wakes=st.lists(st.floats(0.001, 1.0), min_size=1, max_size=8),
    answer_s=st.floats(0.0, 0.1),
)
@example(earlier=0.3, wakes=[0.2], answer_s=0.0)  # the other one is told just before
def test_part_that_died_is_on_diagnostics_within_2_s(earlier, wakes, answer_s):
    with pytest.MonkeyPatch.context() as monkeypatch:
        at, *told = Watching(monkeypatch, earlier, wakes, answer_s).told
    assert told == [DiagnosticStatus.ERROR, "lost: its process has ended"]
    assert at <= LIMIT_S


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
