"""Ranges and choices are read from cfg files that are not run."""

import math

from ros_model.io.dynamic_parameters import ranges_of

CFG = """#!/usr/bin/env python3
from dynamic_reconfigure.parameter_generator_catkin import *
raise SystemExit("nobody runs this")
gen = ParameterGenerator()
modes = gen.enum([gen.const("fast", int_t, 0, "x"), gen.const("good", int_t, 3, "y")], "how")
gen.add("gain", double_t, 0, "how much", 0.5, 0.1, 2.0)
gen.add(name="depth", paramtype=int_t, level=0, description="how deep", default=1, min=-4, max=9)
gen.add("mode", int_t, 0, "how", 0, 0, 3, edit_method=modes)
gen.add("limit", double_t, 0, "computed", 0.5, 0.1, math.pi)
gen.add("on", bool_t, 0, "whether", True)
"""
MANIFEST = (
    "<package format='2'><name>{}</name><version>0.1.0</version><description>x</description>"
    "<maintainer email='a@b.example'>a</maintainer><license>x</license></package>"
)


def package(tmp_path, monkeypatch, name, text):
    (tmp_path / name / "cfg").mkdir(parents=True)
    (tmp_path / name / "package.xml").write_text(MANIFEST.format(name))
    (tmp_path / name / "cfg" / "Lens.cfg").write_text(text)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))


def test_ranges_and_choices_are_told_in_words(tmp_path, monkeypatch):
    package(tmp_path, monkeypatch, "lens_driver", CFG)
    where = "(lens_driver/cfg/Lens.cfg)"
    assert ranges_of("lens_driver") == {
        "gain": f"0.1 to 2.0 {where}",
        "depth": f"-4 to 9 {where}",
        "mode": f"one of 0, 3 {where}",
        "limit": f"0.1 to {math.pi} {where}",
    }


def test_file_that_is_no_python_and_package_that_is_not_here_tell_nothing(tmp_path, monkeypatch):
    package(tmp_path, monkeypatch, "lens_driver", "gen.add(")
    assert ranges_of("lens_driver") == {}
    assert ranges_of("no_such_driver") == {}
