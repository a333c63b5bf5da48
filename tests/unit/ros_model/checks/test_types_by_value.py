"""Types that follow from whole numbers alone: a variant may give a number with a point."""

import pytest
from helpers import launch_files
from ros_model.checks.systems import check_system
from ros_model.findings import ERROR, WARNING
from ros_model.generators.launch import launch_file
from ros_model.language.library import Library
from ros_model.language.packages import OBSERVED
from ros_model.language.packages_reader import parse_packages
from ros_model.language.packages_writer import write_packages
from ros_model.language.system_reader import parse_system

KEPT = "// Whole numbers alone tell types of wells.pump.pump: power, limits.\n"
SEEN = f"// {OBSERVED}\n"


def model(power="Integer", limits="Array { type Integer }", header=""):
    return f"""{header}PackageSet {{ CatkinPackage wells {{ Artifact pump {{ Node {{ name pump Parameters {{
        Parameter {{ name power type {power} }}, Parameter {{ name limits type {limits} }} }} }} }} }} }}"""


def system(power, limits="{1, 2}"):
    return parse_system(
        f"""RosSystem {{ Name s RosComponents ( ComponentInterface {{ name pump FromRosNode 'wells.pump.pump'
        RosParameters {{ RosParameter power {{ RefParameter 'wells.pump.pump.power' value {power} }},
            RosParameter limits {{ RefParameter 'wells.pump.pump.limits' value {limits} }} }} }} ) }}"""
    )


def library(*texts):
    return Library(package for text in texts for package in parse_packages(text).packages)


def findings(value, known):
    return [(f.severity, f.message) for f in check_system(system(*value), library=known) if f.rule == "value"]


@pytest.mark.parametrize("header", [SEEN, KEPT])
@pytest.mark.parametrize(("value", "kind"), [(("0.5",), "Double"), (("1", "{0.5, 2}"), "Array { type Double }")])
def test_number_with_a_point_widens_what_whole_numbers_alone_have_told(header, value, kind):
    known = library(model(header=header))
    ((severity, text),) = findings(value, known)
    assert severity == WARNING
    assert f"counts as {kind}: only whole numbers were seen of it" in text
    assert check_system(system(*value), library=known)[0].position.line > 1  # where the type is written
    assert launch_file(system(*value), library=known)


def test_launch_file_has_the_number_with_a_point(tmp_path):
    path = tmp_path / "a.launch"
    path.write_text(launch_file(system("0.5"), library=library(model(header=SEEN))))
    assert launch_files.read(path).params["/pump/power"].value == 0.5


@pytest.mark.parametrize("order", [1, -1])
def test_type_that_the_source_declares_counts_whichever_model_comes_first(order):
    texts = [model(header=SEEN), model("Double", "Array { type Double }")]
    assert findings(("0.5", "{0.5, 2}"), library(*texts[::order])) == []
    texts = [model(header=SEEN), model()]
    ((severity, text),) = findings(("0.5",), library(*texts[::order]))
    assert (severity, text) == (ERROR, "the value 0.5 of 'power' is no Integer, as it is declared")


@pytest.mark.parametrize("value", [("fast",), ("1", "{one, two}"), ("true",)])
def test_what_is_no_number_is_refused_all_the_same(value):
    ((severity, _),) = findings(value, library(model(header=SEEN)))
    assert severity == ERROR


def test_kept_line_outlives_formatting():
    known = parse_packages(write_packages(parse_packages(model(header=KEPT))))
    (artifact,) = known.packages[0].artifacts
    assert [parameter.is_by_value for parameter in artifact.nodes[0].parameters] == [True, True]
