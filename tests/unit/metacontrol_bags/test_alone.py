"""The package works without ROS and without our other packages, and pip installs it alone."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from metacontrol_bags.bag import read_record
from metacontrol_bags.metrics import summarise
from packaging.requirements import Requirement

PACKAGE = Path(__file__).parents[3] / "catkin_ws" / "src" / "metacontrol_bags"
REQUIREMENTS = [Path(__file__).parents[3] / "requirements" / name for name in ("python-robot.txt", "python.txt")]
NEEDED = re.findall(r'"(\w+)"', re.search(r"install_requires=\[(.*)\]", (PACKAGE / "setup.py").read_text())[1])
FOREIGN = ("rospy", "rosgraph", "genpy", "metacontrol_msgs", "mros1_reasoner", "catkin_pkg")

# The standard library and what is given.
ALONE = f"""
import importlib.util, sys
own = [folder for folder in sys.path if not folder.endswith(("dist-packages", "site-packages"))]
sys.path = [*own, *sys.argv[1:]]
assert not [name for name in {FOREIGN!r} if importlib.util.find_spec(name)]
"""
IMPORT_ALL = """
import importlib, pkgutil, metacontrol_bags
for module in pkgutil.walk_packages(metacontrol_bags.__path__, "metacontrol_bags."):
    importlib.import_module(module.name)
    print(module.name)
"""
READ = """
import json, pathlib
from metacontrol_bags import __file__ as home
from metacontrol_bags.bag import read_record
from metacontrol_bags.metrics import summarise
record = read_record(pathlib.Path("mission.bag"))
print(json.dumps([home, summarise(record)["goal_reached"], [d.state for d in record.decisions]]))
"""


def run(*command, **options):
    finished = subprocess.run(list(map(str, command)), check=False, capture_output=True, text=True, **options)
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


@pytest.fixture
def libraries(tmp_path):
    """Return a folder with the libraries that the package needs and those that they need; Debian's has ROS, too."""
    folder, known = tmp_path / "libraries", set()
    waiting = [*NEEDED, "six"]  # which Debian's dateutil needs, but does not list
    folder.mkdir()
    while waiting:
        name = waiting.pop().lower().replace("_", "-")
        if name in known:
            continue
        known.add(name)
        required = [Requirement(line) for line in metadata.requires(name) or ()]
        waiting += [r.name for r in required if r.marker is None or r.marker.evaluate({"extra": ""})]
    modules = {name.replace("-", "_") for name in known}  # some of Debian's do not list theirs
    for module, owners in metadata.packages_distributions().items():
        if known & {owner.lower().replace("_", "-") for owner in owners}:
            modules.add(module)
    for spec in filter(None, map(importlib.util.find_spec, sorted(modules))):
        origin = Path(spec.submodule_search_locations[0] if spec.submodule_search_locations else spec.origin)
        (folder / origin.name).symlink_to(origin)
    return folder


def test_every_module_imports_without_ros_and_our_other_packages(libraries):
    imported = run(sys.executable, "-I", "-c", ALONE + IMPORT_ALL, PACKAGE / "src", libraries).split()
    files = [path.relative_to(PACKAGE / "src") for path in (PACKAGE / "src").rglob("*.py")]
    modules = {".".join(path.with_suffix("").parts).removesuffix(".__init__") for path in files}
    assert {*imported, "metacontrol_bags"} == modules


def test_pip_installs_it_alone_and_it_reads_a_bag(mission_bag, libraries, tmp_path):
    source, home = tmp_path / "metacontrol_bags", tmp_path / "environment"
    shutil.copytree(PACKAGE, source)  # pip builds within the source
    run(sys.executable, "-m", "venv", home)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    options = ("--no-index", "--no-deps", "--disable-pip-version-check")  # its libraries come from this environment
    run(home / "bin/python", "-m", "pip", "install", *options, source, env=environment)
    version = re.search("<version>(.*)</version>", (PACKAGE / "package.xml").read_text())[1]
    installed = run(home / "bin/python", "-m", "pip", "show", "metacontrol_bags", env=environment)
    assert f"Version: {version}\n" in installed
    mission_bag.write(tmp_path / "mission.bag")
    (place,) = home.glob("lib/*/site-packages")
    told = run(home / "bin/python", "-I", "-c", ALONE + READ, place, libraries, cwd=tmp_path)
    where, reached, states = json.loads(told)
    assert where.startswith(str(home))
    assert reached
    assert states == ["DECIDED", "EXECUTED"]


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    """Install the package with its libraries into an empty environment; return its command, to run without ROS."""
    folder = tmp_path_factory.mktemp("empty")
    shutil.copytree(PACKAGE, folder / "metacontrol_bags")
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in ("PYTHONPATH", "CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH", "VIRTUAL_ENV") and "ROS" not in name
    }
    kept["PATH"] = "/usr/bin:/bin"
    run("/usr/bin/python3", "-m", "venv", folder / "environment", env=kept)
    python = folder / "environment/bin/python"
    pinned = [f"--constraint={path}" for path in REQUIREMENTS]  # the versions that are tested
    run(python, "-m", "pip", "install", "--disable-pip-version-check", *pinned, folder / "metacontrol_bags", env=kept)
    seen = run(python, "-c", f"import importlib.util as u; print([n for n in {FOREIGN!r} if u.find_spec(n)])", env=kept)
    assert seen == "[]\n"

    def call(*arguments):
        return run(folder / "environment/bin/metacontrol-bag", *arguments, env=kept, cwd=folder)

    return call


def test_every_command_works_in_an_environment_with_nothing_else(command, mission_bag, tmp_path):
    bag = mission_bag.write(tmp_path / "mission.bag", "lz4")
    assert json.loads(command("info", "--json", bag))[0]["messages"] == len(mission_bag.messages)
    (told,) = json.loads(command("metrics", "--json", bag))
    assert told["summary"] == summarise(read_record(bag))
    assert "component:front_laser" in command("metrics", bag)
    assert json.loads(command("decisions", "--json", bag))[0]["decisions"][0]["state"] == "EXECUTED"
    assert "f2_v2_r2 -> f2_v1_r3_k" in command("decisions", bag)
    assert "| goal reached | yes | yes |" in command("compare", "--markdown", bag, bag)
    assert command("plot", bag) == f"{tmp_path / 'mission.png'}\n"
    assert (tmp_path / "mission.png").read_bytes().startswith(b"\x89PNG")


def test_libraries_that_it_needs_are_those_that_set_up_installs():
    lines = [line for path in REQUIREMENTS for line in path.read_text().splitlines()]
    pinned = {line.partition("==")[0].lower() for line in lines if "==" in line}
    assert set(NEEDED) <= pinned
