#!/usr/bin/env python3
"""The page of a system that is no demonstrator, in a real browser: a talker in a namespace hangs, dies, is replaced."""

import json
import os
import signal
import subprocess
import unittest
import urllib.error
import urllib.request
from pathlib import Path
from xmlrpc.client import ServerProxy

import rosgraph
import rospy
import rostest
from helpers.browser import Browser
from helpers.waiting import DEADLINE_S, wait_for
from sensor_msgs.msg import Image

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
ROBOT = "/amber"
URL = f"{ROBOT}/metacontrol_dashboard/url"


def process_of(node):
    """Return the process of a node, 0 where none answers."""
    try:
        return ServerProxy(rosgraph.Master("/test").lookupNode(node)).getPid("/test")[2]
    except (OSError, rosgraph.MasterException):
        return 0


def heal(pid):
    """Let a process that was stopped go on, if it is still there."""
    try:
        os.kill(pid, signal.SIGCONT)
    except ProcessLookupError:
        return


class DashboardTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("dashboard_test")

    def start(self, *words):
        """Start a command for the robot in the namespace."""
        robot = EXAMPLES / "talker_listener"
        paths = {"ROS_PACKAGE_PATH": str(robot), "PYTHONPATH": str(robot / "src")}
        environment = {name: f"{path}:{os.environ.get(name, '')}" for name, path in paths.items()}
        process = subprocess.Popen(
            words, env={**os.environ, **environment, "ROS_NAMESPACE": ROBOT}, stdin=subprocess.DEVNULL
        )
        self.addCleanup(process.wait, DEADLINE_S)
        self.addCleanup(process.send_signal, signal.SIGINT)
        return process

    def start_page(self, *arguments, port=0):
        if rospy.has_param(URL):
            rospy.delete_param(URL)
        self.start("roslaunch", "--wait", "metacontrol_dashboard", "dashboard.launch", f"port:={port}", *arguments)
        return wait_for(lambda: rospy.get_param(URL, ""), "the page is served")

    def browser(self, url):
        browser = self.enterContext(Browser())
        browser.open(url)
        return browser

    def test_operator_sees_what_happens_and_decides(self):
        self.start("rosrun", "talker_listener", "listener", "__name:=listener")
        project = f"project:={EXAMPLES / 'talker_listener'}"
        words = ("metacontrol.launch", project, "initial_configuration:=frugal", "parameters:={approval: true}")
        self.start("roslaunch", "--wait", "mros1_reasoner", *words)
        url = self.start_page()
        page = self.browser(url)
        page.wait_for_text("f_talk: frugal", "#summary")
        page.wait_for_text("freshness", "#qualities")
        page.wait_for_text("decides by itself, and asks for your approval", "#operator")

        self.check_what_would_be_done(page)

        talker = wait_for(lambda: process_of(f"{ROBOT}/talker"), "the talker runs")
        os.kill(talker, signal.SIGSTOP)
        self.addCleanup(heal, talker)
        page.wait_for_text("A change waits for your approval", "#operator")
        page.wait_for_text("hangs: amber/talker", "#summary")
        # Whichever is seen first calls for it: the process that hangs, or the level that passes its limit.
        page.click("Approve", "#operator")
        page.wait_for_text("carried out", "#decisions")
        page.wait("!document.querySelector('#summary').innerText.includes('hangs')", "another talker runs")
        wait_for(lambda: process_of(f"{ROBOT}/talker") not in (0, talker), "it is another process")
        self.assertEqual(page.errors(), [])

        self.check_lost_connection(page, url)
        self.assertEqual([e for e in page.errors() if "exceptionDetails" in e], [])

    def check_what_would_be_done(self, page):
        """Nothing is carried out when somebody asks what would be."""
        page.wait_for_text("freshness", "#operator")
        page.ask("document.querySelector(\"input[name='limit/freshness']\").value = '0.01'")
        page.click("Ask", "#operator")
        page.wait("document.querySelector('#operator').innerText.match(/it would (change|leave|find)/)", "the answer")
        page.wait_for_text("f_talk: frugal", "#summary")

    def check_lost_connection(self, page, url):
        """The page tells that it knows nothing new, and goes on when the server is back."""
        os.kill(process_of(f"{ROBOT}/metacontrol_dashboard"), signal.SIGKILL)
        page.wait_for_text("connection lost", "header")
        self.assertEqual(self.start_page(port=url.rstrip("/").rpartition(":")[2]), url)
        page.wait_for_text("live", "header")
        page.wait_for_text("f_talk: f", "#summary")
        page.wait_for_text("carried out", "#decisions")

    def test_pause_and_limit_are_asked_for_by_keys_alone(self):
        project = f"project:={EXAMPLES / 'talker_listener'}"
        self.start("roslaunch", "--wait", "mros1_reasoner", "metacontrol.launch", project)
        page = self.browser(self.start_page())
        page.wait_for_text("The reasoner decides by itself", "#operator")
        page.ask("[...document.querySelectorAll('#operator button')].find((b) => b.innerText === 'Pause').focus()")
        page.press("Enter", 13)
        page.wait("document.querySelector('dialog').open", "the question")
        page.press("Enter", 13)
        page.wait_for_text("is paused: it decides nothing", "#operator")
        page.click("Resume", "#operator")
        page.wait_for_text("The reasoner decides by itself", "#operator")

    def test_camera_is_heard_while_somebody_looks(self):
        camera = rospy.Publisher(f"{ROBOT}/eye/image_raw", Image, queue_size=1)
        self.addCleanup(camera.unregister)
        image = Image(height=48, width=64, encoding="mono8", step=64, data=bytes(48 * 64))
        timer = rospy.Timer(rospy.Duration(0.1), lambda _: camera.publish(image))
        self.addCleanup(timer.shutdown)
        url = self.start_page()
        with Browser() as page:
            page.open(url)
            page.wait("document.querySelector('#map img')?.naturalWidth === 64", "the image of the camera")
            self.assertEqual(page.errors(), [])
        wait_for(lambda: camera.get_num_connections() == 0, "nobody hears the camera")

    def test_page_that_can_only_look_says_so_and_is_refused(self):
        url = self.start_page("control:=false")
        page = self.browser(url)
        page.wait_for_text("This page can only look", "#operator")
        body = json.dumps({"action": "pause"}).encode()
        asked = urllib.request.Request(f"{url}api/act", body, {"Content-Type": "application/json"})  # noqa: S310
        with self.assertRaisesRegex(urllib.error.HTTPError, "403"):
            urllib.request.urlopen(asked)  # noqa: S310


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "dashboard", DashboardTest)
