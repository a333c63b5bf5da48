"""Processes of nodes: started, given their role, ended; none left behind."""

import errno
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import psutil
import pytest
from helpers.waiting import DEADLINE_S, wait_for
from node_kit.io.supervisor import owner_id
from rosgraph_launcher.io import processes
from rosgraph_launcher.io.processes import MARK, OWNER, Command, StartError


def is_alive(pid):
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


@pytest.fixture
def command(tmp_path):
    def make(text, *arguments, log=None, python=True):
        script = tmp_path / "node"
        script.write_text((f"#!{sys.executable}\n" if python else "#!/bin/sh\n") + text)
        script.chmod(0o755)
        environment = {**os.environ, MARK: str(tmp_path)}
        return Command((str(script), *arguments), str(tmp_path), environment, log=log and str(log))

    return make


def test_process_runs_in_its_folder_with_its_log(command, tmp_path):
    process = processes.start(command("echo $1 in $PWD", "hello", log=tmp_path / "log", python=False))
    assert processes.wait_for_ends([process], DEADLINE_S)
    assert process.status == 0
    process.close()
    assert (tmp_path / "log").read_text().split() == ["hello", "in", str(tmp_path)]


def test_prepared_process_imports_first_and_begins_when_told(command, tmp_path):
    text = "import sys\nimport decimal\nprint(*sys.argv[1:], __file__)\n"
    wanted = command(text, "a", "__name:=n", log=tmp_path / "log")
    process = processes.prepare(wanted)
    maps = Path(f"/proc/{process.pid}/maps")
    wait_for(lambda: "_decimal" in maps.read_text(), "the import is done")
    assert (tmp_path / "log").read_text() == ""
    process.begin()
    assert processes.wait_for_ends([process], DEADLINE_S)
    process.close()
    assert (tmp_path / "log").read_text().split() == ["a", "__name:=n", str(tmp_path / "node")]


def test_log_of_an_earlier_process_is_continued(command, tmp_path):
    wanted = command("print('hello')\n", log=tmp_path / "log")
    for process in (processes.start(wanted), processes.prepare(wanted)):
        if process.gate >= 0:
            process.begin()
        assert processes.wait_for_ends([process], DEADLINE_S)
        process.close()
    assert (tmp_path / "log").read_text().split() == ["hello", "hello"]


def test_prepared_process_that_is_closed_never_runs_its_script(command, tmp_path):
    process = processes.prepare(command("open('ran', 'w')\n"))
    process.close()
    assert not (tmp_path / "ran").exists()


def test_prepared_process_that_was_killed_is_told(command):
    process = processes.prepare(command("pass\n"))
    process.signal(signal.SIGKILL)
    assert processes.wait_for_ends([process], DEADLINE_S)
    with pytest.raises(StartError, match="node: its process has ended before it began"):
        process.begin()
    process.close()


def test_prepared_process_keeps_the_exit_status_of_its_script(command):
    wanted = command("import sys\nsys.exit(3)\n")
    process = processes.prepare(wanted)
    process.begin()
    assert processes.wait_for_ends([process], DEADLINE_S)
    assert process.status == 3
    process.close()


def test_script_that_cannot_be_imported_fails_when_it_runs(command):
    wanted = command("import no_such_module\n")
    process = processes.prepare(wanted)
    process.begin()
    assert processes.wait_for_ends([process], DEADLINE_S)
    assert process.status == 1
    process.close()


@pytest.mark.parametrize(
    ("first", "is_python"),
    [
        ("#!/usr/bin/python3", True),
        ("#!/usr/bin/python3 -u", True),
        ("#!/usr/bin/env python3", True),
        ("#!/usr/bin/env -S python3 -u", True),
        (f"#!{sys.executable}", True),
        ("#!/usr/bin/python3 -I", False),
        ("#!/usr/bin/python3 -S", False),
        ("#!/usr/bin/env no_python3", False),
        ("#!/usr/bin/env", False),
        ("#!/bin/sh", False),
        ("#!", False),
        ("import sys", False),
        ("#!/usr/bin/python3 'open", False),
    ],
)
def test_only_scripts_for_a_plain_python_3_are_prepared(tmp_path, first, is_python):
    script = tmp_path / "node"
    script.write_text(f"{first}\n")
    assert Command((str(script),), "/", {"PATH": os.environ["PATH"]}).is_python is is_python
    assert not Command(("nice", str(script)), "/", {"PATH": os.environ["PATH"]}, prefixed=1).is_python


def test_executable_that_is_no_script_is_not_prepared(tmp_path):
    assert processes.prepare(Command((sys.executable,), str(tmp_path), {})) is None
    assert processes.prepare(Command((str(tmp_path / "missing"),), str(tmp_path), {})) is None


def test_log_that_cannot_be_written_stops_nothing(command, tmp_path):
    for log in ("/dev/full", tmp_path / "no" / "folder" / "log"):
        process = processes.start(command("echo hello\nexit 0", log=log, python=False))
        assert processes.wait_for_ends([process], DEADLINE_S)
        assert process.status == 0
        process.close()


def test_missing_executable_is_told(tmp_path):
    with pytest.raises(StartError, match="/no/such/node"):
        # setpriv itself exists, so the folder is what the system refuses
        processes.start(Command(("/no/such/node",), "/proc/no/such/node", {}))


def test_children_of_a_node_end_with_it(command, tmp_path):
    process = processes.start(command("sleep 1000 & echo $! > child; wait", python=False))
    wait_for(lambda: (tmp_path / "child").exists() and (tmp_path / "child").read_text(), "the child runs")
    child = int((tmp_path / "child").read_text())
    process.close()
    wait_for(lambda: not is_alive(child), "the child has ended")


def refuse(*_):
    raise OSError(errno.EMFILE, "Too many open files")


def test_system_that_has_no_pipe_is_told(command, monkeypatch):
    monkeypatch.setattr(processes.os, "pipe", refuse)
    with pytest.raises(StartError, match="node: Too many open files"):
        processes.prepare(command("pass\n"))


def test_process_whose_end_cannot_be_followed_is_killed(command, monkeypatch, tmp_path):
    monkeypatch.setattr(processes, "open_pidfd", refuse)
    wanted = command("echo $$ > pid; exec sleep 1000", python=False)
    with pytest.raises(StartError, match="Too many open files"):
        processes.start(wanted)
    assert processes.kill_marked(str(tmp_path)) == []


def test_process_that_the_kernel_holds_is_told(command, debugger):
    process = processes.start(command("exec sleep 1000", python=False))
    debugger(process.pid)
    assert process.close() is False
    debugger.end()
    wait_for(lambda: process.status is not None, "it has ended")


class Unkillable:
    """A process with a mark that lives on, whatever is done to it, as one that waits for a device does."""

    def __init__(self, pid):
        self.pid, self.kills = pid, 0

    def environ(self):
        return {MARK: "mark", OWNER: "7@1.5"}

    def status(self):
        return psutil.STATUS_DISK_SLEEP

    def create_time(self):
        return 0.0

    def kill(self):
        self.kills += 1


def test_reaper_looks_for_children_again_and_does_not_wait_for_what_cannot_be_killed(monkeypatch):
    owner = subprocess.Popen(["true"])
    owner.wait()
    held, child = Unkillable(-1), Unkillable(-2)
    seen = iter([[held], [held, child], [held, child]])  # a further look would raise StopIteration
    monkeypatch.setattr(processes.psutil, "process_iter", lambda: next(seen))
    monkeypatch.setattr(sys, "argv", ["reaper", str(owner.pid), "mark", "7@1.5"])
    processes.main()
    assert held.kills and child.kills
    assert next(seen, None) is None


OWNER_SCRIPT = """
import os, sys, time
from rosgraph_launcher.io import processes
from rosgraph_launcher.io.processes import Command, MARK
environment = {**os.environ, MARK: sys.argv[2]}
processes.start_reaper(sys.argv[2])
node = processes.start(Command((sys.argv[1],), "/", environment))
print(node.pid, flush=True)
time.sleep(1000)
"""


def test_nothing_outlives_an_owner_that_is_killed(command, tmp_path):
    node = command("setsid sleep 1000 & echo $! > child; wait", python=False)
    owner = subprocess.Popen([sys.executable, "-c", OWNER_SCRIPT, node.words[0], str(tmp_path)], stdout=subprocess.PIPE)
    pid = int(owner.stdout.readline())
    # the node's folder is /, so the child's id is looked up
    wait_for(lambda: psutil.Process(pid).children(), "the child runs")
    child = psutil.Process(pid).children()[0].pid
    owner.send_signal(signal.SIGKILL)
    owner.wait()
    owner.stdout.close()
    wait_for(lambda: not is_alive(pid), "the node has ended")
    wait_for(lambda: not is_alive(child), "its child in another session has ended")


@pytest.fixture
def owner(command, tmp_path):
    """Start an owner with the one mark; return its process and the id of its node."""
    started = []
    node = command("exec sleep 1000", python=False).words[0]

    def begin():
        process = subprocess.Popen([sys.executable, "-c", OWNER_SCRIPT, node, str(tmp_path)], stdout=subprocess.PIPE)
        started.append(process)
        return process, int(process.stdout.readline())

    yield begin
    for process in started:
        process.kill()
        process.communicate()


def test_owner_that_is_killed_takes_nothing_of_its_successor_along(owner):
    (first, of_first), (_second, of_second) = owner(), owner()
    reaper = next(child for child in psutil.Process(first.pid).children() if child.pid != of_first)
    first.kill()
    first.wait()
    wait_for(lambda: not is_alive(of_first), "the node of the first one has ended")
    wait_for(lambda: not is_alive(reaper.pid), "its reaper has done its work")
    assert is_alive(of_second)


@pytest.mark.parametrize("begin", [processes.start, processes.prepare])
def test_process_names_its_owner(command, begin):
    process = begin(command("import time\ntime.sleep(1000)\n"))
    environment = {}

    def is_read():  # there is none for a moment, while a program takes the place of another one
        environment.update(psutil.Process(process.pid).environ())
        return environment

    wait_for(is_read, "it runs")
    assert environment[MARK]
    assert environment[OWNER] == owner_id(os.getpid())
    process.close()


def test_word_with_a_null_character_is_told(command):
    with pytest.raises(StartError, match="node: embedded null byte"):
        processes.start(command("exit 0", "a\0b", python=False))


def test_process_that_has_no_environment_yet_is_found(tmp_path, monkeypatch):
    """For a moment, while a program takes the place of another one."""
    left = subprocess.Popen(["sleep", "1000"], env={MARK: str(tmp_path), "PATH": os.environ["PATH"]})
    wait_for(lambda: MARK in psutil.Process(left.pid).environ(), "it runs")
    environ, looks = psutil.Process.environ, []

    def seen(process):
        if process.pid != left.pid or looks:
            return environ(process)
        looks.append(process)
        return {}

    monkeypatch.setattr(psutil.Process, "environ", seen)
    assert [pid for pid, _ in processes.kill_marked(str(tmp_path))] == [left.pid]
    assert left.wait(DEADLINE_S) == -signal.SIGKILL


def test_what_an_earlier_owner_left_is_killed_and_nothing_else(tmp_path):
    left = subprocess.Popen(["sleep", "1000"], env={MARK: str(tmp_path), "PATH": os.environ["PATH"]})
    other = subprocess.Popen(["sleep", "1000"], env={MARK: "another", "PATH": os.environ["PATH"]})
    try:
        wait_for(lambda: psutil.Process(left.pid).environ().get(MARK) == str(tmp_path), "it runs")
        assert [pid for pid, _ in processes.kill_marked(str(tmp_path))] == [left.pid]
        assert left.wait(DEADLINE_S) == -signal.SIGKILL
        assert other.poll() is None
    finally:
        left.kill()
        other.kill()
        left.wait()
        other.wait()


def test_end_is_waited_for_however_long_it_may_take(command):
    process = processes.start(command("sleep 1000", python=False))
    threading.Timer(0.1, process.signal, [signal.SIGKILL]).start()
    assert processes.wait_for_ends([process], 1e12)
    process.close()
