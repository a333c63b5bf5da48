"""Why a mission's system has ended, with a master of this process."""

import threading
from contextlib import contextmanager
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from helpers.ports import QUIET_HOST
from helpers.waiting import wait_for
from metacontrol_experiments.io.end_of_system import EndOfSystem


class Server(SimpleXMLRPCServer):
    def __init__(self):
        super().__init__((QUIET_HOST, 0), logRequests=False)
        self.calls = 0
        self.register_function(self.pid, "getPid")

    def pid(self, _caller):
        self.calls += 1
        return 1, "", 7


@contextmanager
def lost_master(console):
    """Give the address of a master that has gone after the system was watched, and what watches it."""
    server = Server()
    uri = f"http://{QUIET_HOST}:{server.server_address[1]}"
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    end = EndOfSystem(console, uri)
    end.watch()
    wait_for(lambda: server.calls, "the master is asked")
    server.shutdown()
    thread.join()
    server.server_close()
    wait_for(lambda: end._watch.lost, "the watch finds it gone")
    end._watch.thread.join()
    yield uri, end


@pytest.mark.parametrize(
    ("said", "is_told"),
    [
        ("OSError: [Errno 28] No space left on device\n", True),
        ("[world-2] killing on exit\nRLException: bad tag\n", False),  # roslaunch takes the master with it
        ("=====REQUIRED process [world-2] has died!\n", False),
    ],
)
def test_lost_master_is_the_cause_where_the_console_has_none(tmp_path, said, is_told):
    console = tmp_path / "console.log"
    console.write_text(said)
    with lost_master(console) as (uri, end):
        assert (end.cause() == f"ROS master {uri} is gone") == is_told
