"""The watcher over real sockets of this process."""

import contextlib
import socket
import threading
import time
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest
from helpers.ports import QUIET_HOST
from helpers.waiting import DEADLINE_S, wait_for
from rosgraph_monitor.health.liveness import Life, Timing
from rosgraph_monitor.io.node_connections import NodeConnections, _answer

TIMING = Timing(probe_period=0.05, probe_deadline=150.0, connect_deadline=150.0, retry_period=0.05)
HASTY = Timing(probe_period=0.05, probe_deadline=1.0, connect_deadline=1.0, retry_period=0.05)


class KeepAlive(SimpleXMLRPCRequestHandler):
    protocol_version = "HTTP/1.1"


class CloseAfterAnswer(SimpleXMLRPCRequestHandler):
    protocol_version = "HTTP/1.0"


@contextlib.contextmanager
def black_hole():
    """An address at which no attempt to connect ever ends, as behind a router that drops what it gets."""
    with socket.create_server((QUIET_HOST, 0), backlog=0) as server, contextlib.ExitStack() as stack:
        for _ in range(8):  # more than its queue holds: from then on the kernel answers nobody
            filler = stack.enter_context(socket.socket())
            filler.setblocking(False)
            filler.connect_ex(server.getsockname())
        yield f"http://{QUIET_HOST}:{server.getsockname()[1]}/"


@contextlib.contextmanager
def node(handler=KeepAlive, pid=4711):
    server = SimpleXMLRPCServer((QUIET_HOST, 0), requestHandler=handler, logRequests=False)
    server.register_function(lambda _caller: [1, "", pid], "getPid")
    server.timeout = 0.02
    ended = threading.Event()
    connections = []
    accept = server.get_request

    def get_request():
        connections.append(accept())
        # One connection is served in this thread for as long as it lasts: let it end with the server.
        connections[-1][0].settimeout(0.5)
        return connections[-1]

    server.get_request = get_request

    def serve():
        while not ended.is_set():
            server.handle_request()

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()

    def end():
        ended.set()
        server.socket.close()
        for connection, _ in connections:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
        thread.join()

    try:
        yield f"http://{QUIET_HOST}:{server.server_address[1]}/", end
    finally:
        if not ended.is_set():
            end()


@pytest.fixture
def watcher(request):
    changed = threading.Event()
    watcher = NodeConnections(changed.set, getattr(request, "param", TIMING))
    watcher.changed = changed
    watcher.start()
    yield watcher
    watcher.close()


def known(watcher):
    return lambda: f"what is known of the nodes; that is {watcher.lives()}"


hasty = pytest.mark.parametrize("watcher", [HASTY], indirect=True)


@pytest.mark.parametrize("handler", [KeepAlive, CloseAfterAnswer])
def test_live_node_is_alive_with_its_pid(watcher, handler):
    with node(handler) as (uri, _end):
        watcher.watch({"/n": uri})
        wait_for(
            lambda: watcher.lives() == {("/n", uri): Life.ALIVE},
            known(watcher),
        )
        assert watcher.pids() == {("/n", uri): 4711}
        end = time.monotonic() + 0.4
        while time.monotonic() < end:
            assert watcher.lives()[("/n", uri)] is Life.ALIVE
            time.sleep(0.01)


def test_death_is_told_at_once(watcher):
    with node() as (uri, end):
        watcher.watch({"/n": uri})
        wait_for(
            lambda: watcher.lives().get(("/n", uri)) is Life.ALIVE,
            known(watcher),
        )
        watcher.changed.clear()
        end()
        assert watcher.changed.wait(DEADLINE_S)
        wait_for(lambda: watcher.lives()[("/n", uri)] is Life.DEAD, known(watcher))


@pytest.mark.parametrize("odd", ["http://[", "http://odd:port/", "http://odd:99999999/", "", "http://\udcff:1/"])
def test_node_that_registered_a_senseless_address_ends_no_watch(watcher, odd):
    with node() as (uri, _end):
        watcher.watch({"/odd": odd})
        wait_for(lambda: watcher.lives().get(("/odd", odd)) is Life.UNREACHABLE, known(watcher))
        watcher.watch({"/odd": odd, "/n": uri})
        wait_for(lambda: watcher.lives().get(("/n", uri)) is Life.ALIVE, known(watcher))


def test_host_that_could_not_be_looked_up_for_want_of_a_thread_is_looked_up_later(watcher, monkeypatch):
    begin, refused = threading.Thread.start, []

    def start(thread):
        if thread.name.startswith("resolve") and not refused:
            refused.append(thread)
            raise RuntimeError("can't start new thread")
        begin(thread)

    monkeypatch.setattr(threading.Thread, "start", start)
    with node() as (uri, _end):
        watcher.watch({"/n": uri})
        wait_for(lambda: watcher.lives().get(("/n", uri)) is Life.ALIVE, known(watcher))
    assert refused


ANSWER = b"<methodResponse><value><int>1</int></value><value></value><value><int>4711</int></value></methodResponse>"
CHUNKS = b"Transfer-Encoding: chunked\r\n\r\n%X;a=b\r\n%b\r\n%x\r\n%b\r\n" % (
    20,
    ANSWER[:20],
    len(ANSWER) - 20,
    ANSWER[20:],
)
FORMS = {
    "told length": b"Content-Length: %d\r\n\r\n%b" % (len(ANSWER), ANSWER),
    "chunks": CHUNKS + b"0\r\n\r\n",
    "chunks with a trailer": CHUNKS + b"0\r\nChecked: yes\r\n\r\n",
    "until it closes": b"Content-Type: text/xml\r\n\r\n" + ANSWER,
}


@contextlib.contextmanager
def raw_node(answer, closes=False, host=QUIET_HOST, port=0):
    """A node that gives these bytes for each request, on a connection that it keeps or closes; tells its address."""
    with socket.create_server((host, port)) as server, contextlib.ExitStack() as stack:
        connections = []
        stack.callback(lambda: [c.shutdown(socket.SHUT_RDWR) for c in connections if c.fileno() >= 0])
        stack.callback(server.shutdown, socket.SHUT_RDWR)

        def talk(connection):
            with connection, contextlib.suppress(OSError):
                while connection.recv(65536):
                    for at in range(0, len(answer), 7):  # it comes in pieces
                        connection.sendall(answer[at : at + 7])
                    if closes:
                        return

        def serve():
            with contextlib.suppress(OSError):
                while True:
                    connections.append(server.accept()[0])
                    threading.Thread(target=talk, args=(connections[-1],), daemon=True).start()

        threading.Thread(target=serve, daemon=True).start()
        yield server.getsockname()[1]


@pytest.mark.parametrize("form", FORMS)
def test_answer_may_have_any_form_of_http(watcher, form):
    with raw_node(b"HTTP/1.1 200 OK\r\n" + FORMS[form], closes=form == "until it closes") as port:
        uri = f"http://{QUIET_HOST}:{port}/"
        watcher.watch({"/n": uri})
        wait_for(lambda: watcher.pids() == {("/n", uri): 4711}, known(watcher))


@pytest.mark.parametrize("form", FORMS)
def test_answer_counts_only_when_it_is_whole(form):
    whole = bytearray(b"HTTP/1.1 200 OK\r\n" + FORMS[form])
    until_closed = form == "until it closes"
    assert _answer(whole, is_closed=until_closed) == ANSWER
    assert not any(_answer(whole[:end], is_closed=False) for end in range(len(whole)))
    assert until_closed or not any(_answer(whole[:end], is_closed=True) for end in range(len(whole)))


@pytest.mark.parametrize("body", [b"-5\r\nabc\r\n0\r\n\r\n", b"zz\r\n", b"\r\n\r\n", b"1_0\r\nabc"])
def test_chunks_that_are_none_are_no_answer(body):
    assert _answer(bytearray(b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n" + body), is_closed=True) is None


def test_host_that_gets_another_address_is_found_there(watcher, monkeypatch):
    look_up, address = socket.getaddrinfo, ["127.0.0.2"]
    monkeypatch.setattr(socket, "getaddrinfo", lambda host, *more, **options: look_up(address[0], *more, **options))
    answer = b"HTTP/1.1 200 OK\r\n" + FORMS["told length"]
    with raw_node(answer, host="127.0.0.2") as port:
        uri = f"http://arm-pc:{port}/"
        watcher.watch({"/arm": uri})
        wait_for(lambda: watcher.lives().get(("/arm", uri)) is Life.ALIVE, known(watcher))
    wait_for(lambda: watcher.lives()[("/arm", uri)] is not Life.ALIVE, known(watcher))
    address[0] = "127.0.0.3"
    with raw_node(answer, host="127.0.0.3", port=port):
        wait_for(lambda: watcher.lives()[("/arm", uri)] is Life.ALIVE, known(watcher))


def test_known_address_stays_in_use_while_names_are_not_looked_up(watcher, monkeypatch):
    look_up, works = socket.getaddrinfo, [True]

    def getaddrinfo(_host, *more, **options):
        if not works[0]:
            raise socket.gaierror("no name server")
        return look_up(QUIET_HOST, *more, **options)

    monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)
    answer = b"HTTP/1.1 200 OK\r\n" + FORMS["told length"]
    with raw_node(answer) as port:
        uri = f"http://arm-pc:{port}/"
        watcher.watch({"/arm": uri})
        wait_for(lambda: watcher.lives().get(("/arm", uri)) is Life.ALIVE, known(watcher))
        works[0] = False
    wait_for(lambda: watcher.lives()[("/arm", uri)] is Life.DEAD, known(watcher))
    with raw_node(answer, port=port):
        wait_for(lambda: watcher.lives()[("/arm", uri)] is Life.ALIVE, known(watcher))


@pytest.mark.parametrize("watcher", [Timing(probe_deadline=1e9), Timing(probe_deadline=1e300)], indirect=True)
def test_deadline_may_be_longer_than_sockets_take(watcher):
    with node() as (uri, _end):
        watcher.watch({"/n": uri})
        wait_for(lambda: watcher.lives().get(("/n", uri)) is Life.ALIVE, known(watcher))


@hasty
def test_silent_node_is_hung_until_it_answers(watcher):
    with socket.create_server((QUIET_HOST, 0)) as silent:
        hung = f"http://{QUIET_HOST}:{silent.getsockname()[1]}/"
        watcher.watch({"/hung": hung})
        wait_for(
            lambda: watcher.lives().get(("/hung", hung)) is Life.HUNG,
            known(watcher),
        )
        connection, _ = silent.accept()
        with connection:
            connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\nok")
            wait_for(
                lambda: watcher.lives()[("/hung", hung)] is Life.ALIVE,
                known(watcher),
            )


def test_nodes_that_hang_or_cannot_be_reached_delay_no_other(watcher):
    with socket.create_server((QUIET_HOST, 0)) as silent, node() as (uri, end), black_hole() as hole:
        bad = {f"/unroutable_{i}": hole for i in range(40)}
        bad |= {
            "/hung": f"http://{QUIET_HOST}:{silent.getsockname()[1]}/",
            "/odd": "nonsense",
            "/port": "http://h:99999/",
        }
        watcher.watch(bad | {"/n": uri})
        wait_for(
            lambda: watcher.lives().get(("/n", uri)) is Life.ALIVE,
            known(watcher),
        )
        end()
        wait_for(lambda: watcher.lives()[("/n", uri)] is Life.DEAD, known(watcher))
        # All this while the others were still waited for.
        assert watcher.lives()[("/unroutable_0", hole)] is Life.UNKNOWN
        assert watcher.lives()[("/hung", bad["/hung"])] is Life.UNKNOWN
        assert watcher.lives()[("/odd", "nonsense")] is Life.UNREACHABLE


@hasty
def test_unroutable_address_is_unreachable(watcher):
    with black_hole() as hole:
        watcher.watch({"/n": hole})
        wait_for(
            lambda: list(watcher.lives().values()) == [Life.UNREACHABLE],
            known(watcher),
        )


@hasty
def test_name_without_address_is_unreachable(watcher):
    watcher.watch({"/n": "http://no-such-host.invalid:1234/"})
    wait_for(
        lambda: list(watcher.lives().values()) == [Life.UNREACHABLE],
        known(watcher),
    )


def test_node_that_is_not_watched_any_more_is_forgotten(watcher):
    with node() as (uri, _end):
        watcher.watch({"/n": uri})
        wait_for(
            lambda: watcher.lives().get(("/n", uri)) is Life.ALIVE,
            known(watcher),
        )
        watcher.watch({})
        wait_for(lambda: watcher.lives() == {}, known(watcher))


def test_error_that_nobody_foresaw_costs_no_other_node(caplog):
    told = threading.Semaphore(0)

    def change():
        told.release()
        if not failed:
            failed.append(True)
            raise RuntimeError("unforeseen")

    failed = []
    watcher = NodeConnections(change, TIMING)
    with node() as (one, _), node() as (other, _):
        watcher.start()
        try:
            keys = {"/one": one, "/other": other}
            watcher.watch(keys)
            wait_for(lambda: set(watcher.pids()) == set(keys.items()), "both are known to live")
        finally:
            watcher.close()
    assert failed and "is asked anew" in caplog.text
