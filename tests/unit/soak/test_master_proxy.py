"""What stands before the master breaks connections, and refuses them where it is told to."""

import contextlib
import socket
import threading

import pytest
from helpers.ports import free_port
from helpers.waiting import DEADLINE_S, wait_for
from soak.master_proxy import Proxy


@pytest.fixture
def place(tmp_path):
    """The port of a proxy before a server that repeats what it is told, and the file that says how."""
    server = socket.create_server(("127.0.0.1", 0))

    def repeat():
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=answer, args=server.accept(), daemon=True).start()

    def answer(client, _address):
        client.sendall(client.recv(100))

    threading.Thread(target=repeat, daemon=True).start()
    port, control = free_port(), tmp_path / "control"
    threading.Thread(target=Proxy(port, server.getsockname()[1], control).serve, daemon=True).start()
    yield port, control
    server.close()


def connect(port):
    return socket.create_connection(("127.0.0.1", port), DEADLINE_S)


def refuses(port):
    try:
        connect(port).close()
    except ConnectionRefusedError:
        return True
    return False


def passes(port):
    with connect(port) as client:
        try:
            client.sendall(b"word")
            return client.recv(100) == b"word"
        except ConnectionError:
            return False


def is_broken(client):
    try:
        return client.recv(100) == b""
    except ConnectionError:
        return True


def test_it_breaks_connections_and_refuses_none(place):
    port, control = place
    wait_for(lambda: not refuses(port), "it listens")
    assert passes(port)
    with connect(port) as former:
        control.write_text("break")
        assert is_broken(former)
    for _ in range(20):
        with connect(port) as later:
            assert is_broken(later)
    control.unlink()
    wait_for(lambda: passes(port), "it passes on again")


def test_it_refuses_connections_and_breaks_the_open_ones(place):
    port, control = place
    wait_for(lambda: not refuses(port), "it listens")
    with connect(port) as former:
        control.write_text("refuse")
        assert is_broken(former)
    wait_for(lambda: refuses(port), "it refuses")
    control.unlink()
    wait_for(lambda: not refuses(port), "it listens again")
