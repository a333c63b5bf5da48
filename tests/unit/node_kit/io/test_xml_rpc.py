"""Calls with a deadline, to servers that answer well, badly, late or not at all."""

import contextlib
import socket
import threading
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest
from helpers.ports import QUIET_HOST
from node_kit.io.xml_rpc import CallError, Client, DeniedError, GarbageError, GoneError, SilentError


class KeepingHandler(SimpleXMLRPCRequestHandler):
    """Keeps the connection for the next call."""

    protocol_version = "HTTP/1.1"


@contextlib.contextmanager
def server(handler=SimpleXMLRPCRequestHandler, **methods):
    made = SimpleXMLRPCServer((QUIET_HOST, 0), requestHandler=handler, logRequests=False, allow_none=True)
    for name, function in methods.items():
        made.register_function(function, name)
    made.register_multicall_functions()
    thread = threading.Thread(target=made.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    try:
        yield f"http://{QUIET_HOST}:{made.server_address[1]}"
    finally:
        made.shutdown()
        made.server_close()


def sized(caller, number):
    return [1, "", number] if number < 10 else [-1, f"{number} is too great for {caller}", 0]


@pytest.fixture
def silent():
    """The address of a server that takes connections and says nothing."""
    with socket.create_server((QUIET_HOST, 0)) as listening:
        yield f"http://{QUIET_HOST}:{listening.getsockname()[1]}"


def test_value_of_a_call():
    with server(size=sized) as uri, Client(uri, "/me") as client:
        assert client.call("size", 3) == 3
        assert client.call("size", 4) == 4


def test_refusal_is_told_with_its_text():
    with server(size=sized) as uri, Client(uri, "/me", peer="node /a at") as client:
        with pytest.raises(DeniedError, match=rf"^node /a at {uri} refuses size: 12 is too great for /me$") as refused:
            client.call("size", 12)
        assert refused.value.reason == "12 is too great for /me"


def test_many_calls_in_one_request():
    with server(size=sized) as uri, Client(uri, "/me") as client:
        answers = client.call_all([("size", 1), ("size", 12), ("nothing",), ("size", 2)])
        assert answers == [(True, 1), (False, None), (False, None), (True, 2)]
        assert client.call_all([]) == []


@pytest.mark.parametrize("answer", [5, "x", None, [], [1, ""], ["1", "", 0], {"code": 1}])
def test_answer_that_is_none_is_garbage(answer):
    with server(size=lambda _: answer) as uri, Client(uri, "/me") as client:
        with pytest.raises(GarbageError, match=f"{uri}.* size"):
            client.call("size")
        assert client.call_all([("size",)]) == [(False, None)]


def test_process_id_is_a_number():
    with server(getPid=lambda _: [1, "", 17]) as uri, Client(uri, "/me") as client:
        assert client.pid() == 17


@pytest.mark.parametrize("told", [float("inf"), float("nan"), "x", None, [], {}])
def test_process_id_that_is_no_number_is_garbage(told):
    with server(getPid=lambda _: [1, "", told]) as uri, Client(uri, "/me") as client:  # noqa: SIM117
        with pytest.raises(GarbageError, match=f"{uri}: its process id is"):
            client.pid()


def test_method_that_there_is_not_is_garbage():
    with server() as uri, Client(uri, "/me") as client, pytest.raises(GarbageError, match="size is garbage"):
        client.call("size")


@pytest.mark.parametrize("text", [b"no HTTP at all\r\n\r\n", b"HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\n<meth"])
def test_what_is_no_xml_rpc_is_refused(text):
    with socket.create_server((QUIET_HOST, 0)) as listening:

        def say():
            for _ in range(2):  # a call may be tried again
                with contextlib.suppress(OSError):
                    connection, _ = listening.accept()
                    with connection:
                        connection.recv(4096)
                        connection.sendall(text)

        thread = threading.Thread(target=say, daemon=True)
        thread.start()
        uri = f"http://{QUIET_HOST}:{listening.getsockname()[1]}"
        with Client(uri, "/me") as client, pytest.raises((GarbageError, SilentError), match=uri):
            client.call("size")


def test_nobody_at_the_address():
    with socket.socket() as free:
        free.bind((QUIET_HOST, 0))
        uri = f"http://{QUIET_HOST}:{free.getsockname()[1]}"
        with Client(uri, "/me") as client, pytest.raises(GoneError, match=f"^no ROS master answers at {uri}"):
            client.call("size")


def test_host_that_has_no_address_is_not_taken_for_gone():
    with Client("http://no-such-host.invalid:11311", "/me") as client, pytest.raises(SilentError):
        client.call("size")


def test_silence_ends_at_the_deadline_of_the_client_or_the_call(silent):
    with Client(silent, "/me", timeout=0.05) as client, pytest.raises(SilentError, match="not answer size: timed out"):
        client.call("size")
    with Client(silent, "/me", timeout=3600.0) as client, pytest.raises(SilentError) as ended:
        client.call("size", timeout=0.05)
    assert ended.value.reason == "timed out"
    with Client(silent, "/me", timeout=0.05) as client, pytest.raises(SilentError):
        client.call_all([("size", 1)])


def test_connection_is_kept_and_opened_again_when_the_server_has_closed_it():
    ports = set()

    class Handler(KeepingHandler):
        def do_POST(self):
            ports.add(self.client_address[1])
            super().do_POST()

    with server(Handler, size=sized) as uri:
        client = Client(uri, "/me")
        assert [client.call("size", n) for n in range(3)] == [0, 1, 2]
        assert len(ports) == 1
        address = uri.rpartition(":")[2]
        client._transport._connection[1].sock.shutdown(socket.SHUT_RDWR)  # as a server does that is tired of it
        assert client.call("size", 3) == 3
        assert len(ports) == 2, address
        client.close()


def test_call_after_a_failure_finds_the_server_again():
    slow = threading.Event()

    def size(_caller):
        slow.wait(30.0)
        return [1, "", 1]

    with server(size=size) as uri, Client(uri, "/me") as client:
        with pytest.raises(SilentError):
            client.call("size", timeout=0.05)
        slow.set()
        assert client.call("size", timeout=30.0) == 1


def test_same_answer_is_the_same_object_where_that_is_asked_for():
    with server(tree=lambda _: [1, "", {"a": [1, 2]}]) as uri:
        with Client(uri, "/me", kept_answers=2) as client:
            assert client.call("tree") is client.call("tree")
        with Client(uri, "/me") as client:
            assert client.call("tree") is not client.call("tree")


@pytest.mark.parametrize("uri", ["localhost:11311", "", "ftp://localhost"])
def test_what_is_no_address(uri):
    with pytest.raises(CallError, match=r"^ROS master address .*: set ROS_MASTER_URI$"):
        Client(uri, "/me")
    with pytest.raises(CallError, match=r"^node address ") as refused:
        Client(uri, "/me", peer="node")
    assert "ROS_MASTER_URI" not in str(refused.value)


def test_large_answer_that_comes_by_drops_ends_at_the_deadline():
    ended = threading.Event()
    with socket.create_server((QUIET_HOST, 0)) as listening:

        def drip():
            connection, _ = listening.accept()
            with connection, contextlib.suppress(OSError):
                connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\n")
                while not ended.wait(0.01):
                    connection.sendall(b" ")

        thread = threading.Thread(target=drip, daemon=True)
        thread.start()
        with Client(f"http://{QUIET_HOST}:{listening.getsockname()[1]}", "/me") as client, pytest.raises(SilentError):
            client.call("size", timeout=0.2)
        ended.set()
        thread.join()
