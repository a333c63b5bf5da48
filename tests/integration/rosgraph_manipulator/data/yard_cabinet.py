#!/usr/bin/env python3
"""A cabinet of devices that services reset, each in a way of its own."""

import itertools
import threading

import rospy
from std_srvs.srv import Empty, EmptyResponse, SetBool, SetBoolResponse, Trigger, TriggerResponse

calls = itertools.count()


def reset(_):
    """Fail the first time."""
    return (
        TriggerResponse(False, "the gate\nis jammed") if next(calls) == 0 else TriggerResponse(True, "the gate moves")
    )


def raise_error(_):
    raise ValueError("no such horn")


rospy.init_node("yard_cabinet")
services = [
    rospy.Service("~gate/reset", Trigger, reset),
    rospy.Service("~lamp/restart", Empty, lambda _: EmptyResponse()),
    rospy.Service("~valve/reset", Trigger, lambda _: threading.Event().wait()),  # for ever
    rospy.Service("~door/open", SetBool, lambda _: SetBoolResponse(True, "open")),
    rospy.Service("~horn/reset", Trigger, raise_error),
]
rospy.spin()
