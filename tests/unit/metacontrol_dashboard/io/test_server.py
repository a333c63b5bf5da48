"""The server: who may do what, what viewers get, and that a slow one delays nobody."""

import asyncio
import json
import threading
from contextlib import asynccontextmanager
from functools import partial

import pytest
from aiohttp.test_utils import TestClient, TestServer
from metacontrol_dashboard.io.server import Access, Content, Run, is_loopback, make_app
from metacontrol_dashboard.state.store import Store

FILES = {"index.html": ("text/html", b"<p>page</p>"), "main.js": ("text/javascript", b"1")}
DEADLINE_S = 30
ALL = "0.0.0.0"  # noqa: S104 no server listens there
SECRET = "a word"  # noqa: S105 not one of a real server


class Asked:
    """What operators have asked for."""

    def __init__(self):
        self.requests = []

    async def act(self, request):
        self.requests.append(request)
        return {"ok": True, "message": "done"}


@asynccontextmanager
async def served(access=None, content=None):
    asked = Asked()
    content = content or Content(FILES, Store(), threading.Lock(), asked.act)
    async with TestClient(TestServer(make_app(content, access or Access("localhost")))) as client:
        client.asked, client.store = asked, content.store
        yield client


def run(test):
    return asyncio.run(asyncio.wait_for(test(), DEADLINE_S))


async def message(socket):
    return json.loads(await socket.receive_str(timeout=DEADLINE_S))


def origin_of(client):
    return f"http://{client.host}:{client.port}"


def test_viewer_gets_the_state_and_then_changes():
    async def test():
        async with served() as client:
            client.store.set("node", "/sonar", {"state": "ok"})
            socket = await client.ws_connect("/live")
            assert await message(socket) == {"hello": {"control": "yes"}}
            whole = await message(socket)
            assert (whole["whole"], whole["set"]) == (True, {"node": {"/sonar": {"state": "ok"}}})
            client.store.set("node", "/sonar", {"state": "hung"})
            assert (await message(socket))["set"] == {"node": {"/sonar": {"state": "hung"}}}

    run(test)


def test_viewer_that_does_not_read_delays_no_other_and_skips_what_is_between():
    async def test():
        async with served() as client:
            slow = await client.ws_connect("/live")
            quick = await client.ws_connect("/live")
            await message(quick)
            big = "x" * 200_000
            for number in range(60):  # more than the buffers of a connection hold
                client.store.set("a", "x", f"{number}{big}")
                change = await message(quick)
                assert change["set"]["a"]["x"].startswith(str(number))
            await message(slow)
            seen = 0
            while True:
                value = (await message(slow))["set"]["a"]["x"]
                seen += 1
                if value == f"59{big}":
                    break
            assert seen < 60

    run(test)


def test_twenty_viewers_all_get_the_same():
    async def test():
        async with served() as client:
            sockets = [await client.ws_connect("/live") for _ in range(20)]
            for socket in sockets:
                await message(socket)
            client.store.set("a", "x", 1)
            assert {json.dumps((await message(socket))["set"]) for socket in sockets} == {'{"a": {"x": 1}}'}

    run(test)


def test_viewers_are_sent_away_at_the_end():
    async def test():
        async with served() as client:
            socket = await client.ws_connect("/live")
            await message(socket)
            await client.server.close()
            assert (await socket.receive(timeout=DEADLINE_S)).data == 1001

    run(test)


@pytest.mark.parametrize(
    ("access", "token", "may"),
    [
        (Access("localhost"), "", True),
        (Access("127.0.0.1", token=SECRET), "", False),
        (Access("127.0.0.1", token=SECRET), SECRET, True),
        (Access("localhost", control=False), "", False),
        (Access(ALL), "", False),
        (Access(ALL), "anything", False),
        (Access(ALL, token=SECRET), "guess", False),
        (Access(ALL, token=SECRET), "sécret", False),
        (Access(ALL, token=SECRET), SECRET, True),
        (Access(ALL, token=SECRET, control=False), SECRET, False),
    ],
)
def test_who_may_control(access, token, may):
    async def test():
        async with served(access) as client:
            headers = {"X-Token": token.encode("ascii", "replace").decode()} if token else {}
            answer = await client.post("/api/act", json={"action": "pause"}, headers=headers)
            assert (answer.status, bool(client.asked.requests)) == ((200, True) if may else (403, False))

    run(test)
    assert access.may_control(token) is may


def test_everybody_may_ask_what_would_be_done():
    async def test():
        async with served(Access(ALL)) as client:
            answer = await client.post("/api/act", json={"action": "suppose", "failed": ["rudder"]})
            assert answer.status == 200
            assert client.asked.requests[0].failed == ("rudder",)

    run(test)


@pytest.mark.parametrize("path", ["/live", "/api/act", "/", "/api/runs"])
def test_page_of_somebody_else_gets_nothing(path):
    async def test():
        async with served() as client:
            headers = {"Origin": "http://evil.example"}
            method = "POST" if "act" in path else "GET"
            answer = await client.request(method, path, json={"action": "pause"}, headers=headers)
            assert answer.status == 403
            assert not client.asked.requests

    run(test)


def test_own_page_is_no_stranger():
    async def test():
        async with served() as client:
            answer = await client.post("/api/act", json={"action": "pause"}, headers={"Origin": origin_of(client)})
            assert answer.status == 200

    run(test)


def test_name_that_somebody_has_bound_to_this_computer_is_refused():
    async def test():
        async with served() as client:
            assert (await client.get("/", headers={"Host": "evil.example"})).status == 403
            assert (await client.get("/", headers={"Host": f"localhost:{client.port}"})).status == 200

    run(test)


def test_form_of_another_page_can_not_ask():
    async def test():
        async with served() as client:
            answer = await client.post("/api/act", data='{"action": "pause"}', headers={"Content-Type": "text/plain"})
            assert (answer.status, client.asked.requests) == (415, [])

    run(test)


@pytest.mark.parametrize("body", ["{", "[]", '{"action": "explode"}', '{"action": "set_limit"}'])
def test_nonsense_is_refused(body):
    async def test():
        async with served() as client:
            answer = await client.post("/api/act", data=body, headers={"Content-Type": "application/json"})
            assert (answer.status, client.asked.requests) == (400, [])

    run(test)


@pytest.mark.parametrize(
    ("headers", "body"),
    [
        ({"Host": "["}, "{}"),
        ({"Origin": "http://["}, "{}"),
        ({}, "[" * 90_000),
        ({}, b'"\xff"'),
        ({"Content-Type": "application/json; charset=foo"}, "{}"),
    ],
)
def test_request_that_can_not_be_read_is_refused_in_one_line(headers, body):
    async def test():
        async with served() as client:
            headers_of_json = {"Content-Type": "application/json"} | headers
            answer = await client.post("/api/act", data=body, headers=headers_of_json)
            assert (answer.status, client.asked.requests) == (400, [])
            assert (await answer.text()).count("\n") == 1
            assert "Content-Security-Policy" in answer.headers

    run(test)


@pytest.mark.parametrize(
    "path", ["/../../etc/passwd", "/..%2f..%2fetc%2fpasswd", "/etc/passwd", "/server.py", "/%00", "/main.js/"]
)
def test_no_other_file_is_served(path):
    async def test():
        async with served() as client:
            assert (await client.get(path)).status == 404

    run(test)


def test_page_is_served_with_headers_of_safety():
    async def test():
        async with served() as client:
            answer = await client.get("/")
            assert await answer.text() == "<p>page</p>"
            assert "default-src 'self'" in answer.headers["Content-Security-Policy"]
            assert answer.headers["X-Content-Type-Options"] == "nosniff"
            assert "default-src 'self'" in (await client.get("/nothing")).headers["Content-Security-Policy"]

    run(test)


def test_runs_are_offered_and_read_when_they_are_asked_for():
    opened = []

    def open_run():
        opened.append(1)
        return Run(b'{"name": "a"}', lambda: "<html>", lambda limits: [{"limits": dict(limits)}])

    async def test():
        content = Content(FILES, runs={"a b": open_run})
        async with served(content=content) as client:
            assert (await (await client.get("/api/runs")).json()) == {"runs": ["a b"], "live": False}
            assert not opened
            assert (await (await client.get("/api/runs/a b")).json()) == {"name": "a"}
            assert await (await client.get("/api/runs/a b/page")).text() == "<html>"
            found = await (await client.post("/api/runs/a b/replay", json={"noise": 1})).json()
            assert found == {"ok": True, "pairs": [{"limits": {"noise": 1.0}}]}
            assert opened == [1]
            assert (await client.get("/api/runs/c")).status == 404
            assert (await client.get("/live")).status == 404
            assert (await client.post("/api/act", json={"action": "pause"})).status == 404

    run(test)


def test_token_that_is_no_utf_8_is_refused():
    async def test():
        async with served() as client:
            body = b'{"action": "pause"}'
            reader, writer = await asyncio.open_connection(client.host, client.port)
            head = f"Host: localhost\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n".encode()
            end = b"X-Token: \xff\xfe\r\nConnection: close\r\n\r\n"
            writer.write(b"POST /api/act HTTP/1.1\r\n" + head + end + body)
            answer = await reader.read()
            writer.close()
            assert b" 400 " in answer.splitlines()[0] and answer.endswith(b"X-Token is no UTF-8\n")
            assert not client.asked.requests

    run(test)


def test_page_of_a_run_that_can_not_be_made_is_told():
    def refuse():
        raise ValueError("the page is not built")

    async def test():
        content = Content(FILES, runs={"a": lambda: Run(b"{}", refuse, lambda limits: [])})
        async with served(content=content) as client:
            answer = await client.get("/api/runs/a/page")
            assert (answer.status, await answer.text()) == (422, "the page is not built\n")

    run(test)


def test_run_that_is_open_is_told_while_another_one_is_opened():
    begun, go_on = threading.Event(), threading.Event()
    told = Run(b"{}", lambda: "", lambda limits: [])

    def slow():
        begun.set()
        assert go_on.wait(DEADLINE_S)
        return told

    async def test():
        async with served(content=Content(FILES, runs={"open": lambda: told, "slow": slow})) as client:
            await client.get("/api/runs/open")
            waiting = asyncio.create_task(client.get("/api/runs/slow"))
            try:
                await asyncio.get_running_loop().run_in_executor(None, begun.wait, DEADLINE_S)
                answer = await asyncio.wait_for(client.get("/api/runs/open"), DEADLINE_S / 2)
                assert (answer.status, waiting.done()) == (200, False)
            finally:
                go_on.set()
            assert (await waiting).status == 200

    run(test)


def test_only_the_last_runs_are_kept():
    opened = []

    def open_run(name):
        opened.append(name)
        return Run(name.encode(), lambda: "", lambda limits: [])

    names = [str(number) for number in range(9)]

    async def test():
        async with served(content=Content(FILES, runs={name: partial(open_run, name) for name in names})) as client:
            for name in [*names[:8], "0", "8", "0", "1"]:
                assert await (await client.get(f"/api/runs/{name}")).text() == name

    run(test)
    assert opened == [*names, "1"]


def test_bag_that_can_not_be_read_is_told():
    def refuse():
        raise ValueError("the bag is damaged")

    async def test():
        async with served(content=Content(FILES, runs={"a": refuse})) as client:
            answer = await client.get("/api/runs/a")
            assert (answer.status, await answer.text()) == (422, "the bag is damaged\n")

    run(test)


@pytest.mark.parametrize(
    ("host", "is_local"),
    [
        ("localhost", True),
        ("127.1.2.3", True),
        ("[::1]", True),
        (ALL, False),
        ("robot", False),
        ("localhost.evil.example", False),
    ],
)
def test_what_counts_as_this_computer(host, is_local):
    assert is_loopback(host) is is_local


def test_token_is_in_no_text_of_who_may_do_what():
    assert "hush" not in repr(Access("localhost", 0, "hush"))
