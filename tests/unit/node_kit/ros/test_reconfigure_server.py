"""Servers of dynamic_reconfigure, asked for what they do not have."""

import math
from types import SimpleNamespace

import pytest
import rospy
from bad_input.unconnected import unconnected
from dynamic_reconfigure.encoding import encode_config
from dynamic_reconfigure.msg import BoolParameter, Config, DoubleParameter, GroupState, IntParameter, StrParameter
from dynamic_reconfigure.server import Server
from dynamic_reconfigure.srv import ReconfigureRequest
from node_kit.parameters import ParameterError
from node_kit.ros.reconfigure_server import Strict


class StrictServer(Strict, Server):
    """As nodes have it."""


def definition():
    """Return what a .cfg file of a mixer becomes."""
    rows = (("speed", "double", 1.0, 0.0, 5.0), ("blades", "int", 3, 1, 8), ("lid", "bool", True, False, True),
            ("batch", "str", "none", "", ""))  # fmt: skip
    names = ("name", "type", "default", "min", "max")
    rest = {"level": 0, "description": "", "edit_method": ""}
    parameters = [{**dict(zip(names, row, strict=True)), **rest} for row in rows]
    group = {"name": "Default", "type": "", "state": True, "id": 0, "parent": 0, "parameters": parameters, "groups": []}
    columns = {key: {one["name"]: one[key] for one in parameters} for key in ("default", "min", "max", "level")}
    return SimpleNamespace(config_description=group, defaults=columns.pop("default"), **columns)


@pytest.fixture
def taken():
    """Return the values that the node has taken so far."""
    return []


@pytest.fixture
def ask(taken):
    """Return a function that asks a server of a mixer, and returns its answer."""
    with unconnected():
        server = StrictServer(definition(), lambda config, _level: taken.append(dict(config)) or config)
        yield lambda config: server._set_callback(ReconfigureRequest(config))


def speed_of(config):
    return next(one.value for one in config.doubles if one.name == "speed")


@pytest.mark.parametrize(
    ("config", "told"),
    [
        (Config(doubles=[DoubleParameter("torque", 1.0)]), "there is no parameter 'torque': there are batch, blades"),
        (Config(ints=[IntParameter("groups", 1)]), "there is no parameter 'groups'"),
        (Config(strs=[StrParameter("speed", "fast")]), "speed is 'fast': it must be a number"),
        (Config(bools=[BoolParameter("blades", True)]), "blades is 'True': it must be a whole number"),
        (Config(doubles=[DoubleParameter("blades", 2.5)]), "blades is '2.5': it must be a whole number"),
        (Config(ints=[IntParameter("lid", 1)]), "lid is '1': it must be true or false"),
        (Config(doubles=[DoubleParameter("speed", math.nan)]), "speed is 'nan': it must be a number"),
    ],
)
def test_what_the_server_does_not_have_is_refused_and_later_requests_are_answered(ask, taken, config, told):
    before = len(taken)
    with pytest.raises(rospy.ServiceException, match=told):
        ask(config)
    assert len(taken) == before
    assert speed_of(ask(Config(doubles=[DoubleParameter("speed", 2.0)]))) == 2.0


@pytest.mark.parametrize("group", [GroupState("Default", True, 1, 1), GroupState("Default", True, 3, 3)])
def test_groups_of_a_request_do_no_harm(ask, group):
    assert speed_of(ask(Config(doubles=[DoubleParameter("speed", 2.0)], groups=[group]))) == 2.0


def test_whole_request_of_a_client_is_taken_within_its_bounds(ask, taken):
    wanted = encode_config({"speed": 9.0, "blades": 4, "lid": False, "batch": "7"})
    assert speed_of(ask(wanted)) == 5.0
    assert {"speed": 5.0, "blades": 4, "lid": False, "batch": "7"}.items() <= taken[-1].items()


def test_whole_number_is_taken_where_a_number_is_wanted(ask):
    asked = ask(Config(ints=[IntParameter("speed", 2)]))
    assert [(one.name, one.value) for one in (*asked.doubles, *asked.ints) if one.name == "speed"] == [("speed", 2)]


def test_parameter_of_another_type_is_told_at_the_start():
    with (
        unconnected({"/node": {"speed": "fast"}}),
        pytest.raises(ParameterError, match="parameter /node/speed is 'fast': it must be a number"),
    ):
        StrictServer(definition(), lambda config, _level: config)
