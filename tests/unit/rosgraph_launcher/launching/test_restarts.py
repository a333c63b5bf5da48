"""When a node that died is started again, and when that is given up."""

from rosgraph_launcher.launching.restarts import DeathCounter, RestartPolicy

POLICY = RestartPolicy(intensity=3, period=30.0, first_delay=0.1, longest_delay=0.3)


def test_delay_doubles_up_to_its_limit():
    counter = DeathCounter(POLICY)
    assert [round(counter.count("/a", now) - now, 3) for now in (0.0, 1.0, 2.0)] == [0.1, 0.2, 0.3]


def test_too_many_deaths_in_the_period_end_it():
    counter = DeathCounter(POLICY)
    assert [counter.count(name, 1.0) is None for name in ("/a", "/b", "/a", "/b")] == [False, False, False, True]


def test_deaths_of_long_ago_do_not_count():
    counter = DeathCounter(POLICY)
    assert [counter.count("/a", now) for now in (0.0, 40.0, 80.0, 120.0, 160.0)][-1] == 160.1


def test_another_configuration_starts_without_deaths():
    counter = DeathCounter(POLICY)
    for _ in range(4):
        counter.count("/a", 0.0)
    counter.reset()
    assert counter.count("/a", 0.0) == 0.1


def test_no_restart_at_all_can_be_had():
    assert DeathCounter(RestartPolicy(intensity=0)).count("/a", 0.0) is None


def test_node_may_die_as_often_as_one_likes():
    counter = DeathCounter(RestartPolicy(intensity=10_000, period=1e6, longest_delay=5.0))
    assert [counter.count("/a", float(death)) - death for death in range(1100)][-1] == 5.0
