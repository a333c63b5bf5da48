"""Shortages of the system, for all unit tests."""

import itertools
import threading

import pytest


@pytest.fixture
def failing(monkeypatch):
    """Have the next calls of a function or method fail that are meant; return what is still to be raised."""

    def fail(where, name, error, is_meant=lambda *_: True, times=3):
        usual = getattr(where, name)
        left = [error] * times

        def do(*arguments, **options):
            if left and is_meant(*arguments):
                raise left.pop()
            return usual(*arguments, **options)

        monkeypatch.setattr(where, name, do)
        return left

    return fail


@pytest.fixture
def no_thread(failing):
    """Have threads not start, after so many that do; return what is still to be raised."""

    def fail(times=1, after=0):
        count = itertools.count()
        error = RuntimeError("can't start new thread")
        return failing(threading.Thread, "start", error, lambda *_: next(count) >= after, times)

    return fail
