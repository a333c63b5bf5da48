"""What designs require, by the models and by words of metacontrol.yaml; and how that is shown."""

import pytest
import yaml
from mros1_reasoner.io.ontology_files import read_knowledge_base
from ros_model.checks.projects import needless_words
from ros_model.checks.whole_projects import check_project
from ros_model.errors import ModelError
from ros_model.generators.deployment import monitor, reasoner
from ros_model.io.project import load_project
from ros_model.language.library import Library
from ros_model.project.requirements import requirement_lines


def component(name, out="", into="", more=""):
    node = f"gripper_drivers.{name}.py.{name}"
    ports = [
        f"{section} {{ {word} '{port}' {{ {reference} '{node}.{port}' }} }}"
        for section, word, reference, port in (
            ("RosPublishers", "RosPublisher", "RefPublisher", out),
            ("RosSubscribers", "RosSubscriber", "RefSubscriber", into),
        )
        if port
    ]
    return f"ComponentInterface {{ name '{name}' {more} FromRosNode '{node}' {' '.join(ports)} }}"


BASE = f"""RosSystem {{ Name cell RosComponents (
    {component("touch", "wrench")}, {component("eye", "image", more="NameSpace head")},
    {component("belt", "tf")}, {component("packer", into="wrench")},
    {component("sorter", into="tf")} )
    TopicConnections {{
        TopicConnection wrench {{ From ( 'touch.wrench' ) To ( 'packer.wrench' ) }},
        TopicConnection tf {{ From ( 'belt.tf' ) To ( 'sorter.tf' ) }} }} }}"""
TABLE = "name,packer.force,sensor\nsoft,1,feel\nfirm,5,feel\nseen,5,see\n"
SORTS = "name,sorter.speed\nsort,1\n"


@pytest.fixture
def settings():
    return {
        "package": "packing",
        "base": "cell.rossystem",
        "variants": [
            {
                "component": "packer",
                "table": "packer.csv",
                "connections": {"sensor": {"feel": ["touch.wrench"], "see": ["eye.image"]}},
            },
            {"component": "sorter", "table": "sorter.csv"},
        ],
        "functions": {"f_pack": {"designs": ["soft", "firm", "seen"]}, "f_sort": {"designs": ["sort"]}},
        "quality_attributes": {"speed": {"direction": "higher_is_better"}},
        "utility": "speed",
        "objectives": {"o_pack": {"function": "f_pack"}},
        "components": {},
    }


@pytest.fixture
def load(tmp_path, settings):
    def write_and_load(base=BASE, **components):
        settings["components"].update(components)
        for name, text in (("cell.rossystem", base), ("packer.csv", TABLE), ("sorter.csv", SORTS)):
            (tmp_path / name).write_text(text)
        (tmp_path / "metacontrol.yaml").write_text(yaml.safe_dump(settings))
        return load_project(tmp_path)

    return write_and_load


def requirements(project):
    return {name: set(found) for name, found in project.required_components().items()}


BY_WIRING = {"soft": {"touch"}, "firm": {"touch"}, "seen": {"head/eye"}, "sort": set()}


def test_wiring_says_what_is_required_by_the_names_of_nodes(load):
    assert requirements(load()) == BY_WIRING


def test_component_of_another_name_than_its_node_is_required_by_that_name(load):
    renamed = load(camera={"node": "/head/eye"}, hand={"node": "touch"})
    assert requirements(renamed) == {"soft": {"hand"}, "firm": {"hand"}, "seen": {"camera"}, "sort": set()}


@pytest.mark.parametrize(
    ("word", "designs"),
    [
        ("all", {"soft", "firm", "seen", "sort"}),
        (["f_pack"], {"soft", "firm", "seen"}),
        (["seen", "sort"], {"seen", "sort"}),
    ],
)
def test_requirement_is_added_for_all_for_a_function_or_for_a_variant(load, word, designs):
    found = requirements(load(belt={"node": "belt", "required_by": word}))
    assert {name for name, required in found.items() if "belt" in required} == designs


def test_requirement_is_taken_out_for_one_variant_and_stays_for_others(load):
    found = requirements(load(touch={"node": "touch", "not_required_by": ["firm"]}))
    assert found == BY_WIRING | {"firm": set()}


def test_component_needs_no_node_to_be_named_by_a_word(load):
    project = load(eye={"not_required_by": "all"}, touch={"required_by": ["seen"]})
    assert requirements(project) == BY_WIRING | {"seen": {"touch"}}
    assert project.components == {}


@pytest.fixture
def handed_on(settings, load):
    """Load the project with a sorter that hears the packer, so that touch is behind it."""

    def load_with(designs=("sort",), **components):
        settings["functions"]["f_sort"] = {"designs": list(designs), "requires": ["f_pack"]}
        text = BASE.replace(
            "RosSubscriber 'tf'", "RosSubscriber 'packed' { RefSubscriber 'x.y.z.packed' }, RosSubscriber 'tf'"
        )
        text = text.replace(
            "TopicConnection tf {",
            "TopicConnection packed { From ( 'packer.packed' ) To ( 'sorter.packed' ) }, TopicConnection tf {",
        )
        return load(text, **components)

    return load_with


def test_function_that_needs_another_one_does_not_require_its_nodes_nor_what_is_behind_them(handed_on):
    project = handed_on()
    assert requirements(project) == BY_WIRING
    assert project.requirements["sort"].others["packer"] == "packer -> packed -> sorter: another function deploys it"
    assert requirements(handed_on(touch={"node": "touch", "required_by": ["sort"]}))["sort"] == {"touch"}


def test_node_of_the_function_that_a_variant_solves_counts_as_before(handed_on):
    assert requirements(handed_on(designs=["sort", "soft"]))["sort"] == {"packer", "touch"}


def test_words_take_out_what_values_of_parameters_require(load, settings):
    settings["requires"] = {"force": {"5": "belt"}}
    assert requirements(load())["firm"] == {"touch", "belt"}
    assert requirements(load(belt={"node": "belt", "not_required_by": ["firm"]}))["firm"] == {"touch"}


def test_ontology_and_configurations_say_the_same(load, tmp_path):
    from mros1_reasoner.io.tomasys_generator import generate

    project = load(belt={"node": "belt", "required_by": ["soft"]}, touch={"not_required_by": ["soft"]})
    (path,) = generate(project, tmp_path)
    designs = read_knowledge_base([path]).designs
    assert {name: set(design.components) for name, design in designs.items()} == BY_WIRING | {"soft": {"belt"}}
    assert monitor(project)["components"] == reasoner(project)["components"] == {"belt": {"node": "belt"}}


@pytest.mark.parametrize(
    ("components", "messages"),
    [
        (
            {"touch": {"not_required_by": ["sofd", "f_pack", "f_sord"]}},
            [
                "components.touch.not_required_by[0]: 'sofd' is no function and none of the variants",
                "components.touch.not_required_by[2]: 'f_sord' is no function and none of the variants",
            ],
        ),
        (
            {"belt": {"node": "belt", "required_by": ["f_pack"], "not_required_by": ["soft"]}},
            ["components.belt.not_required_by[0]: soft is meant by required_by, too: take it out of one"],
        ),
        (
            {"belt": {"required_by": ["soft"], "not_required_by": "all"}},
            ["components.belt.not_required_by: soft is meant by required_by, too: take it out of one"],
        ),
        (
            {"bellt": {"required_by": "all"}},
            ["components.bellt: is no component of the base or of a variant: correct the name, or add"],
        ),
        (
            {"belt": {"required_by": "soft"}},
            ["components.belt.required_by: is 'soft', must be 'all' or a list of variants and functions"],
        ),
        (
            {"belt": {"required_by": None}},
            ["components.belt.required_by: is empty, must be 'all' or a list of variants and functions"],
        ),
    ],
)  # fmt: skip
def test_word_that_can_not_be_meant_is_refused_at_its_place(load, tmp_path, components, messages):
    with pytest.raises(ModelError) as caught:
        load(**components)
    assert len(caught.value.all) == len(messages)
    for error, message in zip(caught.value.all, messages, strict=True):
        assert message in str(error)
        assert str(error).startswith(f"{tmp_path}/metacontrol.yaml:")


@pytest.mark.parametrize(
    ("components", "message"),
    [
        (
            {"belt": {"node": "belt", "not_required_by": "all"}},
            "not_required_by: none of the designs requires it anyway",
        ),
        ({"packer": {"node": "packer", "required_by": ["f_pack"]}}, "required_by: the designs bring it themselves"),
    ],
)
def test_word_that_changes_nothing_is_a_warning(load, components, message):
    (finding,) = needless_words(load(**components))
    assert finding.severity == "warning"
    assert message in finding.message


def test_word_that_changes_something_for_one_of_its_designs_is_none(load):
    assert not list(needless_words(load(touch={"not_required_by": "all"}, packer={"required_by": "all"})))


def test_what_is_required_and_what_not_is_shown_with_the_way_once_for_all_designs_alike(load, settings):
    settings["requires"] = {"force": {"5": "hall"}}
    project = load(hall={"topic": "lamp"}, camera={"node": "head/eye"}, touch={"not_required_by": ["firm"]})
    assert list(requirement_lines(project)) == [
        "soft requires:",
        "  touch -> wrench -> packer",
        "firm requires:",
        "  hall: force is 5",
        "and not:",
        "  touch -> wrench -> packer: not_required_by takes it out",
        "seen requires:",
        "  camera: eye -> head/image -> packer",
        "  hall: force is 5",
        "sort requires no component",
        "not:",
        "  belt -> tf -> sorter: any node may publish there",
    ]


def test_designs_that_require_the_same_share_their_lines(load):
    assert next(requirement_lines(load())) == "soft, firm require:"


def test_check_shows_requirements_to_people_and_findings_only_to_programs(load, run, tmp_path):
    load()
    status, out, _ = run("check", tmp_path)
    assert status == 0
    assert "seen requires:\n  head/eye: eye -> head/image -> packer\n" in out
    assert "requires" not in run("check", "--format", "json", tmp_path)[1]


def test_init_shows_what_its_first_variant_requires(load, run, tmp_path):
    load()
    (tmp_path / "metacontrol.yaml").unlink()
    status, out, _ = run("init", tmp_path / "cell.rossystem", "--component", "packer")
    assert status == 0
    assert "cell_default requires:\n  touch -> wrench -> packer\n" in out


# -- roles, and what other functions deploy ---------------------------------------------------------------------------


def test_a_design_that_names_more_components_than_its_role_needs_requires_them_all(load, settings):
    settings["roles"] = {"sense": {"of": ["touch", "eye"]}}
    feel_and_see = {"touch": {"node": "touch", "required_by": ["firm"]}, "eye": {"node": "head/eye"}}
    assert load(**feel_and_see).roles.components["firm"] == {"touch"}  # one alone is a filler like any other
    both = {name: {**entry, "required_by": ["firm"]} for name, entry in feel_and_see.items()}
    project = load(**both)
    assert project.roles.components["firm"] == {"touch", "eye"}
    assert "sense" not in project.roles.of_designs["firm"]


CROSSED = """RosSystem { Name handwritten RosComponents (
    ComponentInterface { name follower FromRosNode 'gripper_drivers.follower.py.follower'
        RosSubscribers { RosSubscriber 'grip' { RefSubscriber 'gripper_drivers.follower.py.follower.grip' } } } )
    TopicConnections { TopicConnection grip { From ( 'PACKER.grip' ) To ( 'follower.grip' ) } } }"""


@pytest.mark.parametrize(("source", "problems"), [("packer", 0), ("nobody", 1)])
def test_a_variant_may_be_connected_to_what_another_function_deploys(load, settings, tmp_path, source, problems):
    (tmp_path / "crossed.rossystem").write_text(CROSSED.replace("PACKER", source))
    (tmp_path / "pack.rossystem").write_text(
        "RosSystem { Name pack RosComponents ( ComponentInterface { name packer "
        "FromRosNode 'gripper_drivers.packer.py.packer' "
        "RosPublishers { RosPublisher 'grip' { RefPublisher 'gripper_drivers.packer.py.packer.grip' } } } ) }"
    )
    base = "RosSystem { Name cell RosComponents ( " + component("touch", "wrench") + " ) }"
    settings["variants"] = {"files": ["crossed.rossystem", "pack.rossystem"]}
    settings["functions"] = {"f_pack": {"designs": ["pack"]}, "f_follow": {"designs": ["handwritten"]}}
    project = load(base)
    found = [finding for finding in check_project(project, Library()) if finding.rule == "connection"]
    assert len(found) == problems
