import math
from dataclasses import replace

import pytest
from mros1_reasoner.knowledge.model import Design, Direction, Objective, Quality
from mros1_reasoner.knowledge.scale import Correction
from mros1_reasoner.planning.planner import Situation, difference, plan
from mros1_reasoner.planning.utility import quality as expected_level

OBJECTIVE = Objective("o", "f", {"risk": 0.6, "power": 0.62})
UTILITY = expected_level("use", {"use": Quality(Direction.HIGHER_IS_BETTER)})


def design(name, risk=0.1, power=0.1, use=0.5, components=()):
    return Design(name, "f", {"risk": risk, "power": power, "use": use}, frozenset(components))


def choose(*designs, objective=OBJECTIVE, utility=UTILITY, distance=difference, **situation):
    return plan(objective, designs, Situation(**situation), utility, distance)


def reasons(result):
    return {candidate.name: candidate.refused_because for candidate in result.candidates}


def test_highest_utility_wins():
    result = choose(design("a", use=0.5), design("b", use=0.9), design("c", use=0.7))
    assert result.choice == "b"
    assert [c.name for c in result.candidates] == ["b", "c", "a"]
    assert [c.chosen for c in result.candidates] == [True, False, False]
    assert set(reasons(result).values()) == {""}
    assert not result.degraded


@pytest.mark.parametrize("quality", ["risk", "power"])
def test_every_limit_counts(quality):
    result = choose(design("good"), design("bad", use=1.0, **{quality: 0.7}))
    assert result.choice == "good"
    assert reasons(result)["bad"] == f"{quality} 0.7 > {OBJECTIVE.limits[quality]:g}"


def test_where_nothing_can_be_deployed_only_what_these_designs_lack_is_told():
    unrealisable = {"weld": ["gas"], "glue": ["pump"], "drive": ["wheel"]}  # of which drive is of another function
    result = choose(design("weld"), design("glue"), unrealisable=unrealisable, unfulfilled={"glue": ["f_look"]})
    assert result.reason == "no design can be deployed without gas, pump or f_look"


def test_where_nothing_can_be_deployed_surroundings_that_do_not_suit_are_told():
    unrealisable = {"weld": ["gas"], "glue": [], "rivet": []}
    unsuited = {"glue": ["dust 5 > 3", "light 0.1 < 0.25"], "rivet": ["dust 5 > 3"]}
    designs = [design(name) for name in unrealisable]
    result = choose(*designs, unrealisable=unrealisable, unsuited=unsuited)
    assert result.reason == "no design can be deployed without gas or where dust 5 > 3 and light 0.1 < 0.25"
    result = choose(*designs[1:], unrealisable=unrealisable, unsuited=unsuited)
    assert result.reason == "no design can be deployed where dust 5 > 3 and light 0.1 < 0.25"


def test_level_at_the_limit_keeps_it():
    assert choose(design("edge", risk=0.6, power=0.62)).degraded is False


def test_direction_turns_the_comparison_round():
    objective = Objective("o", "f", {"use": 0.4})
    result = choose(
        design("low", use=0.3),
        design("high", use=0.5),
        objective=objective,
        qualities={"use": Quality(Direction.HIGHER_IS_BETTER)},
    )
    assert result.choice == "high"
    assert reasons(result)["low"] == "use 0.3 < 0.4"


def test_unrealisable_design_is_refused_with_the_component():
    result = choose(design("a", use=0.9), design("b"), unrealisable={"a": ["laser"]})
    assert result.choice == "b"
    assert reasons(result)["a"] == "requires laser, which does not work"


def test_design_that_was_tried_in_vain_is_refused():
    result = choose(design("a", use=0.9), design("b"), tried={"a": "tried"})
    assert result.choice == "b"
    assert reasons(result)["a"] == "tried"


def test_design_without_an_expected_level_is_refused():
    result = choose(Design("bare", "f", {"use": 1.0}), design("b"))
    assert result.choice == "b"
    assert "no risk is expected of it" in reasons(result)["bare"]


def test_tie_goes_to_the_smaller_change():
    near, far = design("z_near", risk=0.2), design("a_far", risk=0.5)
    result = choose(near, far, design("now", risk=0.2, use=0.1), current="now")
    assert result.choice == "z_near"
    assert "smaller change than a_far" in result.reason


def test_smaller_change_is_that_of_fewer_components():
    same, other = design("z", components=["laser"]), design("a", components=["camera"])
    assert choose(same, other, design("now", use=0.1, components=["laser"]), current="now").choice == "z"


def test_given_distance_is_used():
    result = choose(
        design("a"), design("b"), design("now", use=0), current="now", distance=lambda _, to: to.name == "a"
    )
    assert result.choice == "b"


def test_where_none_keeps_every_limit_the_least_violating_one_is_taken_and_it_says_degraded():
    result = choose(design("a", risk=0.9, use=0.9), design("b", risk=0.65, use=0.1), design("c", risk=0.65, power=0.7))
    assert result.choice == "b"
    assert result.degraded
    assert result.reason.startswith("degraded:")


def test_current_design_counts_with_what_was_observed():
    current, other = design("now", risk=0.1), design("other", risk=0.8)
    worse = choose(current, other, current="now", tried={"now": "tried"}, observed={"risk": 0.9})
    assert worse.choice == "other"
    better = choose(current, other, current="now", tried={"now": "tried"}, observed={"risk": 0.7})
    assert better.choice == "now"


def test_where_all_were_tried_in_vain_they_are_tried_again():
    result = choose(design("a"), design("b", use=0.9), tried={"a": "x", "b": "x"})
    assert (result.choice, result.degraded, result.is_retry) == ("b", False, True)
    assert (
        result.reason == "all designs that keep every limit have failed recently; b is tried again: it is the "
        "most useful of them"
    )
    assert reasons(result)["a"] == "x"


def test_design_at_a_limit_that_it_must_not_reach_keeps_it_no_more_when_it_has_failed():
    at_limit = {"qualities": {"risk": Quality(reaching_violates=True)}, "tried": {"a": "x"}}
    result = choose(design("a", risk=0.6), **at_limit)
    assert (result.choice, result.degraded, result.is_retry) == ("a", True, False)


def test_nothing_can_be_deployed():
    result = choose(design("a"), unrealisable={"a": ["laser", "base"]})
    assert result.choice is None
    assert "base, laser" in result.reason


def test_each_loser_has_its_reason():
    result = choose(
        design("best", use=0.9),
        design("less", use=0.5),
        design("far", use=0.9, power=0.4),
        design("bad", risk=0.9),
        design("now", use=0.1),
        current="now",
    )
    assert {c.name: c.lost_because for c in result.candidates} == {
        "best": "",
        "far": "as useful as the choice, but a bigger change",
        "less": "utility 0.5 is less than 0.9",
        "now": "utility 0.1 is less than 0.9",
        "bad": "risk 0.9 > 0.6",
    }


def test_losers_of_a_degraded_choice_say_how_much_they_violate():
    result = choose(design("a", risk=0.9), design("b", risk=0.66))
    assert [c.lost_because for c in result.candidates] == [
        "",
        "risk 0.9 > 0.6; violates limits by 0.5, the choice by 0.1",
    ]


def test_where_nothing_can_be_deployed_the_candidates_are_ranked():
    result = choose(design("a", risk=0.9), design("b"), unrealisable={"a": ["laser"], "b": ["laser"]})
    assert [c.name for c in result.candidates] == ["b", "a"]
    assert all(c.lost_because for c in result.candidates)


def test_no_designs():
    assert choose().choice is None


def test_utility_where_lower_is_better():
    result = choose(
        design("a", power=0.1), design("b", power=0.5), utility=expected_level("power", {"power": Quality()})
    )
    assert result.choice == "a"


def test_difference_of_a_design_to_itself_is_nothing():
    assert difference(design("a"), replace(design("a"), name="b")) == 0


def test_of_designs_that_are_as_useful_the_one_that_keeps_limits_best_is_taken_where_that_is_wanted():
    designs = [
        Design(name, "f", {"heat": heat, "speed": speed})
        for name, heat, speed in (
            ("hot", 0.58, 0.70),
            ("cool", 0.40, 0.66),
            ("slow", 0.10, 0.40),
        )
    ]
    objective = Objective("o", "f", {"heat": 0.6})

    def choose(indifference):
        situation = Situation(indifference=indifference)
        return plan(objective, designs, situation, lambda design: design.expected["speed"], difference)

    assert choose(0.0).choice == "hot"
    assert choose(0.05).choice == "cool"
    assert choose(0.5).choice == "slow"
    assert "keeps them best of the 2 within 0.05" in choose(0.05).reason
    lost = {c.name: c.lost_because for c in choose(0.05).candidates}
    assert lost["hot"] == "as useful as the choice, but nearer to a limit"


def test_design_that_keeps_a_violated_limit_barely_is_taken_only_where_no_other_brings_relief():
    designs = [Design("now", "f", {"heat": 0.5, "speed": 0.9}), Design("near", "f", {"heat": 0.55, "speed": 0.8})]
    far = Design("far", "f", {"heat": 0.3, "speed": 0.1})
    situation = Situation(current="now", observed={"heat": 0.7}, relief={"heat": 0.1})
    objective = Objective("o", "f", {"heat": 0.6})

    def choose(candidates):
        return plan(objective, candidates, situation, lambda design: design.expected["speed"], difference)

    assert choose([*designs, far]).choice == "far"
    assert choose(designs).choice == "near"
    lost = {c.name: c.lost_because for c in choose([*designs, far]).candidates}
    assert lost["near"] == "it would keep the violated limit barely"


def test_design_that_is_hardly_better_in_the_violated_quality_is_not_worth_a_change():
    designs = [Design("now", "f", {"heat": 0.5, "speed": 0.9}), Design("near", "f", {"heat": 0.49, "speed": 0.9})]
    situation = Situation(
        current="now",
        observed={"heat": 0.61},
        corrections={("heat", ""): Correction(factor=1.22)},
        relief={"heat": 0.0},
        worth=0.1,
    )
    result = plan(Objective("o", "f", {"heat": 0.6}), designs, situation, lambda _: 0.0, difference)
    assert result.choice == "now"
    lost = {c.name: c.lost_because for c in result.candidates}
    assert lost["near"].startswith("heat 0.5978 is hardly better than the present 0.61")


def test_of_designs_as_useful_the_one_wins_that_keeps_all_limits_best_with_the_fewest_changes():
    def made(name, heat, noise, speed, *components):
        expected = {"heat": heat, "noise": noise, "speed": speed}
        return Design(name, "f", expected, components=frozenset(components))

    now = made("now", 0.5, 0.58, 0.9, "camera")
    loud = made("loud", 0.51, 0.5, 0.92, "camera")
    calm = made("calm", 0.52, 0.3, 0.88, "camera")
    other = made("other", 0.52, 0.3, 0.89, "laser")
    objective = Objective("o", "f", {"heat": 0.6, "noise": 0.6})
    situation = Situation(current="now", indifference=0.05, worth=0.1)
    result = plan(objective, [now, loud, calm, other], situation, lambda design: design.expected["speed"], difference)
    assert result.choice == "calm"
    lost = {c.name: c.lost_because for c in result.candidates}
    assert lost["loud"] == "as useful as the choice, but nearer to a limit"
    assert lost["other"] == "as useful as the choice, but a bigger change"


def test_desired_design_comes_first_where_it_keeps_every_limit():
    result = choose(design("a", use=0.9), design("b", use=0.2), desired="b")
    assert result.choice == "b" and not result.degraded
    assert result.reason == "b is the desired configuration, and keeps every limit"
    assert result.candidates[1].lost_because == "b is the desired configuration"


def test_desired_design_that_violates_a_limit_is_not_taken_while_others_keep_all():
    result = choose(design("a", use=0.9), design("b", use=0.5), design("c", risk=0.7), desired="c")
    assert result.choice == "a" and not result.degraded
    assert result.reason.endswith("; c, the desired configuration, is not taken: risk 0.7 > 0.6")


def test_desired_design_is_taken_where_no_design_keeps_every_limit():
    designs = design("a", risk=0.65), design("b", risk=0.9), design("c", risk=0.7)
    result = choose(*designs, desired="b")
    assert result.choice == "b" and result.degraded
    assert result.reason == "degraded: no design keeps every limit; b is the desired configuration"
    assert choose(*designs, desired="b", unrealisable={"b": ["laser"]}).choice == "a"
    assert choose(*designs, desired="b", strained={"b": ["f_look"]}).choice == "a"


@pytest.mark.parametrize("indifference", [0.0, 1.0])
def test_levels_beyond_what_can_be_computed_end_no_plan(indifference):
    designs = design("a", risk=-1e308, power=1e308), design("b", risk=1e308, power=-1e308), design("c")
    limits = {"risk": 1e308, "power": 1e308}
    result = choose(*designs, objective=replace(OBJECTIVE, limits=limits), current="a", indifference=indifference)
    assert result.choice in {"a", "b", "c"}
    assert difference(designs[0], designs[1]) == 1.0


@pytest.mark.parametrize("size", [math.nan, math.inf])
def test_change_of_no_finite_size_is_the_greatest(size):
    sizes = {"a": size, "b": 3.0}
    result = choose(
        design("a"), design("b"), design("c"), current="c", distance=lambda _, other: sizes.get(other.name, 9)
    )
    assert [candidate.name for candidate in result.candidates] == ["b", "c", "a"]
