"""What nodes tell when they are asked, well or badly; and the command `rosmodel snapshot` without a master."""

from __future__ import annotations

import os
import socket
import struct
import threading
import time
from contextlib import contextmanager, suppress
from io import BytesIO
from xmlrpc.server import SimpleXMLRPCServer

import pytest
import rosgraph.network
from helpers.ports import QUIET_HOST, reserved_port
from ros_model.cli.rosmodel import main
from ros_model.graph.snapshot import GraphSnapshot, NodeState, ServiceState
from ros_model_extraction.io import live_nodes
from ros_model_extraction.io.live_nodes import ask_nodes, executable_of

PATIENCE_S = 20.0
IMPATIENCE_S = 0.5


@contextmanager
def xmlrpc_server(**methods):
    """Serves methods over XML-RPC; gives the address."""
    with SimpleXMLRPCServer((QUIET_HOST, 0), logRequests=False) as server:
        server.register_multicall_functions()
        for name, method in methods.items():
            server.register_function(method, name)
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
        thread.start()
        try:
            yield f"http://{QUIET_HOST}:{server.server_address[1]}"
        finally:
            server.shutdown()
            thread.join()


@contextmanager
def tcp_server(answer):
    """Answers each connection by a function of the socket; gives the port."""
    with socket.create_server((QUIET_HOST, 0)) as server:

        def serve():
            while True:
                try:
                    connection, _ = server.accept()
                except OSError:
                    return
                with connection:
                    answer(connection)

        threading.Thread(target=serve, daemon=True).start()
        try:
            yield server.getsockname()[1]
        finally:
            server.shutdown(socket.SHUT_RDWR)


def header(connection: socket.socket) -> None:
    asked = rosgraph.network.read_ros_handshake_header(connection, BytesIO(), 4096)
    assert asked["probe"] == "1"
    rosgraph.network.write_ros_handshake_header(connection, {"type": f"std_srvs/{asked['service'][1:]}"})


def graph(uri: str, *services: str) -> GraphSnapshot:
    return GraphSnapshot(
        nodes={"/a": NodeState("/a", uri)}, services={name: ServiceState(name, ("/a",)) for name in services}
    )


def test_type_of_a_service_is_asked_of_its_node():
    with tcp_server(header) as port:
        address = [1, "", f"rosrpc://{QUIET_HOST}:{port}"]
        with xmlrpc_server(lookupService=lambda _caller, _name: address, getPid=lambda _: [1, "", 1]) as master:
            found = ask_nodes(graph(master, "/Empty", "/Trigger"), master, PATIENCE_S)
    assert found.service_types == {"/Empty": "std_srvs/Empty", "/Trigger": "std_srvs/Trigger"}


def silent(connection: socket.socket) -> None:
    connection.settimeout(PATIENCE_S)
    while connection.recv(4096):  # until the other side has had enough
        pass


def garbage(connection: socket.socket) -> None:
    connection.sendall(b"\xff" * 64)


def closing(connection: socket.socket) -> None:
    connection.recv(4096)


@pytest.mark.parametrize("answer", [silent, garbage, closing])
def test_service_that_does_not_answer_well_has_no_type(answer):
    with tcp_server(answer) as port:
        address = [1, "", f"rosrpc://{QUIET_HOST}:{port}"]
        with xmlrpc_server(lookupService=lambda _caller, _name: address, getPid=lambda _: [1, "", 1]) as master:
            assert ask_nodes(graph(master, "/Empty"), master, IMPATIENCE_S).service_types == {}


@pytest.mark.parametrize("address", ["rosrpc://localhost", "rosrpc://localhost:x", "nonsense", ""])
def test_address_of_a_service_that_is_none_gives_no_type(address):
    with xmlrpc_server(lookupService=lambda _caller, _name: [1, "", address], getPid=lambda _: [1, "", 1]) as master:
        assert ask_nodes(graph(master, "/Empty"), master, PATIENCE_S).service_types == {}


def test_node_that_runs_no_program_of_a_package_is_told():
    with xmlrpc_server(getPid=lambda _: [1, "", os.getpid()]) as node:
        found = ask_nodes(graph(node), node, PATIENCE_S)
    assert found.origins == {} and "is in no ROS package" in found.unknown["/a"]


@pytest.mark.parametrize("answer", [[1, "", "x"], [1], "nonsense", {}])
def test_node_that_answers_garbage_is_told(answer):
    with xmlrpc_server(getPid=lambda _: answer) as node:
        assert ask_nodes(graph(node), node, PATIENCE_S).unknown == {"/a": "it does not answer"}


def test_node_that_hangs_is_not_waited_for():
    with tcp_server(silent) as port:
        uri = f"http://{QUIET_HOST}:{port}"
        assert ask_nodes(graph(uri), uri, IMPATIENCE_S).unknown == {"/a": "it does not answer"}


def test_node_at_whose_address_nobody_listens_is_dead():
    with reserved_port() as port:
        uri = f"http://{QUIET_HOST}:{port}"
        found = ask_nodes(graph(uri), uri, PATIENCE_S)
    assert found.dead == {"/a"} and found.unknown == {}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--master", "http://localhost:1"), "http://localhost:1 can't be reached: start the system, or set --master"),
        *(
            (("--master", uri), f"{uri!r} is no address of a ROS master: give one like http://localhost:11311")
            for uri in ("foo", "localhost:11311", "https://localhost:1", "http://", "http://a:99999", "http://a:b")
        ),
    ],
)
def test_command_without_a_master_ends_with_one_line(arguments, said, tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["snapshot", "-o", str(tmp_path), *arguments])
    error = capsys.readouterr().err
    assert ended.value.code == 2 and said in error and len(error.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("timeout", ["nan", "inf", "-1", "0", "soon"])
def test_patience_must_be_a_finite_time(timeout, tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["snapshot", "-o", str(tmp_path), "--master", "http://localhost:1", "--timeout", timeout])
    assert ended.value.code == 2
    assert "Invalid value for '--timeout'" in capsys.readouterr().err


def dripping(connection: socket.socket) -> None:
    connection.recv(4096)
    with suppress(OSError):
        connection.sendall(struct.pack("<I", 60_000))
        while True:  # until the other side has had enough
            connection.sendall(b"x")
            time.sleep(IMPATIENCE_S / 10)


def huge(connection: socket.socket) -> None:
    connection.recv(4096)
    with suppress(OSError):
        connection.sendall(struct.pack("<I", 2**31))
        while connection.recv(4096):
            pass


@pytest.mark.parametrize("answer", [dripping, huge])
def test_service_whose_answer_does_not_end_has_no_type(answer):
    found = []
    with tcp_server(answer) as port:
        address = [1, "", f"rosrpc://{QUIET_HOST}:{port}"]
        with xmlrpc_server(lookupService=lambda _caller, _name: address, getPid=lambda _: [1, "", 1]) as master:
            patience = IMPATIENCE_S if answer is dripping else 10 * PATIENCE_S
            asked = lambda: found.append(ask_nodes(graph(master, "/Empty"), master, patience))  # noqa: E731
            thread = threading.Thread(target=asked, daemon=True)
            thread.start()
            thread.join(PATIENCE_S)
    assert [one.service_types for one in found] == [{}]


def test_program_that_is_a_long_text_is_of_no_package(tmp_path):
    arguments = ["/usr/bin/python3", "-c", "import time\n" + "# long\n" * 2000]
    assert executable_of(arguments, tmp_path, ["p"]) is None


def test_program_below_a_package_that_can_not_be_read_is_of_no_package(tmp_path):
    (tmp_path / "package.xml").write_text("<package")
    (tmp_path / "program").write_text("")
    assert executable_of([str(tmp_path / "program")], tmp_path, []) is None


def test_node_that_can_not_be_looked_at_does_not_hinder_the_others(monkeypatch):
    def origin(*_):
        raise RuntimeError("no way")

    monkeypatch.setattr(live_nodes, "_origin", origin)
    with xmlrpc_server(getPid=lambda _: [1, "", os.getpid()]) as node:
        found = ask_nodes(graph(node), node, PATIENCE_S)
    assert found.unknown == {"/a": f"its process {os.getpid()} can't be looked at (RuntimeError: no way)"}
