"""Where the programs of packages are."""

from functools import cache

from roslib.packages import find_node


@cache
def program(package, name):
    """Return the path of a package's program, as rosrun finds it; rosrun itself takes half a second for that."""
    (path,) = find_node(package, name)[:1]
    return path
