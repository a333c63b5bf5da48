"""A node that was prepared must not be able to tell: whatever its code sees is as in a cold start."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from helpers.waiting import DEADLINE_S, wait_for
from hypothesis import given, settings
from hypothesis import strategies as st
from rosgraph_launcher.io import processes
from rosgraph_launcher.io.node_commands import safe_imports
from rosgraph_launcher.io.processes import MARK, Command
from rosgraph_launcher.io.warm_start.sitecustomize import KNOWN, SETTING, Modules, imports_in_advance

RECORDER = r"""
import atexit, builtins, gc, json, locale, logging, multiprocessing, os, resource, signal, sys, threading, warnings
def state():
    main = sys.modules["__main__"]
    rospy = sys.modules.get("rospy")
    zoneinfo = sys.modules.get("zoneinfo")
    return {
        "argv": sys.argv, "orig_argv": sys.orig_argv, "environment": dict(os.environ), "folder": os.getcwd(),
        "path": sys.path, "flags": list(sys.flags), "implementation": [sys.executable, sys.prefix, sys.warnoptions],
        "command": open("/proc/self/cmdline").read(), "comm": open("/proc/self/comm").read(),
        "main": sorted(main.__dict__), "file": main.__file__, "spec": repr(main.__spec__),
        "loader": type(main.__loader__).__name__, "package": main.__package__,
        "locale": [locale.setlocale(locale.LC_ALL), locale.getpreferredencoding(False)],
        "signals": [str(signal.getsignal(number)) for number in range(1, 32)],
        "mask": sorted(signal.pthread_sigmask(signal.SIG_BLOCK, [])),
        "threads": [[thread.name, thread.daemon] for thread in threading.enumerate()],
        "logging": [logging.root.level, len(logging.root.handlers), sorted(logging.root.manager.loggerDict)],
        "logging started in the last 60 s": __import__("time").time() - logging._startTime < 60.0,
        "atexit": atexit._ncallbacks(), "multiprocessing": multiprocessing.get_start_method(allow_none=True),
        "warnings": len(warnings.filters), "finders": [str(getattr(f, "__name__", type(f))) for f in sys.meta_path],
        "hooks": [sys.excepthook is sys.__excepthook__, threading.excepthook.__name__, sys.displayhook.__name__],
        "builtins": sorted(builtins.__dict__), "limits": [sys.getrecursionlimit(), gc.get_threshold(), gc.isenabled()],
        "streams": [[s.encoding, s.errors, s.line_buffering, s.isatty()] for s in (sys.stdin, sys.stdout, sys.stderr)],
        "files": sorted((n, os.readlink(f"/proc/self/fd/{n}")) for n in os.listdir("/proc/self/fd")[:-1]
                        if "/proc/" not in os.readlink(f"/proc/self/fd/{n}") and "pipe" not in
                        os.readlink(f"/proc/self/fd/{n}")),
        "session": [os.getsid(0) == os.getpid(), os.getpgid(0) == os.getpid(), os.getpriority(os.PRIO_PROCESS, 0)],
        "rlimits": [resource.getrlimit(n) for n in (resource.RLIMIT_NOFILE, resource.RLIMIT_CORE)],
        "world": open("world").read(),
        "ros": rospy and [rospy.names.get_mappings(), rospy.names.get_namespace(), rospy.names.get_caller_id()],
        "zones": zoneinfo and list(zoneinfo.TZPATH),
        "sitecustomize": str(sys.modules.get("sitecustomize")),
    }
def record(place):
    with open("record", "a") as file:
        file.write(json.dumps([place, state()]) + "\n")
"""
"""`record` appends all that a module may fix at its import. The file `world` stands for the state of the world."""

STATEMENTS = (
    "import json",
    "import logging",
    "import rospy",
    "import yaml",
    "import zoneinfo",
    "from geometry_msgs.msg import Twist",
    "from xml.dom import minidom as dom",
    "import queue",
    "import own_{0}",
    "from own_{0} import VALUE",
    "from own_package import part_{0}",
    "from own_package.part_{0} import VALUE, record as other",
    "import no_such_module_{0}",
    "CONSTANT_{0} = (1, 'x', -2.5)",
    "NUMBER: int = 3",
    "def function(x, *, y=2):\n    return x",
    "class Thing(dict):\n    name = 'thing'\n    def method(self):\n        raise ValueError",
    "import os; os.environ['PYTHONTZPATH'] = '/zones/{0}'",
    "import os; os.environ['ROS_NAMESPACE'] = 'space_{0}'",
    "import os, sys; sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), 'more'))",
    "import sys; sys.argv.append('a:=b_{0}')",
    "import logging; logging.getLogger('x_{0}').setLevel(10)",
    "import logging; logging.basicConfig()",
    "try:\n    import no_such_module\nexcept ImportError:\n    no_such_module = None",
    "if __name__ == '__main__':\n    import colorsys",
    "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import no_such_module",
    "import warnings; warnings.simplefilter('ignore')",
    "import atexit; atexit.register(print, 'the end')",
    "from threading import Event, Thread; Thread(target=Event().wait, name='thread {0}', daemon=True).start()",
    "import os; os.chdir(os.path.dirname(os.path.realpath(__file__)) + '/..')",
    "print('said at once')",
    "from recorder import record; record('main {0}')",
    "from __main__ import __file__ as own_file",
    "lambda: 1/0",
    "1/0",
)
LAST = "from recorder import record; import sys; record('end'); record(' '.join(sorted(sys.modules)))"

statement = st.builds(str.format, st.sampled_from(STATEMENTS), st.integers(0, 2))
body = st.lists(statement, max_size=6)
futures = st.sampled_from(["", '"""A docstring."""\n', "from __future__ import annotations\n"])


def is_waiting(process):
    """Whether a prepared process sleeps where it waits to be begun, as far as the kernel tells."""
    where = Path(f"/proc/{process.pid}/wchan").read_text()
    asleep = psutil.Process(process.pid).status() == psutil.STATUS_SLEEPING
    return asleep and (where == "0" or "pipe_read" in where)


class Workspace:
    """A folder with a script, modules of its own, and a record of what they saw."""

    def __init__(self, folder, script, modules, shadow=()):
        self.scripts = folder / "scripts"
        self.work = folder / "work"
        (self.scripts / "own_package").mkdir(parents=True)
        (self.scripts / "more").mkdir()
        self.work.mkdir()
        own = "from recorder import record\nrecord(__name__)\nVALUE = 1\n"
        for number, text in enumerate(modules):
            (self.scripts / f"own_{number}.py").write_text(f"{text}\n{own}")
            (self.scripts / "own_package" / f"part_{number}.py").write_text(f"{text}\n{own}")
        (self.scripts / "own_package" / "__init__.py").write_text("")
        for name in shadow:
            line = json.dumps(["shadow", name]) + "\n"
            text = f"with open({str(self.work / 'record')!r}, 'a') as file:\n    file.write({line!r})\n"
            (self.scripts / f"{name}.py").write_text(text)
        recorder = RECORDER.replace('"world": open("world")', f'"world": open({str(self.work / "world")!r})')
        recorder = recorder.replace('open("record"', f"open({str(self.work / 'record')!r}")
        (self.scripts / "recorder.py").write_text(recorder)
        self.script = self.scripts / "node"
        self.script.write_text(f"#!/usr/bin/env python3\n{script}\n{LAST}\n")
        self.script.chmod(0o755)

    def run(self, prepared, arguments=("x:=y", "_p:=1", "__name:=other_name", "--flag")):
        """Run the script cold, or prepared in another state of the world; return all that can be seen of the run."""
        world, record, log = (self.work / name for name in ("world", "record", "log"))
        for path in (record, log):
            path.write_text("")
        environment = {**os.environ, MARK: str(self.work), "ROS_NAMESPACE": "/ns", "PYTHONTZPATH": "/zones/cold"}
        command = Command((str(self.script), *arguments), str(self.work), environment, str(log))
        world.write_text("before" if prepared else "after")
        if prepared:
            process = processes.prepare(command)
            wait_for(lambda: is_waiting(process), "it waits")
            assert record.read_text() == ""  # no module of its own was executed
            world.write_text("after")
            process.begin()
        else:
            process = processes.start(command)
        assert processes.wait_for_ends([process], DEADLINE_S)
        status = process.status
        process.close()
        return {
            "status": status,
            "output": log.read_text(),
            "records": [json.loads(line) for line in record.read_text().splitlines()],
        }


OF_IMPORTS = {"logging", "atexit", "warnings", "ros", "zones", "builtins"}
"""What depends on the modules that are loaded by then: it is compared when all are."""


def compare(workspace):
    cold, warm = workspace.run(prepared=False), workspace.run(prepared=True)
    assert (warm["status"], warm["output"]) == (cold["status"], cold["output"])
    assert [place for place, _ in warm["records"]] == [place for place, _ in cold["records"]]
    for (place, seen), (_, expected) in zip(warm["records"], cold["records"], strict=True):
        if isinstance(seen, dict):
            keys = set(expected) if place == "end" else set(expected) - OF_IMPORTS
            assert {key: seen[key] for key in keys if seen[key] != expected[key]} == {
                key: expected[key] for key in keys if seen[key] != expected[key]
            }, place
        else:
            assert seen == expected, place
    return cold


@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_generated_script_sees_the_same_cold_and_prepared(tmp_path_factory, data):
    script = data.draw(futures) + "\n".join(data.draw(body))
    modules = [data.draw(futures) + "\n".join(data.draw(body)) for _ in range(3)]
    shadow = data.draw(st.sets(st.sampled_from(["json", "queue", "yaml", "contextlib"]), max_size=1))
    compare(Workspace(tmp_path_factory.mktemp("node"), script, modules, shadow))


@pytest.mark.parametrize(
    "script",
    [
        "import rospy\nfrom own_0 import VALUE",
        "import os\nos.environ['ROS_NAMESPACE'] = 'changed'\nimport rospy",
        "import os\nos.environ['PYTHONTZPATH'] = '/zones/changed'\nimport zoneinfo",
        "import sys\nsys.argv.append('c:=d')\nimport rospy",
        "import rospy\n1/0",
    ],
)
def test_script_that_uses_rospy_sees_the_same_cold_and_prepared(tmp_path, script):
    assert compare(Workspace(tmp_path, script, ["import rospy", "", ""]))["records"] or "1/0" in script


@pytest.mark.parametrize("name", ["json", "queue", "socket", "logging", "yaml", "rospkg", "enum", "ast", "contextlib"])
def test_own_module_with_the_name_of_a_library_is_found_as_in_a_cold_start(tmp_path, name):
    compare(Workspace(tmp_path, "import rospy", ["", "", ""], [name]))


def test_traceback_names_the_script_only(tmp_path):
    workspace = Workspace(tmp_path, "import sys\nsys.stderr = sys.stdout\nimport rospy\n1/0", ["", "", ""])
    cold = compare(workspace)
    assert "ZeroDivisionError" in cold["output"]
    assert "sitecustomize" not in cold["output"]


def test_environment_without_a_python_path_is_restored(tmp_path, monkeypatch):
    monkeypatch.delenv("PYTHONPATH")
    cold = compare(Workspace(tmp_path, "import json", ["", "", ""]))
    assert "PYTHONPATH" not in cold["records"][0][1]["environment"]


# -- what is imported in advance ---------------------------------------------------------------------------------------


def planned(tmp_path, script, modules=(), safe=()):
    for name, text in dict(modules).items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    (tmp_path / "node").write_text(script)
    sys.path.insert(0, str(tmp_path))
    try:
        return [name for name, _ in imports_in_advance(str(tmp_path / "node"), Modules(str(tmp_path), safe))]
    finally:
        sys.path.remove(str(tmp_path))


def test_imports_of_own_modules_are_followed_without_executing_them(tmp_path):
    modules = {
        "own/__init__.py": "",
        "own/a.py": "import yaml\nfrom . import b\nfrom .b import X\n\n\ndef f():\n    import wave\n",
        "own/b.py": "from geometry_msgs.msg import Twist\nX: int = 1\n",
    }
    script = "import sys\nfrom own.a import f\nimport rospy\nf()\nimport json\n"
    assert planned(tmp_path, script, modules) == ["sys", "yaml", "geometry_msgs.msg", "rospy"]


@pytest.mark.parametrize(
    "statement",
    [
        "f()",
        "x.y = 1",
        "x['y'] = 1",
        "x += 1",
        "del x",
        "for x in y: pass",
        "with x: pass",
        "if x: pass",
        "assert x",
        "x = f()",
        "x = [y for y in f()]",
        "def g(x=f()): pass",
        "@f\ndef g(): pass",
        "@f\nclass G: pass",
        "class G(f()): pass",
        "class G:\n    x = f()",
        "class G:\n    import os",
        "import unknown_module",
        "x: f() = 1",
        "(y := 1)",
        "exec('')",
        "raise X",
        "import _ctypes_of_somebody",
        "class G: pass\nG()",
        "@dataclass\nclass G:\n    def __post_init__(self): f()\nx = G()",
        "@dataclass\nclass G:\n    a: list = field(default_factory=f)\nx = G()",
        "@dataclass\nclass G: pass\ndef G(): f()\nx = G()",
        "@dataclass\nclass G(H): pass\nx = G()",
        "def dict(): f()\nx = dict()",
    ],
)
def test_nothing_after_a_statement_that_may_do_more_is_done_in_advance(tmp_path, statement):
    assert planned(tmp_path, f"import json\n{statement}\nimport yaml\n") == ["json"]


@pytest.mark.parametrize(
    "statement",
    [
        "'text'",
        "x = 1, [2], {'a': -3}",
        "x = y.z | w[0]",
        "x: dict[str, int] = {}",
        "x = re.compile('x')",
        "x = lambda: f()",
        "def g(): f()",
        "async def g(x: int = 1) -> int: f()",
        "class G(x.Y, metaclass=Z):\n    'doc'\n    a: int = 1\n    def b(self): f()",
        "@dataclass(frozen=True)\nclass G:\n    x: list = field(default_factory=list)",
        "class G:\n    @property\n    def a(self): ...\n    @a.setter\n    def a(self, v): ...",
        "if TYPE_CHECKING:\n    import unknown_module",
        "pass",
        "@dataclass(frozen=True)\nclass G:\n    a: list = field(default_factory=list)\nx = G()",
        "class G(NamedTuple):\n    a: int = 1\nx = [G(1), G(a=2)]",
    ],
)
def test_definitions_do_not_end_the_imports(tmp_path, statement):
    assert planned(tmp_path, f"import json\n{statement}\nimport yaml\n") == ["json", "yaml"]


def test_relay_scripts_and_packages_of_catkin_are_followed(tmp_path):
    build = Path(os.environ["MROS_ROOT"]) / "catkin_ws" / "devel"
    script = build / "lib" / "move_base" / "move_base"
    found = [name for name, _ in imports_in_advance(str(script), Modules(str(script.parent)))]
    assert {"cv2", "rospy", "geometry_msgs.msg"} <= set(found)
    assert not any(name.startswith("move_base.") for name in found)


def test_own_modules_that_are_declared_safe_are_imported_in_advance(tmp_path):
    modules = {"own/__init__.py": "", "own/a.py": "f()\n", "other.py": "import wave\n"}
    assert planned(tmp_path, "from own.a import f\nimport other\n", modules, ["own"]) == ["own.a", "wave"]


def run_with_safe_modules(tmp_path, modules):
    """Prepare and begin a script that imports `own`, which is declared safe; return its output before and after."""
    for name, text in modules.items():
        (tmp_path / name).write_text(text)
    script, log = tmp_path / "node", tmp_path / "log"
    script.write_text("#!/usr/bin/env python3\nimport own\nprint('begun')\n")
    script.chmod(0o755)
    process = processes.prepare(Command((str(script),), str(tmp_path), os.environ, str(log), safe_imports=("own",)))
    wait_for(lambda: is_waiting(process), "it waits")
    before = log.read_text()
    process.begin()
    assert processes.wait_for_ends([process], DEADLINE_S)
    process.close()
    return before, log.read_text()


def test_module_that_is_declared_safe_is_executed_before_its_node_begins(tmp_path):
    said = run_with_safe_modules(tmp_path, {"own.py": "import yaml\nprint('own', flush=True)\n"})
    assert said == ("own\n", "own\nbegun\n")


def test_module_that_a_safe_one_imports_is_not_executed_before_its_node_begins(tmp_path):
    modules = {"own.py": "import other\n", "other.py": "print('other', flush=True)\n"}
    assert run_with_safe_modules(tmp_path, modules) == ("", "other\nbegun\n")


def test_modules_of_move_base_are_imported_in_advance(tmp_path):
    script = Path(os.environ["MROS_ROOT"]) / "catkin_ws" / "devel" / "lib" / "move_base" / "move_base"
    command = Command((str(script),), str(tmp_path), os.environ, safe_imports=safe_imports("move_base"))
    process = processes.prepare(command)
    wait_for(lambda: is_waiting(process), "it waits")
    setting = psutil.Process(process.pid).environ()[SETTING]
    process.close()
    assert ":1:move_base " in setting  # where a process has begun anew, without imports, it is :0:


def test_script_that_is_no_python_has_no_imports(tmp_path):
    assert planned(tmp_path, "import json\nthis is no Python\n") == []
    assert imports_in_advance(str(tmp_path / "missing"), Modules(str(tmp_path))) == []


MEASURE = r"""
import importlib, locale, os, signal, sys, threading
def state():
    return {"environment": dict(os.environ), "path": list(sys.path), "folder": os.getcwd(), "arguments": sys.argv,
            "locale": locale.setlocale(locale.LC_ALL), "threads": threading.active_count(),
            "signals": [str(signal.getsignal(number)) for number in range(1, 32)]}
REACHES_OUT = ("socket.connect", "socket.bind", "subprocess.Popen", "os.exec", "os.fork", "os.posix_spawn", "os.system",
               "os.remove", "os.mkdir", "os.rename", "os.chdir")
found = []
def hook(event, arguments):
    written = event == "open" and isinstance(arguments[1], str) and set(arguments[1]) & set("wax+")
    if (event in REACHES_OUT or written) and "__pycache__" not in str(arguments[0]):
        found.append((event, str(arguments)))
before = state()
sys.addaudithook(hook)
importlib.import_module(sys.argv[1])
after = state()
for seen in (before, after):
    if sys.argv[1] in ("cv2", "move_base.ros.move_base"):  # cv2 adds its own folder
        seen["environment"].pop("LD_LIBRARY_PATH", None)
    if "." in sys.argv[1]:  # relays of catkin, in the workspace where the package was built
        seen.pop("path")
print(found + [(key, before[key], after[key]) for key in before if before[key] != after[key]])
"""
INSTALLED = [name for name in sorted(KNOWN) if importlib.util.find_spec(name)]


def test_libraries_are_measured():
    assert {"rospy", "tf2_ros", "actionlib", "dynamic_reconfigure", "numpy", "cv2", "yaml"} <= set(INSTALLED)


@pytest.mark.parametrize("name", [*INSTALLED, "move_base.ros.move_base"])
def test_import_of_a_known_library_reaches_out_for_nothing_and_changes_nothing(name):
    words = [sys.executable, "-c", MEASURE, name]
    result = subprocess.run(words, check=False, capture_output=True, text=True, timeout=DEADLINE_S)
    assert (result.stdout.strip(), result.stderr) == ("[]", "")
