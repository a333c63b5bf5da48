"""What runs, as the launcher, the launch files and the nodes themselves tell."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from node_kit.io.xml_rpc import CallError
from rosgraph_launcher.description import NodeDescription, SystemDescription, owner_of

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.change.parameters import put_back
from rosgraph_manipulator.change.progress import ChangeProgress
from rosgraph_manipulator.change.surroundings import Adjusting, Surroundings
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions
from rosgraph_manipulator.configuration.difference import read_by_nodes, same_value
from rosgraph_manipulator.configuration.sharing import disagreement, seen_by

if TYPE_CHECKING:
    from rosgraph_manipulator.io.launch_files import LaunchFile


@dataclass(frozen=True)
class Comparison:
    """What a change has to go by.

    Attributes:
        running: what runs, as the function that changes sees it.
        wanted: the configuration to deploy.
        shared: nodes of both that another function needs, too.
        drifted: what somebody has changed since the configuration was deployed, where it is the wanted one, too: the
            values on the parameter server by full name; None: it is not set.
    """

    running: SystemDescription
    wanted: SystemDescription
    shared: frozenset[str]
    drifted: Mapping[str, Any]

    @property
    def remark(self) -> str:
        """What a change puts back, in words; empty: nothing."""
        return put_back(self.drifted, self.wanted.all_parameters()) if self.drifted else ""


class RunningSystem:
    """The running configurations of all functions, and those that can be deployed."""

    def __init__(
        self,
        options: ManipulatorOptions,
        progress: ChangeProgress,
        is_here: Callable[[NodeDescription], bool],
        around: Surroundings,
        adjusting: Adjusting,
    ) -> None:
        """Look at what the launchers' reports in `progress` say.

        Args:
            options: the configurations.
            progress: has the reports.
            is_here: tells whether a node is started on this host, so that its executable must be here.
            around: the master, the nodes and the launch files.
            adjusting: the dynamic_reconfigure servers of nodes.
        """
        self._is_here = is_here
        self._around = around
        self.nodes = adjusting
        self._options = options
        self._progress = progress
        self._described: tuple[Configuration, LaunchFile] | None = None  # the last one read
        self._deployed: dict[str, tuple[Configuration, LaunchFile]] = {}  # what the launcher deployed, by function

    def compare(self, wanted: Configuration, restart: Collection[str] = ()) -> Comparison:
        """Return what runs and what is wanted, as far as a change of the function may touch it.

        Where the configuration runs already, nodes that do not answer count as nodes that do not run.

        Args:
            wanted: the configuration to deploy.
            restart: nodes that count as nodes that do not run.

        Raises:
            DeploymentError: the wanted configuration can't be read, or can't run beside the other functions.
        """
        function = wanted.function
        system = self.describe_beside_others(wanted)
        others = self.others(function)
        lost = set(restart)
        is_repair = self._progress.running(function) == wanted.name
        if is_repair:
            lost |= self._around.silent(self._progress.launched_for(function))
        drifted = self._drifted(function)
        running = seen_by(self._with_live_values(function, drifted), system, others)
        nodes = {name: node for name, node in running.nodes.items() if name not in lost}
        shared = self._progress.shared(function) & set(nodes) & set(system.nodes)
        return Comparison(SystemDescription(nodes, running.parameters), system, shared, drifted if is_repair else {})

    def describe(self, configuration: Configuration) -> SystemDescription:
        """Return what a configuration's launch file starts.

        Raises:
            DeploymentError: it can't be read, or names an executable that does not exist.
        """
        launch = self._around.launch_file(configuration)
        for remark in launch.remarks:
            self._around.log.warn(f"{configuration.launch_file}: {remark}", once=True)
        for node in launch.system.nodes.values():
            if self._is_here(node) and (reason := self._around.why_not_started(node)):
                raise DeploymentError(f"{configuration.launch_file}: {reason}")
        self._described = (configuration, launch)
        return launch.system

    def describe_beside_others(self, configuration: Configuration) -> SystemDescription:
        """Return what a configuration's launch file starts, where it can run beside what runs for other functions.

        Drivers of components yield: their parameters keep no function from its change, and none keeps another driver.

        Raises:
            DeploymentError: it can't, or can't be read.
        """
        system = self.describe(configuration)
        others, drivers = self.others(configuration.function), self._options.drivers
        if configuration.name in drivers:
            others = {name: other for name, other in others.items() if name not in drivers}
        reason = disagreement(configuration.function, system, others, yielding=drivers)
        if reason:
            raise DeploymentError(f"{configuration.name}: {reason}")
        return system

    def ask_for_adjustable(self) -> None:
        """Ask the running nodes what they take by dynamic_reconfigure, so that the next plan need not wait for that."""
        for node in self._progress.launched:
            self.nodes.adjustable(node)

    def launch_file(self, configuration: Configuration) -> LaunchFile:
        """Return the launch file of a configuration, as it was described last.

        Raises:
            DeploymentError: it can't be read.
        """
        if self._described is None or self._described[0] != configuration:
            self._described = configuration, self._around.launch_file(configuration)
        return self._described[1]

    def deployed(self, configuration: Configuration, launch: LaunchFile) -> None:
        """Note that the launcher has deployed a configuration, and by which content of its launch file."""
        self._deployed[configuration.function] = configuration, launch

    def deployed_file(self, configuration: Configuration) -> LaunchFile | None:
        """Return the launch file by which a configuration was deployed last; None: it was not."""
        deployed, launch = self._deployed.get(configuration.function, (None, None))
        return launch if deployed == configuration else None

    def released(self, function: str) -> None:
        """Note that nothing runs for a function."""
        self._deployed.pop(function, None)

    def others(self, function: str) -> dict[str, SystemDescription]:
        """Return what runs for each other function, by its name."""
        progress = self._progress
        return {
            other: self._runs(other) for other in progress.functions if other != function and progress.running(other)
        }

    def parameters_of(self, function: str, nodes: Collection[str]) -> dict[str, Any]:
        """Return the parameters of what runs for a function that these nodes may read, by full name.

        Expected quality levels are left out: each function has its own under the same names.
        """
        runs = self._described_as_deployed(function)
        own = {name: node for name, node in runs.nodes.items() if name in nodes}
        return read_by_nodes(SystemDescription(own, runs.parameters if own else {}))

    def _described_as_deployed(self, function: str) -> SystemDescription:
        self._runs(function)  # reads what an earlier manipulator has deployed
        found = self._deployed.get(function)
        return found[1].system if found else SystemDescription()

    def _runs(self, function: str) -> SystemDescription:
        """Return what runs for a function, by the launcher's reports and the launch file as it was when deployed."""
        name = self._progress.running(function)
        configuration = self._options.configurations.get(name, self._options.drivers.get(name))
        if configuration is None:
            return SystemDescription()
        if function not in self._deployed or self._deployed[function][0] != configuration:
            try:  # an earlier manipulator has deployed it
                self._deployed[function] = configuration, self._around.launch_file(configuration)
            except DeploymentError as error:
                self._around.log.warn(str(error))
                return self._progress.running_system(function, None)
        return self._progress.running_system(function, self._deployed[function][1].system)

    def _drifted(self, function: str) -> dict[str, Any]:
        """Return the values that the parameters of what runs have now, where they differ; None: not set."""
        wanted = read_by_nodes(self._described_as_deployed(function))
        try:
            live = self._around.parameters(wanted)
        except CallError as error:
            self._around.log.warn(f"parameters are not compared with what the nodes have: {error}")
            return {}
        differ = (n for n, value in wanted.items() if n not in live or not same_value(live[n], value))
        return {name: live.get(name) for name in differ}

    def _with_live_values(self, function: str, drifted: Mapping[str, Any]) -> SystemDescription:
        """Return what runs, with the values that somebody has set by dynamic_reconfigure since.

        Other parameters on the server are no sign of what a node works with: it has read them at its start.
        """
        system = self._runs(function)
        values = {}
        for node in system.nodes:
            own = {n: v for n, v in drifted.items() if v is not None and owner_of(n, system.nodes) == node}
            adjustable = self.nodes.adjustable(node) if own else {}
            values.update({name: value for name, value in own.items() if name.removeprefix(f"{node}/") in adjustable})
        if not values:
            return system
        return self._progress.running_system(function, self._deployed[function][1].system, values)
