"""Functions that run side by side: what each sees of the others, and whether they agree."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosgraph_launcher.description import NodeDescription, SystemDescription
from rosgraph_manipulator.change.tactics import ChangeProcesses, NoRunningNodes, load_tactics, plan_change
from rosgraph_manipulator.configuration.difference import compare
from rosgraph_manipulator.configuration.sharing import disagreement, seen_by

TACTICS = load_tactics()
NAMES = ("/camera", "/detector", "/arm", "/gripper")


def system(*names, parameters=None, **options):
    nodes = {name: NodeDescription(name, "/", "cell", "driver", **options) for name in names}
    return SystemDescription(nodes, parameters or {})


def test_shared_node_need_not_be_started_and_must_not_be_stopped():
    others = {"f_look": system("/camera")}
    assert not compare(seen_by(system(), system("/camera"), others), system("/camera")).touches_nodes
    difference = compare(seen_by(system("/camera", "/arm"), system("/arm"), others), system("/arm"))
    assert not difference.touches_nodes


def test_configuration_that_agrees_can_run_beside_others():
    others = {"f_look": system("/camera", parameters={"/rate": 1, "/qa_safety": 0.5})}
    wanted = system("/camera", "/arm", parameters={"/rate": 1.0, "/qa_safety": 0.9})
    assert disagreement("f_pick", wanted, others) == ""


@pytest.mark.parametrize(
    ("wanted", "reason"),
    [
        (
            system("/camera", args="--fast"),
            "node /camera belongs to f_pick and f_look, which runs, and differs in args",
        ),
        (system("/camera", parameters={"/rate": 2}), "parameter /rate is 2 for f_pick and 1 for f_look, which runs"),
        (
            SystemDescription(
                {"/camera": NodeDescription("/camera", "/", "cell", "driver", parameters={"qa_gain": 2})}
            ),
            "parameter /camera/qa_gain is 2 for f_pick and 5 for f_look",
        ),
        (system("/arm", parameters={"/camera/gain": 2}), "parameter /camera/gain is 2 for f_pick and 5 for f_look"),
    ],
)
def test_configuration_that_disagrees_is_refused_with_the_place(wanted, reason):
    camera = NodeDescription("/camera", "/", "cell", "driver", parameters={"gain": 5, "qa_gain": 5})
    others = {"f_look": SystemDescription({"/camera": camera}, {"/rate": 1})}
    assert reason in disagreement("f_pick", wanted, others)


def test_node_of_which_only_the_name_is_known_does_not_disagree():
    others = {"f_look": SystemDescription({"/camera": NodeDescription("/camera", "", "", "")})}
    assert disagreement("f_pick", system("/camera"), others) == ""


def test_shared_parameter_that_changes_does_not_restart_nodes_of_others():
    running, wanted = system("/camera", "/arm", parameters={"/x": 1}), system("/camera", "/arm", parameters={"/x": 2})
    assert compare(running, wanted, {"/camera"}).replaced == ("/arm",)


subsets = st.sets(st.sampled_from(NAMES)).map(sorted)


@given(subsets, subsets, subsets, st.sampled_from([1, 2]))
def test_no_plan_touches_what_another_function_needs(before, wanted, other, value):
    running, others = system(*before), {"f_other": system(*other)}
    after = system(*wanted, parameters={"/x": value})
    seen = seen_by(running, after, others)
    plans, problems = plan_change(seen, after, NoRunningNodes(), TACTICS, set(other) & set(seen.nodes))
    assert not problems
    assert plans
    for plan in plans:
        stopped = {name for step in plan.steps if isinstance(step, ChangeProcesses) for name in step.stop}
        assert not stopped & set(other)
        left = (set(before) - stopped) | set(other) | set(plan.started)
        assert set(wanted) <= left
        assert left <= set(wanted) | set(other)
