"""The simulated clock and its tasks."""

from simulated.kernel import Inbox, Kernel, Process


def process(kernel, failed=None):
    return Process(kernel, "part", lambda name, error: (failed if failed is not None else []).append(error))


def test_tasks_wait_side_by_side():
    kernel, seen = Kernel(1), []
    part = process(kernel)

    def work(name, duration):
        part.pause(duration)
        seen.append((name, kernel.now))

    part.start(lambda: work("slow", 2.0))
    part.start(lambda: work("fast", 1.0))
    kernel.run(5.0)
    assert seen == [("fast", 1.0), ("slow", 2.0)] and kernel.now == 5.0


def test_killed_process_does_nothing_more_and_cleans_nothing_up():
    kernel, seen = Kernel(1), []
    part = process(kernel)

    def work():
        try:
            part.pause(2.0)
        finally:
            part.check()
            seen.append("cleaned up")

    part.start(work)
    kernel.after(1.0, part.kill)
    kernel.run(5.0)
    assert seen == []


def test_frozen_process_goes_on_later():
    kernel, seen = Kernel(1), []
    part = process(kernel)
    part.start(lambda: (part.pause(1.0), seen.append(kernel.now)))
    kernel.after(0.5, part.freeze)
    kernel.after(3.0, part.thaw)
    kernel.run(5.0)
    assert seen == [3.0]


def test_exception_of_a_task_is_told():
    kernel, failed = Kernel(1), []
    process(kernel, failed).start(lambda: 1 / 0)
    kernel.run(1.0)
    assert [type(error) for error in failed] == [ZeroDivisionError]


def test_inbox_wakes_its_task():
    kernel, seen = Kernel(1), []
    part = process(kernel)
    inbox = Inbox(part)

    def work():
        inbox.wait(10.0)
        inbox.drain()
        inbox.wait(2.0)
        seen.append(kernel.now)

    part.start(work)
    kernel.after(1.0, lambda: inbox.put(lambda: seen.append(kernel.now)))
    kernel.run(20.0)
    assert seen == [1.0, 3.0]
