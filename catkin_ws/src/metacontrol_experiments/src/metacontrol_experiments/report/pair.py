"""The single-run pair: which pair stands for all, and its series from the logs of both missions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from metacontrol_msgs.msg import FunctionGrounding, MissionEvent

from metacontrol_experiments.report.missions import BASELINE, OURS, QUALITIES, Mission, pairs_of
from metacontrol_experiments.report.tables import undisturbed
from metacontrol_experiments.report.text import count

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

_SAFETY, _ENERGY = 6, 7
"""Places of the levels in a line of a lockstep log, after the stamp: x y yaw, three speeds, safety, energy."""
_NUMBERS = 8


@dataclass(frozen=True)
class Series:
    """What a mission's log tells over time; stamps are s since the start.

    Attributes:
        stamps: of the levels.
        levels: by quality, one for each stamp.
        strikes: stamp and name of each contingency.
        changes: start and end of each reconfiguration, and the new configuration.
        end: of the mission.
    """

    stamps: tuple[float, ...]
    levels: dict[str, tuple[float, ...]]
    strikes: tuple[tuple[float, str], ...]
    changes: tuple[tuple[float, float, str], ...]
    end: float

    @property
    def disturbed_from(self) -> float | None:
        """When the first contingency on the way struck; the start where all were there before, None without any."""
        later = [stamp for stamp, _ in self.strikes if stamp > 0.0]
        return min(later, default=0.0 if self.strikes else None)


@dataclass(frozen=True)
class Pair:
    """The pair that stands for all.

    Attributes:
        baseline: a mission.
        ours: in the same world.
        chosen: how it was chosen, in words.
    """

    baseline: Mission
    ours: Mission
    chosen: str


def typical_pair(missions: Sequence[Mission]) -> Pair | None:
    """Return the pair of baseline and ours that stands for all, neither the best one nor the worst one.

    It has the median gain (time above both thresholds) of the pairs without component failure in which the baseline is
    above a threshold and ours reconfigures; of all those without component failure where there is none such.

    Returns:
        The pair; None where there is none.
    """
    pairs = pairs_of(undisturbed(missions), BASELINE, OURS)
    adapted = [pair for pair in pairs if _above(pair[0]) > 0.0 and pair[1].summary.get("reconfigurations")]
    ranked = sorted(adapted or pairs, key=lambda pair: (_above(pair[0]) - _above(pair[1]), pair[0].run.name))
    if not ranked:
        return None
    which = "the baseline is above a threshold and the meta-controller reconfigures" if adapted else "nothing fails"
    chosen = f"It has the median gain in time above the thresholds of {count(len(ranked), 'pair')} in which {which}."
    return Pair(*ranked[(len(ranked) - 1) // 2], chosen)


def read_series(log: str) -> Series | None:
    """Return the series that the log of a mission in lockstep tells; None where it is no such log."""
    lines = [line.split() for line in log.splitlines()]
    events = [(float(line[0]), line[1:]) for line in lines if len(line) > 1 and _is_number(line[0])]
    start = next((stamp for stamp, said in events if said[0] == MissionEvent.MISSION_START), None)
    if start is None:
        return None
    samples = [
        (stamp - start, [float(word) for word in said])
        for stamp, said in events
        if len(said) == _NUMBERS and all(map(_is_number, said))
    ]
    if not samples:
        return None
    end = next((stamp - start for stamp, said in events if said[0] == MissionEvent.MISSION_END), samples[-1][0])
    return Series(
        stamps=tuple(stamp for stamp, _ in samples),
        levels={
            name: tuple(numbers[place] for _, numbers in samples)
            for name, place in zip(QUALITIES, (_SAFETY, _ENERGY), strict=True)
        },
        strikes=tuple(
            (stamp - start, said[1]) for stamp, said in events if said[0] == MissionEvent.PERTURBATION and len(said) > 1
        ),
        changes=tuple(_changes(((stamp - start, said) for stamp, said in events), end)),
        end=end,
    )


def _changes(events: Iterable[tuple[float, Sequence[str]]], end: float) -> Iterator[tuple[float, float, str]]:
    """Yield the reconfigurations; one that does not end lasts until the end."""
    begun: tuple[float, str] | None = None
    for stamp, said in events:
        if len(said) != 2:
            continue
        if said[1] == FunctionGrounding.RECONFIGURING:
            begun = begun or (stamp, said[0])
        elif begun is not None and said[1] in (FunctionGrounding.STABLE, FunctionGrounding.FAILED):
            yield begun[0], stamp, said[0]
            begun = None
    if begun is not None:
        yield begun[0], end, begun[1]


def _above(mission: Mission) -> float:
    return sum(mission.above(quality) or 0.0 for quality in QUALITIES)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
