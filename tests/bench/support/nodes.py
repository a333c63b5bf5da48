"""Many live nodes in one process: each is registered like a running one, and answers at an address of its own."""

from __future__ import annotations

import asyncio
import os
import sys
import xmlrpc.client

_LENGTH = b"content-length:"


async def _answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Answer every call with this process's id, as getPid does."""
    body = xmlrpc.client.dumps(([1, "", os.getpid()],), methodresponse=True).encode()
    head = f"HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\nContent-Length: {len(body)}\r\n\r\n".encode()
    try:
        while True:
            received = await reader.readuntil(b"\r\n\r\n")
            lines = (line for line in received.lower().split(b"\r\n") if line.startswith(_LENGTH))
            await reader.readexactly(int(next(lines)[len(_LENGTH) :]))
            writer.write(head + body)
            await writer.drain()
    except (asyncio.IncompleteReadError, ConnectionError):
        writer.close()


async def _serve(uri: str, count: int) -> None:
    servers = [await asyncio.start_server(_answer, "127.0.0.1", 0) for _ in range(count)]
    ports = [server.sockets[0].getsockname()[1] for server in servers]
    await asyncio.to_thread(_register, uri, ports)
    await asyncio.gather(*(server.serve_forever() for server in servers))


def _register(uri: str, ports: list[int]) -> None:
    """Register each as a publisher and subscriber in a chain, with two services and two parameters."""
    master = xmlrpc.client.ServerProxy(uri)
    for i, port in enumerate(ports):
        name, api = f"/node_{i}", f"http://localhost:{port}/"
        master.setParam(name, name, {f"parameter_{k}": 0.5 * k for k in range(2)})
        for service in ("get_loggers", "set_logger_level"):
            master.registerService(name, f"{name}/{service}", f"rosrpc://localhost:{port}", api)
        master.registerPublisher(name, "/rosout", "rosgraph_msgs/Log", api)
        if i:
            master.registerSubscriber(name, f"/topic_{i - 1}", "std_msgs/Float64", api)
        master.registerPublisher(name, f"/topic_{i}", "std_msgs/Float64", api)


if __name__ == "__main__":
    asyncio.run(_serve(sys.argv[1], int(sys.argv[2])))
