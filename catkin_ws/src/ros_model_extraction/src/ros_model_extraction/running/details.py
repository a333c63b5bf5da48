"""Facts that the nodes of a running system tell, in addition to the master's list."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class Origin:
    """The executable that a node runs, and how it was started.

    Attributes:
        package: its package.
        executable: the name of its file.
        remaps: (name in the node's code, name in the graph) of its command line, as they are written there.
        arguments: what else its command line tells the program.
    """

    package: str
    executable: str
    remaps: tuple[tuple[str, str], ...] = ()
    arguments: tuple[str, ...] = ()


@dataclass(frozen=True)
class Details:
    """What the nodes and their processes tell.

    Attributes:
        origins: executable of each node that could be traced.
        unknown: node -> why its executable is not known.
        service_types: service -> type, of those that answered.
        dead: nodes at whose address nobody listens, though the master lists them.
    """

    origins: Mapping[str, Origin] = field(default_factory=dict)
    unknown: Mapping[str, str] = field(default_factory=dict)
    service_types: Mapping[str, str] = field(default_factory=dict)
    dead: frozenset[str] = frozenset()
