"""What stood on the parameter server comes back when a configuration that wrote over it leaves."""

from rosgraph_manipulator.launching.parameters import OverwrittenParameters


def adopt(memory, server, wanted):
    asked = memory.unknown(wanted)
    memory.remember(asked, {name: server[name] for name in asked if name in server})
    values, gone = memory.transition(wanted)
    for name in gone:
        server.pop(name, None)
    server.update(values)


def test_nothing_is_left_of_an_earlier_configuration():
    memory, server = OverwrittenParameters(), {"/a/x": "base"}
    adopt(memory, server, {"/a/x": 1, "/a/y": 1})
    assert server == {"/a/x": 1, "/a/y": 1}
    adopt(memory, server, {"/a/z": 2})
    assert server == {"/a/x": "base", "/a/z": 2}
    adopt(memory, server, {"/a/x": 3})
    assert server == {"/a/x": 3}
