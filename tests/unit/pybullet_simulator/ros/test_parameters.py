import math

import pytest
from pybullet_simulator.ros.parameters import ParameterError, file_path, flag, number, seed


def test_good_values_pass():
    assert number(1, "~a", 0.0) == 1.0
    assert seed(7) == 7
    assert flag(True, "~gui") is True
    assert file_path("/tmp/w.yaml", "~world").name == "w.yaml"


@pytest.mark.parametrize("value", ["1", None, True, math.nan, math.inf, -1, 11])
def test_bad_number_is_refused_by_name(value):
    with pytest.raises(ParameterError, match=r"~rate is .* at least 0 and at most 10"):
        number(value, "~rate", 0.0, 10.0)


@pytest.mark.parametrize("value", [-1, 1.5, "x", True])
def test_bad_seed_is_refused(value):
    with pytest.raises(ParameterError, match="~seed"):
        seed(value)


def test_bad_flag_and_path_are_refused():
    with pytest.raises(ParameterError, match="true or false"):
        flag("yes", "~gui")
    with pytest.raises(ParameterError, match="path"):
        file_path(3, "~world")
