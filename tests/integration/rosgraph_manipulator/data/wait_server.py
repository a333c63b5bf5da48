#!/usr/bin/env python3
"""An actionlib server: a goal of 0 is pending until cancelled, one below 0 is rejected, others succeed at once.

Arguments make it misbehave: --exit-at-once, --hang, --stubborn, --die-after SECONDS, --port NUMBER, --waits-for FILE.
With --passes-on ACTION it sends that action, its own one mostly, a goal of 0 for each message on `simple_goal`.
"""

import argparse
import os
import signal
import socket
import sys
import time
from pathlib import Path

import actionlib
import rospy
from actionlib.msg import TestAction, TestGoal, TestResult
from node_kit.ros.action_server import Sturdy
from std_msgs.msg import Empty

parser = argparse.ArgumentParser()
parser.add_argument("--exit-at-once", action="store_true")
parser.add_argument("--hang", action="store_true")
parser.add_argument("--stubborn", action="store_true")
parser.add_argument("--die-after", type=float)
parser.add_argument("--port", type=int)
parser.add_argument("--passes-on")
parser.add_argument("--waits-for", type=Path)
options = parser.parse_args(rospy.myargv()[1:])

if options.exit_at_once:
    sys.exit(1)
if options.stubborn:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
while options.hang:
    time.sleep(1.0)
while options.waits_for and not options.waits_for.exists():
    time.sleep(0.02)
if options.port:
    socket.create_server(("127.0.0.1", options.port))

rospy.init_node("wait_server", disable_signals=options.stubborn)
sys.stdout.write("it writes to its log\n")


class Server(Sturdy, actionlib.ActionServer):
    """A server as any, but what a node prints when it ends stands in the launcher's output, which tests read."""


def accept(handle):
    if handle.get_goal().goal < 0:
        handle.set_rejected()
        return
    handle.set_accepted()
    if handle.get_goal().goal:
        handle.set_succeeded(TestResult(handle.get_goal().goal))


server = Server("wait", TestAction, accept, lambda handle: handle.set_canceled(), auto_start=False)
server.start()
if options.passes_on:
    client = actionlib.SimpleActionClient(options.passes_on, TestAction)
    client.wait_for_server()
    heard_by = client.action_client.pub_goal.impl.has_connection
    while not (heard_by("/rosgraph_manipulator") or heard_by("/action_relay")):  # who keeps the goal
        rospy.sleep(0.01)
    rospy.Subscriber("simple_goal", Empty, lambda _: client.send_goal(TestGoal(0)))
if options.die_after is not None:
    time.sleep(options.die_after)
    os._exit(3)
while options.stubborn:
    time.sleep(1.0)
rospy.spin()
