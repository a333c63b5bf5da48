"""Loading of observers: a plug-in that does not return silences neither the monitor nor other observers."""

import threading

import pytest
import rospy
from helpers.waiting import wait_for
from rosgraph_monitor.observers.plugins import PluginError
from rosgraph_monitor.ros import observers as module
from rosgraph_monitor.ros.observers import ObserverHost

PATIENCE = 30.0  # s


class Observer:
    """An observer that waits where the test says until the test lets it go on."""

    rate_hz = 1.0

    def __init__(self, name):
        self.name, self.systems = name, []

    def configure(self, _):
        pass

    def follow(self, system):
        self.systems.append(system)


class Runner:
    """Runs nothing."""

    def __init__(self, observer, _):
        self.observer = observer

    def follow(self, system):
        self.observer.follow(system)

    def hangs_for(self):
        return 0.0

    def stop(self):
        pass


class World:
    """What a test changes, and what was logged."""

    def __init__(self):
        self.lines, self.made, self.going_on = [], {}, threading.Event()
        self.waiting = set()

    def wait(self, where):
        self.waiting.add(where)
        assert self.going_on.wait(PATIENCE)


@pytest.fixture
def world(monkeypatch):
    found = World()

    def make(name):
        if name == "Fails":
            raise PluginError("it is broken")
        if name == "Imports":
            found.wait("import")
        found.made[name] = Observer(name)
        return found.made[name]

    def get_param(name, _):
        if name == "~Asks":
            found.wait("parameters")
        return {}

    def log(text, *values):
        found.lines.append(text % values)

    monkeypatch.setattr(module.plugins, "make", make)
    monkeypatch.setattr(module, "_Runner", Runner)
    monkeypatch.setattr(module, "_PATIENCE", 0.1)
    monkeypatch.setattr(rospy, "get_param", get_param)
    monkeypatch.setattr(rospy, "Service", lambda *_: None)
    for name in ("loginfo", "logwarn", "logerr"):
        monkeypatch.setattr(rospy, name, log)
    yield found
    found.going_on.set()


@pytest.fixture
def host(world):
    return ObserverHost(None)


def aside(work):
    """Start some work in a thread; return a way to wait for its end, which tells its result."""
    found = []
    thread = threading.Thread(target=lambda: found.append(work()), daemon=True)
    thread.start()

    def result():
        thread.join(PATIENCE)
        return found[0] if found else "waits"

    return result


@pytest.mark.parametrize(("name", "where"), [("Imports", "import"), ("Asks", "parameters")])
def test_monitor_goes_on_while_a_plugin_does_not_return(world, host, name, where):
    assert host.load("Quick")
    loaded = aside(lambda: host.load(name))
    wait_for(lambda: where in world.waiting, "the plug-in waits")
    main_loop = aside(lambda: (host.follow("a system"), host.supervise()))
    wait_for(lambda: world.made["Quick"].systems == [None, "a system"], "the main loop goes on")
    assert main_loop() == (None, 1)
    world.going_on.set()
    assert loaded() is True
    assert host.supervise() == 2
    assert world.made[name].systems[-1] == "a system", "what changed meanwhile is told"


def test_second_load_of_a_name_is_refused(world, host):
    loaded = aside(lambda: host.load("Asks"))
    wait_for(lambda: world.waiting, "the plug-in waits")
    assert aside(lambda: host.load("Asks"))() is False
    assert world.lines == ["observer Asks is being loaded already"]
    world.going_on.set()
    assert loaded() is True
    assert host.load("Asks") is False
    assert world.lines[-1] == "observer Asks runs already"


def test_other_observer_is_refused_while_one_is_imported_and_loaded_afterwards(world, host):
    loaded = aside(lambda: host.load("Imports"))
    wait_for(lambda: world.waiting, "the plug-in waits")
    assert aside(lambda: host.load("Quick"))() is False
    assert world.lines == ["observer Quick is not loaded: another observer is still being loaded"]
    world.going_on.set()
    assert loaded() is True
    assert host.load("Quick") is True


def test_name_is_free_again_after_a_failure(world, host):
    assert [host.load("Fails"), host.load("Fails")] == [False, False]
    assert world.lines == ["it is broken"] * 2


def test_observer_that_can_not_start_for_a_moment_is_started_later(world, host, failing, monkeypatch):
    monkeypatch.setattr(module, "_FIRST_AGAIN", 0.01)
    left = failing(rospy, "get_param", ConnectionResetError("reset by peer"), times=2)
    host.begin(["Quick", "Fails"])
    assert "observer Quick can't start: ConnectionResetError: reset by peer" in world.lines
    wait_for(lambda: host.supervise() == 1, "it runs")
    assert not left
    assert world.lines.count("it is broken") == 1


def test_observer_without_a_thread_leaves_no_subscription(no_thread, monkeypatch):
    ended = []
    runner = object.__new__(module._Runner)
    monkeypatch.setattr(module._Runner, "_subscribe", lambda _: None)
    monkeypatch.setattr(module._Runner, "stop", lambda runner: ended.append(runner))  # noqa: PLW0108, a method
    no_thread()
    observer = Observer("Quick")
    observer.outputs = ()
    with pytest.raises(RuntimeError, match="can't start new thread"):
        runner.__init__(observer, None)
    assert ended == [runner]
