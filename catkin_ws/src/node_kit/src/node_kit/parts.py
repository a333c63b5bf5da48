"""Nodes that watch over each other: which parts of a system are lost, and which of the others tells it.

Each part gives a sign of life now and then. One that gives none is asked, and lost when it does not answer. Of the
parts that are left, the one that has run for longest tells: it has heard of all others. Times are wall s of one clock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

PERIOD = 0.5
"""s between two signs of life."""
SILENCE = 1.2
"""s without a sign after which a part is asked."""
HANGS_AFTER = 4.0
"""s without a sign or an answer after which a part hangs; one at whose address nobody listens is lost at once."""
STARTS_WITHIN = 15.0
"""s without a sign after which a part that was started again has not come back."""
FORGOTTEN_AFTER = 300.0
"""s without a sign or an answer after which a part is forgotten that the master does not know any more: its host is
gone, and somebody has cleaned up. Minutes, so that the loss is read before."""


@dataclass(frozen=True)
class Sign:
    """A sign of life.

    Attributes:
        node: resolved name of the node that gives it.
        part: what it is in the system.
        uri: address of its XML-RPC API.
        started: when it was started, wall s since 1970.
        ends: whether it is the last one: the node was asked to end.
    """

    node: str
    part: str = ""
    uri: str = ""
    started: float = 0.0
    ends: bool = False

    @property
    def is_usable(self) -> bool:
        """Tell whether a part can have given it: it says where to ask the part, and since when the part has run.

        One that was started in the future is no error: its host's clock may have been set back since then.
        """
        return self.uri.startswith("http://") and math.isfinite(self.started) and self.started > 0.0


class Answer(Enum):
    """What came of asking a part."""

    LIVES = "it answers"
    GONE = "its process has ended"
    ENDED = "it was asked to end"
    STARTS = "it was started again, but gives no sign of life"
    SILENT = "it does not answer"
    UNKNOWN = "it does not answer, and the master does not know it"


_PATIENCE = {
    Answer.GONE: 0.0,
    Answer.SILENT: HANGS_AFTER,
    Answer.UNKNOWN: HANGS_AFTER,
    Answer.STARTS: STARTS_WITHIN,
}


@dataclass(frozen=True)
class Standing:
    """How a part stands.

    Attributes:
        sign: its last one.
        heard: when it was heard of last, by a sign or an answer.
        lost: why it is lost; empty while it is not.
    """

    sign: Sign
    heard: float
    lost: str = ""


class Parts:
    """What one part knows of the others."""

    def __init__(self, own: str = "", started: float = 0.0) -> None:
        """Know nobody.

        Args:
            own: resolved name of one's own node; empty where one only looks on.
            started: when it was started, as the signs of the others tell it.
        """
        self._own, self._started = own, started
        self._known: dict[str, Standing] = {}
        self._told: set[str] = set()

    @property
    def known(self) -> dict[str, Standing]:
        """How each part stands that was ever heard of and has not ended by itself, by the node's name."""
        return dict(sorted(self._known.items()))

    def hear(self, sign: Sign, now: float) -> None:
        """Take in a sign of life, if it is usable."""
        if sign.node == self._own or not sign.is_usable:
            return
        if sign.ends:
            self.note(sign.node, Answer.ENDED, now)
        else:
            self._known[sign.node] = Standing(sign, now)

    def doubtful(self, now: float) -> list[Sign]:
        """Return the last signs of those to ask whether they are there, because they have given none for too long."""
        return [known.sign for known in self._known.values() if now - known.heard > SILENCE]

    def note(self, node: str, answer: Answer, now: float) -> None:
        """Take in what came of asking a part."""
        standing = self._known.get(node)
        if standing is None:
            return
        is_forgotten = answer is Answer.UNKNOWN and now - standing.heard >= FORGOTTEN_AFTER
        if answer is Answer.ENDED or is_forgotten:  # neither lost nor back
            del self._known[node]
            self._told.discard(node)
        elif answer is Answer.LIVES:
            if not standing.lost:
                self._known[node] = replace(standing, heard=now)
        elif now - standing.heard >= _PATIENCE[answer]:
            self._known[node] = replace(standing, lost=answer.value)

    def lost(self) -> dict[str, str]:
        """Return which nodes are lost, and why."""
        return {node: standing.lost for node, standing in self.known.items() if standing.lost}

    def head_start(self) -> float:
        """Return for how long the oldest of the others had run when one's own part was started, s; 0 if none had.

        Who finds others that have run for long takes somebody's place in a system that has started long ago.
        """
        started = (known.sign.started for known in self._known.values() if not known.lost)
        return max([0.0, *(self._started - other for other in started if math.isfinite(other))])

    def to_tell(self) -> dict[str, str]:
        """Return what one's own part is to tell: the nodes that are lost, and why; empty for those that are back.

        Of those that are left, the one that has run for longest tells of a loss: a node that has just been started may
        not know who was there before. Who has told a loss tells the return, once.
        """
        lost = self.lost()
        returned = dict.fromkeys(sorted(self._told - lost.keys()), "")
        self._told &= lost.keys()
        others = ((known.sign.started, node) for node, known in self._known.items() if not known.lost)
        if all((self._started, self._own) < other for other in others):
            self._told |= lost.keys()
        return {**returned, **{node: why for node, why in lost.items() if node in self._told}}
