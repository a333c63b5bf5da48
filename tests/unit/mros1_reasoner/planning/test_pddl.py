from mros1_reasoner.planning.pddl import problem


def test_initial_state_has_what_can_be_fulfilled_and_how():
    assert problem({"f_go": ["fast", "slow"], "f_see": []}) == (
        "(define (problem now)\n"
        "  (:domain mros)\n"
        "  (:objects\n"
        "    f_go - function\n"
        "    f_see - function\n"
        "    fast - design\n"
        "    slow - design\n"
        "  )\n"
        "  (:init\n"
        "    (fulfillable f_go)\n"
        "    (best fast f_go)\n"
        "    (solves fast f_go)\n"
        "    (solves slow f_go)\n"
        "  )\n"
        ")\n"
    )


def test_names_are_those_of_pddl_and_differ():
    text = problem({"F1": ["FD1.1", "fd1_1", "2nd"]})
    assert "f1 - function" in text
    assert "fd1_1 - design" in text
    assert "fd1_1-2 - design" in text
    assert "x2nd - design" in text


def test_nothing_is_a_problem_too():
    assert "(:init\n  )" in problem({})
