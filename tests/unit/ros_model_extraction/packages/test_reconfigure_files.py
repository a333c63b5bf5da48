"""Parameters of dynamic_reconfigure."""

from __future__ import annotations

import textwrap

import pytest
from ros_model_extraction.node_facts import SourceError
from ros_model_extraction.packages.reconfigure_files import configuration, read_configurations

CODE = """
    from math import pi
    from dynamic_reconfigure.parameter_generator_catkin import *
    PACKAGE = "demo"
    gen = ParameterGenerator()
    modes = gen.enum([gen.const("Slow", int_t, 3, "")], "")
    FIRST = gen.const("First", int_t, 7, "")
    gen.add("rate", double_t, 0, "Hz", 10, 0, 100)
    gen.add("angle", double_t, 0, "rad", -pi / 6, -2 * pi, 2 * pi)
    group = gen.add_group("More")
    group.add("count", int_t, 0, "how many", default=2 + 3)
    group.add("mode", int_t, 0, "how", 3, 0, 3, edit_method=modes)
    group.add(name="is_on", paramtype=bool_t, level=0, description="", default=1)
    gen.add("frame", str_t, 0, "frame", PACKAGE + "_link")
    gen.add("limit", double_t, 0, "no default")
    gen.add("unknown", double_t, 0, "", compute())
    gen.add("by_zero", double_t, 0, "", 1 / 0)
    exit(gen.generate(PACKAGE, "demo", "Planner"))
    """


def read(code: str):
    return configuration(textwrap.dedent(code), "cfg/Demo.cfg", "Demo")


def test_parameters_have_type_and_default_as_the_generated_class():
    name, parameters, remarks = read(CODE)
    assert name == "PlannerConfig"
    assert [(p.name, p.kind, p.default) for p in parameters] == [
        ("rate", "Double", 10),
        ("angle", "Double", pytest.approx(-0.5235987)),
        ("count", "Integer", 5),
        ("mode", "Integer", 3),
        ("is_on", "Boolean", True),
        ("frame", "String", "demo_link"),
        ("limit", "Double", 0.0),
        ("unknown", "Double", None),
        ("by_zero", "Double", None),
    ]
    assert remarks == ()


def test_what_is_not_understood_is_said():
    code = """
        gen = ParameterGenerator()
        for name in names():
            gen.add(name, double_t, 0, "", 1.0)
        add_more(gen)
        """
    name, parameters, remarks = read(code)
    assert (name, parameters) == ("DemoConfig", ())
    assert [str(remark) for remark in remarks] == [
        "cfg/Demo.cfg:4:5: a parameter of dynamic_reconfigure whose name is not known",
        "cfg/Demo.cfg:5:1: add_more may add parameters of dynamic_reconfigure: look there",
    ]


def test_file_that_is_no_python_is_said(tmp_path):
    with pytest.raises(SourceError, match="no Python 3"):
        read("print 'x'")
    (tmp_path / "cfg").mkdir()
    (tmp_path / "cfg" / "Bad.cfg").write_text("print 'x'")
    found, remarks = read_configurations(tmp_path)
    assert found == {}
    assert [str(remark) for remark in remarks] == ["cfg/Bad.cfg:1:1: not read: it is no Python 3"]
