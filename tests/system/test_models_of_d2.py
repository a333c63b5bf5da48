"""Models that are extracted from demonstrator D2 as it runs, beside its own model and its source."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
import rospkg
from helpers.ports import reserved_port
from node_kit.io.xml_rpc import CallError
from ros_model.graph.snapshot import GraphSnapshot
from ros_model.io.master import take_snapshot
from ros_model.io.models import read_system
from ros_model.io.project import load_project
from ros_model.language.graph_names import resolve
from ros_model.language.metamodel import PortKind
from ros_model_extraction import ros_defaults as plumbing
from ros_model_extraction.io.live_nodes import ask_nodes
from ros_model_extraction.node_facts import FoundPort
from ros_model_extraction.packages.catkin_package import find_packages
from ros_model_extraction.packages.package_source import ExtractedPackage, extract_package
from ros_model_extraction.running.details import Details
from ros_model_extraction.running.graph import End, interfaces

START_S = 120.0
SETTLED_S = 3.0
PATIENCE_S = 10.0
D2 = Path(rospkg.RosPack().get_path("metacontrol_sim"))
KINDS = [kind for kind in PortKind if kind is not PortKind.SERVICE_CLIENT]  # a master knows no clients of services


def ends_of(uri: str) -> set[End]:
    try:
        return set(interfaces(take_snapshot(uri), Details()))
    except CallError:
        return set()


def wait_until_settled(uri: str, process: subprocess.Popen[bytes], log: Path) -> None:
    """Wait until components, the server of navigation and an action's client are there, and nothing is added."""
    wanted = {f"/{c.graph_name}" for c in read_system(D2 / "models" / "d2.rossystem").components} | {"/reasoner"}
    deadline, before, since = time.monotonic() + START_S, set[End](), time.monotonic()
    while time.monotonic() < deadline and process.poll() is None:
        now = ends_of(uri)
        if now != before:
            before, since = now, time.monotonic()
        has_server = (PortKind.ACTION_SERVER, "/move_base") in {(end.kind, end.name) for end in now}
        is_up = has_server and wanted <= {end.node for end in now} and set(KINDS) <= {end.kind for end in now}
        if is_up and time.monotonic() - since > SETTLED_S:
            return
        time.sleep(0.2)
    missing = wanted - {end.node for end in before}
    pytest.fail(f"D2 is not up within {START_S:g} s, missing {missing}\n{log.read_text()[-4000:]}")


@contextmanager
def running_d2(folder: Path) -> Iterator[str]:
    """Run D2, and give the address of its master."""
    with reserved_port() as port:
        yield from running_at(port, folder)


def running_at(port: int, folder: Path) -> Iterator[str]:
    uri = f"http://localhost:{port}"
    environment = {
        **os.environ,
        "ROS_MASTER_URI": uri,
        "ROS_HOSTNAME": "localhost",
        "ROS_HOME": str(folder),
        "ROS_LOG_DIR": str(folder / "log"),
    }
    log = folder / "console"
    with log.open("wb") as console:
        process = subprocess.Popen(
            ["roslaunch", "-p", str(port), "metacontrol_sim", "metacontrol_sim_reasoner.launch"],
            env=environment,
            stdout=console,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    try:
        wait_until_settled(uri, process, log)
        yield uri
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(timeout=150.0)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@dataclass(frozen=True)
class Seen:
    """What was seen of D2 while it ran."""

    snapshot: GraphSnapshot
    details: Details
    command: subprocess.CompletedProcess[str]
    folder: Path


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    folder = tmp_path_factory.mktemp("d2")
    with running_d2(folder) as uri:
        command = rosmodel("snapshot", "--master", uri, "-o", folder / "models")
        snapshot = take_snapshot(uri)
        details = ask_nodes(snapshot, uri, PATIENCE_S)
    return Seen(snapshot, details, command, folder / "models")


def rosmodel(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = ["rosmodel", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def test_snapshot_checks_and_lacks_no_component_of_the_models(seen):
    assert seen.command.returncode == 0, seen.command.stdout + seen.command.stderr
    checked = rosmodel("check", seen.folder / "snapshot.ros", seen.folder / "snapshot.rossystem")
    assert checked.returncode == 0, checked.stdout + checked.stderr
    compared = rosmodel("diff", D2 / "models" / "d2.rossystem", seen.folder / "snapshot.rossystem")
    assert compared.returncode == 1, compared.stdout + compared.stderr  # the snapshot has more parameters
    lines = compared.stdout.splitlines()
    assert [line for line in lines if re.fullmatch(r"- component '[^']*'", line)] == []
    assert [line for line in lines if line.startswith("+ component 'move_base', ")]  # the form that is expected
    assert "+ component 'reasoner'" not in lines  # a snapshot leaves the meta-controller out
    assert "who calls which service" in (seen.folder / "snapshot.rossystem").read_text()


def test_variant_of_the_snapshot_requires_the_laser_and_the_robot_and_nothing_else(seen, tmp_path):
    for name in ("snapshot.ros", "snapshot.rossystem"):
        shutil.copy(seen.folder / name, tmp_path)
    made = rosmodel("init", tmp_path / "snapshot.rossystem", "--component", "move_base")
    assert made.returncode == 0, made.stdout + made.stderr
    assert "  front_laser -> front/scan -> move_base\n" in made.stdout
    assert load_project(tmp_path).required_components() == {"snapshot_default": {"front_laser", "simulator"}}


def test_source_has_every_interface_that_the_running_nodes_have(seen):
    ours = {path.name for path in find_packages(D2.parent)[0]}
    packages = {origin.package for origin in seen.details.origins.values()} & ours
    extracted = {name: extract_package(D2.parent / name) for name in sorted(packages)}
    total, by_name, by_place, missing, said, own = Counter(), Counter(), Counter(), [], [], 0
    ends = interfaces(seen.snapshot, seen.details)
    for end in sorted(ends, key=lambda end: (end.node, end.kind.value, end.name)):
        ports = ports_of(end, seen.details, extracted)
        if ports is None:
            continue  # a program of somebody else's package
        if plumbing.is_plumbing(end):
            own += 1
            continue
        total[end.kind] += 1
        if any(explains(port, end) for port in ports if port.is_resolved):
            by_name[end.kind] += 1
        elif any(explains(port, end) for port in ports if not port.is_resolved):
            by_place[end.kind] += 1
            said.append(f"known only at run time: {end.node} {end.kind.value} {end.name}")
        else:
            missing.append(end)
    said += [f"{kind.value}: {by_name[kind]} by name + {by_place[kind]} by place, of {total[kind]}" for kind in KINDS]
    sys.stdout.write("\n".join([*said, f"made by rospy in every node: {own}", ""]))
    assert missing == []
    assert all(total[kind] for kind in KINDS)
    # Most of the others are names that follow from parameters: of layers, planners and sensors of move_base.
    assert sum(by_name.values()) > 2 / 3 * sum(total.values())


def ports_of(end: End, details: Details, extracted: dict[str, ExtractedPackage]) -> tuple[FoundPort, ...] | None:
    origin = details.origins.get(end.node)
    if origin is None or origin.package not in extracted:
        assert origin is not None or end.node in plumbing.NODES, details.unknown
        return None
    return extracted[origin.package].nodes[origin.executable].ports


def explains(port: FoundPort, end: End) -> bool:
    """Whether a port of the source is an end of the running graph. Goals of an action may be sent by a mere topic."""
    ends = [(end.kind, end.name, end.type)]
    if end.kind is PortKind.ACTION_CLIENT:
        ends.append((PortKind.PUBLISHER, f"{end.name}/goal", f"{end.type}Goal"))
    name = port.name.partition("@")[0] if not port.is_resolved else port.name
    parts = re.split(r"\{.*?\}", name)
    pattern = resolve(parts[0], end.node) if parts[0] or len(parts) == 1 else ""
    expression = ".+".join(map(re.escape, [pattern, *parts[1:]]))
    return any(
        port.kind is kind
        and re.fullmatch(expression, known)
        and (not port.type or not type_name or port.type == type_name)
        for kind, known, type_name in ends
    )
