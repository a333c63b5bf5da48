"""A topic is connected to each of its publishers, once, however the lists of publishers come in."""

import contextlib
import errno
import socket
import threading
import time
from socketserver import ThreadingMixIn
from types import SimpleNamespace
from xmlrpc.server import SimpleXMLRPCServer

import pytest
import rospy.topics
from helpers.ports import QUIET_HOST
from helpers.waiting import wait_for
from node_kit.ros import shortages
from node_kit.ros.connections import connect_to_all
from rospy.impl import registration, tcpros_base
from rospy.impl.masterslave import ROSHandler
from rospy.impl.registration import Registration, RegManager
from std_msgs.msg import String

UPDATES = 8


class Api(ThreadingMixIn, SimpleXMLRPCServer):
    daemon_threads = True


class Publisher:
    """Answers to whoever asks for a topic after a while, and keeps the connections that are then made."""

    def __init__(self, stack):
        self.server = stack.enter_context(socket.create_server((QUIET_HOST, 0)))
        self.asked, self.connections = 0, []
        api = stack.enter_context(Api((QUIET_HOST, 0), logRequests=False))
        stack.callback(api.shutdown)
        api.register_function(self.request_topic, "requestTopic")
        self.uri = f"http://{QUIET_HOST}:{api.server_address[1]}/"
        threading.Thread(target=api.serve_forever, args=(0.01,), daemon=True).start()
        threading.Thread(target=self.accept, daemon=True).start()

    def request_topic(self, *_):
        self.asked += 1
        time.sleep(0.2)  # so that whoever else asks is there, too
        return 1, "", ["TCPROS", QUIET_HOST, self.server.getsockname()[1]]

    def accept(self):
        with contextlib.suppress(OSError):
            while True:
                self.connections.append(self.server.accept()[0])


def test_call_of_a_nodes_api_waits_for_a_thread(no_thread):
    served = threading.Event()
    server = SimpleNamespace(process_request_thread=lambda request, address: served.set())
    left = no_thread(times=2)
    shortages._serve_in_time(server, "request", "address")
    assert served.wait(60.0) and not left


@pytest.fixture
def publisher():
    with contextlib.ExitStack() as stack:
        yield Publisher(stack)


@pytest.fixture
def topics(monkeypatch):
    manager = rospy.topics._TopicManager()
    monkeypatch.setattr(registration, "_topic_manager", manager)
    monkeypatch.setattr(tcpros_base, "_use_tcp_keepalive", False)  # else it asks the master
    connect_to_all()
    yield manager
    manager.close_all()


def test_lists_that_come_at_once_make_one_connection(publisher, topics):
    subscriber = topics.acquire_impl(Registration.SUB, "/news", String)
    handler = ROSHandler("/listener", "http://localhost:1")
    threads = [threading.Thread(target=handler._connect_topic, args=("/news", publisher.uri)) for _ in range(UPDATES)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    wait_for(lambda: publisher.connections, "a connection")
    assert (publisher.asked, len(publisher.connections), len(subscriber.connections)) == (1, 1, 1)


def test_publisher_that_a_newer_list_has_is_not_lost_when_an_older_list_comes_last(topics):
    manager = RegManager(ROSHandler("/listener", "http://localhost:1"))
    for topic, publishers in [("/news", ["http://b"]), ("/other", ["http://c"]), ("/news", ["http://a"])]:
        manager.publisher_update(topic, publishers)
    assert manager.updates[-1] == ("/news", ["http://a", "http://b"])


@pytest.fixture
def manager(topics, monkeypatch):
    """What acts on lists of publishers."""
    manager = RegManager(ROSHandler("/listener", "http://localhost:1"))
    listeners = registration.RegistrationListeners()
    listeners.add_listener(manager)
    monkeypatch.setattr(registration, "_registration_listeners", listeners)
    monkeypatch.setattr(shortages, "ASKS_AGAIN", 0.05)
    thread = threading.Thread(target=manager.run)
    thread.start()
    yield manager
    manager.handler.done = True
    thread.join()


def is_for_connection(thread):
    return thread.name == "/news"


def is_for_request(thread):
    return getattr(thread._target, "__name__", "") == "_connect_topic_thread"


@pytest.mark.parametrize("is_meant", [is_for_request, is_for_connection])
@pytest.mark.parametrize("error", [RuntimeError("can't start new thread"), MemoryError()])
def test_publisher_is_connected_once_there_are_threads_again(publisher, topics, manager, failing, error, is_meant):
    topics.acquire_impl(Registration.SUB, "/news", String)
    left = failing(threading.Thread, "start", error, is_meant)
    manager.publisher_update("/news", [publisher.uri])
    wait_for(lambda: publisher.connections, "a connection")
    assert not left


@pytest.mark.parametrize("number", [errno.EMFILE, errno.ENOBUFS, errno.EHOSTUNREACH])
def test_publisher_is_connected_once_it_can_be_reached_again(publisher, topics, manager, failing, monkeypatch, number):
    topics.acquire_impl(Registration.SUB, "/news", String)
    sockets = SimpleNamespace(**vars(socket))
    monkeypatch.setattr(tcpros_base, "socket", sockets)
    left = failing(sockets, "socket", OSError(number, ""), times=2)
    manager.publisher_update("/news", [publisher.uri])
    wait_for(lambda: publisher.connections, "a connection")
    assert not left
