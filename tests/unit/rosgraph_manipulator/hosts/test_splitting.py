"""What each launcher is asked for in one change."""

from hypothesis import given
from hypothesis import strategies as st
from rosgraph_launcher.launching.report import LauncherReport
from rosgraph_manipulator.hosts.splitting import Part, split

LAUNCHERS = ["/far", "/here", "/other"]
NODES = ["/a", "/b", "/c", "/d"]


def report(*nodes, configuration="c"):
    return LauncherReport("f", configuration, nodes=nodes)


def test_each_launcher_starts_and_stops_its_own():
    reports = {"/here": report("/old"), "/far": report("/b_old")}
    parts = split({"/a": "/here", "/b": "/far"}, reports, ["/old", "/b_old"], ["/a", "/b"])
    assert parts == [
        Part("/far", ("/b",), ("/b_old",), ("/b",)),
        Part("/here", ("/a",), ("/old",), ("/a",)),
    ]


def test_launcher_of_nodes_that_run_on_gets_the_new_configuration():
    parts = split({"/a": "/here", "/b": "/far"}, {"/far": report("/b")}, [], ["/a"])
    assert parts[0] == Part("/far", ("/b",))


def test_launcher_that_loses_its_last_node_releases_the_function():
    (here,) = split({}, {"/here": report("/a")}, ["/a"], [])
    assert here.releases
    far, _ = split({"/a": "/here"}, {"/far": report("/b")}, ["/b"], ["/a"])
    assert (far.releases, far.stop) == (True, ("/b",))


def test_launcher_that_keeps_nodes_for_a_later_step_does_not_release_the_function():
    far, _ = split({"/a": "/here"}, {"/far": report("/b")}, [], ["/a"])
    assert not far.releases


def test_node_that_moves_to_another_host_ends_first():
    far, here = split({"/a": "/here"}, {"/far": report("/a")}, ["/a"], ["/a"])
    assert (far.stop, far.start, far.comes_first) == (("/a",), (), True)
    assert (here.stop, here.start, here.comes_first) == ((), ("/a",), False)


def test_nodes_that_change_places_end_before_either_of_them_starts():
    reports = {"/here": report("/a", "/c"), "/far": report("/b")}
    places = {"/a": "/far", "/b": "/here", "/c": "/here"}
    parts = split(places, reports, ["/a", "/b"], ["/a", "/b"])
    assert [part for part in parts if part.comes_first] == [
        Part("/far", (), ("/b",), releases=True, comes_first=True),
        Part("/here", ("/c",), ("/a",), comes_first=True),
    ]
    assert [part for part in parts if not part.comes_first] == [
        Part("/far", ("/a",), start=("/a",)),
        Part("/here", ("/b", "/c"), start=("/b",)),
    ]


def test_launcher_that_never_had_the_function_is_not_asked():
    parts = split({"/a": "/here"}, {"/far": report(configuration="")}, [], ["/a"])
    assert [part.launcher for part in parts] == ["/here"]


@given(
    places=st.dictionaries(st.sampled_from(NODES), st.sampled_from(LAUNCHERS)),
    running=st.dictionaries(st.sampled_from(NODES), st.sampled_from(LAUNCHERS)),
)
def test_parts_together_are_the_change(places, running):
    reports = {name: report(*(n for n, place in running.items() if place == name)) for name in set(running.values())}
    stop = list(running)
    parts = split(places, reports, stop, list(places))
    assert sorted(node for part in parts for node in part.start) == sorted(places)
    assert sorted(node for part in parts for node in part.stop) == sorted(stop)
    assert {node: part.launcher for part in parts for node in part.nodes} == places
    assert all(part.releases is (not part.nodes) for part in parts)
    for node, place in running.items():
        ends = next(number for number, part in enumerate(parts) if node in part.stop)
        begins = next((number for number, part in enumerate(parts) if node in part.start), ends)
        assert places.get(node, place) == place or (parts[ends].comes_first and not parts[begins].comes_first)
