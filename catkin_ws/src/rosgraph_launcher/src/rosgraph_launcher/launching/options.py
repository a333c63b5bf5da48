"""The launcher's options, which it reads at its start."""

from __future__ import annotations

from dataclasses import dataclass, field

from rosgraph_launcher.launching.restarts import RestartPolicy

LONGEST_TIMEOUT = 86_400.0
"""s, for each time that a parameter gives: poll and sockets take none of more than 24 days."""


@dataclass(frozen=True)
class LauncherOptions:
    """The launcher's parameters; times in s, wall.

    Attributes:
        mark: names this launcher and its master, in the environment of each process that it starts.
        run_id: of the roslaunch run; names the folder of the logs.
        shutdown_timeout: how long a node may take to end after a request over XML-RPC; then it gets SIGINT.
        sigint_timeout: how long it may take after SIGINT; then it gets SIGKILL.
        standby: whether a warm process waits for the next variant of each Python node.
        standby_others: how many warm processes wait at most for nodes that do not run.
        policy: when nodes that die are started again.
    """

    mark: str
    run_id: str = ""
    shutdown_timeout: float = 2.0
    sigint_timeout: float = 2.0
    standby: bool = True
    standby_others: int = 4
    policy: RestartPolicy = field(default_factory=RestartPolicy)
