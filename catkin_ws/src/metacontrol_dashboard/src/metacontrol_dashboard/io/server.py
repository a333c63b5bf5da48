"""The web server of the page: the state over a WebSocket, what an operator asks for, and recorded runs.

Everything that it serves is in memory: no request leads to a file. A viewer gets what is new when it has taken what
came before, of each entry the last value only; so a slow one delays nobody.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import hmac
import ipaddress
import json
import threading
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

from aiohttp import WSMsgType, web

from metacontrol_dashboard.io.page import INDEX
from metacontrol_dashboard.state.numbers import finite
from metacontrol_dashboard.state.requests import LOOKS_ONLY, Request, RequestError, read_limits, read_request
from metacontrol_dashboard.state.store import Store

Answer = dict[str, Any]
"""What the page shows of an action: `ok`, `message`, and what else there is."""

_PERIOD = 0.1  # s between two messages to a viewer
_PATIENCE = 10.0  # s for a viewer to take a message; one that does not is given up
_LARGEST = 100_000  # bytes of a request
_MOST_VIEWERS = 100
_MOST_OPEN = 8  # recorded runs that are kept in memory
_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class ServerError(Exception):
    """The server can't listen; one line with the remedy."""


@dataclass(frozen=True)
class Access:
    """Who may do what.

    Attributes:
        address: that the server listens on.
        port: the same; where it is taken, another one that is free.
        token: who gives it may control; empty: on localhost everybody may, elsewhere nobody.
        control: whether anybody may.
    """

    address: str = "localhost"
    port: int = 0
    token: str = field(default="", repr=False)
    control: bool = True

    @property
    def is_local(self) -> bool:
        """Whether only this computer reaches the server."""
        return is_loopback(self.address)

    def may_control(self, token: str) -> bool:
        """Return whether somebody with that token may control."""
        if not self.control:
            return False
        if not self.token:
            return self.is_local
        return hmac.compare_digest(token.encode(), self.token.encode())


def is_loopback(host: str) -> bool:
    """Return whether a host, by name or address, is this computer and reached from nowhere else."""
    name = host.strip("[]")
    if name == "localhost":
        return True
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return False


Act = Callable[[Request], Awaitable[Answer]]
Replay = Callable[[Mapping[str, float]], list[dict[str, Any]]]


@dataclass(frozen=True)
class Run:
    """A recorded run: as JSON, as a page of its own, and what other limits would have led to."""

    data: bytes
    export: Callable[[], str]
    replay: Replay


@dataclass
class Content:
    """What the server offers.

    Attributes:
        files: type and content of the files of the page, by name.
        store: the state of a running system; None where there is none.
        lock: held while the store changes.
        act: does what an operator asks for.
        runs: recorded runs by their names.
    """

    files: Mapping[str, tuple[str, bytes]]
    store: Store | None = None
    lock: threading.Lock = field(default_factory=threading.Lock)
    act: Act | None = None
    runs: Mapping[str, Callable[[], Run]] = field(default_factory=dict)


class Viewers:
    """Sends the state to viewers. What several of them need is written once."""

    def __init__(self, store: Store, lock: threading.Lock) -> None:
        """Send the state of a store that changes while a lock is held."""
        self._store, self._lock = store, lock
        self._written: dict[int, tuple[int, str]] = {}
        self._sockets: set[web.WebSocketResponse] = set()

    @property
    def count(self) -> int:
        """How many viewers there are."""
        return len(self._sockets)

    async def serve(self, socket: web.WebSocketResponse, hello: Mapping[str, Any]) -> None:
        """Send a viewer the state and its changes, until it leaves or takes too long."""
        self._sockets.add(socket)
        reading = asyncio.create_task(_read(socket))
        try:
            await socket.send_str(_dumps({"hello": hello}))
            known = 0
            while not (socket.closed or reading.done()):
                known, text = self._news(known)
                if text:
                    await asyncio.wait_for(socket.send_str(text), _PATIENCE)
                await asyncio.wait([reading], timeout=_PERIOD)
        except (TimeoutError, ConnectionError):
            pass  # it comes again by itself
        finally:
            self._sockets.discard(socket)
            reading.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await reading

    async def close(self) -> None:
        """Send all viewers away."""
        for socket in tuple(self._sockets):
            await socket.close(code=1001, message=b"the dashboard ends")

    def _news(self, known: int) -> tuple[int, str]:
        """Return the number of the last change, and what is new after another one as text; empty: nothing."""
        version = self._store.version
        if version == known:
            return known, ""
        cached = self._written.get(known)
        if cached is None or cached[0] != version:
            with self._lock:
                change = self._store.changes(known)
            cached = change["version"], json.dumps(change, allow_nan=False, separators=(",", ":"), default=str)
            if len(self._written) > _MOST_VIEWERS:
                self._written.clear()
            self._written[known] = cached
        return cached


async def _read(socket: web.WebSocketResponse) -> None:
    """Read what a viewer sends, which is nothing, until it leaves."""
    async for message in socket:
        if message.type in (WSMsgType.ERROR, WSMsgType.CLOSE):
            return


_VIEWERS = web.AppKey("viewers", Viewers)


def make_app(content: Content, access: Access) -> web.Application:
    """Return the server's application."""
    handlers = _Handlers(content, access)
    app = web.Application(middlewares=[handlers.guard], client_max_size=_LARGEST)
    if handlers.viewers:
        app[_VIEWERS] = handlers.viewers
    app.router.add_get("/", handlers.index)
    app.router.add_get("/live", handlers.live)
    app.router.add_get("/api/runs", handlers.runs)
    app.router.add_get("/api/runs/{name}", handlers.run)
    app.router.add_get("/api/runs/{name}/page", handlers.export)
    app.router.add_post("/api/runs/{name}/replay", handlers.replay)
    app.router.add_post("/api/act", handlers.act)
    app.router.add_get("/{name}", handlers.file)
    app.on_shutdown.append(handlers.end)
    return app


class _Handlers:
    def __init__(self, content: Content, access: Access) -> None:
        self._content, self._access = content, access
        self.viewers = Viewers(content.store, content.lock) if content.store else None
        self._open: OrderedDict[str, Run] = OrderedDict()  # the last used one last
        self._opening = asyncio.Lock()

    @web.middleware
    async def guard(
        self, request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
    ) -> web.StreamResponse:
        """Refuse requests that come from pages of others, and add the headers of safety."""
        try:
            self._check_origin(request)
            response = await handler(request)
        except web.HTTPException as error:
            error.headers.update(_HEADERS)
            raise
        if not response.prepared:
            response.headers.update(_HEADERS)
        return response

    def _check_origin(self, request: web.Request) -> None:
        host, origin = request.host, request.headers.get("Origin")
        try:
            name, origin_host = urlsplit(f"//{host}").hostname or "", urlsplit(origin or "").netloc
        except ValueError as error:
            raise web.HTTPBadRequest(text="Host or Origin is no address\n") from error
        if self._access.is_local and not is_loopback(name):
            raise web.HTTPForbidden(text="this server answers to localhost only\n")  # a name that was bound to it
        if origin is not None and origin_host != host:
            raise web.HTTPForbidden(text="the request comes from the page of somebody else\n")

    async def index(self, _request: web.Request) -> web.Response:
        return self._file(INDEX)

    async def file(self, request: web.Request) -> web.Response:
        return self._file(request.match_info["name"])

    def _file(self, name: str) -> web.Response:
        if name not in self._content.files:
            raise web.HTTPNotFound(text="no such page\n")
        kind, content = self._content.files[name]
        return web.Response(body=content, content_type=kind, charset="utf-8")

    async def live(self, request: web.Request) -> web.StreamResponse:
        if self.viewers is None:
            raise web.HTTPNotFound(text="no running system is shown here\n")
        if self.viewers.count >= _MOST_VIEWERS:
            raise web.HTTPServiceUnavailable(text="too many viewers\n")
        socket = web.WebSocketResponse(heartbeat=20.0, max_msg_size=_LARGEST, compress=False)
        await socket.prepare(request)
        control = "yes" if self._access.may_control("") else "token" if self._may_ever() else "no"
        await self.viewers.serve(socket, {"control": control})
        return socket

    def _may_ever(self) -> bool:
        return self._access.control and bool(self._access.token)

    async def act(self, request: web.Request) -> web.Response:
        if self._content.act is None:
            raise web.HTTPNotFound(text="no running system is shown here\n")
        asked = read_request_or_refuse(await self._json(request), read_request)
        if asked.action not in LOOKS_ONLY and not self._access.may_control(_token(request)):
            told = "the token is missing or wrong" if self._may_ever() else "this page can only look"
            return web.json_response({"ok": False, "message": told}, status=403)
        return web.json_response(await self._content.act(asked), dumps=_dumps)

    async def runs(self, _request: web.Request) -> web.Response:
        return web.json_response({"runs": list(self._content.runs), "live": self._content.store is not None})

    async def run(self, request: web.Request) -> web.Response:
        run = await self._run(request)
        response = web.Response(body=run.data, content_type="application/json", charset="utf-8")
        response.enable_compression()
        return response

    async def export(self, request: web.Request) -> web.Response:
        run = await self._run(request)
        try:
            page = (await asyncio.get_running_loop().run_in_executor(None, run.export)).encode()
        except Exception as error:  # that there is no built page, for one
            raise web.HTTPUnprocessableEntity(text=f"{error}\n") from error
        headers = {"Content-Disposition": 'attachment; filename="mission.html"'}
        return web.Response(body=page, content_type="text/html", charset="utf-8", headers=headers)

    async def replay(self, request: web.Request) -> web.Response:
        limits = read_request_or_refuse(await self._json(request), read_limits)
        run = await self._run(request)
        try:
            found = await asyncio.get_running_loop().run_in_executor(None, run.replay, limits)
        except Exception as error:  # whatever is wrong with the bag, the page tells it
            return web.json_response({"ok": False, "message": " ".join(str(error).split())})
        return web.json_response({"ok": True, "pairs": found}, dumps=_dumps)

    async def _run(self, request: web.Request) -> Run:
        name = request.match_info["name"]
        if name not in self._content.runs:
            raise web.HTTPNotFound(text="no such run\n")
        if name not in self._open:
            async with self._opening:  # one at a time: each takes much memory
                if name not in self._open:
                    await self._read(name)
        self._open.move_to_end(name)
        return self._open[name]

    async def _read(self, name: str) -> None:
        try:
            self._open[name] = await asyncio.get_running_loop().run_in_executor(None, self._content.runs[name])
        except Exception as error:  # as above
            raise web.HTTPUnprocessableEntity(text=f"{error}\n") from error
        if len(self._open) > _MOST_OPEN:
            self._open.popitem(last=False)

    @staticmethod
    async def _json(request: web.Request) -> Any:
        if request.content_type != "application/json":  # forms of other pages can't send this
            raise web.HTTPUnsupportedMediaType(text="send JSON\n")
        try:
            return await request.json()
        except (ValueError, LookupError, RecursionError) as error:  # of the text, of its charset, of its depth
            raise web.HTTPBadRequest(text="this is no JSON\n") from error

    async def end(self, _app: web.Application) -> None:
        if self.viewers:
            await self.viewers.close()


def _token(request: web.Request) -> str:
    """Return the token that a request gives; empty: none.

    Raises:
        HTTPBadRequest: it is no UTF-8.
    """
    token = request.headers.get("X-Token", "")
    try:
        token.encode()
    except UnicodeEncodeError as error:
        raise web.HTTPBadRequest(text="X-Token is no UTF-8\n") from error
    return token


def read_request_or_refuse(data: Any, read: Callable[[Any], Any]) -> Any:
    """Return what a function reads in data that a page has sent.

    Raises:
        HTTPBadRequest: it makes no sense.
    """
    try:
        return read(data)
    except RequestError as error:
        raise web.HTTPBadRequest(text=f"{error}\n") from error


def _dumps(data: Any) -> str:
    return json.dumps(finite(data), allow_nan=False, default=str)


class Server:
    """The server in a thread of its own.

    Attributes:
        url: where the page is, once it has started.
    """

    def __init__(self, content: Content, access: Access) -> None:
        """Prepare."""
        self._app, self._access = make_app(content, access), access
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="dashboard server", daemon=True)
        self._runner: web.AppRunner | None = None
        self.url = ""

    def start(self) -> None:
        """Listen from now on.

        Raises:
            ServerError: the address can't be used.
        """
        self._thread.start()
        try:
            self._wait_for(self._start())
        except OSError as error:
            where = f"{self._access.address}:{self._access.port}"
            raise ServerError(f"can't listen on {where}: {error.strerror or error}: give another address") from error

    @property
    def viewers(self) -> int:
        """How many look at the running system now."""
        return self._app[_VIEWERS].count if _VIEWERS in self._app else 0

    def close(self) -> None:
        """Send the viewers away, and end."""
        if self._runner is not None:
            with contextlib.suppress(TimeoutError):
                self._wait_for(self._runner.cleanup(), timeout=2.0)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(timeout=2.0)

    async def _start(self) -> None:
        self._runner = web.AppRunner(self._app, access_log=None, shutdown_timeout=0.5)
        await self._runner.setup()
        try:
            await web.TCPSite(self._runner, self._access.address, self._access.port).start()
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
            await web.TCPSite(self._runner, self._access.address, 0).start()  # several robots, or several users
        addresses = self._runner.addresses
        port = addresses[0][1]
        host = self._access.address if self._access.address not in ("0.0.0.0", "::") else "localhost"  # noqa: S104
        self.url = f"http://{f'[{host}]' if ':' in host else host}:{port}/"

    def _wait_for(self, work: Any, timeout: float | None = 10.0) -> Any:
        future: Future[Any] = asyncio.run_coroutine_threadsafe(work, self._loop)
        return future.result(timeout)
