"""Roles that several components can fill: what follows when some of them fail, by Pellet and by the rule engine."""

import itertools

import pytest
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Facts, Objective
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError

XSD = "http://www.w3.org/2001/XMLSchema#"
HEAD = """<rdf:RDF xml:base="http://example.org/drone" xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"
 xmlns:t="http://metacontrol.org/tomasys#" xmlns:m="http://ros/mros#">
<t:Function rdf:about="#f_fly"/>
"""
OBJECTIVE = Objective("o_fly", "f_fly")
# hover needs three of four rotors and one height sensor: baro, or the spare sonar in hover_low; glide needs no role.
DRONE = (
    f'<t:Role rdf:about="#lift"><t:role_least rdf:datatype="{XSD}decimal">3</t:role_least></t:Role>'
    f'<t:Role rdf:about="#height"><t:role_least rdf:datatype="{XSD}decimal">1</t:role_least></t:Role>'
)


def binding(role, component):
    return (
        f'<t:Component rdf:about="#{component}"/><t:Binding rdf:about="#{role}_{component}">'
        f'<t:binding_role rdf:resource="#{role}"/><t:binding_component rdf:resource="#{component}"/></t:Binding>'
    )


def design(name, roles=(), binds=(), rebinds="", solves="f_fly"):
    links = [("t:solvesF", solves), *(("t:roles", role) for role in roles), *(("t:binds", b) for b in binds)]
    links += [("t:rebinds", rebinds)] if rebinds else []
    body = "".join(f'<{link} rdf:resource="#{target}"/>' for link, target in links)
    return f'<t:FunctionDesign rdf:about="#{name}">{body}</t:FunctionDesign>'


ROTORS = [f"rotor_{number}" for number in range(1, 5)]
PARTS = [
    DRONE,
    *(binding("lift", rotor) for rotor in ROTORS),
    binding("height", "baro"),
    binding("height", "sonar"),
    design("hover", ["lift", "height"], ["height_baro"]),
    design("hover_low", ["lift", "height"], ["height_sonar"], "hover"),
    design("glide"),
]


def drone(load, *more, parts=PARTS, **how):
    return load(HEAD + "".join([*parts, *more]) + "</rdf:RDF>", **how)


def failed(*components):
    return dict.fromkeys(components, v.FAILED)


@pytest.fixture(params=["pellet", "rules"])
def reasoner(request):
    return request.getfixturevalue("pellet") if request.param == "pellet" else RuleEngine()


def test_what_can_be_deployed_follows_from_how_many_work(load, reasoner):
    knowledge_base = drone(load)
    reasoner.load(knowledge_base.ontology)
    everything = [*ROTORS, "baro", "sonar"]
    for lost in itertools.chain(*(itertools.combinations(everything, count) for count in range(4))):
        found = knowledge_base.analyse(Facts((OBJECTIVE,), {"o_fly": "hover"}, components=failed(*lost)), reasoner)
        rotors, sensors = {*lost} & {*ROTORS}, {*lost} & {"baro", "sonar"}
        cannot = {
            *(["hover"] if len(rotors) > 1 or "baro" in sensors else []),
            *(["hover_low"] if len(rotors) > 1 or "sonar" in sensors else []),
        }
        assert set(found.unrealisable) == cannot, lost
        assert found.objectives["o_fly"].in_error == ("hover" in cannot), lost
        if len(rotors) > 1:
            assert rotors <= set(found.unrealisable["hover"])
        assert set(found.unrealisable.get("hover", ())) <= {*lost}


def test_design_is_realisable_while_a_spare_works_though_this_binding_does_not_hold(load, reasoner):
    knowledge_base = drone(load)
    reasoner.load(knowledge_base.ontology)
    asked = (v.FD_UNREALISABLE_BY, v.ROLE_AVAILABILITY)
    one = reasoner.infer(knowledge_base.assertions(Facts(components=failed("baro"))), asked)
    assert [a for a in one if a.property in asked] == []
    both = reasoner.infer(knowledge_base.assertions(Facts(components=failed("baro", "sonar"))), asked)
    lost = {a.subject.rpartition("#")[2] for a in both if a.property in asked}
    assert lost == {"height", "hover", "hover_low"}


def test_running_binding_in_error_is_an_error_of_its_grounding_only(load, reasoner):
    knowledge_base = drone(load)
    reasoner.load(knowledge_base.ontology)
    for running, in_error in (("hover", True), ("hover_low", False), ("glide", False)):
        facts = Facts((OBJECTIVE,), {"o_fly": running}, components=failed("baro"))
        assert knowledge_base.analyse(facts, reasoner).objectives["o_fly"].in_error is in_error


def test_without_spares_a_design_is_lost_with_its_component(load, reasoner):
    knowledge_base = drone(load, spares=False)
    reasoner.load(knowledge_base.ontology)
    assert set(knowledge_base.designs) == {"hover", "glide"}
    found = knowledge_base.analyse(Facts(components=failed("baro")), reasoner)
    assert found.unrealisable == {"hover": ("baro",)}


def test_plain_pellet_says_the_same_of_the_saved_knowledge_base(load, tmp_path):
    import owlready2
    from mros1_reasoner.io.ontology_files import save_knowledge_base

    knowledge_base = drone(load)
    save_knowledge_base(
        tmp_path / "saved.owl",
        knowledge_base,
        Facts((OBJECTIVE,), {"o_fly": "hover"}, components=failed("baro", "sonar", "rotor_1", "rotor_3")),
    )
    world = owlready2.World()
    ontology = world.get_ontology((tmp_path / "saved.owl").as_uri()).load()
    with ontology:
        owlready2.sync_reasoner_pellet(world, infer_property_values=True, infer_data_property_values=True, debug=0)
    roles = {role.name: list(role.role_availability) for role in world.search(type=world[v.TOMASYS + "Role"])}
    assert roles == {"lift": [False], "height": [False]}
    grounding = world.search_one(iri="*fg/o_fly/hover")
    assert "IN_ERROR_COMPONENT" in grounding.fg_cause


def test_conclusions_that_a_model_holds_are_of_another_moment(load, reasoner):
    old = f'<rdf:Description rdf:about="#height"><t:role_availability rdf:datatype="{XSD}boolean">false'
    old += '</t:role_availability></rdf:Description><rdf:Description rdf:about="#height_baro"><t:b_status '
    old += f'rdf:datatype="{XSD}boolean">false</t:b_status></rdf:Description>'
    knowledge_base = drone(load, old)
    reasoner.load(knowledge_base.ontology)
    assert not knowledge_base.analyse(Facts((OBJECTIVE,), {"o_fly": "hover"}), reasoner).unrealisable


def test_designs_say_what_they_are_deployed_with(load):
    designs = drone(load).designs
    assert designs["hover"].bindings == {"height": "baro"}
    assert designs["hover_low"].bindings == {"height": "sonar"}
    assert (designs["hover"].root, designs["hover_low"].root, designs["glide"].root) == ("hover", "hover", "glide")
    assert designs["hover_low"].components == {"sonar"}


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (
            design("dive", ["height"], ["height_baro", "height_sonar"]),
            "dive binds several components to the role height",
        ),
        (design("dive", ["height"], ["nothing"]), "nothing, which dive binds, must have one binding_role"),
        (design("dive", rebinds="nowhere"), "dive rebinds something, which is no FunctionDesign"),
        (design("dive", rebinds="hover_low"), "dive rebinds hover_low, which rebinds hover, itself"),
        (
            '<t:Function rdf:about="#f_land"/>' + design("dive", rebinds="hover", solves="f_land"),
            "dive rebinds hover, which solves another function",
        ),
        (
            f'<t:Role rdf:about="#tail"><t:role_least rdf:datatype="{XSD}decimal">2</t:role_least></t:Role>'
            + binding("tail", "fin"),
            "role tail has role_least 2.0, and 1 components can fill it",
        ),
    ],
)
def test_bad_roles_get_one_line(load, more, words):
    with pytest.raises(KnowledgeBaseError) as caught:
        drone(load, more)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
