"""Health of topics over time."""

import pytest
from ros_model.language.metamodel import RosSystem, SystemParameter
from rosgraph_monitor.diagnostics.status import Level
from rosgraph_monitor.health.topics import TopicHealth, TopicSpec, merged, model_topics, parse_topics, verdict_statuses

BEGIN = 1e-9
"""s. A time of 0 means that the clock has not begun."""


def health(grace=5.0, **limits):
    followed = TopicHealth(grace)
    followed.follow({"scan": TopicSpec("scan", **limits)}, BEGIN, BEGIN)
    return followed


def said(followed, now, **options):
    return [verdict.message for verdict in followed.judge(now, now, **options)]


def feed(followed, begin, end, rate, digest=lambda i: i):
    for i in range(round((end - begin) * rate)):
        followed.arrived("scan", begin + i / rate, begin + i / rate, digest(i))


def test_topic_may_bring_its_first_message_within_the_grace():
    followed = health(max_age=1.0)
    assert said(followed, 5.0) == [""]
    assert not followed.judge(5.0, 5.0)[0].heard
    assert said(followed, 5.1) == ["Silent topic"]


def test_another_grace_may_hold_for_the_moment():
    followed = health(max_age=1.0)
    assert said(followed, 3.0, grace=3.0) == [""]
    assert said(followed, 3.1, grace=3.0) == ["Silent topic"]
    assert said(followed, 3.2) == [""]


def test_first_message_of_a_slow_topic_has_two_of_its_periods():
    followed = health(min_rate=0.25)
    assert said(followed, 8.0, grace=3.0) == [""]
    assert said(followed, 8.1, grace=3.0) == ["Silent topic"]


@pytest.mark.parametrize(("ros", "wall"), [(60.0, 4.0), (4.0, 60.0)])
def test_neither_a_fast_simulation_nor_a_paused_one_shortens_the_grace(ros, wall):
    assert health(max_age=1.0).judge(ros, wall)[0].message == ""


def test_silence_is_told_when_the_last_message_is_too_old():
    followed = health(max_age=1.0)
    followed.arrived("scan", 2.0, 2.0)
    assert said(followed, 3.0) == [""]
    (verdict,) = followed.judge(3.1, 3.1)
    assert verdict.message == "Silent topic"
    (status,) = verdict_statuses([verdict])
    assert (status.level, status.name) == (Level.ERROR, "scan")
    assert dict(status.values)["expected"] == "max_age 1"
    followed.arrived("scan", 3.2, 3.2)
    assert said(followed, 3.2) == [""]


@pytest.mark.parametrize(("rate", "message"), [(20.0, ""), (10.5, ""), (9.0, "Slow topic"), (3.0, "Slow topic")])
def test_rate(rate, message):
    followed = health(min_rate=10.0)
    feed(followed, 0.0, 6.0, rate)
    assert said(followed, 6.0) == [message]


def test_rate_is_not_judged_before_there_was_time_to_measure_it():
    followed = health(min_rate=10.0)
    feed(followed, 0.0, 1.9, 1.0)
    assert said(followed, 1.9) == [""]


def test_topic_that_stops_becomes_slow_even_without_a_limit_of_age():
    followed = health(min_rate=10.0)
    feed(followed, 0.0, 4.0, 20.0)
    assert said(followed, 9.0) == ["Slow topic"]


def test_same_data_again_and_again_is_a_stuck_sensor():
    followed = health(stuck_after=5)
    feed(followed, 0.0, 0.4, 10.0, digest=lambda i: 7)
    assert said(followed, 0.4) == [""]
    followed.arrived("scan", 0.5, 0.5, 7)
    assert said(followed, 0.5) == ["Stuck topic"]
    followed.arrived("scan", 0.6, 0.6, 8)
    assert said(followed, 0.6) == [""]


def test_excused_topic_is_fine_and_begins_anew():
    followed = health(grace=1.0, max_age=1.0)
    followed.arrived("scan", 0.0, 0.0)
    assert said(followed, 9.0, excused={"scan"}) == [""]
    assert said(followed, 9.9) == [""]
    assert said(followed, 10.1) == ["Silent topic"]


def test_time_is_ros_time_unless_wall_time_is_asked_for():
    followed = TopicHealth(5.0)
    specs = {"clock": TopicSpec("clock", max_age=1.0, wall_time=True), "scan": TopicSpec("scan", max_age=1.0)}
    followed.follow(specs, BEGIN, BEGIN)
    followed.arrived("clock", 1.0, 1.0)
    followed.arrived("scan", 1.0, 1.0)
    messages = {v.spec.name: v.message for v in followed.judge(ros=1.5, wall=9.0)}
    assert messages == {"clock": "Silent topic", "scan": ""}


def test_jump_of_time_begins_anew():
    followed = health(max_age=1.0)
    followed.arrived("scan", 100.0, 100.0)
    assert said(followed, 100.5) == [""]
    assert said(followed, 2.0) == [""]
    assert said(followed, 3.0) == [""]
    followed.arrived("scan", 3.0, 3.0)
    assert said(followed, 4.5) == ["Silent topic"]


def test_grace_begins_with_the_clock():
    followed = TopicHealth(5.0)
    followed.follow({"scan": TopicSpec("scan", max_age=1.0)}, 0.0, 0.0)
    assert said(followed, 0.0) == [""]
    assert said(followed, 1000.0) == [""]
    assert said(followed, 1005.1) == ["Silent topic"]


def run(followed, ros, pace=1.0, lasts=10.0, rate=20.0, wall=0.0, scan_rate=10.0):
    """Let a clock go on at a pace, with messages at a rate of ROS time; return the times, and all that is said."""
    told, due = [], ros
    for _ in range(round(lasts * rate)):
        ros, wall = ros + pace / rate, wall + 1.0 / rate
        while scan_rate and due <= ros:
            followed.arrived("scan", due, wall)
            due += 1.0 / scan_rate
        told += [verdict.message for verdict in followed.judge(ros, wall)]
    return ros, wall, told


def silence(followed, ros, wall, pace, rate=20.0):
    """Return after how much ROS time without a message the topic is said to be silent, in s."""
    begin = ros
    while ros - begin < 1000.0:
        ros, wall = ros + pace / rate, wall + 1.0 / rate
        if followed.judge(ros, wall)[0].message == "Silent topic":
            return ros - begin
    return None


@pytest.mark.parametrize("jump", [5.0, 3600.0, 1e9])
def test_clock_that_jumps_ahead_makes_no_topic_silent_and_no_later_silence_is_told_later(jump):
    followed = health(max_age=1.0, min_rate=5.0)
    ros, wall, told = run(followed, 1000.0)
    assert set(told) == {""}
    ros, wall, told = run(followed, ros + jump, wall=wall, lasts=5.0)
    assert set(told) == {""}
    assert silence(followed, ros, wall, 1.0) == pytest.approx(1.0, abs=0.11)


@pytest.mark.parametrize("jump", [5.0, 3600.0])
def test_clock_that_jumps_ahead_hides_no_silence(jump):
    followed = health(max_age=1.0)
    ros, wall, _ = run(followed, 1000.0)
    for _ in range(3):
        ros, wall, told = run(followed, ros + jump, wall=wall, lasts=3.0, scan_rate=0.0)
    assert set(told) == {"Silent topic"}


@pytest.mark.parametrize("pace", [0.1, 1.0, 10.0, 20.0, 200.0])
def test_silence_is_told_at_any_pace_of_a_simulation(pace):
    followed = health(max_age=1.0)
    ros, wall, told = run(followed, 1000.0, pace)
    assert set(told) == {""}
    assert silence(followed, ros, wall, pace) <= 1.0 + 2 * pace / 20.0


def test_silence_is_told_though_the_clock_goes_in_coarse_steps():
    followed = health(max_age=25.0)
    told = []
    for step in range(40):
        ros = 1000.0 + 10.0 * step  # s, one step each wall s
        if step < 20:
            followed.arrived("scan", ros, step)
        told += [followed.judge(ros, step + part / 20.0)[0].message for part in range(20)]
    assert set(told[:400]) == {""}
    assert set(told[460:]) == {"Silent topic"}


def test_monitor_that_was_held_up_takes_no_time_for_a_jump():
    followed = health(max_age=1.0)
    ros, wall, _ = run(followed, 1000.0)
    assert followed.judge(ros + 60.0, wall + 60.0)[0].message == "Silent topic"


def test_messages_are_not_kept_without_end_while_the_clock_stands():
    followed = health(min_rate=5.0)
    for i in range(25_000):
        followed.arrived("scan", 1000.0, i * 0.001)
    assert len(followed._seen["scan"].arrivals) <= 10_000
    ros, wall, told = run(followed, 1000.0, wall=25.0, scan_rate=20.0)
    assert set(told) == {""}
    assert set(run(followed, ros, wall=wall, scan_rate=2.0)[2][-20:]) == {"Slow topic"}


def test_followed_topics_keep_their_history_and_others_are_forgotten():
    followed = health(max_age=1.0)
    followed.arrived("scan", 1.0, 1.0)
    followed.follow({"scan": TopicSpec("scan", max_age=3.0)}, 1.5, 1.5)
    assert said(followed, 3.0) == [""]
    followed.follow({"scan": TopicSpec("scan", type="a/B")}, 3.0, 3.0)
    followed.arrived("scan", 3.0, 3.0)
    assert said(followed, 99.0) == []


def test_settings_by_topic_as_the_parameter_server_has_them():
    nested = {"front": {"scan": {"min_rate": 5, "type": "sensor_msgs/LaserScan"}}, "odom": {"max_age": 0.5}}
    assert parse_topics(nested) == parse_topics({"/front/scan": nested["front"]["scan"], "odom": {"max_age": 0.5}})
    assert parse_topics(nested)["front/scan"] == TopicSpec("front/scan", "sensor_msgs/LaserScan", 5)


@pytest.mark.parametrize(
    "value",
    [
        *([], {"min_rate": 5}, {"scan": {"rate": 5}}, {"scan": {"min_rate": 0}}, {"scan": {"max_age": "1"}}),
        *({"scan": {"stuck_after": 2.5}}, {"scan": {"max_age": float("inf")}}, {"scan": {"min_rate": True}}),
    ],
)
def test_bad_settings_are_refused(value):
    with pytest.raises(ValueError, match="topics"):
        parse_topics(value)


def test_model_may_say_what_it_expects_and_settings_go_first():
    system = RosSystem(
        "s",
        parameters=(
            SystemParameter("min_rate/front/scan", value=5),
            SystemParameter("max_age/front/scan", value=0.5),
            SystemParameter("qa_safety", value=0.5),
            SystemParameter("max_age/odom", value="soon"),
        ),
    )
    from_model = model_topics(system)
    assert from_model == {"front/scan": TopicSpec("front/scan", min_rate=5.0, max_age=0.5)}
    settings = {"front/scan": TopicSpec("front/scan", max_age=2.0), "odom": TopicSpec("odom", max_age=1.0)}
    assert merged(from_model, settings)["front/scan"] == TopicSpec("front/scan", min_rate=5.0, max_age=2.0)
