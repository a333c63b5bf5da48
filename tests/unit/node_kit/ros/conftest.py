"""What tests of rospy in trouble share."""

import pytest


@pytest.fixture
def failing(monkeypatch):
    """Have the next calls of a function or method fail that are meant; return what is still to be raised."""

    def fail(where, name, error, is_meant=lambda *_: True, times=3):
        usual = getattr(where, name)
        left = [error] * times

        def do(*arguments):
            if left and is_meant(*arguments):
                raise left.pop()
            return usual(*arguments)

        monkeypatch.setattr(where, name, do)
        return left

    return fail
