"""Which plans lead from one configuration to another, and in which order."""

import pytest
from rosgraph_launcher.description import NodeDescription, SystemDescription
from rosgraph_manipulator.change.tactics import Adjustable, ChangeProcesses, SetParameters, load_tactics, plan_change

TACTICS = load_tactics()


class Nodes:
    """Running nodes that take some parameters by dynamic_reconfigure."""

    def __init__(self, **taken):
        self._taken = {f"/{name}": parameters for name, parameters in taken.items()}

    def adjustable(self, node):
        return self._taken.get(node, {})


SPEED = {"speed": Adjustable("/a", "speed", "double", 0.0, 2.0), "dwa/mode": Adjustable("/a/dwa", "mode", "str")}


def system(**nodes):
    return SystemDescription(
        {f"/{name}": NodeDescription(f"/{name}", "/", "p", "x", parameters=values) for name, values in nodes.items()}
    )


def found(running, wanted, nodes=None):
    return plan_change(running, wanted, nodes or Nodes(), TACTICS)[0]


def names(*arguments):
    return [plan.tactic for plan in found(*arguments)]


def test_equal_configurations_need_nothing():
    first = found(system(a={"speed": 1}), system(a={"speed": 1}))[0]
    assert (first.tactic, first.touched) == ("nothing", ())


def test_drifted_parameter_that_no_node_takes_while_it_runs_is_stored_only():
    same = system(a={"sources": "scan"}, b={})
    plans, _ = plan_change(same, same, Nodes(a=SPEED), TACTICS, drifted=["/a/sources", "/site"])
    assert [(plan.tactic, plan.touched) for plan in plans] == [("parameters", ())]


def test_drifted_parameter_that_a_node_takes_is_set_while_it_runs():
    running, wanted = system(a={"speed": 7.5}), system(a={"speed": 1.0})
    plans, _ = plan_change(running, wanted, Nodes(a=SPEED), TACTICS, drifted=["/a/speed"])
    assert plans[0].steps == (SetParameters("/a", {"speed": 1.0}), ChangeProcesses())


def test_parameters_that_the_node_takes_are_set_while_it_runs():
    wanted = system(a={"speed": 2, "dwa/mode": "fast"})
    first = found(system(a={"speed": 1, "dwa/mode": "slow"}), wanted, Nodes(a=SPEED))[0]
    assert first.tactic == "parameters"
    assert first.steps == (
        SetParameters("/a", {"speed": 2.0}),
        SetParameters("/a/dwa", {"mode": "fast"}),
        ChangeProcesses(),
    )


@pytest.mark.parametrize("value", [2.1, -0.1, "fast", True])
def test_value_that_the_node_does_not_take_needs_a_restart(value):
    assert names(system(a={"speed": 1}), system(a={"speed": value}), Nodes(a=SPEED))[0] == "restart"


def test_parameter_that_the_node_does_not_take_needs_a_restart():
    wanted = system(a={"speed": 2, "sources": "cloud"})
    assert names(system(a={"speed": 1, "sources": "scan"}), wanted, Nodes(a=SPEED))[0] == "restart"


def test_exactly_the_nodes_that_differ_are_restarted():
    running, wanted = system(a={"x": 1}, b={"x": 1}, gone={}), system(a={"x": 1}, b={"x": 2}, new={})
    first, second = found(running, wanted)
    assert first.steps == (ChangeProcesses(("/gone", "/b"), ("/b", "/new")),)
    assert second.steps == (ChangeProcesses(("/a", "/b", "/gone"), ("/a", "/b", "/new")),)


def test_nodelets_are_loaded_again_when_their_manager_is_restarted():
    def camera(threads):
        manager = NodeDescription(
            "/m", "/", "nodelet", "nodelet", "manager", parameters={"num_worker_threads": threads}
        )
        return SystemDescription({"/m": manager, "/l": NodeDescription("/l", "/", "nodelet", "nodelet", "load a/B m")})

    assert found(camera(1), camera(2))[0].steps == (ChangeProcesses(("/m", "/l"), ("/m", "/l")),)
    assert found(camera(1), camera(1))[0].touched == ()


def test_node_that_takes_its_parameters_runs_on_while_another_is_restarted():
    running, wanted = system(a={"speed": 1}, b={}, gone={}), system(a={"speed": 2}, b={}, new={})
    first = found(running, wanted, Nodes(a=SPEED))[0]
    assert first.steps == (SetParameters("/a", {"speed": 2.0}), ChangeProcesses(("/gone",), ("/new",)))


def test_plan_that_does_the_same_as_a_cheaper_one_is_left_out():
    assert names(system(a={"x": 1}), system(a={"x": 2})) == ["restart"]


def test_from_nothing_everything_is_started():
    assert [str(plan) for plan in found(SystemDescription(), system(a={}, b={}))] == [
        "replace\n  1. start /a, /b; store the configuration's parameters"
    ]


def test_plan_prints_what_is_done():
    running, wanted = system(a={"speed": 1}, b={}, gone={}), system(a={"speed": 2}, b={}, new={})
    assert str(found(running, wanted, Nodes(a=SPEED))[0]) == (
        "restart\n  1. set at /a: speed = 2.0\n  2. stop /gone; start /new; store the configuration's parameters"
    )


def test_tactic_that_raises_is_named_and_the_others_go_on():
    def broken(_difference, _nodes):
        raise ZeroDivisionError("oh")

    kept, problems = plan_change(system(), system(a={}), Nodes(), {"broken": broken, **TACTICS})
    assert [plan.tactic for plan in kept] == ["replace"]
    assert problems == ["tactic broken makes no plan: ZeroDivisionError: oh"]


def test_tactics_are_exported_by_packages():
    assert set(TACTICS) >= {"nothing", "parameters", "restart", "replace"}


@pytest.mark.parametrize(
    ("kind", "value", "taken"),
    [
        ("int", 1, True),
        ("int", 1.0, False),
        ("double", 1, True),
        ("bool", True, True),
        ("bool", 1, False),
        ("str", "x", True),
        ("str", 1, False),
        ("int", True, False),
    ],
)
def test_types_must_fit(kind, value, taken):
    assert Adjustable("/a", "x", kind).takes(value) is taken
