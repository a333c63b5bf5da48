#!/usr/bin/env python3
"""A node that writes into the file in its first argument when it begins and when it ends.

Its second argument says how long its end takes, s: whoever does not wait for that has it twice. While there is a file
of that name and `.hold`, it does not become a node.
"""

import time
from pathlib import Path

import rospy

_, path, to_end = rospy.myargv()
path = Path(path)
hold = Path(f"{path}.hold")


def note(word):
    with path.open("a") as file:
        file.write(f"{word}\n")


note("begins")
while hold.exists():
    time.sleep(0.02)
rospy.init_node("lived")
rospy.spin()
time.sleep(float(to_end))
note("ends")
