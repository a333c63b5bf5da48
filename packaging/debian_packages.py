#!/usr/bin/env python3
"""Makes Debian packages of all our packages, and one of the Python packages beside them; `./mros package` runs it.

The packages install to /usr, as Debian's own ROS packages do: share/PKG, lib/PKG, lib/python3/dist-packages/PKG. What
they need beyond Debian is in `mros-python`: a virtual environment in /usr/lib/mros with the exact versions of
requirements/python-robot.txt and python.txt. Only our executables use it, by their first line, so the system's own
Python stays as it is.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from email.parser import HeaderParser
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "catkin_ws" / "src"
REQUIREMENTS = [ROOT / "requirements" / "python-robot.txt", ROOT / "requirements" / "python.txt"]
HASHES = ROOT / "requirements" / "hashes.txt"

ENVIRONMENT = Path("usr/lib/mros")
"""Where the virtual environment is installed, from the root."""

PYTHON_PACKAGE = "mros-python"

NEEDED_PROGRAMS = {
    "mros1_reasoner": ["openjdk-17-jre-headless"],  # Pellet
    "ros_model": ["graphviz", "python3-simpleeval"],  # drawings; expressions of launch files
    "rosgraph_monitor": ["libdiagnostic-aggregator-tools"],  # the aggregator that its launch file starts
    "metacontrol_sim": ["python3-rosmaster"],
}
"""Debian packages that are not found by package.xml: programs, what roslaunch starts, and Python packages of Debian."""

TOOLS = [
    "catkin",
    "python3-rosnode",
    "python3-rosparam",
    "python3-rosservice",
    "python3-rostopic",
    "rosbash",
    "rospack-tools",
]
"""Commands that the documents use: rosrun, rospack, rostopic and so on."""

META_CONTROLLER = (
    *("metacontrol_dashboard", "mros1_reasoner", "ros_model", "ros_model_extraction"),
    *("rosgraph_launcher", "rosgraph_manipulator", "rosgraph_monitor"),
)
"""What goes beside a robot. The rest is the demonstrator, with its own robot and its stand-in for move_base."""

DEPENDENCIES = ("depend", "exec_depend", "build_export_depend")
BUILD_ONLY = {"catkin", "message_generation"}
OF_PYTHON = "python3-"
"""How rosdep's names of Python packages begin; ours are in the virtual environment."""


class PackagingError(Exception):
    """Packages can't be made; the message says why, and what to do."""


@dataclass
class Manifest:
    """What a package.xml says."""

    name: str
    version: str
    description: str
    maintainer: str
    dependencies: list[str]
    has_code: bool


@dataclass
class Control:
    """The control data of a Debian package."""

    name: str
    version: str
    maintainer: str
    summary: str
    text: str
    architecture: str = "all"
    depends: list[str] = field(default_factory=list)
    suggests: list[str] = field(default_factory=list)

    def written(self, size_kb: int) -> str:
        """Return the control file."""
        lines = [
            f"Package: {self.name}",
            f"Version: {self.version}",
            "Section: science",
            "Priority: optional",
            f"Architecture: {self.architecture}",
            f"Maintainer: {self.maintainer}",
            f"Installed-Size: {size_kb}",
        ]
        lines += [f"Depends: {', '.join(sorted(set(self.depends)))}"] if self.depends else []
        lines += [f"Suggests: {', '.join(sorted(set(self.suggests)))}"] if self.suggests else []
        body = "\n".join(f" {line}" if line else " ." for line in self.text.splitlines())
        return "\n".join([*lines, f"Description: {self.summary}", body]) + "\n"


def main() -> None:
    """Make the packages; exit status 2 and one line where that fails."""
    parser = argparse.ArgumentParser(prog="mros package", description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "results" / "packages")
    folder: Path = parser.parse_args().folder
    try:
        for file in make_packages(folder.absolute()):
            say(f"{file} ({file.stat().st_size / 1e6:.1f} MB)")
    except PackagingError as error:
        say(str(error))
        sys.exit(2)
    say(f"to install them on Debian 12: apt-get install {folder}/*.deb")


def say(text: str) -> None:
    """Write a line for whoever runs the script."""
    sys.stderr.write(f"mros package: {text}\n")


def make_packages(folder: Path) -> list[Path]:
    """Make all packages in a folder and return their files; former files of the packages are removed.

    Raises:
        PackagingError: something is missing, or a command fails.
    """
    manifests = {path.parent.name: read_manifest(path) for path in sorted(SOURCES.glob("*/package.xml"))}
    folder.mkdir(parents=True, exist_ok=True)
    for former in folder.glob("mros*.deb"):
        former.unlink()
    with tempfile.TemporaryDirectory(prefix="mros-package-") as scratch:
        stages = install(sorted(manifests), Path(scratch))
        files = [pack(stages[name], control_of(manifests[name], manifests), folder) for name in sorted(manifests)]
        python = Path(scratch) / "python"
        files.append(pack(python, install_python(python, next(iter(manifests.values()))), folder))
        files += [pack(Path(scratch) / control.name, control, folder) for control in metapackages(manifests)]
    return files


# -- what a package is called and needs -------------------------------------------------------------------------------


def debian_name(package: str) -> str:
    """Return the name of our package in Debian, where no other package has such a name."""
    return f"mros-{package.replace('_', '-')}"


def read_manifest(path: Path) -> Manifest:
    """Read a package.xml of ours."""
    root = ElementTree.parse(path).getroot()  # noqa: S314 - our own file

    def text(tag: str) -> str:
        return " ".join((root.findtext(tag) or "").split())

    maintainer = root.find("maintainer")
    mail = maintainer.get("email") if maintainer is not None else ""
    found = [element.text or "" for tag in DEPENDENCIES for element in root.findall(tag)]
    needed = sorted(name for name in set(found) - BUILD_ONLY if not name.startswith(OF_PYTHON))
    return Manifest(
        *(text("name"), text("version"), text("description"), f"{text('maintainer')} <{mail}>", needed),
        has_code=(path.parent / "src").exists(),
    )


def control_of(manifest: Manifest, ours: dict[str, Manifest]) -> Control:
    """Return the control data of one of our packages.

    Raises:
        PackagingError: nothing in Debian is known to have something that it needs.
    """
    version = debian_version(manifest)
    depends = list(NEEDED_PROGRAMS.get(manifest.name, []))
    if manifest.has_code:  # definitions of messages need Debian's packages only
        depends.append(f"{PYTHON_PACKAGE} (= {version})")
    suggests = []
    for name in manifest.dependencies:
        if name in ours:
            depends.append(f"{debian_name(name)} (= {version})")
            continue
        owners = owners_of(name)
        depends += owners
        if not owners:
            suggests.append(suggestion(name, manifest.name))
    summary = f"MROS for ROS 1: {manifest.name}"
    return Control(
        debian_name(manifest.name),
        version,
        manifest.maintainer,
        summary,
        manifest.description,
        "all",
        depends,
        suggests,
    )


def debian_version(manifest: Manifest) -> str:
    """Return the version of the Debian packages."""
    return f"{manifest.version}-1"


def owners_of(package: str) -> list[str]:
    """Return the installed Debian packages that hold a ROS package: definitions, modules and executables."""
    places = [f"/usr/share/{package}", f"/usr/lib/{package}", f"/usr/lib/python3/dist-packages/{package}"]
    existing = [place for place in places if Path(place).exists()]
    owners: set[str] = set()
    for place in existing:
        done = subprocess.run(["dpkg-query", "-S", place], capture_output=True, text=True, check=False)
        for line in done.stdout.splitlines():
            names, _, path = line.rpartition(": ")
            if path == place:
                owners.update(name.strip().partition(":")[0] for name in names.split(","))
    return sorted(owners)


def suggestion(package: str, needed_by: str) -> str:
    """Return the Debian package of the same name as something that is not installed here.

    Raises:
        PackagingError: there is none.
    """
    name = package.replace("_", "-")
    done = subprocess.run(["apt-cache", "show", name], capture_output=True, text=True, check=False)
    if done.returncode:
        raise PackagingError(
            f"{needed_by} needs {package}, which no Debian package holds here: install it, or run ./mros setup first"
        )
    return name


def metapackages(manifests: dict[str, Manifest]) -> list[Control]:
    """Return the packages that stand for several: the meta-controller, and the demonstrator beside it."""
    first = next(iter(manifests.values()))
    version, maintainer = debian_version(first), first.maintainer

    def ours(names: list[str]) -> list[str]:
        return [f"{debian_name(name)} (= {version})" for name in names]

    text = "Run-time adaptation of ROS 1 robots from models: monitor, reasoner, manipulator and their tools."
    demo = "A robot on a simulated factory floor that adapts, a stand-in for move_base, and missions with failures."
    return [
        Control("mros", version, maintainer, "MROS for ROS 1", text, depends=[*ours(list(META_CONTROLLER)), *TOOLS]),
        Control(
            *("mros-demo", version, maintainer, "MROS for ROS 1: the demonstrator", demo),
            depends=[f"mros (= {version})", *ours([name for name in manifests if name not in META_CONTROLLER])],
        ),
    ]


# -- files ------------------------------------------------------------------------------------------------------------


def install(packages: list[str], scratch: Path) -> dict[str, Path]:
    """Build all packages for /usr, and install each to a folder of its own."""
    sources, build, home = scratch / "src", scratch / "build", scratch / "home"
    shutil.copytree(SOURCES, sources, symlinks=True, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    home.mkdir()
    # The build knows Debian's packages only, not the workspace that is in use.
    environment = {"HOME": str(home), "PATH": f"{Path(sys.executable).parent}:/usr/bin:/bin", "LANG": "C.UTF-8"}
    say("building")
    toplevel = sources / "CMakeLists.txt"
    toplevel.unlink(missing_ok=True)
    toplevel.symlink_to("/usr/share/catkin/cmake/toplevel.cmake")
    run(
        *("cmake", "-S", str(sources), "-B", str(build), "-DCMAKE_INSTALL_PREFIX=/usr"),
        *("-DCATKIN_ENABLE_TESTING=OFF", "-DCATKIN_BUILD_BINARY_PACKAGE=ON"),
        *(f"-DCATKIN_DEVEL_PREFIX={scratch / 'devel'}", f"-DPYTHON_EXECUTABLE={sys.executable}"),
        environment=environment,
    )
    run("cmake", "--build", str(build), environment=environment)
    stages = {}
    for package in packages:
        stages[package] = scratch / "stages" / package
        run("cmake", "--install", str(build / package), environment={**environment, "DESTDIR": str(stages[package])})
        for bytecode in sorted(stages[package].rglob("__pycache__")):
            shutil.rmtree(bytecode)  # it names folders of the build
        set_interpreter(stages[package])
        check_stage(package, stages[package], scratch)
        compile_modules(stages[package])
        write_copyright(
            stages[package], debian_name(package), ["Licence: Apache-2.0, /usr/share/common-licenses/Apache-2.0"]
        )
    return stages


def set_interpreter(stage: Path) -> None:
    """Let the executables run in the installed virtual environment."""
    ours = f"#!{sys.executable}".encode()
    for path in stage.rglob("*"):
        if path.is_file() and not path.is_symlink() and os.access(path, os.X_OK):
            first, separator, rest = path.read_bytes().partition(b"\n")
            if first == ours or re.fullmatch(rb"#!/usr/bin/env python3?", first):
                path.write_bytes(f"#!/{ENVIRONMENT}/bin/python3".encode() + separator + rest)


def check_stage(package: str, stage: Path, scratch: Path) -> None:
    """Refuse a file outside of /usr, and one that names a folder of this machine.

    Raises:
        PackagingError: there is one.
    """
    outside = [path for path in stage.iterdir() if path.name != "usr"]
    if outside:
        raise PackagingError(f"{package} installs {outside[0].name}, outside of /usr: correct its CMakeLists.txt")
    for path in stage.rglob("*"):
        if path.is_file() and any(str(folder).encode() in path.read_bytes() for folder in (scratch, ROOT)):
            raise PackagingError(f"{package} installs {path.relative_to(stage)}, which names a folder of the build")


def compile_modules(stage: Path) -> None:
    """Write the modules' bytecode: nodes start faster, and who runs them may not write to /usr."""
    for folder in stage.glob("usr/lib/python3/dist-packages/*/"):
        run(sys.executable, "-m", "compileall", "-q", "-s", str(stage), "-p", "/", str(folder))


def with_hashes() -> str:
    """Return the pinned packages, each with the hashes of its files."""
    pins = {line for path in REQUIREMENTS for line in path.read_text().splitlines() if "==" in line}
    lines = [line for line in HASHES.read_text().splitlines() if line.partition(" ")[0] in pins]
    return "\n".join(lines)


def install_python(stage: Path, manifest: Manifest) -> Control:
    """Install the virtual environment, and return the control data of its package."""
    say("installing the Python packages that Debian has not")
    environment, requirements = stage / ENVIRONMENT, stage / "requirements.txt"
    stage.mkdir()
    requirements.write_text(with_hashes())
    run("/usr/bin/python3", "-m", "venv", "--system-site-packages", "--without-pip", "--symlinks", str(environment))
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", str(environment / "bin" / "python3"))
    run(
        *pip,
        "install",
        "--ignore-installed",
        "--no-deps",
        "--no-compile",
        "--require-hashes",
        f"--requirement={requirements}",
    )
    requirements.unlink()
    for path in (environment / "bin").iterdir():
        if not path.name.startswith("python"):
            path.unlink()  # commands of the packages, and scripts that name this folder
    (environment / "pyvenv.cfg").write_text(
        "home = /usr/bin\ninclude-system-site-packages = true\n"
        f"version = {sys.version_info.major}.{sys.version_info.minor}\n",
        encoding="utf-8",
    )
    minor = sys.version_info.minor
    (site,) = environment.glob("lib/python3.*/site-packages")
    run(sys.executable, "-m", "compileall", "-q", "-s", str(stage), "-p", "/", str(site))
    write_copyright(stage, PYTHON_PACKAGE, licences(site))
    architecture = run("dpkg", "--print-architecture").strip()
    depends = [f"python3 (>= 3.{minor})", f"python3 (<< 3.{minor + 1})", "libc6", "libgomp1", "libstdc++6"]
    text = (
        "A virtual environment in /usr/lib/mros with exact versions of Python packages that Debian\n"
        "has not, or has in other versions. Only executables of MROS use it.\n\n"
        "It holds owlready2 with Pellet, which is under AGPL-3.0; Pellet runs in a process of its own."
    )
    summary = "MROS for ROS 1: Python packages"
    return Control(PYTHON_PACKAGE, debian_version(manifest), manifest.maintainer, summary, text, architecture, depends)


def licences(site: Path) -> list[str]:
    """Return one line for each Python package: its name, version and licence, as its metadata say."""
    lines = []
    for path in sorted(site.glob("*.dist-info/METADATA")):
        data = HeaderParser().parsestr(path.read_text(encoding="utf-8"))
        classifiers = [
            value.rpartition(" :: ")[2] for value in data.get_all("Classifier", []) if value.startswith("License")
        ]
        given = (
            data.get("License-Expression") or ", ".join(classifiers) or (data.get("License") or "").partition("\n")[0]
        )
        lines.append(f"{data['Name']} {data['Version']}: {given or 'see its files'}")
    lines += ["", "Pellet (inside Owlready2): AGPL-3.0, with its sources at https://github.com/stardog-union/pellet"]
    lines += ["The full texts are in /usr/lib/mros/lib/python3.*/site-packages/*.dist-info."]
    return lines


def write_copyright(stage: Path, name: str, lines: list[str]) -> None:
    """Write the file that says under which licences a package is."""
    folder = stage / "usr" / "share" / "doc" / name
    folder.mkdir(parents=True)
    (folder / "copyright").write_text("\n".join([name, "", *lines]) + "\n", encoding="utf-8")


def pack(stage: Path, control: Control, folder: Path) -> Path:
    """Make a Debian package of the files in a folder."""
    control_folder = stage / "DEBIAN"
    control_folder.mkdir(parents=True)
    if not (stage / "usr" / "share" / "doc").exists():
        write_copyright(stage, control.name, ["Licence: Apache-2.0, /usr/share/common-licenses/Apache-2.0"])
    files = [path for path in stage.rglob("*") if path.is_file() and not path.is_symlink()]
    size = sum(path.stat().st_size for path in files) // 1024
    (control_folder / "control").write_text(control.written(size), encoding="utf-8")
    for path in [stage, *stage.rglob("*")]:
        if not path.is_symlink():
            path.chmod(0o755 if path.is_dir() or os.access(path, os.X_OK) else 0o644)
    target = folder / f"{control.name}_{control.version}_{control.architecture}.deb"
    run("dpkg-deb", "--root-owner-group", "-Zzstd", "-z3", "--build", str(stage), str(target))
    return target


def run(*command: str, environment: dict[str, str] | None = None) -> str:
    """Run a command and return what it wrote.

    Raises:
        PackagingError: it fails.
    """
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        end = "\n".join((done.stdout + done.stderr).splitlines()[-30:])
        raise PackagingError(f"this failed: {' '.join(command)}\n{end}")
    return done.stdout


if __name__ == "__main__":
    main()
