"""The tutorial as a reader follows it: every block in its terminal, and what the page says that it shows."""

import os
import re
import shutil
import signal
import subprocess
import threading
import time
from pathlib import Path

import psutil
from helpers.ports import reserved_port
from helpers.waiting import DEADLINE_S, wait_for

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "tutorial.md"
BLOCK = re.compile(r'^```(?:bash|text) title="([^"]+)"\n(.*?)^```$', re.MULTILINE | re.DOTALL)
SHOWS = "shows"
STAYS = ("roslaunch ", "rosrun cart ")
"""How lines begin whose command runs until Ctrl-C."""
DONE = "== done: "


class Terminal:
    """A shell in a terminal of its own."""

    def __init__(self, environment):
        self._output = []
        self._process = subprocess.Popen(
            ["bash"],
            env=environment,
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        threading.Thread(target=self._read, daemon=True).start()

    @property
    def said(self):
        return "".join(self._output)

    def _read(self):
        self._output += iter(self._process.stdout.readline, "")

    def _send(self, text):
        self._process.stdin.write(text + "\n")
        self._process.stdin.flush()

    def run(self, block):
        """Type a block; return what it shows. A command that stays is left running."""
        self.interrupt()
        lines = block.splitlines()
        stays = lines[-1].startswith(STAYS)
        done = self._typed("\n".join(lines[:-1] if stays else lines))
        if stays:
            self._send(lines[-1])
        return done

    def _typed(self, text):
        begin = len(self.said)
        mark = f"{DONE}{time.monotonic()}"
        if text.startswith("./mros shell"):
            text = text.replace("./mros shell", "./mros shell\nset +o emacs; PS1= PS2=", 1)
        self._send(f"{text}\necho; echo '{mark} '$?")
        ended = rf"{re.escape(mark)} (\d+)"
        status = wait_for(lambda: re.search(ended, self.said[begin:]), lambda: f"{text}\n\n{self.said[begin:][-3000:]}")
        shown = self.said[begin:].split(mark)[0]
        assert status[1] == "0", f"{text}\n\n{shown[-3000:]}"
        return shown

    def interrupt(self):
        """Press Ctrl-C, where a command runs that stays."""
        try:
            shells = [p for p in psutil.Process(self._process.pid).children(recursive=True) if p.name() == "bash"]
            running = [child for shell in shells for child in shell.children() if child.name() != "bash"]
        except psutil.NoSuchProcess:
            return
        for child in running:
            child.send_signal(signal.SIGINT)
        psutil.wait_procs(running, DEADLINE_S)

    def close(self):
        self.interrupt()
        self._process.stdin.close()
        try:
            self._process.wait(DEADLINE_S)
        finally:
            if self._process.poll() is None:
                os.killpg(self._process.pid, signal.SIGKILL)


def pattern(shows):
    """Return the regular expression of what a block shows: `...` stands for anything, and lines may be in between."""
    lines = [re.escape(line).replace(r"\.\.\.", ".*") for line in shows.splitlines()]
    return re.compile(r"[^\n]*\n(?:.*\n)*?".join(lines))


def test_every_block_does_what_the_page_says(tmp_path):
    page = PAGE.read_text(encoding="utf-8")
    blocks = BLOCK.findall(page)
    assert len(re.findall("^```", page, re.MULTILINE)) == 2 * len(blocks), "a block without a terminal is not tried"
    terminals = {}
    (tmp_path / "home").mkdir()
    with reserved_port() as port:
        environment = {**os.environ, "HOME": str(tmp_path / "home"), "ROS_MASTER_URI": f"http://localhost:{port}"}
        for name in ("ROS_HOME", "ROS_LOG_DIR", "CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH", "PYTHONPATH"):
            environment.pop(name, None)
        try:
            shown = again = ""
            for title, text in blocks:
                if title == SHOWS:
                    expected, last = pattern(text), [shown]
                    again_until(terminals["Work"], again, expected, last)
                else:
                    terminal = terminals.get(title) or terminals.setdefault(title, Terminal(environment))
                    shown, again = terminal.run(text), text.splitlines()[-1]
        finally:
            for terminal in terminals.values():
                terminal.close()
            shutil.rmtree(tmp_path / "home", ignore_errors=True)


def again_until(terminal, command, expected, last):
    """Type a command again until it shows what is expected."""

    def shows():
        if expected.search(last[-1]):
            return True
        last.append(terminal.run(command))
        return expected.search(last[-1])

    wait_for(shows, lambda: f"{command} shows {expected.pattern}\n\n{last[-1]}")
