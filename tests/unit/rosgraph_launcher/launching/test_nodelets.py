"""Which node has a manager unload what a killed loader has left there."""

import pytest
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.launching.nodelets import loaders, unloading


def loader(args, package="nodelet", executable="nodelet"):
    remaps = (("manager", "/camera/manager"),)
    return NodeDescription("/camera/debayer", "/camera/", package, executable, args, remaps, launch_prefix="nice")


@pytest.mark.parametrize(
    "args",
    [
        "load image_proc/debayer manager",
        "load --no-bond image_proc/debayer manager",
        "  load image_proc/debayer manager --no-bond _queue:=3 image_raw:=image",
    ],
)
def test_what_a_loader_has_left_is_unloaded_from_its_manager(args):
    unload = unloading(loader(args))
    assert unload.args == "unload /camera/debayer manager"
    assert (unload.namespace, unload.remaps) == ("/camera/", (("manager", "/camera/manager"),))
    assert unload.launch_prefix is None
    assert unload.name != "/camera/debayer"  # the master would end the loader otherwise


@pytest.mark.parametrize("args", ["manager", "standalone image_proc/debayer", "load image_proc/debayer", "", "load 'x"])
def test_other_nodelet_commands_leave_nothing_in_a_manager(args):
    assert unloading(loader(args)) is None


def test_other_nodes_that_load_leave_nothing_in_a_manager():
    assert unloading(loader("load a b", package="my_tools")) is None
    assert unloading(loader("load a b", executable="declared_nodelets")) is None


@pytest.mark.parametrize(
    ("manager", "remaps"),
    [
        ("manager", ()),
        ("/camera/manager", ()),
        ("m", (("m", "manager"),)),
        ("/m", (("/m", "/camera/manager"), ("other", "/manager"))),
    ],
)
def test_loader_belongs_to_its_manager_by_the_full_name(manager, remaps):
    nodes = {
        "/camera/debayer": NodeDescription(
            "/camera/debayer", "/camera", "nodelet", "nodelet", f"load a/B {manager}", remaps
        ),
        "/manager": NodeDescription("/manager", "/", "nodelet", "nodelet", "manager"),
    }
    assert loaders(nodes, ["/camera/manager"]) == ["/camera/debayer"]
    assert loaders(nodes, ["/manager", "/camera/debayer"]) == []


def test_nodes_that_load_no_nodelet_belong_to_no_manager():
    assert loaders({"/camera/debayer": loader("standalone a/B manager")}, ["/camera/manager"]) == []
