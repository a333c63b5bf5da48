"""The package works without ROS and without our other packages, and pip installs it alone."""

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

PACKAGE = Path(__file__).parents[3] / "catkin_ws" / "src" / "metacontrol_bags"
REQUIREMENTS = Path(__file__).parents[3] / "requirements" / "python.txt"
LIBRARIES = sysconfig.get_path("purelib")
FOREIGN = ("rospy", "rosgraph", "genpy", "metacontrol_msgs", "mros1_reasoner", "catkin_pkg")

# Only the standard library, this environment's own libraries and what is given; not Debian's, where ROS is.
ALONE = f"""
import importlib.util, sys
own = [folder for folder in sys.path if not folder.endswith(("dist-packages", "site-packages"))]
sys.path = [*own, *sys.argv[1:], {LIBRARIES!r}]
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


def test_every_module_imports_without_ros_and_our_other_packages():
    imported = run(sys.executable, "-I", "-c", ALONE + IMPORT_ALL, PACKAGE / "src").split()
    modules = {f"metacontrol_bags.{path.stem}" for path in (PACKAGE / "src/metacontrol_bags").glob("[!_]*.py")}
    assert set(imported) == modules


def test_pip_installs_it_alone_and_it_reads_a_bag(mission_bag, tmp_path):
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
    told = run(home / "bin/python", "-I", "-c", ALONE + READ, place, cwd=tmp_path)
    where, reached, states = json.loads(told)
    assert where.startswith(str(home))
    assert reached
    assert states == ["DECIDED", "EXECUTED"]


def test_libraries_that_it_needs_are_those_that_set_up_installs():
    needed = re.search(r"install_requires=\[(.*)\]", (PACKAGE / "setup.py").read_text())[1]
    pinned = {line.partition("==")[0].lower() for line in REQUIREMENTS.read_text().splitlines() if "==" in line}
    assert {name.strip(' "') for name in needed.split(",")} <= pinned
