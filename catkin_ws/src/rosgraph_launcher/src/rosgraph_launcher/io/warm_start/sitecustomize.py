"""Lets a Python node do imports in advance, and wait until it may begin.

Python imports a module of this name at its start, before it runs a script. The launcher puts this folder in front of
PYTHONPATH, and sets `MROS_WARM_START` to `DESCRIPTOR:IMPORTS:SAFE:=PYTHON_PATH`. This module takes both back, does
imports that the script would do first, and waits for a line on the descriptor. After that, Python runs the script as
ever, so that nothing in it can tell this start from a cold one. Where the descriptor ends without a line, the process
ends.

Arguments, environment, folder and output are the node's own from the beginning. What may still differ is the state of
the world: parameters, files, devices, other nodes. So only modules that read none of it are imported in advance: the
standard library, those in `KNOWN`, generated messages, and those in SAFE, which the node's package declares to be so.
No other module of the node's own is executed. It is read, to find the imports that it will do. The reading stops at the
first statement that might do more than import, define or name something, because what follows it may depend on it.

This module imports nothing that Python has not imported by then: a node may have modules of its own by any name.
"""

import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Sequence
    from typing import Any

SETTING = "MROS_WARM_START"
MOST_MODULES = 200  # of the node's own, that are read; more would take longer than they save

KNOWN = frozenset(
    (
        # ROS client libraries for Python
        *("actionlib", "bondpy", "catkin", "diagnostic_updater", "dynamic_reconfigure", "genmsg", "genpy"),
        *("image_geometry", "laser_geometry", "message_filters", "ros_numpy", "rosgraph", "roslib"),
        *("roslz4", "rosmaster", "rosmsg", "rosnode", "rosparam", "rospkg", "rosservice", "rostopic", "rospy"),
        *("sensor_msgs", "smclib", "tf", "tf2_geometry_msgs", "tf2_py", "tf2_ros", "tf2_sensor_msgs"),
        *("tf_conversions",),
        # libraries that many nodes use
        *("PIL", "cv2", "defusedxml", "netifaces", "numpy", "psutil", "pyastar2d", "scipy", "transforms3d", "yaml"),
    )
)
"""Modules outside the standard library whose import reads nothing but arguments, environment and installed files.

It also changes nothing, which a test measures, with one exception: cv2 adds its folder to LD_LIBRARY_PATH. cv_bridge is
none of them: Debian's is compiled for NumPy 1, and complains at length where a newer one is installed.
"""

PURE_CALLS = frozenset(
    (
        *("dict", "float", "frozenset", "int", "len", "list", "max", "min", "range", "set", "sorted", "str", "tuple"),
        *("TypeVar", "typing.TypeVar", "NewType", "typing.NewType", "namedtuple", "collections.namedtuple"),
        *("dataclass", "dataclasses.dataclass", "field", "dataclasses.field", "enum.auto", "auto"),
        *("logging.getLogger", "re.compile", "Path", "pathlib.Path", "math.radians", "math.sqrt", "np.array"),
    )
)
PURE_DECORATORS = PURE_CALLS | frozenset(
    (
        *("property", "staticmethod", "classmethod", "abstractmethod", "abc.abstractmethod", "contextmanager"),
        *("contextlib.contextmanager", "enum.unique", "functools.wraps", "functools.cache", "functools.lru_cache"),
        *("functools.cached_property", "overload", "typing.overload", "override", "runtime_checkable"),
    )
)
OWN_CONSTRUCTION = ("__init__", "__new__", "__post_init__", "__setattr__")
IMPURE_EXPRESSIONS = ("Await", "NamedExpr", "Yield", "YieldFrom")
ONLY_SYNTAX_TREE = 0x400  # ast.PyCF_ONLY_AST
RELAYED_SCRIPT = "generated from catkin/cmake/template/script.py.in"
RELAYED_PACKAGE = "generated from catkin/cmake/template/__init__.py.in"


class _Unknown(BaseException):
    """An import in advance needs a module that is not known. No `except Exception` of a library may hide it."""


class _Stop(Exception):  # noqa: N818, it is no error
    """What follows in the script can't be done in advance."""


# -- which modules ----------------------------------------------------------------------------------------------------


def _inside(path: "str | None", folders: "Iterable[str]") -> bool:
    return path is not None and any(path.startswith(folder + os.sep) for folder in folders)


def _library_folders() -> "tuple[tuple[str, ...], tuple[str, ...]]":
    """Return the folders of the standard library, and those of packages that are installed for this Python."""
    standard = {os.path.dirname(os.__file__)}
    installed = set()
    prefixes = {sys.prefix, sys.base_prefix, sys.exec_prefix}
    user = getattr(sys.modules.get("site"), "USER_SITE", None)
    for entry in sys.path:
        name = os.path.basename(entry)
        if name in ("site-packages", "dist-packages"):
            if entry == user or _inside(entry, prefixes):
                installed.add(entry)
        elif name == "lib-dynload" and _inside(entry, prefixes):
            standard.add(entry)
    return tuple(standard), tuple(installed)


class Modules:
    """Finds modules without executing any, and tells which may be imported in advance."""

    def __init__(self, script_folder: str, safe: "Iterable[str]" = ()) -> None:
        self._own = script_folder
        self._safe = frozenset(safe)
        self._standard, self._installed = _library_folders()
        self._generated: dict[str, bool] = {}

    @staticmethod
    def find(name: str, path: "Sequence[str] | None") -> "Any":
        """Return the spec of a module, or None.

        Args:
            name: its full name.
            path: the folders of its parent package; None: it has no parent.
        """
        for finder in sys.meta_path:
            if isinstance(finder, Guard) or not hasattr(finder, "find_spec"):
                continue
            spec = finder.find_spec(name, path)
            if spec is not None:
                return spec
        return None

    def is_standard(self, spec: "Any") -> bool:
        """Tell whether a module is in the standard library."""
        if spec.origin in ("built-in", "frozen"):
            return True
        return _inside(spec.origin, self._standard) and not _inside(spec.origin, self._installed)

    def is_known(self, name: str, spec: "Any") -> bool:
        """Tell whether a script's import of a module may be done in advance."""
        if self.is_standard(spec):
            return True
        package = name.partition(".")[0]
        if package in self._safe:
            return True
        if self._is_own(spec):
            return False
        return package in KNOWN or self._is_generated(package, spec)

    def is_library(self, name: str, spec: "Any") -> bool:
        """Tell whether a known module may import another one."""
        places = [spec.origin] if spec.has_location else list(spec.submodule_search_locations or ())
        return self.is_known(name, spec) or all(_inside(place, self._installed) for place in places)

    def _is_own(self, spec: "Any") -> bool:
        return _inside(spec.origin, [self._own])

    def _is_generated(self, package: str, spec: "Any") -> bool:
        """Tell whether a package has only generated messages and services in it."""
        if package not in self._generated:
            origin = spec.origin if spec.origin and spec.name == package else None
            self._generated[package] = bool(origin) and _is_message_package(str(origin))
        return self._generated[package]


def _is_message_package(init: str) -> bool:
    if os.path.basename(init) != "__init__.py" or read(init).strip():
        return False
    folder = os.path.dirname(init)
    inits = [os.path.join(folder, kind, "__init__.py") for kind in ("msg", "srv")]
    found = [path for path in inits if os.path.isfile(path)]
    return bool(found) and all(line.startswith("from ._") for path in found for line in read(path).splitlines())


class Guard:
    """A finder in front of all others, which raises `_Unknown` for modules that may not be imported in advance."""

    def __init__(self, modules: Modules) -> None:
        self._modules = modules

    def find_spec(self, name: str, path: "Sequence[str] | None" = None, target: object = None) -> "Any":  # noqa: ARG002
        """Return the spec that the other finders have for a module."""
        spec = self._modules.find(name, path)
        if spec is not None and not self._modules.is_library(name, spec):
            raise _Unknown(name)
        return spec


# -- which imports ----------------------------------------------------------------------------------------------------


def read(path: str) -> str:
    """Return a source file's text."""
    with open(path, encoding="utf-8") as file:
        return file.read()


def _kind(node: object) -> str:
    return type(node).__name__


def _dotted(node: "Any") -> str:
    """Return the name that an expression is, with dots; empty where it is none."""
    if _kind(node) == "Name":
        return str(node.id)
    if _kind(node) == "Attribute":
        owner = _dotted(node.value)
        return f"{owner}.{node.attr}" if owner else ""
    return ""


def _is_pure(node: "Any", calls: "Container[str]") -> bool:
    """Tell whether an expression can't change anything outside itself.

    Args:
        node: the expression, or a list of some.
        calls: the names of what it may call.
    """
    if isinstance(node, list):
        return all(_is_pure(item, calls) for item in node)
    if not hasattr(node, "_fields") or _kind(node) == "Lambda":
        return True
    if _kind(node) in IMPURE_EXPRESSIONS or (_kind(node) == "Call" and _dotted(node.func) not in calls):
        return False
    return all(_is_pure(getattr(node, field, None), calls) for field in node._fields)


def _is_name(target: "Any") -> bool:
    return _kind(target) == "Name" or (_kind(target) == "Tuple" and all(_is_name(item) for item in target.elts))


def _only_defines(statement: "Any", calls: "Container[str]") -> bool:
    """Tell whether a statement does no more than to define or name something in its module."""
    kind = _kind(statement)
    if kind in ("FunctionDef", "AsyncFunctionDef"):
        return _is_pure([statement.args, statement.returns], calls) and _only_decorated(statement, calls)
    if kind == "ClassDef":
        return (
            _is_pure([statement.bases, statement.keywords], calls)
            and _only_decorated(statement, calls)
            and all(_only_defines(inner, calls) for inner in statement.body)
        )
    if kind == "Assign":
        return all(map(_is_name, statement.targets)) and _is_pure(statement.value, calls)
    if kind == "AnnAssign":
        return _is_name(statement.target) and _is_pure([statement.annotation, statement.value], calls)
    return kind == "Pass" or (kind == "Expr" and _kind(statement.value) == "Constant")


def _only_decorated(statement: "Any", calls: "Container[str]") -> bool:
    """Tell whether a function or class is decorated by nothing that does more than to define it."""
    for decorator in statement.decorator_list:
        call = _kind(decorator) == "Call"
        name = _dotted(decorator.func if call else decorator)
        if name.rpartition(".")[2] not in ("setter", "deleter") and name not in PURE_DECORATORS:
            return False
        if call and not _is_pure([decorator.args, decorator.keywords], calls):
            return False
    return True


def _is_plain(statement: "Any", calls: "Container[str]") -> bool:
    """Tell whether a class is a dataclass or named tuple whose construction executes nothing of the node's own."""
    decorators = [_dotted(d.func if _kind(d) == "Call" else d) for d in statement.decorator_list]
    bases = [_dotted(base) for base in statement.bases]
    if statement.keywords or not (
        (not bases and decorators in (["dataclass"], ["dataclasses.dataclass"]))
        or (not decorators and bases in (["NamedTuple"], ["typing.NamedTuple"]))
    ):
        return False
    for inner in statement.body:
        if getattr(inner, "name", "") in OWN_CONSTRUCTION:
            return False
        for keyword in getattr(getattr(inner, "value", None), "keywords", ()):
            if keyword.arg == "default_factory" and _dotted(keyword.value) not in calls:
                return False
    return True


class _Reader:
    """Reads a script and its own modules, and collects the imports that may be done in advance."""

    def __init__(self, modules: Modules) -> None:
        self._modules = modules
        self._seen: set[str] = set()
        self._paths: dict[str, list[str]] = {}
        self._front: list[str] = []  # folders that relays of catkin put in front of sys.path
        self._calls = set(PURE_CALLS)
        self._defined: set[str] = set()  # classes and functions of all modules of its own
        self.found: list[tuple[str, tuple[str, ...]]] = []

    def script(self, path: str) -> None:
        text = read(path)
        body = _parsed(text, path)
        if RELAYED_SCRIPT in text:
            path = str(_constant(body, "python_script"))
            body = _parsed(read(path), path)
        self._body(body, "")

    def _body(self, body: "Any", package: str) -> None:
        """Go through the statements of a module."""
        for statement in body:
            kind = _kind(statement)
            if kind == "Import":
                for alias in statement.names:
                    self._import(alias.name, ())
            elif kind == "ImportFrom":
                base = package.split(".")[: len(package.split(".")) + 1 - statement.level] if statement.level else []
                name = ".".join([*base, *([statement.module] if statement.module else [])])
                if name != "__future__":
                    self._import(name, tuple(alias.name for alias in statement.names))
            elif kind == "If" and _dotted(statement.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING"):
                self._body(statement.orelse, package)
            elif not _only_defines(statement, self._calls):
                raise _Stop
            elif hasattr(statement, "name"):
                self._note(statement)

    def _note(self, statement: "Any") -> None:
        """Note a class or function of the node's own: whether calling what has its name may do anything."""
        if statement.name not in self._defined and _kind(statement) == "ClassDef" and _is_plain(statement, self._calls):
            self._calls.add(statement.name)
        else:
            self._calls.discard(statement.name)
        self._defined.add(statement.name)

    def _import(self, name: str, wanted: "tuple[str, ...]") -> None:
        parts = name.split(".")
        path: list[str] | None = None
        for end in range(1, len(parts) + 1):
            partial = ".".join(parts[:end])
            spec = self._find(partial, path)
            if spec is None:
                raise _Stop
            if self._modules.is_known(partial, spec):
                self.found.append((name, wanted))
                return
            path = self._read_module(partial, spec)
        for inner in wanted:
            spec = self._find(f"{name}.{inner}", path) if path else None
            if spec is not None:
                self._read_module(f"{name}.{inner}", spec)

    def _find(self, name: str, path: "list[str] | None") -> "Any":
        if path is None and self._front:
            return self._modules.find(name, self._front) or self._modules.find(name, None)
        return self._modules.find(name, path)

    def _read_module(self, name: str, spec: "Any") -> "list[str]":
        """Go through a module of the node's own; return the folders of its sub-modules."""
        if name in self._paths:
            return self._paths[name]
        if len(self._paths) == MOST_MODULES:
            raise _Stop
        paths = self._paths[name] = list(spec.submodule_search_locations or ())
        if not spec.has_location:
            return paths
        if not str(spec.origin).endswith(".py"):
            raise _Stop
        text = read(spec.origin)
        bodies = [_parsed(text, spec.origin)]
        if RELAYED_PACKAGE in text:
            folders = str(_constant(bodies[0], "__extended_path")).split(";")
            self._front = [*folders, *self._front]
            paths[:0] = [folder for folder in (os.path.join(f, name) for f in folders) if os.path.isdir(folder)]
            inits = [os.path.join(folder, "__init__.py") for folder in paths[: len(folders)]]
            bodies = [_parsed(read(path), path) for path in inits if path != spec.origin and os.path.isfile(path)]
        for body in bodies:
            self._body(body, name if spec.submodule_search_locations is not None else name.rpartition(".")[0])
        return paths


def _parsed(text: str, path: str) -> "Any":
    return compile(text, path, "exec", ONLY_SYNTAX_TREE, dont_inherit=True).body


def _constant(body: "Any", name: str) -> "Any":
    """Return the text that a module assigns to a name, also by `'...'.split(';')`, as relays of catkin do."""
    for statement in body:
        if _kind(statement) == "Assign" and _dotted(statement.targets[0]) == name:
            value = statement.value
            return value.func.value.value if _kind(value) == "Call" else value.value
    raise _Stop


def imports_in_advance(script: str, modules: Modules) -> "list[tuple[str, tuple[str, ...]]]":
    """Return the imports of a script that may be done in advance, in their order: modules, and the names from each."""
    reader = _Reader(modules)
    try:
        reader.script(script)
    except (SyntaxError, ValueError, OSError, AttributeError, RecursionError):
        return []  # the script itself will show the error
    except _Stop:
        return reader.found
    return reader.found


# -- the wait ---------------------------------------------------------------------------------------------------------


def import_in_advance(script: str, safe: "Sequence[str]" = ()) -> bool:
    """Do a script's imports that may be done in advance; return False where this process is spoiled by that."""
    folder = os.path.dirname(os.path.realpath(script))
    first = not getattr(sys.flags, "safe_path", False)
    if first:
        sys.path.insert(0, folder)  # as Python does when it runs the script
    modules = Modules(folder, safe)
    guard: Any = Guard(modules)
    path = list(sys.path)
    try:
        imports = imports_in_advance(script, modules)
        sys.meta_path.insert(0, guard)
        for name, wanted in imports:
            __import__(name, {}, {}, wanted)
    except (_Unknown, Exception):
        return False
    if sys.path[-len(path) :] != path or not (safe or len(sys.path) == len(path)):
        return False  # only relays of catkin, which safe modules may have, put folders in front
    sys.meta_path.remove(guard)
    if first:
        sys.path.remove(folder)
    return True


def wait(setting: str) -> None:
    """Take back the changes of the environment, import in advance, and wait until the script may begin."""
    here = os.path.dirname(__file__)
    changed = os.environ["PYTHONPATH"]
    descriptor, imports, safe, python_path = setting.split(":", 3)
    if python_path:
        os.environ["PYTHONPATH"] = python_path[1:]
    else:
        del os.environ["PYTHONPATH"]
    if here in sys.path:
        sys.path.remove(here)
    sys.path_importer_cache.pop(here, None)
    script = sys.argv[0]
    if imports == "1" and not import_in_advance(script, safe.split()):
        # An import has failed half-way, has reached for a module of the node's own, or has changed where modules are
        # found. Begin anew, without imports.
        os.environ.update({SETTING: f"{descriptor}:0::{python_path}", "PYTHONPATH": changed})
        os.execv(script, sys.argv)  # noqa: S606, the words that this process was started with
    if os.read(int(descriptor), 1) != b"\n":
        os._exit(0)
    os.close(int(descriptor))
    logging = sys.modules.get("logging")
    if logging is not None and isinstance(getattr(logging, "_startTime", None), float):
        logging._startTime = sys.modules["time"].time()  # type: ignore[attr-defined]


def give_way() -> None:
    """Import the module of this name that Python would have found without this folder."""
    del sys.modules["sitecustomize"]
    import sitecustomize  # noqa: F401


if SETTING in os.environ and __name__ == "sitecustomize":
    try:
        wait(os.environ.pop(SETTING))
    except Exception as error:  # Python would go on with the script, though it may not begin yet
        os.write(2, f"{sys.argv[0]}: its imports in advance have failed: {error}\n".encode())
        os._exit(1)
    give_way()
