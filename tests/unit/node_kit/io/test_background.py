"""Work in threads of its own, also where the system gives no thread."""

import pytest
from node_kit.io.background import NoThreadError, again_and_again, in_background, start_thread


def test_what_comes_of_the_work_is_returned():
    assert in_background(lambda: 3, "work").result(5.0) == 3
    assert isinstance(in_background(lambda: 1 / 0, "work").exception(5.0), ZeroDivisionError)


def test_work_without_a_thread_fails_as_a_call_of_the_system_does(no_thread):
    no_thread(times=2)
    error = in_background(lambda: 3, "work").exception(0.0)
    assert isinstance(error, OSError)
    assert str(error) == "no thread could be started: can't start new thread"
    with pytest.raises(NoThreadError):
        start_thread(lambda: 3, "work")


def test_thread_outlasts_errors_that_nobody_foresaw(caplog):
    found = iter([1, MemoryError(), 2, ValueError("odd"), 3])
    done = []

    def step():
        one = next(found)
        if isinstance(one, Exception):
            raise one
        done.append(one)

    again_and_again(step, lambda: done[-1:] != [3])
    assert done == [1, 2, 3]
    assert "odd" in caplog.text
