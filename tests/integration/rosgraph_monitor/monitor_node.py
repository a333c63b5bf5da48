#!/usr/bin/env python3
"""A node with the interfaces that its arguments name: pub=TOPIC:TYPE[@HZ], sub=TOPIC:TYPE, srv=NAME.

act=NAME:TYPE serves an action, ask=NAME:TYPE is a client of it.

What it publishes changes with each message, or what ~mode says: "quiet" nothing, "stuck" the same again and again.
"""

import itertools
import signal

import actionlib
import roslib.message
import rospy
from std_msgs.msg import String
from std_srvs.srv import Empty, EmptyResponse


class Node:
    def __init__(self, name, interfaces):
        rospy.init_node(name)
        self.mode = ""
        self.subscriber = rospy.Subscriber("~mode", String, self.change)
        self.ends = [self.make(*interface.partition("=")[::2]) for interface in interfaces]

    def change(self, msg):
        self.mode = msg.data

    def make(self, kind, text):
        if kind == "srv":
            return rospy.Service(text, Empty, lambda _: EmptyResponse())
        text, _, rate = text.partition("@")
        topic, _, type_name = text.partition(":")
        message_class = roslib.message.get_message_class(type_name)
        if kind == "act":
            return actionlib.ActionServer(topic, message_class, lambda _: None, auto_start=False).start()
        if kind == "ask":
            return actionlib.ActionClient(topic, message_class)
        if kind == "sub":
            return rospy.Subscriber(topic, message_class, lambda _: None)
        publisher = rospy.Publisher(topic, message_class, queue_size=1)
        if rate:
            count = itertools.count()
            last = [0]

            def publish(_):
                if self.mode != "stuck":
                    last[0] = next(count)
                if self.mode != "quiet":
                    publisher.publish(message(message_class, last[0]))

            return publisher, rospy.Timer(rospy.Duration(1.0 / float(rate)), publish)
        return publisher


def message(message_class, number):
    msg = message_class()
    if hasattr(msg, "header"):
        msg.header.stamp = rospy.Time.now()
        msg.header.frame_id = "frame"
    if hasattr(msg, "ranges"):
        msg.ranges = [float(number)]
    elif hasattr(msg, "percentage"):
        msg.percentage = 0.5
    elif isinstance(msg, String):
        msg.data = str(number)
    else:
        msg.data = number
    return msg


if __name__ == "__main__":
    # Until it spins, the handler of rospy may wait for a lock that the main thread holds.
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    _, name, *arguments = rospy.myargv()
    node = Node(name, [argument for argument in arguments if "=" in argument])
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, signal.SIGTERM})
    rospy.spin()
