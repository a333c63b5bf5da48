"""Why a mission's system has ended, with a master of this process."""

import threading
from contextlib import contextmanager
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from helpers.ports import QUIET_HOST
from helpers.waiting import wait_for
from metacontrol_experiments.io.end_of_system import EndOfSystem
from node_kit.master import Standing, View


class Server(SimpleXMLRPCServer):
    def __init__(self):
        super().__init__((QUIET_HOST, 0), logRequests=False)
        self.calls = 0
        self.register_function(self.pid, "getPid")

    def pid(self, _caller):
        self.calls += 1
        return 1, "", 7


@contextmanager
def watched_master(console):
    """Give the address of a master, what watches it, and a function that ends it."""
    server = Server()
    uri = f"http://{QUIET_HOST}:{server.server_address[1]}"
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    end = EndOfSystem(console, uri)
    end.watch()
    wait_for(lambda: server.calls, "the master is asked")

    def lose():
        server.shutdown()
        thread.join()
        server.server_close()
        wait_for(lambda: end._watch.lost, "the watch finds it gone")
        end._watch.thread.join()

    yield uri, end, lose
    if not end._watch.lost:
        lose()


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
    with watched_master(console) as (uri, end, lose):
        lose()
        assert (end.cause() == f"ROS master {uri} is gone") == is_told


def test_master_that_answers_again_is_no_cause(tmp_path):
    console = tmp_path / "console.log"
    console.write_text("error: no display\n")
    with watched_master(console) as (_, end, _):
        first = end._watch
        mute = View(Standing.MUTE, 7, "garbage: nothing that can be read", silent_since=1.0)
        end._watch.heartbeat = None
        end._on_loss(mute)
        assert end._watch is not first
        wait_for(lambda: end.cause() == "error: no display", "it has answered again")


def test_master_that_stays_mute_is_told_with_the_whole_reason(tmp_path):
    console = tmp_path / "console.log"
    console.write_text("error: no display\n")
    end = EndOfSystem(console, f"http://{QUIET_HOST}:1")
    end._on_loss(View(Standing.MUTE, 7, "garbage: nothing that can be read"))
    wait_for(lambda: end._watch.lost, "nobody is there any more")
    assert end.cause() == f"ROS master http://{QUIET_HOST}:1 does not answer (garbage: nothing that can be read)"


def test_lost_master_is_told_where_the_console_can_not_be_read(tmp_path):
    with watched_master(tmp_path / "no.log") as (uri, end, lose):
        lose()
        assert end.cause() == f"ROS master {uri} is gone"


def test_end_has_begun_once_roslaunch_ends_its_processes(tmp_path):
    console = tmp_path / "console.log"
    end = EndOfSystem(console, "http://localhost:1")
    assert not end.has_begun()  # there is no console yet
    with console.open("w") as written:
        for text, has_begun in [
            ("process[world-2]: started\n", False),
            ("[world-2] killing ", False),
            ("on exit\n", True),
        ]:
            written.write(text)
            written.flush()
            assert end.has_begun() == has_begun
        written.write("[master] killing on exit\n")
    assert end.has_begun()


def test_end_has_begun_once_the_master_is_gone(tmp_path):
    with watched_master(tmp_path / "no.log") as (_, end, lose):
        assert not end.has_begun()
        lose()
        assert end.has_begun()


def test_master_that_does_not_answer_may_do_so_again(tmp_path):
    end = EndOfSystem(tmp_path / "no.log", f"http://{QUIET_HOST}:1")
    end._on_loss(View(Standing.MUTE, 7, "timed out"))
    assert not end.has_begun()
    wait_for(lambda: end._watch.lost, "nobody is there any more")
