from mros1_reasoner.ros.log_throttle import LogThrottle


def test_a_text_passes_once_in_a_period():
    throttle = LogThrottle(period=10.0)
    assert [throttle.admit(now, "qa", "bad") for now in (0.0, 1.0, 9.9)] == ["bad", None, None]


def test_after_a_period_it_tells_how_many_it_held_back():
    throttle = LogThrottle(period=10.0)
    for now in (0.0, 1.0, 2.0):
        throttle.admit(now, "qa", "bad")
    assert throttle.admit(10.0, "qa", "worse") == "worse (2 like it were not shown in the meantime)"
    assert throttle.admit(20.0, "qa", "bad") == "bad"


def test_few_different_texts_of_a_kind_pass_and_other_kinds_are_not_held_back():
    throttle = LogThrottle(period=10.0, burst=3)
    said = [throttle.admit(0.0, "qa", f"bad {i}") for i in range(1000)]
    assert [text for text in said if text] == ["bad 0", "bad 1", "bad 2"]
    assert throttle.admit(0.0, "component", "broken") == "broken"
