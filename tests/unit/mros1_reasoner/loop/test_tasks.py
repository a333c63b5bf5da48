from types import SimpleNamespace

from mros1_reasoner.loop.tasks import newest_goal


def statuses(*goals):
    found = [
        SimpleNamespace(goal_id=SimpleNamespace(stamp=stamp, id=name), status=status) for stamp, name, status in goals
    ]
    return SimpleNamespace(status_list=found)


def test_only_the_newest_goal_counts():
    assert newest_goal(statuses((2.0, "b", 1), (1.0, "a", 4))) == ("b", False)
    assert newest_goal(statuses((1.0, "a", 3), (2.0, "b", 4))) == ("b", True)


def test_without_goals_nothing_is_known():
    assert newest_goal(statuses()) is None
