"""The watch of the master, without one."""

from node_kit.io import master_watch
from node_kit.io.master_watch import MasterWatch
from node_kit.master import Answer, Refusal


def test_watch_outlasts_an_error_and_tells_the_loss_later(monkeypatch):
    answers = iter([MemoryError(), Answer(1), MemoryError(), Answer(1)])
    lost = []

    def ask(_timeout):
        answer = next(answers, Refusal())
        if isinstance(answer, Exception):
            raise answer
        return answer

    monkeypatch.setattr(master_watch, "_Asker", lambda _: ask)
    watch = MasterWatch(lambda _: None, lost.append)
    watch.start("http://localhost:1")
    assert watch.confirm()
    watch.thread.join(60.0)
    assert len(lost) == 1 and watch.lost
