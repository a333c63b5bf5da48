"""A node greets clients although no descriptor or thread was left for one of them."""

import errno
import socket
import struct
import threading

import pytest
from helpers.waiting import DEADLINE_S, wait_for
from node_kit.ros.handshakes import greet_apart
from rospy.impl import tcpros_base

HEADER = b"service=/greeting"
GREETING = b"welcome"


@pytest.fixture
def server(monkeypatch):
    server = tcpros_base.TCPROSServer()
    server.service_connection_handler = lambda client, *_: client.sendall(GREETING)
    server.start_server()
    monkeypatch.setattr(tcpros_base, "_tcpros_server", server)
    greet_apart()
    yield server.tcp_ros_server
    server.shutdown()


def greeting_of(server):
    with socket.create_connection(("localhost", server.port), DEADLINE_S) as client:
        client.sendall(struct.pack("<II", len(HEADER) + 4, len(HEADER)) + HEADER)
        return client.recv(len(GREETING))


@pytest.mark.parametrize("number", [errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.EHOSTUNREACH])
def test_clients_are_greeted_once_there_are_descriptors_again(server, failing, number):
    port = server.server_sock._server.getsockname()
    left = failing(socket.socket, "accept", OSError(number, ""), lambda own: own.getsockname() == port)
    assert greeting_of(server) == GREETING  # the thread that accepts had got a descriptor for this one
    wait_for(lambda: not left, "no descriptor is left")
    assert greeting_of(server) == GREETING


@pytest.mark.parametrize("error", [RuntimeError("can't start new thread"), MemoryError()])
def test_client_is_greeted_once_there_are_threads_again(server, failing, error):
    left = failing(threading.Thread, "start", error, lambda thread: thread.name == "greeting")
    assert greeting_of(server) == GREETING
    assert not left


def test_who_accepts_ends_with_the_server(server):
    server.shutdown()
    with pytest.raises(OSError, match="Bad file descriptor"):
        server.server_sock.accept()
