"""Projects: metacontrol.yaml, the base, the family of variants, and what each variant requires."""

import itertools
import re
import time

import pytest
import yaml
from ros_model.errors import ModelError
from ros_model.generators.deployment import manipulator, reasoner
from ros_model.io.project import load_project, problems_of
from ros_model.language.metamodel import PortPath, compose
from ros_model.project.tables import parse_table

BASE = """RosSystem { Name base
    RosComponents (
        ComponentInterface { name robot FromRosNode 'p.robot.robot'
            RosPublishers { RosPublisher odom { RefPublisher 'p.robot.robot.odom' }, RosPublisher rays { RefPublisher 'p.robot.robot.rays' } }
            RosSubscribers { RosSubscriber cmd { RefSubscriber 'p.robot.robot.cmd' }, RosSubscriber load { RefSubscriber 'p.robot.robot.load' } } },
        ComponentInterface { name laser FromRosNode 'p.laser.laser'
            RosPublishers { RosPublisher scan { RefPublisher 'p.laser.laser.scan' } }
            RosSubscribers { RosSubscriber rays { RefSubscriber 'p.laser.laser.rays' } } },
        ComponentInterface { name camera FromRosNode 'p.camera.camera'
            RosPublishers { RosPublisher points { RefPublisher 'p.camera.camera.points' } } },
        ComponentInterface { name battery FromRosNode 'p.battery.battery'
            RosPublishers { RosPublisher load { RefPublisher 'p.battery.battery.load' } } },
        ComponentInterface { name nav FromRosNode 'n.nav.nav'
            RosPublishers { RosPublisher cmd { RefPublisher 'n.nav.nav.cmd' } }
            RosSubscribers { RosSubscriber odom { RefSubscriber 'n.nav.nav.odom' }, RosSubscriber scan { RefSubscriber 'n.nav.nav.scan' } }
            RosParameters { RosParameter speed { RefParameter 'n.nav.nav.speed' value 1 }, RosParameter frame { RefParameter 'n.nav.nav.frame' value map } } }
    )
    TopicConnections {
        TopicConnection odom { From ( 'robot.odom' ) To ( 'nav.odom' ) },
        TopicConnection rays { From ( 'robot.rays' ) To ( 'laser.rays' ) },
        TopicConnection load { From ( 'battery.load' ) To ( 'robot.load' ) },
        TopicConnection scan { From ( 'laser.scan' ) To ( 'nav.scan' ) },
        TopicConnection cmd { From ( 'nav.cmd' ) To ( 'robot.cmd' ) }
    }
}"""  # noqa: E501
TABLE = "name,speed_mps,sensor\nslow,0.3,laser\nblind,0.7,camera\n"
QA = "name,safety,source\nslow,0.2,measured\nblind,0.9,measured\n"


@pytest.fixture
def settings():
    return {
        "package": "robot_models",
        "base": "base.rossystem",
        "variants": {
            "component": "nav",
            "table": "variants.csv",
            "qa": "qa.csv",
            "parameters": {"speed_mps": [{"name": "speed"}, {"name": "acceleration", "factor": 12}]},
            "connections": {"sensor": {"laser": ["laser.scan"], "camera": ["camera.points"]}},
        },
        "functions": {"f_move": {"designs": "all"}},
        "quality_attributes": {"safety": {"direction": "lower_is_better", "range": [0, 1]}},
        "utility": "safety",
        "objectives": {"o_move": {"function": "f_move", "nfrs": {"safety": 0.5}}},
        "components": {"laser": {"node": "laser"}},
    }


@pytest.fixture
def load(tmp_path, settings):
    def write_and_load(*, base=BASE, table=TABLE, qa=QA):
        for name, text in (("base.rossystem", base), ("variants.csv", table), ("qa.csv", qa)):
            (tmp_path / name).write_text(text)
        (tmp_path / "metacontrol.yaml").write_text(yaml.safe_dump(settings))
        return load_project(tmp_path)

    return write_and_load


def test_columns_set_parameters(load):
    slow, _ = load().variants
    (nav,) = slow.components
    assert {p.key: p.value for p in nav.parameters} == {"frame": "map", "speed": 0.3, "acceleration": 3.6}


def test_column_chooses_the_wiring(load):
    slow, blind = load().variants
    assert [port.name for port in slow.components[0].ports] == ["cmd", "odom", "scan"]
    assert [port.name for port in blind.components[0].ports] == ["cmd", "odom", "points"]
    assert blind.connections[-1].sources == (PortPath("camera", "points"),)
    assert blind.connections[-1].targets == (PortPath("nav", "points"),)


def test_expected_levels_are_parameters(load):
    assert [variant.expected_qas for variant in load().variants] == [{"safety": 0.2}, {"safety": 0.9}]


def test_composed_variant_is_the_whole_system(load):
    project = load()
    whole = compose(project.base, project.variants[1])
    assert {component.name for component in whole.components} == {"robot", "laser", "camera", "battery", "nav"}
    assert {connection.name for connection in whole.connections} == {"odom", "rays", "load", "points", "cmd"}


def test_required_components_feed_the_variant_and_not_merely_the_plant(load):
    assert load().required_components() == {"slow": {"laser", "robot"}, "blind": {"camera", "robot"}}


def test_parameter_values_tell_what_models_without_wiring_require(load, settings, tmp_path):
    (tmp_path / "variants").mkdir()
    (tmp_path / "variants" / "one.rossystem").write_text(
        "RosSystem { Name one RosComponents ( ComponentInterface { name nav RosParameters {"
        " RosParameter sources { RefParameter 'n.nav.nav.local/sources' value 'scan points' } } } ) }"
    )
    settings["variants"] = {"component": "nav"}
    settings["requires"] = {"sources": {"scan": "laser", "points": "camera", "echo": "sonar"}}
    settings["components"]["sonar"] = {"node": "sonar"}
    assert load().required_components()["one"] >= {"laser", "camera"}


def test_project_is_found_by_its_file_too(load, tmp_path):
    assert load() == load_project(tmp_path / "metacontrol.yaml")


def test_without_a_table_variants_are_files(load, settings, tmp_path):
    (tmp_path / "variants").mkdir()
    (tmp_path / "variants" / "one.rossystem").write_text("RosSystem { Name one }")
    settings["variants"] = {"component": "nav"}
    assert [variant.name for variant in load().variants] == ["one"]


def test_utility_function_goes_to_the_reasoner_with_its_parameters(load, settings):
    settings["utility"] = {"weights": {"safety": -1.0}}
    assert reasoner(load())["utility"] == {"weights": {"safety": -1.0}}


def test_levels_of_variants_that_are_files_come_from_a_table(load, settings, tmp_path):
    (tmp_path / "variants").mkdir()
    for name in ("one", "two"):
        (tmp_path / "variants" / f"{name}.rossystem").write_text(f"RosSystem {{ Name {name} }}")
    settings["variants"] = {"qa": "qa.csv"}
    assert [v.expected_qas for v in load(qa="name,safety\none,0.2\ntwo,\n").variants] == [{"safety": 0.2}, {}]
    with pytest.raises(ModelError, match=r"qa.csv:1:1: no row for two"):
        load(qa="name,safety\none,0.2\n")
    with pytest.raises(ModelError, match=r"qa.csv:4:1: 'three' is none of the 2 variants"):
        load(qa="name,safety\none,0.2\ntwo,\nthree,1\n")
    (tmp_path / "variants" / "two.rossystem").write_text(
        "RosSystem { Name two Parameters { Parameter { name qa_safety type Double value 0.5 } } }"
    )
    with pytest.raises(ModelError, match=r"two.rossystem:1:.*two has qa_safety here and in qa.csv: keep one"):
        load(qa="name,safety\none,0.2\ntwo,0.3\n")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"package": None}, "package: is empty, must be a name"),
        ({"manipulator": None}, "manipulator: is empty, must be a mapping: fill it, or take it out"),
        ({"functions": {"f_move": {"designs": None}}}, "functions.f_move.designs: is empty, must be 'all' or a list"),
        (
            {"components": {"laser": None}},
            "components.laser: is empty, must be a mapping with node, topic or diagnostic",
        ),
        ({"colour": 1}, "colour: unknown key, allowed here: package, base"),
        ({"functions": []}, "functions: is '[]', must be a mapping"),
        ({"utility": "speed"}, "utility: 'speed' is none of quality_attributes: safety"),
        ({"utility": {}}, "utility: is '{}', must be a mapping of one utility to its parameters"),
        ({"utility": {"a": 1, "b": 2}}, "must be a mapping of one utility to its parameters"),
        ({"utility": [1]}, "utility: is '[1]', must be a name, or a mapping of one utility to its parameters"),
        (
            {"quality_attributes": {"safety": {"direction": "down"}}},
            "quality_attributes.safety.direction: is 'down', must be lower_is_better or higher_is_better",
        ),
        (
            {"quality_attributes": {"safety": {"direction": "lower_is_better", "range": [1, 0]}}},
            "quality_attributes.safety.range: is '[1, 0]', must be a list of two numbers, the lower one first",
        ),
        (
            {"objectives": {"o": {"function": "f_move", "nfrs": {"safety": float("nan")}}}},
            "objectives.o.nfrs.safety: is 'nan', must be a finite number",
        ),
        (
            {"objectives": {"o": {"function": "f_move", "nfrs": {"safety": [0.6, 0.2]}}}},
            "objectives.o.nfrs.safety: is '[0.6, 0.2]', must be a list of two numbers, the lower one first",
        ),
        (
            {"environment": {"light": {"required_by": {"lamp": {"least": 1}}}}},
            "environment.light.required_by.lamp: 'lamp' is no component and none of the 2 variants",
        ),
        (
            {"environment": {"light": {"required_by": {"laser": {}}}}},
            "environment.light.required_by.laser: is '{}', must be a mapping with least, most, or both",
        ),
        (
            {"environment": {"safety": {"required_by": {"laser": {"least": 1}}}}},
            "'safety' names a quality attribute and a property of the surroundings: rename one",
        ),
        ({"objectives": {"o": {"function": "f"}}}, "objectives.o.function: 'f' is none of functions: f_move"),
        (
            {"functions": {"f_move": {"designs": ["fast"]}}},
            "f_move.designs[0]: 'fast' is none of the 2 variants",
        ),
        ({"components": {"laser": {}}}, "components.laser: is '{}', must be a mapping with node, topic or diagnostic"),
        ({"base": "../base.rossystem"}, "base: ../base.rossystem leaves the folder"),
        ({"base": "none.rossystem"}, "No such file"),
        ({"variants": {"component": "nav", "table": "variants.csv"}}, "nothing says what column 'speed_mps'"),
        ({"variants": {"component": "arm", "table": "variants.csv"}}, "'arm' is no component with a FromRosNode"),
    ],
)
def test_wrong_setting_is_refused_in_one_line(load, settings, change, message):
    settings.update(change)
    with pytest.raises(ModelError) as caught:
        load()
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", r"metacontrol\.yaml:2:1: "),
        ("a: b: c", r"metacontrol\.yaml:1:5: "),
        ("", "the file: is empty, must be a mapping with package"),
        ("!!python/object/apply:os.system [id]", "could not determine a constructor"),
        ("[" * 10_000, "metacontrol.yaml"),
    ],
)
def test_wrong_yaml_is_refused_in_one_line(tmp_path, text, message):
    (tmp_path / "metacontrol.yaml").write_text(text + "\n")
    with pytest.raises(ModelError, match=message) as caught:
        load_project(tmp_path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"table": ""}, "variants.csv:1:1: no column 'name'"),
        ({"table": "name,speed_mps,sensor\n"}, "variants.csv:1:1: no rows"),
        ({"table": "name,speed_mps\nslow,0.3\n"}, "column 'sensor' is missing"),
        ({"table": "name,speed_mps,sensor\nslow,0.3\n"}, "variants.csv:2:1: has 2 cells, must have 3"),
        ({"table": "name,speed_mps,sensor\nslow,quick,laser\n"}, "column 'speed_mps' is 'quick', must be a number"),
        (
            {"table": "name,speed_mps,sensor\nslow,1,sonar\n"},
            "2:1: column 'sensor' is 'sonar', must be camera or laser",
        ),
        ({"table": TABLE + "slow,1,laser\n"}, "variants.csv:4:1: name 'slow' stands twice"),
        ({"table": "name,speed_mps,sensor\n../slow,1,laser\n", "qa": "name,safety\n../slow,1\n"}, "can't name a file"),
        ({"qa": "name,safety\nslow,0.2\n"}, "qa.csv:1:1: no row for blind"),
        ({"qa": "name,safety\nslow,low\nblind,1\n"}, "qa.csv:2:1: slow: safety is 'low', must be a number"),
    ],
)
def test_wrong_table_is_refused_with_its_line(load, files, message):
    with pytest.raises(ModelError) as caught:
        load(**files)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("qa", "message"),
    [
        ("name,safety\nslow,7\nblind,0.9\n", "qa.csv:2:1: slow expects 7 of 'safety', whose range is [0, 1]"),
        ("name,safety\nslow,-0.1\nblind,0.9\n", "qa.csv:2:1: slow expects -0.1 of 'safety', whose range is [0, 1]"),
        (QA + "extra,0.5,measured\n", "qa.csv:4:1: 'extra' is none of the 2 variants: take the row out"),
    ],
)
def test_level_that_no_variant_can_have_is_refused_at_its_row(load, qa, message):
    with pytest.raises(ModelError) as caught:
        load(qa=qa)
    assert message in str(caught.value)


def test_levels_at_the_ends_of_the_range_and_without_one_are_fine(load, settings):
    load(qa="name,safety\nslow,0\nblind,1\n")
    del settings["quality_attributes"]["safety"]["range"]
    load(qa="name,safety\nslow,-5\nblind,7\n")


def test_families_may_share_a_table_of_levels(load, settings, tmp_path):
    (tmp_path / "more.csv").write_text("name,speed_mps,sensor\nfast,1.5,laser\n")
    settings["variants"] = [settings["variants"], settings["variants"] | {"table": "more.csv"}]
    project = load(qa=QA + "fast,0.8,estimated\n")
    assert [variant.name for variant in project.variants] == ["slow", "blind", "fast"]


def test_every_error_of_the_tables_is_told_in_order_and_none_as_unreadable(load, tmp_path):
    with pytest.raises(ModelError) as caught:
        load(
            table="name,speed_mps,sensor\nslow,1\nblind,0.7,camera\nblind,0.7,camera\n",
            qa="name,safety\nslow,0.2\nslow,0.9\nsl/ow,1\n",
        )
    assert [str(error).removeprefix(f"{tmp_path}/").split(" ")[0] for error in caught.value.all] == [
        *("qa.csv:3:1:", "qa.csv:4:1:", "variants.csv:2:1:", "variants.csv:4:1:"),
    ]
    assert {error.rule for error in caught.value.all} == {"table"}


def test_every_wrong_row_is_told_with_its_missing_level(load, tmp_path):
    with pytest.raises(ModelError) as caught:
        load(table="name,speed_mps,sensor\nslow,x,laser\nblind,1,sonar\n", qa="name,safety\nother,1\n")
    assert [str(error).removeprefix(f"{tmp_path}/").split(":")[0] for error in caught.value.all] == [
        *("qa.csv", "qa.csv", "variants.csv", "variants.csv"),
    ]


def test_no_more_errors_are_told_than_can_be_read(load):
    with pytest.raises(ModelError) as caught:
        load(table="name,speed_mps,sensor\n" + "slow,1\n" * 1000)
    assert len(caught.value.all) == 20


def test_wiring_to_what_the_base_does_not_publish_is_refused(load, settings):
    settings["variants"]["connections"]["sensor"]["camera"] = ["camera.image"]
    with pytest.raises(ModelError, match=r"metacontrol\.yaml:\d+:\d+: camera\.image is no publisher"):
        load()


def test_hierarchy_is_required_by_all_designs_or_by_those_named(load, settings):
    settings["functions"] = {
        "f_move": {"designs": ["slow", "blind"], "requires": {"blind": ["f_see"]}},
        "f_see": {"designs": []},
    }
    project = load()
    assert [project.required_functions(name) for name in ("slow", "blind")] == [(), ("f_see",)]
    settings["functions"]["f_move"]["requires"] = ["f_see"]
    assert load().required_functions("slow") == ("f_see",)


@pytest.mark.parametrize(
    ("function", "message"),
    [
        ({"requires": ["f_fly"]}, "functions.f_move.requires[0]: 'f_fly' is none of functions: f_move"),
        ({"requires": {"slow": ["f_move"]}}, "functions.f_move.requires.slow[0]: a function can't require itself"),
        ({"requires": {"fast": []}}, "functions.f_move.requires.fast: 'fast' is none of the designs of f_move"),
    ],
)
def test_hierarchy_that_leads_nowhere_is_refused(load, settings, function, message):
    settings["functions"]["f_move"] |= function
    with pytest.raises(ModelError) as caught:
        load()
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("requires", "cycle"),
    [
        ({"f_move": ["f_see"], "f_see": ["f_move"]}, {"f_move", "f_see"}),
        ({"f_move": {"slow": ["f_see"]}, "f_see": ["f_map"], "f_map": ["f_see"]}, {"f_see", "f_map"}),
        ({"f_move": {"slow": ["f_see"]}, "f_see": ["f_map"], "f_map": ["f_move"]}, {"f_move", "f_see", "f_map"}),
    ],
)
def test_functions_that_require_each_other_are_refused(load, settings, requires, cycle):
    settings["functions"] |= {"f_see": {"designs": []}, "f_map": {"designs": []}}
    for function, required in requires.items():
        settings["functions"][function]["requires"] = required
    with pytest.raises(ModelError, match="functions require each other") as caught:
        load()
    (names,) = re.findall(r"\((.*)\): take one out", str(caught.value))
    first, *others, last = names.split(" requires ")
    assert first == last and {first, *others} == cycle
    assert all(other in str(requires[one]) for one, other in itertools.pairwise([first, *others, last]))


def test_functions_that_require_one_twice_over_are_no_cycle(load, settings):
    settings["functions"] |= {"f_see": {"designs": [], "requires": ["f_map"]}, "f_map": {"designs": []}}
    settings["functions"]["f_move"]["requires"] = ["f_see", "f_map"]
    assert load().required_functions("slow") == ("f_see", "f_map")


def test_families_are_put_together(load, settings, tmp_path):
    (tmp_path / "arm.rossystem").write_text("RosSystem { Name one_arm }")
    settings["variants"] = [settings["variants"], {"files": ["arm.rossystem"]}]
    project = load()
    assert [variant.name for variant in project.variants] == ["slow", "blind", "one_arm"]
    assert project.by_table == {"slow", "blind"}


def test_variants_of_one_name_are_refused(load, settings, tmp_path):
    (tmp_path / "arm.rossystem").write_text("RosSystem { Name slow }")
    settings["variants"] = [settings["variants"], {"files": ["arm.rossystem"]}]
    with pytest.raises(ModelError, match=r"metacontrol\.yaml:\d+:1: variants: two variants bear the name 'slow'"):
        load()


def test_requirement_of_an_unknown_component_is_refused(load, settings):
    settings["requires"] = {"sources": {"echo": "sonar"}}
    with pytest.raises(ModelError, match=r"requires\.sources\.echo: 'sonar' is a component neither of the base nor"):
        load()


def test_level_of_an_unknown_quality_is_refused_at_its_row(load):
    with pytest.raises(ModelError, match=r"qa\.csv:2:1: slow expects a level of 'saftey', which is none of quality_a"):
        load(qa="name,saftey\nslow,0.2\nblind,0.9\n")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"components": {"safety": {"node": "x"}}}, "'safety' names a quality attribute and a component"),
        ({"objectives": {"f_move": {"function": "f_move"}}}, "'f_move' names a function and an objective"),
        ({"components": {"slow": {"node": "x"}}}, "'slow' names a component and a variant"),
        (
            {"quality_attributes": {q: {"direction": "lower_is_better"} for q in ("safety", "slow_safety")}},
            "'slow_safety' names a quality attribute and an expected or required level",
        ),
    ],
)
def test_name_with_two_meanings_is_refused(load, settings, change, message):
    settings.update(change)
    with pytest.raises(ModelError) as caught:
        load()
    assert message in str(caught.value)


def test_every_problem_of_the_settings_is_told_at_its_place(tmp_path):
    path = tmp_path / "metacontrol.yaml"
    path.write_text(
        "package: robot models\n"
        "base: base.rossystem\n"
        "colour: red\n"
        "variants: {component: nav, table: [a]}\n"
        "functions:\n"
        "  f_move: {designs: some}\n"
        "quality_attributes: {safety: {direction: down, 15: x}}\n"
        "objectives: {o: {function: f_move, nfrs: {safety: .nan}}}\n"
    )
    assert [str(problem).removeprefix(f"{path}:") for problem in problems_of(path)] == [
        "1:1: utility: is missing, must be a name, or a mapping of one utility to its parameters",
        "1:1: package: is 'robot models', must be a name of letters, digits, '_' and '-'",
        "3:1: colour: unknown key, allowed here: package, base, variants, functions, quality_attributes, utility, "
        "objectives, components, topics, environment, roles, spares, observers, reasoner, manipulator, arguments, "
        "parameter_files, requires",
        "4:28: variants.table: is \"['a']\", must be the name of a CSV or YAML file",
        "6:12: functions.f_move.designs: is 'some', must be 'all' or a list of variants",
        "7:22: quality_attributes.safety: the key 15 must be text: put it in quotes",
        "7:31: quality_attributes.safety.direction: is 'down', must be lower_is_better or higher_is_better",
        "8:43: objectives.o.nfrs.safety: is 'nan', must be a finite number",
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: &a [*a]", "1:1: is nested too deep"),
        ("a: &a [1, 2, 3, 4, 5, 6, 7, 8, 9]\n" + "".join(
            f"{new}: &{new} [{', '.join([f'*{old}'] * 9)}]\n" for old, new in zip("abcdef", "bcdefg", strict=True)
        ), "holds more than 200000 values"),
        ("a: 1\nb: 2\na: 3", "3:1: the key 'a' stands twice"),
        ("a: \x07", "1:1: special characters are not allowed"),
        ("a: 1\n---\nb: 1", "2:1: but found another document"),
        ("base: 2001-99-99", "1:1: a value is not of its type (month must be in 1..12)"),
    ],
)  # fmt: skip
def test_treacherous_yaml_is_refused_in_one_line(tmp_path, text, message):
    (tmp_path / "metacontrol.yaml").write_text(text)
    with pytest.raises(ModelError, match=r"metacontrol\.yaml:") as caught:
        load_project(tmp_path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


GRASP = {"save_action": "grasp", "goal_msg_type": "arm_msgs.msg.GraspAction"}


def test_action_to_keep_belongs_to_a_function(load, settings):
    settings["functions"]["f_grasp"] = {"designs": [], **GRASP, "kill_nodes": ["gripper"]}
    content = manipulator(load())
    assert content["functions"] == {"f_grasp": {**GRASP, "kill_nodes": ["gripper"]}}
    assert "save_action" not in content


@pytest.mark.parametrize(
    ("functions", "common", "message"),
    [
        ({"f_grasp": {"designs": []}}, GRASP, "put it under functions/NAME"),
        ({"f_move": {"designs": "all", **GRASP}}, GRASP, "put it under functions/NAME"),
        (
            {"f_grasp": {"designs": [], "save_action": "grasp"}},
            {},
            "functions.f_grasp.save_action: has no goal_msg_type",
        ),
    ],
)
def test_action_of_which_function_or_type_is_unclear_is_refused(load, settings, functions, common, message):
    settings["functions"].update(functions)
    settings["manipulator"] = common
    with pytest.raises(ModelError, match=re.escape(message)):
        load()


def test_table_of_many_columns_takes_no_time(tmp_path):
    columns = ",".join(f"c{number}" for number in range(80_000))
    before = time.process_time()
    table = parse_table(f"name,{columns}\na,{','.join(['1'] * 80_000)}\n", tmp_path / "x.csv")
    assert len(table.columns) == 80_000
    assert time.process_time() - before < 3
    with pytest.raises(ModelError, match="column 'c1' is empty or stands twice"):
        parse_table("name,c1,c1\n", tmp_path / "x.csv")
