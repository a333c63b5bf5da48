"""Work that threads leave for one of them."""

import signal
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from node_kit.io.inbox import ClosedError, Inbox


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


def test_call_returns_what_the_work_returns():
    inbox = Inbox()
    with ThreadPoolExecutor(1) as pool:
        call = pool.submit(inbox.call, lambda: 7, 60.0)
        inbox.drain(30.0)
        assert call.result(60.0) == 7


def test_call_given_up_before_its_turn_is_not_done_later():
    inbox, done = Inbox(), []
    with pytest.raises(TimeoutError, match=r"within 0\.01 s"):
        inbox.call(lambda: done.append(1), 0.01)
    inbox.drain()
    assert done == []


def test_time_out_of_the_work_itself_is_told_as_it_is():
    inbox = Inbox()

    def fail():
        raise TimeoutError("the camera is slow")

    with ThreadPoolExecutor(1) as pool:
        call = pool.submit(inbox.call, fail, 60.0)
        inbox.drain(30.0)
        with pytest.raises(TimeoutError, match="the camera is slow"):
            call.result(60.0)


def test_full_inbox_takes_nothing_more():
    inbox = Inbox()
    assert [inbox.put(print, at_most=2) for _ in range(4)] == [True, True, False, False]
    assert len(inbox) == 2


def test_drain_leaves_what_comes_meanwhile():
    inbox, done = Inbox(), []
    inbox.put(lambda: inbox.put(lambda: done.append("later")))
    inbox.drain()
    assert done == []
    inbox.drain()
    assert done == ["later"]


def test_work_that_raises_leaves_the_rest():
    inbox, done = Inbox(), []
    inbox.put(lambda: 1 / 0)
    inbox.put(lambda: done.append(1))
    with pytest.raises(ZeroDivisionError):
        inbox.drain()
    inbox.drain()
    assert done == [1]


def test_work_is_done_one_by_one_for_who_looks_at_something_else_between():
    inbox, done = Inbox(), []
    inbox.put(lambda: done.append(1))
    inbox.put(lambda: done.append(2))
    assert inbox.do_next()
    assert done == [1]
    assert inbox.do_next(wait_s=30.0)
    assert not inbox.do_next()
    assert not inbox.do_next(wait_s=0.001)


def test_each_put_wakes_who_waits_elsewhere():
    woken = []
    inbox = Inbox(lambda: woken.append(len(inbox)))
    inbox.put(print)
    inbox.put(print)
    assert woken == [1, 2]


def test_closing_ends_calls_that_wait_and_that_come_later():
    inbox, done = Inbox(), []
    begun, release = threading.Event(), threading.Event()

    def long():
        begun.set()
        release.wait(60.0)

    with ThreadPoolExecutor(3) as pool:
        at_work = pool.submit(inbox.call, long)
        worker = pool.submit(inbox.drain, 30.0)
        assert begun.wait(60.0)
        waiting = pool.submit(inbox.call, lambda: done.append(1))
        while not inbox:
            pass
        inbox.close("it ends")
        for call in (at_work, waiting):
            with pytest.raises(ClosedError, match="it ends"):
                call.result(60.0)
        with pytest.raises(ClosedError, match="it ends"):
            inbox.call(print)
        release.set()
        worker.result(60.0)
    inbox.drain()
    assert done == []


@pytest.mark.parametrize("waits", [lambda inbox: inbox.drain(0.02), lambda inbox: inbox.wait(0.02)])
def test_wait_ends_when_a_signal_handler_outlasts_it(waits):
    """With queue.SimpleQueue it does not, on Python 3.11."""
    inbox, rescued = Inbox(), []
    handler = signal.signal(signal.SIGALRM, lambda *_: release.wait(0.1))
    release = threading.Event()  # never set: a wait that a handler may do
    rescuer = threading.Timer(20.0, lambda: inbox.put(lambda: rescued.append(1)))
    rescuer.daemon = True
    rescuer.start()
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.01)
        waits(inbox)
    finally:
        rescuer.cancel()
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, handler)
    assert not rescued
    assert not inbox
