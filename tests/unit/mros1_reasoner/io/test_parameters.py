"""Parameters of the node, as a mapping."""

import math

import pytest
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.knowledge.model import Direction
from node_kit.parameters import ParameterError
from reasoner_helpers import DECIMAL, application


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "application.owl"
    path.write_text(application())
    return path


def given(model, **values):
    return Parameters({"model_file": str(model), **values})


def test_any_number_of_limits(model):
    parameters = given(model, nfr_safety=0.5, nfr_energy=1, nfr_performance=0.1)
    (objective,) = parameters.objectives(parameters.knowledge_base())
    assert objective.name == "o_moveA"
    assert objective.limits == {"safety": 0.5, "energy": 1.0, "performance": 0.1}


def test_name_that_is_a_number_is_no_limit(model):
    parameters = Parameters({"model_file": str(model), "nfr_safety": 0.5, 7: 0.1})  # as a journal may have it
    (objective,) = parameters.objectives(parameters.knowledge_base())
    assert objective.limits == {"safety": 0.5}


def test_tasks_may_ask_for_all_objectives_of_a_model_without_any(model):
    parameters = given(model, default_objectives=False, nfr_safety=0.5)
    assert parameters.objectives(parameters.knowledge_base()) == ()


def test_limit_of_an_unknown_quality_is_left_out_with_a_warning(model, caplog):
    parameters = given(model, nfr_comfort=0.5)
    (objective,) = parameters.objectives(parameters.knowledge_base())
    assert objective.limits == {}
    assert "Unsupported QA TYPE received: comfort" in caplog.text


def test_every_setting_of_the_loop_has_a_parameter(model):
    parameters = given(model, cool_down=7, approval=True, dry_run="true", always_improve=1, error_log_expiry=0)
    settings = parameters.settings(parameters.knowledge_base())
    assert (settings.cool_down, settings.error_log_expiry) == (7.0, 0.0)
    assert (settings.approval, settings.dry_run, settings.always_improve) == (True, True, True)


def test_without_a_manipulator_nothing_is_waited_for(model):
    parameters = given(model, use_reconfigure_srv=False)
    assert not parameters.asks
    assert parameters.settings(parameters.knowledge_base()).start_grace == 0.0


def test_models_as_list_or_separated_by_commas(model, tmp_path):
    more = tmp_path / "more.owl"
    assert given(model, model_file=[str(model), str(more)]).model_files == [model, more]
    assert given(model, model_file=f"{model}, {more}").model_files == [model, more]


def test_list_in_an_argument_of_a_launch_file_is_a_list(model, tmp_path):
    """As in the published `tomasys:="[a, b]"`, which roslaunch passes on as text."""
    (tmp_path / "more.owl").write_text(model.read_text().replace("app#", "more#").replace("/app", "/more"))
    parameters = Parameters({"model_file": f"[{model}]", "tomasys_file": f"[{tmp_path / 'more.owl'}, '{model}']"})
    assert parameters.model_files == [model]
    assert parameters.vocabulary_files == [tmp_path / "more.owl", model]


def test_default_limits_hold_where_the_model_has_no_objective(model, tmp_path):
    defaults = {"energy": 0.5, "safety": 0.5, "comfort": 0.5}
    parameters = given(model, default_nfrs=defaults, nfr_safety=0.7)
    (objective,) = parameters.objectives(parameters.knowledge_base())
    assert objective.limits == {"energy": 0.5, "safety": 0.7}
    asked_for = '<t:Objective rdf:about="#o_go"><t:typeF rdf:resource="#f_move"/></t:Objective>'
    model.write_text(application(extra=asked_for))
    parameters = given(model, default_nfrs=defaults)
    (objective,) = parameters.objectives(parameters.knowledge_base())
    assert (objective.name, objective.limits) == ("o_go", {})


def test_qualities_with_a_namespace_in_their_names(model):
    """The parameter server makes levels of the slashes."""
    model.write_text(model.read_text().replace("#energy", "#arm/energy"))
    parameters = given(
        model,
        qa_direction={"arm": {"energy": "higher_is_better"}, "safety": "lower_is_better"},
        nfr_arm={"energy": 0.3},
        nfr_safety=0.5,
    )
    knowledge_base = parameters.knowledge_base()
    assert knowledge_base.qualities["arm/energy"].direction is Direction.HIGHER_IS_BETTER
    (objective,) = parameters.objectives(knowledge_base)
    assert objective.limits == {"arm/energy": 0.3, "safety": 0.5}
    defaults = given(model, default_nfrs={"arm": {"energy": 0.5}})
    assert defaults.objectives(knowledge_base)[0].limits == {"arm/energy": 0.5}


def test_nodes_of_components(model):
    components = {"laser": {"node": "/front_laser"}, "base": {}, "odd": 3, "arm": {"driver": {"node": "arm/driver"}}}
    assert given(model, components=components).nodes == {"front_laser": "laser", "arm/driver": "arm/driver"}


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"nfr_safety": "high"}, "~nfr_safety is 'high': it must be a finite number"),
        ({"nfr_safety": math.nan}, "~nfr_safety is nan"),
        ({"nfr_safety": True}, "~nfr_safety is True"),
        ({"cool_down": -1}, "~cool_down is -1: it must be a finite number, at least 0"),
        ({"dry_run": "perhaps"}, "~dry_run is 'perhaps': it must be true or false"),
        ({"qa_direction": {"safety": "sideways"}}, "~qa_direction/safety is 'sideways'"),
        ({"qa_direction": "safety"}, "~qa_direction is 'safety': it must be a mapping"),
        ({"desired_configuration": "fly"}, "~desired_configuration is 'fly': no FunctionDesign"),
        ({"components": [1]}, r"~components is \[1\]: it must be a mapping"),
        ({"task_actions": "move_base"}, "~task_actions is 'move_base': it must be a mapping"),
        ({"reasoning_rate": 0}, "~reasoning_rate is 0: it must be a finite number, more than 0"),
        ({"model_file": ""}, "~model_file is not set"),
    ],
)
def test_what_can_not_be_used_is_named(model, values, message):
    def use():
        parameters = given(model, **values)
        knowledge_base = parameters.knowledge_base()
        parameters.objectives(knowledge_base)
        parameters.settings(knowledge_base)
        return parameters.nodes, parameters.task_actions, parameters.period

    with pytest.raises(ParameterError, match=message):
        use()


@pytest.mark.parametrize("given_limit", [-2, [-0.5, 0.5]])
def test_limit_out_of_its_range_is_named(tmp_path, given_limit):
    bounds = f'<t:qa_min rdf:datatype="{DECIMAL}">0</t:qa_min><t:qa_max rdf:datatype="{DECIMAL}">1</t:qa_max>'
    path = tmp_path / "bounded.owl"
    path.write_text(application(extra=f'<t:QualityAttributeType rdf:about="#safety">{bounds}</t:QualityAttributeType>'))
    parameters = given(path, nfr_safety=given_limit)
    with pytest.raises(ParameterError, match=r"~nfr_safety is .* a level within its range, 0 to 1"):
        parameters.objectives(parameters.knowledge_base())


def test_utility_that_a_design_has_not_is_refused_at_the_start(model):
    parameters = given(model, utility={"weights": {"performance": 1e308, "energy": -1e308, "safety": 1e308}})
    parameters.settings(parameters.knowledge_base())
    model.write_text(application().replace(">0.7<", ">7<"))
    with pytest.raises(ParameterError, match=r"~utility: .*of camera_fast: ValueError"):
        parameters.settings(parameters.knowledge_base())
