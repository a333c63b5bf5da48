"""Work that threads leave for one of them."""

from concurrent.futures import ThreadPoolExecutor

import pytest
from node_kit.io.inbox import Inbox


def test_work_is_done_in_order_when_it_is_drained():
    inbox, done = Inbox(), []
    for number in range(3):
        inbox.put(lambda number=number: done.append(number))
    assert done == []
    inbox.drain()
    inbox.drain()
    assert done == [0, 1, 2]


def test_call_returns_once_another_thread_has_done_it():
    inbox, done = Inbox(), []
    with ThreadPoolExecutor(1) as pool:
        call = pool.submit(inbox.call, lambda: done.append(1), 60.0)
        inbox.drain(30.0)
        call.result(60.0)
    assert done == [1]


def test_what_a_called_work_raises_comes_up_with_the_caller():
    inbox = Inbox()

    def fail():
        raise ValueError("no")

    with ThreadPoolExecutor(1) as pool:
        call = pool.submit(inbox.call, fail, 60.0)
        inbox.drain(30.0)
        with pytest.raises(ValueError, match="no"):
            call.result(60.0)


def test_call_that_nobody_does_ends_after_its_patience():
    with pytest.raises(TimeoutError):
        Inbox().call(lambda: None, 0.01)


def test_drain_waits_for_the_first():
    inbox, done = Inbox(), []
    with ThreadPoolExecutor(1) as pool:
        pool.submit(inbox.put, lambda: done.append(1))
        inbox.drain(30.0)
    assert done == [1]
