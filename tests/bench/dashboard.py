"""The dashboard beside 300 live nodes and a monitor: share of a core with one viewer, time from event to viewers."""

from __future__ import annotations

import asyncio
import json
import sys
import time
from typing import Any

import aiohttp
import psutil
from monitor_tick import _model as model
from support.figures import LIMIT, entry, percentile
from support.stand import stand, wait_until

_NODES = 300
_SECONDS = 15.0
_EVENTS = 20
_VIEWERS = 20
_MOST_CPU, _LONGEST = 5.0, 1.0  # % of a core, s: what was asked for


def run() -> list[dict[str, Any]]:
    """Return the entries `dashboard_cpu_300`, and the p95 of the time to one viewer and to the last one of 20."""
    with stand() as system:
        system.start_nodes(_NODES)
        system.start_monitor({"startup_grace": 2.0}, model())
        system.proxy.setParam("/bench", "/metacontrol_dashboard/port", 0)
        page = system.start("rosrun", "metacontrol_dashboard", "dashboard")
        wait_until(lambda: system.ask_master("getParam", "/metacontrol_dashboard/url"))
        url = system.ask_master("getParam", "/metacontrol_dashboard/url")
        found = system.measure(__file__, str(page.pid), url)
    return [
        entry("dashboard_cpu_300", found["cpu"], "% of a core", 1, LIMIT, _MOST_CPU),
        entry("dashboard_event_1", percentile(found["one"], 0.95), "s", len(found["one"]), LIMIT, _LONGEST),
        entry("dashboard_event_20", percentile(found["all"], 0.95), "s", len(found["all"]), LIMIT, _LONGEST),
    ]


async def _measure(pid: int, url: str) -> dict[str, Any]:
    import rospy  # here, where the process is a node
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

    rospy.init_node("bench")
    publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
    process = psutil.Process(pid)
    everything = [process, *process.children(recursive=True)]  # rosrun may stay above it

    def used() -> float:
        return sum(sum(p.cpu_times()[:2]) for p in everything)

    async def times(session: aiohttp.ClientSession, viewers: int) -> list[float]:
        """Return how long each event took to the last viewer, s."""
        sockets = [await session.ws_connect(f"{url}live", max_msg_size=0) for _ in range(viewers)]

        async def seen(socket: aiohttp.ClientWebSocketResponse, value: str) -> None:
            while value not in await socket.receive_str():
                pass

        found = []
        for number in range(_EVENTS):
            value = f"event {viewers}-{number} happened"
            pair = [KeyValue("bench_part", "FALSE"), KeyValue("reason", value)]
            array = DiagnosticArray(status=[DiagnosticStatus(level=2, message="Component status", values=pair)])
            array.header.stamp = rospy.Time.now()
            began = time.perf_counter()
            publisher.publish(array)
            await asyncio.gather(*(asyncio.wait_for(seen(socket, value), 30) for socket in sockets))
            found.append(time.perf_counter() - began)
            await asyncio.sleep(0.13)  # not in step with the server
        for socket in sockets:
            await socket.close()
        return found

    async with aiohttp.ClientSession() as session:
        socket = await session.ws_connect(f"{url}live", max_msg_size=0)
        known: set[str] = set()
        while len(known) < _NODES:  # it shows them all
            change = json.loads(await socket.receive_str())
            known |= {name for name in change.get("set", {}).get("node", {}) if name.startswith("/node_")}
        await asyncio.sleep(5.0)

        async def read() -> None:
            async for _ in socket:
                pass

        reading = asyncio.create_task(read())
        before, began = used(), time.perf_counter()
        await asyncio.sleep(_SECONDS)
        cpu = 100.0 * (used() - before) / (time.perf_counter() - began)
        reading.cancel()
        await socket.close()
        return {"cpu": cpu, "one": await times(session, 1), "all": await times(session, _VIEWERS)}


if __name__ == "__main__":
    measured = asyncio.run(_measure(int(sys.argv[1]), sys.argv[2]))
    sys.stdout.write(json.dumps(measured) + "\n")
