"""The launcher's secret and the page's token are in nothing that is logged, published, answered or recorded."""

import asyncio
import logging
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from types import SimpleNamespace

import genpy
import metacontrol_msgs.msg
import pytest
import rospy
import yaml
from aiohttp.test_utils import TestClient, TestServer
from bad_input.journals import MODEL, PARAMETERS
from bad_input.unconnected import NAME, Publisher, unconnected
from metacontrol_dashboard.io.server import make_app
from metacontrol_dashboard.ros import dashboard
from metacontrol_msgs.msg import NodeDescription
from metacontrol_msgs.srv import ChangeNodesRequest, StandByRequest
from mros1_reasoner.ros import run
from mros1_reasoner.ros.reasoner import ReasonerNode
from node_kit.parameters import ParameterTree
from rosgraph_launcher.io.secret import SecretError, read_secret, secret_file, sign
from rosgraph_launcher.launching.options import LauncherOptions
from rosgraph_launcher.ros import launcher

DEADLINE_S = 30
TOKEN = "sesame-93-open"  # noqa: S105 not one of a real server


class Outside:
    """All that others can see.

    Attributes:
        ros: of the nodes.
        texts: what was logged, published and answered.
    """

    def __init__(self, ros):
        self.ros, self.texts = ros, []

    def log(self, *words, **_):
        self.texts.append(str(words))

    def ask(self, service, request):
        """Ask for a service, and have its answer seen."""
        (offered,) = self.ros.listening(service)
        try:
            answer = offered.handler(request)
        except rospy.ServiceException as error:
            answer = error
        self.texts.append(f"{request} {answer}")
        return answer


@pytest.fixture
def outside(monkeypatch, caplog, capfd):
    """Return what has others see what nodes do; in the end, it checks that they have not seen a secret."""
    caplog.set_level(logging.DEBUG)

    @contextmanager
    def watching(secret, parameters=None):
        with unconnected(parameters) as ros, monkeypatch.context() as patch:
            seen = Outside(ros)
            for name in [name for name in dir(rospy) if name.startswith("log")]:
                patch.setattr(rospy, name, seen.log)
            send = Publisher.publish

            def publish(publisher, *arguments, **named):
                seen.log(*arguments, *named.values())
                send(publisher, *arguments, **named)

            patch.setattr(Publisher, "publish", publish)
            yield seen
        texts = [*seen.texts, *map(repr, ros.parameters.items()), caplog.text, *capfd.readouterr()]
        assert [text for text in texts if secret in text] == []

    return watching


def change(signature="", executable="talker"):
    node = NodeDescription(name="/rover/a", executable=executable)
    return ChangeNodesRequest("f", "c", [node], [], ["/rover/a"], signature)


def test_secret_of_the_launcher_is_in_no_log_message_parameter_or_answer(outside, monkeypatch, tmp_path):
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    secret = read_secret().decode()
    made = SimpleNamespace(expect=len, changes=1, change=lambda *_: {"start": 0.1})
    monkeypatch.setattr(launcher, "Launcher", lambda _options, publish, log: made)
    with outside(secret) as seen:
        node = launcher.LauncherNode(LauncherOptions(mark="x"), SimpleNamespace())
        node._publish(())
        signed, other = change(), StandByRequest([NodeDescription(name="/rover/b")], "")
        for request in (signed, other):
            sign(request, NAME)
        assert seen.ask(f"{NAME}/change", signed).ok
        seen.ask(f"{NAME}/stand_by", other)
        for refused in (change(), change("0" * 64), change(signed.signature, "rm")):
            assert not seen.ask(f"{NAME}/change", refused).ok
            seen.ask(f"{NAME}/stand_by", StandByRequest(refused.nodes, refused.signature))
        secret_file().chmod(0o644)
        assert "chmod 600" in seen.ask(f"{NAME}/change", signed).message
        with pytest.raises(SecretError) as error:
            sign(change(), NAME)
        seen.log(error.value)
    assert len(seen.texts) > 10


def test_token_of_the_page_is_in_no_log_message_parameter_or_answer(outside, monkeypatch):
    served = []
    monkeypatch.setenv(dashboard.TOKEN, TOKEN)
    monkeypatch.setattr(dashboard, "page_files", lambda: {"index.html": ("text/html", b"<p>page</p>")})
    server = SimpleNamespace(start=lambda: None, url="http://robot:8090/", viewers=0)
    monkeypatch.setattr(dashboard, "Server", lambda content, access: served.append((content, access)) or server)
    with outside(TOKEN) as seen:
        dashboard.DashboardNode(ParameterTree({"address": "0.0.0.0"}, NAME))  # noqa: S104 no server listens there
    assert "the page of this system" in " ".join(seen.texts)
    [(content, access)] = served
    assert access.may_control(TOKEN) and not access.may_control("")
    with outside(TOKEN) as seen:
        asyncio.run(asyncio.wait_for(look_at_all(content, access, seen), DEADLINE_S))
    assert len(seen.texts) == 14


async def look_at_all(content, access, seen):
    """Have a page with the token, one with another and one without ask for everything."""
    asked = []

    async def act(request):
        asked.append(request)
        return {"ok": True, "message": str(request)}

    app = make_app(replace(content, act=act), access)
    async with TestClient(TestServer(app)) as client:
        for headers in ({"X-Token": TOKEN}, {"X-Token": "guess"}, {}):
            for path in ("/", "/nothing"):
                answer = await client.get(path, headers=headers)
                seen.log(answer.headers, await answer.text())
            for body in ('{"action": "pause"}', "{"):
                kind = {"Content-Type": "application/json"}
                answer = await client.post("/api/act", data=body, headers=headers | kind)
                seen.log(answer.headers, await answer.text())
        socket = await client.ws_connect("/live", headers={"X-Token": TOKEN})
        for _ in range(2):
            seen.log(await socket.receive_str(timeout=DEADLINE_S))
    assert [request.action for request in asked] == ["pause"]


def test_journal_has_the_parameters_of_the_reasoner_and_of_nobody_else(monkeypatch):
    made = []

    def keep(node):
        made.append(node)

    life = SimpleNamespace(start=lambda **_: None, begun=lambda: None)
    monkeypatch.setattr(run, "Lifetime", lambda *_: nullcontext(life))
    monkeypatch.setattr(
        run, "Thread", lambda target, args, **_: SimpleNamespace(start=lambda: target(*args), join=lambda: None)
    )
    monkeypatch.setattr(run, "log_core", lambda: None)
    monkeypatch.setattr(run, "watch_parts", lambda _: None)
    monkeypatch.setattr(ReasonerNode, "run", keep)
    own = {**PARAMETERS, "model_file": str(MODEL)}
    with unconnected({NAME: own, "/vault": {"password": TOKEN}, f"{NAME}_2": {"password": TOKEN}}):
        run.run(None)
        told = made[0]._journal._beginning()
    assert yaml.safe_load(told.parameters) == own
    assert TOKEN not in str(told)


def test_signatures_are_in_requests_that_no_bag_records_and_in_no_message():
    kinds = [kind for kind in vars(metacontrol_msgs.msg).values() if isinstance(kind, type)]
    assert len(kinds) > 20
    assert [kind._type for kind in kinds if issubclass(kind, genpy.Message) and "signature" in kind.__slots__] == []
    assert "signature" in ChangeNodesRequest.__slots__
