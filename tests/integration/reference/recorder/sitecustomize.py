"""Makes a node of a test tell which parameters it reads, and with which defaults: a line of JSON for each, in a file.

Python imports this module at the start of each process that has its folder on PYTHONPATH.
"""

import json
import os
import sys
from pathlib import Path

OWN = tuple(path.name for path in (Path(os.environ["MROS_ROOT"]) / "catkin_ws" / "src").iterdir() if path.is_dir())
FILE = Path(os.environ["ROS_LOG_DIR"]) / "parameters" / str(os.getpid())
NAME = "".join(word.removeprefix("__name:=") for word in sys.argv if word.startswith("__name:="))
NODE = "/".join([os.environ.get("ROS_NAMESPACE", "").rstrip("/"), NAME])


class Group(dict):
    """A group of parameters that tells what is read of it; it counts as given, where it is empty, too."""

    place = "~"

    def __bool__(self):
        return True

    def get(self, name, default=None):
        _tell(f"{self.place}{name}", default)
        return super().get(name, default)

    def __getitem__(self, name):
        if name in self:
            _tell(f"{self.place}{name}", None)
        return super().__getitem__(name)


def _tell(name, default):
    FILE.parent.mkdir(parents=True, exist_ok=True)
    with FILE.open("a", encoding="utf-8") as file:
        file.write(json.dumps({"node": NODE, "name": name, "default": default}, default=str) + "\n")


def _watch_trees():
    from node_kit.parameters import ParameterTree

    def watched(method):
        def read(tree, name, *given, **options):
            default = given[0] if given and method.__name__ != "mapping" else options.get("default")
            if not isinstance(tree.values, Group):
                _tell(tree.full_name(name), default)
            return method(tree, name, *given, **options)

        return read

    for name in ("value", "number", "whole", "flag", "text", "choice", "path", "items", "texts", "numbers", "mapping"):
        setattr(ParameterTree, name, watched(getattr(ParameterTree, name)))


def _watch_calls():
    import rospy

    get_param = rospy.get_param

    def read(name, default=rospy.client._unspecified):
        value = get_param(name, default)
        caller = sys._getframe(1).f_globals.get("__name__", "")
        if not caller.startswith(OWN):
            return value
        if rospy.resolve_name(name).rstrip("/") == rospy.get_name():
            return Group(value or {})
        _tell(name, None if default is rospy.client._unspecified else default)
        return value

    rospy.get_param = read


if NAME:
    _watch_trees()
    _watch_calls()
