"""Which launchers count, and which are given up, with a master and launchers that are played."""

import threading
from types import SimpleNamespace

import pytest
import rospy
from metacontrol_msgs.msg import LaunchedFunction, LaunchedFunctions
from metacontrol_msgs.srv import ChangeNodesResponse
from node_kit.io.background import NoThreadError
from node_kit.io.xml_rpc import SilentError
from rosgraph_launcher.description import NodeDescription
from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.ros import launcher_reports, launchers
from rosgraph_manipulator.ros.launchers import Launchers

MAIN, SECOND, STRANGER = "/rosgraph_launcher", "/rosgraph_launcher_box", "/play_1"
NODE = NodeDescription("/nav", "/", "p", "x")
FAR_NODE = NodeDescription("/arm", "/", "p", "x", machine="box")


class Surroundings:
    """The master, the connections of the topic, and the launchers.

    Attributes:
        parameters: on the master; None: it does not answer.
        connected: who is connected.
        living: whose API answers.
        hosts: names of those of launchers that are not `localhost`.
        pids: process ids of launchers that are not 1.
        change: what a launcher answers to a request.
        requests: what launchers were asked, with their names.
    """

    def __init__(self):
        self.parameters = {f"{MAIN}/addresses": ["robot"], f"{SECOND}/addresses": ["box"]}
        self.hosts, self.pids = {}, {}
        self.connected = {MAIN, SECOND, STRANGER}
        self.living = {MAIN, SECOND, STRANGER}
        self.change = lambda: ChangeNodesResponse(ok=True, change=4)
        self.requests = []

    def get_parameters(self, names):
        if self.parameters is None:
            raise SilentError("the master does not answer", "timed out")
        return {name: self.parameters[name] for name in names if name in self.parameters}

    def subscriber(self, *_, **__):
        return SimpleNamespace(impl=self)

    @property
    def connections(self):
        return [SimpleNamespace(callerid_pub=name) for name in self.connected]

    def address(self, name):
        return f"http://{self.hosts.get(name, 'localhost')}:1{name}"

    def pid(self, uri):
        name = uri.partition(":1")[2]
        return self.pids.get(name, 1) if self.is_answering(name) else None

    def is_answering(self, name):
        return name in self.living

    def proxy(self, name, _type):
        def call(request):
            self.requests.append((name.rpartition("/")[0], request))
            return self.change()

        return Proxy(call)


class Proxy:
    def __init__(self, call):
        self._call, self.uri = call, "rosrpc://localhost:1"

    def wait_for_service(self, timeout):
        """The service is there."""

    def __call__(self, request):
        return self._call(request)


@pytest.fixture
def around(monkeypatch):
    played = Surroundings()
    monkeypatch.setattr(rospy, "Subscriber", played.subscriber)
    monkeypatch.setattr(rospy, "ServiceProxy", played.proxy)
    monkeypatch.setattr(rospy, "resolve_name", lambda name: f"/{name}")
    monkeypatch.setattr(launcher_reports, "get_parameters", played.get_parameters)
    monkeypatch.setattr(launcher_reports, "WATCH_PERIOD", 0.01)
    monkeypatch.setattr(launchers, "WATCH_PERIOD", 0.01)
    for module in (launcher_reports, launchers):
        monkeypatch.setattr(module, "NodeApi", played)
    monkeypatch.setattr(launchers, "sign", lambda request, _name: setattr(request, "signature", "signed"))
    monkeypatch.setattr(Launchers, "_watch", lambda _: None)  # a test looks around when it wants to
    return played


@pytest.fixture
def followed(around):
    return Launchers(timeout=2.0, host_timeout=0.0)


def tell(followed, who, change=3, nodes=("/nav",), configuration="slow", header=None, state="STABLE"):
    """Have a launcher tell what it has; without the header of a connection, over a new one."""
    report = LaunchedFunction("f", configuration, change, state, list(nodes), [], "")
    message = LaunchedFunctions(functions=[report])
    message._connection_header = header or {"callerid": who}
    followed._take(message)


def ask(followed, *nodes):
    return followed.change("f", "fast", nodes, [], [node.name for node in nodes], lambda: None)


def test_reports_of_a_stranger_are_left_out(followed, around):
    tell(followed, MAIN)
    before = followed.reports()
    tell(followed, STRANGER)
    followed._look_around()
    assert followed.reports() == before
    ask(followed, NODE)
    assert [name for name, _ in around.requests] == [MAIN]


def test_launcher_is_found_as_soon_as_the_master_answers(followed, around):
    told = []
    followed.on_reports = lambda: told.append(followed.reports()["f"].nodes)
    known, around.parameters = around.parameters, None
    tell(followed, MAIN)
    tell(followed, SECOND, nodes=["/arm"])
    assert told == [("/nav",)]  # the main launcher is known by its name
    followed._look_around()
    around.parameters = known
    followed._look_around()
    assert told == [("/nav",), ("/nav", "/arm")]


def test_stranger_that_is_gone_is_asked_about_no_more(followed, around):
    tell(followed, STRANGER)
    around.connected.discard(STRANGER)
    followed._look_around()
    around.parameters[f"{STRANGER}/addresses"] = ["robot"]
    followed._look_around()
    assert followed.reports() == {}


def test_second_launcher_of_this_host_that_has_ended_is_forgotten(followed, around):
    tell(followed, MAIN)
    before = followed.reports()
    tell(followed, SECOND, nodes=["/arm"])
    followed._look_around()
    assert followed.reports()["f"].nodes == ("/nav", "/arm")
    around.living.discard(SECOND)
    around.connected.discard(SECOND)
    followed._look_around()
    assert followed.reports() == before


def test_function_of_a_second_launcher_that_has_ended_fails_and_can_be_changed(followed, around):
    tell(followed, MAIN)
    tell(followed, SECOND, nodes=["/arm"])
    followed.adopt("f", [NODE, FAR_NODE])
    around.living.discard(SECOND)
    around.connected.discard(SECOND)
    followed._look_around()
    report = followed.reports()["f"]
    assert (report.state, report.dead) == ("FAILED", ("/arm",))
    assert report.message.endswith("and ran /arm: start it again")
    ask(followed, NODE)
    assert [name for name, _ in around.requests] == [MAIN]


MOVED_NODE = NodeDescription("/arm", "/", "p", "x", machine="arm-pc")


def move(around, name):
    around.parameters[f"{name}/addresses"] = ["arm-pc"]
    around.hosts[name] = "192.0.2.7"


@pytest.mark.parametrize("name", [MAIN, SECOND])
def test_launcher_that_is_started_again_for_another_host_is_found_there(followed, around, name):
    tell(followed, name)
    assert (followed._find("arm-pc"), followed._known[name].is_here) == ("", True)
    move(around, name)
    tell(followed, name)
    assert (followed._find("arm-pc"), followed.is_here(MOVED_NODE)) == (name, False)
    assert followed._find("box") == ""


def test_launcher_is_read_again_over_the_same_connection_only_where_its_process_is_another_one(followed, around):
    header = {"callerid": SECOND}
    tell(followed, SECOND, header=header)
    followed._look_around()
    move(around, SECOND)
    tell(followed, SECOND, header=header)
    followed._look_around()
    assert followed._find("box") == SECOND
    around.pids[SECOND] = 2
    followed._look_around()
    assert followed._find("arm-pc") == SECOND


def test_launcher_that_can_not_be_read_again_stays_where_it_was_until_the_master_answers(followed, around):
    tell(followed, MAIN)
    tell(followed, SECOND)
    move(around, SECOND)
    known, around.parameters = around.parameters, None
    tell(followed, SECOND)
    followed._look_around()
    assert followed._find("box") == SECOND
    around.parameters = known
    followed._look_around()
    assert (followed._find("box"), followed._find("arm-pc")) == ("", SECOND)


def test_launcher_that_takes_a_request_and_gives_no_sign_is_given_up(followed, around):
    tell(followed, MAIN)
    around.living.clear()
    never = threading.Event()
    around.change = never.wait
    with pytest.raises(DeploymentError, match="takes requests and does not answer"):
        ask(followed, NODE)
    ((_, request),) = around.requests
    assert request.signature == ""
    never.set()


def test_launcher_that_lives_may_take_its_time_for_a_change(followed, around, monkeypatch):
    tell(followed, MAIN)
    looks, done = [], threading.Event()

    def is_answering(name):
        looks.append(name)
        if len(looks) > 250:  # each takes WATCH_PERIOD: longer than the time to look for a launcher
            done.set()
        return True

    monkeypatch.setattr(around, "is_answering", is_answering)
    around.change = lambda: done.wait() and ChangeNodesResponse(ok=True, change=4)
    assert ask(followed, NODE).number == 4


def test_change_is_possible_only_while_all_launchers_answer_that_have_a_part_of_it(followed, around):
    tell(followed, MAIN)
    tell(followed, SECOND)
    followed.require("f", [NODE])
    around.living.discard(SECOND)  # it has a node of the function, though none of these
    with pytest.raises(DeploymentError, match=f"^{SECOND} does not answer, so nothing is changed"):
        followed.require("f", [NODE])
    followed.require("another", [NODE])
    around.living = {SECOND}
    with pytest.raises(DeploymentError, match=f"^{MAIN} does not answer"):
        followed.require("another", [NODE])
    assert around.requests == []


def test_launcher_that_comes_is_waited_for(followed, around, monkeypatch):
    answers = iter([False, False, True])
    monkeypatch.setattr(around, "is_answering", lambda name: next(answers))
    followed.require("f", [NODE])


def test_end_of_the_main_launcher_concerns_the_functions_of_which_it_has_a_part(followed, around):
    tell(followed, MAIN)
    followed.adopt("f", [NODE])
    assert not followed.main_has_ended("f")
    around.connected.discard(MAIN)
    assert followed.main_has_ended("f")
    assert not followed.main_has_ended("another")


def test_what_runs_although_nothing_should_is_stopped_once_its_launcher_is_there(followed, around):
    tell(followed, MAIN)
    followed.adopt("f", [NODE])
    assert followed.clear("f") == []
    followed.expect_nothing("f")
    assert followed.reports()["f"].nodes == ()
    around.connected.discard(MAIN)
    assert followed.clear("f") == []
    around.connected.add(MAIN)
    followed.clear("f")
    ((name, request),) = around.requests
    assert (name, request.configuration) == (MAIN, "")


# -- no thread


def test_change_without_a_thread_to_ask_a_launcher_fails(followed, around, no_thread):
    tell(followed, MAIN)
    no_thread()
    with pytest.raises(DeploymentError, match=r"^no thread could be started: can't start new thread$"):
        ask(followed, NODE)
    assert around.requests == []
    assert ask(followed, NODE).number == 4


def test_request_that_was_not_sent_for_want_of_a_thread_is_repeated(followed, around, no_thread):
    tell(followed, MAIN)
    no_thread(after=1)
    assert ask(followed, NODE).number == 4
    assert len(around.requests) == 1


def test_launchers_that_no_thread_tells_what_to_be_ready_for_are_an_error(followed, no_thread):
    no_thread()
    with pytest.raises(NoThreadError):
        followed.stand_by([NODE])


def test_launcher_that_can_not_be_asked_for_want_of_a_thread_is_asked_again(followed, around, monkeypatch, no_thread):
    asked = []
    monkeypatch.setattr(launcher_reports, "publishers", lambda _topic: {MAIN})
    monkeypatch.setattr(around, "answer", lambda name: asked.append(name) or tell(followed, name), raising=False)
    no_thread()
    assert followed.find()
    assert asked == [MAIN]


def test_report_of_before_a_change_that_was_answered_says_nothing_of_what_runs_now(followed, around):
    header = {"callerid": MAIN}
    tell(followed, MAIN, header=header)
    assert ask(followed, NODE).number == 4
    tell(followed, MAIN, state="FAILED", header=header)
    assert followed.reports()["f"].state == "CHANGING"
    tell(followed, MAIN, change=4, configuration="fast", header=header)
    assert (followed.reports()["f"].state, followed.reports()["f"].configuration) == ("STABLE", "fast")


def test_report_of_a_launcher_that_has_started_anew_counts_though_its_numbers_are_lower(followed, around):
    tell(followed, MAIN)
    ask(followed, NODE)
    tell(followed, MAIN, change=1, state="FAILED")
    assert followed.reports()["f"].state == "FAILED"


def test_change_that_a_launcher_refuses_is_not_waited_for(followed, around):
    tell(followed, MAIN)
    around.change = lambda: ChangeNodesResponse(ok=False, message="no", change=4)
    with pytest.raises(DeploymentError, match="no"):
        ask(followed, NODE)
    assert followed.reports()["f"].state == "STABLE"
