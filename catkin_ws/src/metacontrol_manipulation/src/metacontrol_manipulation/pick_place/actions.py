"""What a program that builds the pyramid can do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from metacontrol_manipulation.perception.blocks import Block
    from metacontrol_manipulation.pick_place.pyramid import Slot


@dataclass(frozen=True, slots=True)
class Pick:
    """An arm takes a loose block."""

    arm: str
    block: Block


@dataclass(frozen=True, slots=True)
class Place:
    """An arm puts the block that it holds into a slot."""

    arm: str
    slot: Slot


@dataclass(frozen=True, slots=True)
class PutDown:
    """An arm puts the block that it holds on the table, at x and y in m, cell frame."""

    arm: str
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class Open:
    """The gripper of an arm that does not work opens: its block drops, and is found again."""

    arm: str


@dataclass(frozen=True, slots=True)
class Retreat:
    """An arm that does not work goes back along the way by which it came, a part of it at a time."""

    arm: str


@dataclass(frozen=True, slots=True)
class MoveBase:
    """The base drives along the table to y in m, cell frame."""

    y: float


@dataclass(frozen=True, slots=True)
class Look:
    """All arms that can go out of the camera's way."""


@dataclass(frozen=True, slots=True)
class Done:
    """The pyramid stands."""


@dataclass(frozen=True, slots=True)
class Stuck:
    """Nothing can be done; the reason is a sentence for people."""

    reason: str


Action = Pick | Place | PutDown | Open | Retreat | MoveBase | Look | Done | Stuck
