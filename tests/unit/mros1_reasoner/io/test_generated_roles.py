"""Roles and spares of metacontrol.yaml, by way of the generated ontology to what follows when components fail."""

import pytest
import yaml
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.io.tomasys_generator import generate
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Facts, Objective
from ros_model.errors import ModelError
from ros_model.io.project import load_project
from ros_model.project.roles import role_lines


def component(name, outs=(), into=(), space=""):
    node = f"boat_drivers.{name}.py.{name}"
    sections = [("RosPublishers", "RosPublisher", "RefPublisher", outs)]
    sections += [("RosSubscribers", "RosSubscriber", "RefSubscriber", into)]
    ports = []
    for section, word, reference, names in sections:
        listed = ", ".join(f"{word} '{port}' {{ {reference} '{node}.{port}' }}" for port in names)
        ports += [f"{section} {{ {listed} }}"] if names else []
    where = f"NameSpace {space}" if space else ""
    return f"ComponentInterface {{ name '{name}' {where} FromRosNode '{node}' {' '.join(ports)} }}"


def topic(name, source, target):
    return f"TopicConnection '{name}' {{ From ( '{source}.{name}' ) To ( '{target}.{name}' ) }}"


THRUSTERS = ["thruster_1", "thruster_2", "thruster_3"]
RPM = [f"rpm_{number}" for number in (1, 2, 3)]
# A boat: its helmsman hears three thrusters, one of two GPS receivers, and a compass or a sonar.
BASE = f"""RosSystem {{ Name boat RosComponents (
    {", ".join(component(thruster, [rpm]) for thruster, rpm in zip(THRUSTERS, RPM, strict=True))},
    {component("gps", ["fix"], space="bow")}, {component("gps_spare", ["fix_2"], space="stern")},
    {component("sonar", ["depth"])}, {component("helmsman", into=[*RPM, "fix", "fix_2", "depth"])} )
    TopicConnections {{
    {", ".join(topic(rpm, thruster, "helmsman") for thruster, rpm in zip(THRUSTERS, RPM, strict=True))},
    {topic("fix", "gps", "helmsman")}, {topic("fix_2", "gps_spare", "helmsman")}, {topic("depth", "sonar", "helmsman")}
    }} }}"""
TABLE = "name,helmsman.speed,receiver,eyes\ncruise,2,first,no\ncrawl,1,first,no\ncrawl_2,1,second,no\nfeel,1,none,yes\n"


@pytest.fixture
def settings():
    return {
        "package": "boat",
        "base": "boat.rossystem",
        "variants": {
            "component": "helmsman",
            "table": "variants.csv",
            "connections": {
                "receiver": {"first": ["gps.fix"], "second": ["gps_spare.fix_2"], "none": []},
                "eyes": {"yes": ["sonar.depth"], "no": []},
            },
        },
        "functions": {"f_sail": {"designs": "all"}},
        "quality_attributes": {"speed": {"direction": "higher_is_better"}},
        "utility": "speed",
        "objectives": {"o_sail": {"function": "f_sail"}},
        "roles": {
            "propulsion": {"of": THRUSTERS, "least": 2, "class": "thruster"},
            "position": {"of": ["gps", "gps_spare"], "class": "receiver"},
            "depth_sensor": {"of": ["sonar"]},
        },
        "spares": {"crawl_2": "crawl"},
    }


@pytest.fixture
def load(tmp_path, settings):
    def write_and_load():
        (tmp_path / "boat.rossystem").write_text(BASE)
        (tmp_path / "variants.csv").write_text(TABLE)
        (tmp_path / "metacontrol.yaml").write_text(yaml.safe_dump(settings, sort_keys=False))
        return load_project(tmp_path)

    return write_and_load


@pytest.fixture
def knowledge_base(load, tmp_path):
    (path,) = generate(load(), tmp_path)
    return read_knowledge_base([path], utility="speed")


@pytest.fixture(params=["pellet", "rules"])
def analyse(request, knowledge_base):
    reasoner = request.getfixturevalue("pellet") if request.param == "pellet" else RuleEngine()
    reasoner.load(knowledge_base.ontology)

    def analyse(*failed, running="cruise"):
        components = dict.fromkeys(failed, v.FAILED)
        facts = Facts((Objective("o_sail", "f_sail"),), {"o_sail": running}, components=components)
        return knowledge_base.analyse(facts, reasoner)

    return analyse


def test_roles_of_designs_follow_from_the_wiring(load):
    roles = load().roles
    assert roles.of_designs == {
        "cruise": ("propulsion",),
        "crawl": ("propulsion", "position"),
        "crawl_2": ("propulsion", "position"),
        "feel": ("propulsion", "depth_sensor"),
    }
    assert roles.filled["crawl_2"] == {"position": "stern/gps_spare"}
    assert roles.components == {
        "cruise": {"bow/gps"},  # it has no spare that another receiver fills
        "crawl": frozenset(),
        "crawl_2": frozenset(),
        "feel": frozenset(),
    }


def test_they_are_told(load):
    assert list(role_lines(load())) == [
        "role propulsion: 2 of 3 must work: thruster_1, thruster_2, thruster_3",
        "role position: 1 of 2 must work: bow/gps, stern/gps_spare",
        "  bow/gps fills it in crawl",
        "  stern/gps_spare fills it in crawl_2",
        "role depth_sensor: all must work: sonar",
        "  sonar fills it in feel",
    ]


@pytest.mark.parametrize(
    ("failed", "cannot"),
    [
        ((), set()),
        (("thruster_2",), set()),
        (("thruster_1", "thruster_3"), {"cruise", "crawl", "crawl_2", "feel"}),
        (("bow/gps",), {"cruise", "crawl"}),
        (("stern/gps_spare",), {"crawl_2"}),
        (("sonar",), {"feel"}),
        (("bow/gps", "stern/gps_spare", "thruster_1"), {"cruise", "crawl", "crawl_2"}),
    ],
)
def test_what_can_be_deployed(analyse, failed, cannot):
    for running in ("cruise", "crawl", "crawl_2", "feel"):
        found = analyse(*failed, running=running)
        assert set(found.unrealisable) == cannot
        assert found.objectives["o_sail"].in_error == (running in cannot)
        assert all(set(missing) <= set(failed) and missing for missing in found.unrealisable.values())


def test_value_of_a_parameter_may_need_a_role(load, settings, tmp_path):
    settings["requires"] = {"speed": {"2": "position"}}
    assert load().roles.filled.get("cruise") is None
    assert "position" in load().roles.of_designs["cruise"]  # whichever receiver works
    (path,) = generate(load(), tmp_path)
    knowledge_base, reasoner = read_knowledge_base([path], utility="speed"), RuleEngine()
    reasoner.load(knowledge_base.ontology)
    for failed, lost in ((["bow/gps"], False), (["bow/gps", "stern/gps_spare"], True)):
        found = knowledge_base.analyse(Facts(components=dict.fromkeys(failed, v.FAILED)), reasoner)
        assert ("cruise" in found.unrealisable) is lost


def test_role_may_name_who_needs_it(load, settings):
    settings["roles"]["position"]["required_by"] = ["feel"]
    assert load().roles.of_designs["feel"] == ("propulsion", "position", "depth_sensor")


@pytest.mark.parametrize(
    ("of", "least", "lost"), [(["sonar"], 1, ["sonar"]), (["sonar", "gps"], 2, ["bow/gps"]), (["gps", "sonar"], 1, [])]
)
def test_role_without_a_spare_that_a_design_names_puts_it_in_error(load, settings, tmp_path, of, least, lost):
    settings["roles"] = {"eyes": {"of": of, "least": least, "required_by": ["feel"]}}
    settings["spares"] = {}
    (path,) = generate(load(), tmp_path)
    knowledge_base, reasoner = read_knowledge_base([path], utility="speed"), RuleEngine()
    reasoner.load(knowledge_base.ontology)
    facts = Facts((Objective("o_sail", "f_sail"),), {"o_sail": "feel"}, components=dict.fromkeys(lost, v.FAILED))
    found = knowledge_base.analyse(facts, reasoner)
    assert ("feel" in found.unrealisable) == found.objectives["o_sail"].in_error == bool(lost)


def test_spare_that_other_wiring_feeds_is_no_spare(load, settings):
    settings["roles"]["position"] = {"of": ["gps", "gps_spare", "sonar"]}
    settings["variants"]["connections"]["receiver"]["first"] = ["gps.fix", "sonar.depth"]
    with pytest.raises(ModelError, match=r"crawl_2 and crawl differ in .*stern/gps_spare"):
        load()


def test_role_of_which_two_must_work_binds_no_single_one(load, settings):
    settings["roles"]["position"]["least"] = 2
    with pytest.raises(ModelError, match="crawl_2 and crawl differ in bow/gps, stern/gps_spare"):
        load()


def test_whoever_takes_what_works_does_so_without_spares_too(load, settings, tmp_path):
    settings["roles"]["position"]["required_by"] = ["feel"]
    (path,) = generate(load(), tmp_path)
    knowledge_base, reasoner = read_knowledge_base([path], utility="speed", spares=False), RuleEngine()
    reasoner.load(knowledge_base.ontology)
    found = knowledge_base.analyse(Facts(components={"bow/gps": v.FAILED}), reasoner)
    assert set(found.unrealisable) == {"cruise", "crawl"}


def test_components_of_a_role_count_by_their_names_in_the_system(load, settings):
    settings["roles"]["position"]["of"] = ["gps", "bow/gps", "gps_spare"]
    assert load().roles.all["position"].fillers == ("bow/gps", "stern/gps_spare")
    settings["roles"]["depth_sensor"] = {"of": ["sonar", "/sonar"], "least": 2}
    with pytest.raises(ModelError):
        load()


@pytest.mark.parametrize(
    ("section", "entry", "words"),
    [
        ("roles", {"position": {"of": ["gps", "gsp_spare"]}}, "'gsp_spare' is no component"),
        ("roles", {"position": {"of": ["gps"], "least": 2}}, "is 2, and only 1 components can fill the role"),
        ("roles", {"position": {"of": ["gps"], "required_by": ["nobody"]}}, "'nobody' is no function and none of"),
        ("roles", {"position": {"of": []}}, "a list of components"),
        ("roles", {}, "crawl_2 and crawl differ in bow/gps, stern/gps_spare, of which none fills a role of both alone"),
        ("spares", {"crawl_3": "crawl"}, "'crawl_3' is none of the 4 variants"),
        ("spares", {"crawl_2": "krawl"}, "'krawl' is none of the 4 variants"),
        ("spares", {"crawl_2": "feel", "feel": "cruise"}, "feel is a spare's design itself"),
        ("spares", {"feel": "cruise"}, "feel and cruise differ in bow/gps"),
    ],
)
def test_bad_entries_get_one_line_each(load, settings, section, entry, words):
    settings[section] = entry
    with pytest.raises(ModelError) as caught:
        load()
    assert words in str(caught.value)
    assert "metacontrol.yaml:" in str(caught.value)
