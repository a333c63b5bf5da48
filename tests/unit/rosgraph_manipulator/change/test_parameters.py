"""What stood on the parameter server comes back when a configuration that wrote over it leaves."""

import pytest
from rosgraph_manipulator.change.parameters import OverwrittenParameters, put_back


def adopt(memory, server, wanted):
    asked = memory.unknown(wanted)
    memory.remember(asked, {name: server[name] for name in asked if name in server})
    values, gone = memory.transition(wanted)
    for name in gone:
        server.pop(name, None)
    server.update(values)
    memory.restored(wanted)


def test_nothing_is_left_of_an_earlier_configuration():
    memory, server = OverwrittenParameters(), {"/a/x": "base"}
    adopt(memory, server, {"/a/x": 1, "/a/y": 1})
    assert server == {"/a/x": 1, "/a/y": 1}
    adopt(memory, server, {"/a/z": 2})
    assert server == {"/a/x": "base", "/a/z": 2}
    adopt(memory, server, {"/a/x": 3})
    assert server == {"/a/x": 3}


def test_parameters_of_other_functions_are_left_alone():
    overwritten = OverwrittenParameters({"/speed": 1, "/width": 2}, ["/a", "/b"])
    assert overwritten.transition({"/x": 0}, others=["/speed", "/a"]) == ({"/width": 2, "/x": 0}, ["/b"])


def test_former_values_survive_the_parameter_server():
    overwritten = OverwrittenParameters({"/speed": {"x": 1}}, ["/a"])
    again = OverwrittenParameters.from_parameter(overwritten.as_parameter())
    assert again.transition({}) == ({"/speed": {"x": 1}}, ["/a"])


@pytest.mark.parametrize("value", [None, 3, {}, {"before": 3, "absent": []}, {"before": [["/a"]], "absent": []}])
def test_parameter_of_another_form_tells_nothing(value):
    assert OverwrittenParameters.from_parameter(value).transition({}) == ({}, [])


def test_words_tell_what_parameters_had_and_have_again():
    wanted = {f"/arm/{name}": 1 for name in "abcdefg"}
    assert put_back({"/arm/a": 5, "/arm/b": None}, wanted) == "put back: /arm/a (5, not 1), /arm/b (not set, not 1)"
    assert put_back(dict.fromkeys(wanted, 2), wanted).endswith("/arm/e (2, not 1) and 2 more")


def test_what_was_restored_belongs_to_others_again():
    memory, server = OverwrittenParameters(), {"/speed": 1.0}
    adopt(memory, server, {"/move_base/x": 1, "/speed": 0.5})
    adopt(memory, server, {})
    assert server == {"/speed": 1.0}
    server.update({"/move_base/x": 7, "/speed": 2.0})  # by an operator
    adopt(memory, server, {"/arm/y": 1})
    assert server == {"/move_base/x": 7, "/speed": 2.0, "/arm/y": 1}
    adopt(memory, server, {"/speed": 0.5})
    adopt(memory, server, {})
    assert server == {"/move_base/x": 7, "/speed": 2.0}
    assert memory.as_parameter() == {"before": [], "absent": []}


def test_former_values_of_what_is_still_overwritten_are_kept():
    overwritten = OverwrittenParameters({"/speed": 1, "/width": 2}, ["/a", "/b"])
    assert overwritten.restored(["/x"], others=["/speed", "/a"])
    assert overwritten.as_parameter() == {"before": [["/speed", 1]], "absent": ["/a"]}
    assert not overwritten.restored(["/x"], others=["/speed", "/a"])
