"""The page of a mission of D2 in a real browser: a laser is killed, and the robot goes on with its camera."""

import os
import re
import signal
import subprocess
from pathlib import Path

from helpers.browser import Browser
from helpers.ports import free_port
from helpers.waiting import DEADLINE_S, wait_for

GOAL = Path(__file__).parents[1] / "integration" / "reference" / "goal.yaml"


def test_page_shows_a_mission_that_adapts(tmp_path):
    port = free_port()
    console = tmp_path / "console.log"
    environment = {**os.environ, "ROS_MASTER_URI": f"http://localhost:{port}", "ROS_LOG_DIR": str(tmp_path / "log")}
    words = ["roslaunch", "-p", str(port), "metacontrol_sim", "metacontrol_sim_reasoner.launch", "dashboard:=true"]
    with console.open("w") as out, Browser() as page:
        # On a busy machine, either level may ask for a change.
        words += [f"current_goal_file:={GOAL}", "nfr_energy:=1", "nfr_safety:=1"]
        system = subprocess.Popen(words, env=environment, stdout=out, stderr=out, start_new_session=True)
        try:
            told = wait_for(lambda: re.search(r"page of this system: (\S+)", console.read_text()), console.read_text)
            page.open(told[1])
            page.wait_for_text("f_navigate: f", "#summary", DEADLINE_S)
            page.wait_for_text("decides by itself", "#operator")
            page.wait_for_text("The robot is at", "#map")
            laser = int(re.search(r"front_laser-\d+\]: started with pid \[(\d+)\]", console.read_text())[1])
            os.kill(laser, signal.SIGKILL)
            page.wait_for_text("failed: front_laser", "#summary")
            page.wait_for_text("because component front_laser", "#decisions")
            page.wait("document.querySelector('#decisions').innerText.includes('carried out')", "the change is made")
            page.wait_for_text("front_laser", "#graph .plain")
            page.click("why", "#timeline")
            page.wait_for_text("concluded by rule compError", "#decisions")
            page.wait_for_text("front/scan", "#graph")
            assert page.errors() == []
        finally:
            system.send_signal(signal.SIGINT)
            system.wait(60)
