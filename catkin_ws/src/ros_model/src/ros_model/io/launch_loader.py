"""roslaunch's reader of launch files, which refuses what no reader of this project takes. It imports roslaunch."""

from __future__ import annotations

import functools
import math
import re
import shlex
from typing import TYPE_CHECKING, Any
from xml.dom import expatbuilder

import roslaunch.core
import roslaunch.loader
import roslaunch.substitution_args
import roslaunch.xmlloader
import rospkg
import yaml
from node_kit.io.input_files import InputFileError, read_bytes, read_text
from node_kit.yaml_text import MAX_DIGITS, MAX_VALUES, YamlError, explained
from rosgraph.names import ns_join

from ros_model.errors import ModelError
from ros_model.language.builder import MAX_NESTING
from ros_model.language.expressions import FUNCTIONS, MATHEMATICS, ExpressionError, evaluate

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

MAX_YAML = 500_000
"""Bytes of the largest text of parameters; PyYAML takes 3 s for them. Files of parameters have some thousand."""
MAX_FILES = 1_000
"""Launch files of the largest load, each counted as often as it is included."""
MAX_SUBSTITUTED = 20_000_000
"""Characters that `$(...)` may make in a load: arguments made of arguments grow fast."""
MAX_SUBSTITUTIONS = 1_000
"""`$(...)` in a text: roslaunch looks through all of it for each."""
EXPLAINED = (roslaunch.core.RLException, roslaunch.substitution_args.SubstitutionException, rospkg.ResourceNotFound)
"""Errors of roslaunch whose message says what is wrong."""

_EVAL = "$(eval "
_ARGUMENT = re.compile(r"\$\( *arg +([^ ()$]+)")
_XML = re.compile(r"\.? (?:\w+ )?xml is (<[^>]*>).*", re.IGNORECASE)
"""How roslaunch ends a message: with an element and all that is in it."""
_SHOWN = 100  # characters of an element or expression in a message
_TEXT_KEYS = ("tag:yaml.org,2002:str", "tag:yaml.org,2002:merge")


class LaunchContentError(ModelError):
    """A launch file holds what can't be used.

    Args:
        file: the one that holds it: the file that is read, or one that it includes; `string` for a text.
        problem: what is wrong, and what to do.
    """

    def __init__(self, file: object, problem: str) -> None:
        super().__init__(f"{file}: {in_one_line(problem)}")
        self.file = str(file)
        self.problem = in_one_line(problem)


class LaunchLoader(roslaunch.xmlloader.XmlLoader):
    """roslaunch's reader, without XML entities, and with limits for what files and parameters hold.

    It runs no Python of a file: expressions and angles are computed.

    Args:
        instead_of_programs: makes the value of a parameter of the command that would give it; None: the commands run.
    """

    ignore_unset_args = False

    def __init__(self, instead_of_programs: Callable[[str], Any] | None = None) -> None:
        super().__init__()
        self._instead_of_programs = instead_of_programs
        self._at: tuple[Any, Any] | None = None
        self._files = 0
        self._substituted = 0  # characters

    def load(self, filename: str, ros_config: Any, **options: Any) -> None:
        """Read a launch file into a configuration.

        Raises:
            LaunchContentError: it can't be used; or an error of EXPLAINED.
        """
        try:
            super().load(filename, ros_config, **options)
        except LaunchContentError:
            raise
        except EXPLAINED as error:
            if content := _content_error(error):
                raise content from error
            raise
        except (Exception, SystemExit) as error:  # whatever `$(eval ...)`, names and values make of it
            file, element = self._place(filename)
            text = f"{type(error).__name__}: {str(error) or 'no reason given'}"
            raise LaunchContentError(
                file, f"roslaunch can't read {element}: {text}: correct the launch file"
            ) from error

    def opt_attrs(self, tag: Any, context: Any, attrs: Any) -> Any:
        """Return attributes of an element, and note that it is being read: roslaunch asks so for each."""
        self._at = context, tag
        return super().opt_attrs(tag, context, attrs)

    def resolve_args(self, args: str | None, context: Any) -> Any:
        """Return a text with its `$(...)` replaced.

        Raises:
            LaunchContentError: an expression is not taken, or they make too much.
            Exception: an expression fails, as in Python; or roslaunch refuses the text.
        """
        if not args or "$" not in args:
            return args
        given = context.resolve_dict
        given["filename"] = context.filename
        if args.startswith(_EVAL) and args.endswith(")"):
            found = self._evaluated(args[len(_EVAL) : -1], given)
            self._count(len(found))
            return found
        self._check_arguments(args, given.get("arg", {}))
        return super().resolve_args(args, context)

    def param_value(
        self,
        verbose: bool,
        name: str,
        ptype: str,
        value: str | None,
        textfile: str | None,
        binfile: str | None,
        command: str | None,
    ) -> Any:
        """Return the value of a `<param>`."""
        for file in (textfile, binfile):
            if file is not None:
                self._reading(read_bytes, file)
        if command is not None:
            self._check_command(command)
            if self._instead_of_programs is not None:
                return self._instead_of_programs(command)
        is_yaml = ptype == "yaml"
        given = super().param_value(verbose, name, "str" if is_yaml else ptype, value, textfile, binfile, command)
        return self._parsed(given, name, textfile) if is_yaml and isinstance(given, str) else given

    def load_rosparam(
        self,
        context: Any,
        ros_config: Any,
        cmd: str,
        param: str,
        file_: str | None,
        text: str,
        verbose: bool = True,
        subst_function: Callable[[str], str] | None = None,
    ) -> None:
        """Take in what a `<rosparam>` says."""
        if cmd != "load":
            super().load_rosparam(context, ros_config, cmd, param, file_, text, verbose=verbose)
            return
        import rosparam  # noqa: F401 - teaches PyYAML angles and binary data, as in roslaunch only from here on

        name = ns_join(context.ns, param) if param else context.ns

        def values_of(text: str) -> Any:
            found = self._parsed(subst_function(text) if subst_function else text, name, file_)
            if not param and not isinstance(found, dict | None):
                what = file_ or "its text"
                raise self._refusal(f"{what} is no mapping: make it a mapping NAME: VALUE, or give 'param'")
            return {} if found is None else found

        values = values_of(text) if file_ is None else self.values_of_file(file_, values_of)
        self.add_param(ros_config, name, values, verbose=verbose)

    def values_of_file(self, file: str, values_of: Callable[[str], Any]) -> Any:
        """Return what a file of parameters says.

        Args:
            file: its path.
            values_of: what a text says; raises LaunchContentError.

        Raises:
            LaunchContentError: it can't be used.
        """
        return values_of(self.text_of(file))

    def text_of(self, file: str) -> str:
        """Return the text of a file of parameters.

        Raises:
            LaunchContentError: it can't be read.
        """
        text: str = self._reading(read_text, file, MAX_YAML)
        return text

    def _parse_launch(self, filename: str, verbose: bool) -> Any:  # noqa: ARG002
        self._files += 1
        if self._files > MAX_FILES:
            raise self._refusal(f"there are more than {MAX_FILES} files with it: include fewer, or each once")
        try:
            content = read_bytes(filename)
        except InputFileError as error:
            raise roslaunch.xmlloader.XmlParseException(str(error)) from error
        try:
            document = _Builder().parseString(content)
        except RecursionError:
            raise
        except _DocumentTypeError as error:
            problem = "no DOCTYPE is allowed (a document type declaration may define entities): remove it"
            raise LaunchContentError(filename, problem) from error
        except Exception as error:  # also of the codec that an unknown encoding has no match for
            raise roslaunch.xmlloader.XmlParseException(
                f"{filename}: not well-formed XML: {error}: correct it, and save it as UTF-8"
            ) from error
        roots = document.getElementsByTagName("launch")
        if len(roots) != 1:
            raise roslaunch.xmlloader.XmlParseException(f"{filename}: must have one root element <launch>")
        return roots[0]

    def _evaluated(self, text: str, given: dict[str, Any]) -> str:
        """Return what roslaunch makes of `$(eval text)`, without Python's `eval`.

        Args:
            text: the expression.
            given: what roslaunch resolves by: `arg`, `anon` and `filename`.
        """
        if "__" in text:
            raise roslaunch.substitution_args.SubstitutionException(
                "$(eval ...) may not contain double underscore expressions"
            )
        arguments, known = given.setdefault("arg", {}), roslaunch.substitution_args
        functions = {
            **{"true": True, "false": False, "True": True, "False": False},
            "anon": functools.partial(known._eval_anon, anons=given.setdefault("anon", {})),
            "arg": lambda name: _typed(known._eval_arg(name, arguments)),
            "dirname": lambda: known._eval_dirname(given["filename"]),
            **{"env": known._eval_env, "optenv": known._eval_optenv, "find": known._eval_find},
        }

        def lookup(name: str) -> Any:
            for names in (functions, MATHEMATICS):
                if name in names:
                    return names[name]
            return _typed(arguments[name]) if name in arguments else FUNCTIONS[name]

        try:
            return str(evaluate(text, lookup))
        except ExpressionError as error:
            remedy = "files are read without Python: use numbers, texts, their methods and roslaunch's functions"
            raise self._refusal(f"$(eval ...): {error}; {remedy}") from error

    def _check_arguments(self, text: str, arguments: dict[str, str]) -> None:
        """Refuse a text in which arguments would make too much."""
        if text.count("$(") > MAX_SUBSTITUTIONS:
            raise self._refusal(f"it has more than {MAX_SUBSTITUTIONS} $(...): write its values out")
        values = [(name, arguments.get(name, "")) for name in _ARGUMENT.findall(text)]
        for name, value in values:
            if "$(" in value:  # roslaunch might replace in it, too
                raise self._refusal(f"the argument {name} holds '$(': take it out")
        self._count(len(text) + sum(len(value) for _, value in values))

    def _count(self, characters: int) -> None:
        self._substituted += characters
        if self._substituted > MAX_SUBSTITUTED:
            raise self._refusal(f"$(...) make more than {MAX_SUBSTITUTED} characters up to here: shorten the arguments")

    def _check_command(self, command: str) -> None:
        try:
            words = shlex.split(command)
        except ValueError as error:
            raise self._refusal(f"its command: {error}: close the quotation, or take it out") from error
        if not words or not words[0]:
            raise self._refusal("its command is empty: name a program, or take the parameter out")

    def _reading(self, read: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return read(*arguments)
        except InputFileError as error:
            remedy = "" if ":" in error.problem else ": give a smaller one"  # only that of the size has none
            raise self._refusal(f"{error}{remedy}") from error

    def _parsed(self, text: str, name: str, file: str | None) -> Any:
        """Return what a YAML text says, as roslaunch reads it.

        Args:
            text: it.
            name: of the parameter that has its value.
            file: the one that holds it; None: the launch file.
        """
        try:
            return _parse(text, name)
        except YamlError as error:
            line, column = error.place
            where = f"{file}:{line}:{column}" if file else f"line {line} of its YAML"
            raise self._refusal(f"{where}: {error.problem}") from error

    def _refusal(self, problem: str) -> LaunchContentError:
        """Return the error of what is being read."""
        file, element = self._place("")
        return LaunchContentError(file, f"{element}: {problem}" if file else problem)

    def _place(self, filename: str) -> tuple[str, str]:
        """Return the file and the element that is being read."""
        if self._at is None:
            return filename, "it"
        context, tag = self._at
        given = "".join(f' {name}="{value}"' for name, value in tag.attributes.items())
        return getattr(context, "filename", filename), shortened(f"<{tag.tagName}{given}>")


class _DocumentTypeError(Exception):
    """An XML file declares a document type."""


class _Builder(expatbuilder.ExpatBuilderNS):
    """minidom's builder, which refuses XML entities while it parses: they are declared in a document type."""

    def start_doctype_decl_handler(self, *_: object) -> None:
        raise _DocumentTypeError


def _content_error(error: BaseException | None) -> LaunchContentError | None:
    """Return the error of this module that roslaunch has put into one of its own; None: there is none."""
    while error is not None and not isinstance(error, LaunchContentError):
        error = error.__context__
    return error


def _typed(argument: str) -> Any:
    return roslaunch.loader.convert_value(argument, "auto")


def check_configuration(file: object, config: Any) -> None:
    """Check what roslaunch has made of a launch file.

    Raises:
        LaunchContentError: roslaunch warns of something, a node has no name, or its parameters hold too much.
    """
    if config.config_errors:
        text = str(config.config_errors[0]).removeprefix("WARN: ").removeprefix(f"[{file}] ")
        raise LaunchContentError(file, f"roslaunch warns of it, so it is not taken: {in_one_line(text)}: correct it")
    for node in config.nodes:
        if not node.name:  # roslaunch makes one up at each start
            raise LaunchContentError(file, f"a node of {node.package}/{node.type} has no name: give it one")
    left = MAX_VALUES  # a private parameter before nodes is that of each
    for name, parameter in config.params.items():
        left -= _size(parameter.value, left)
        if left < 0:
            raise LaunchContentError(
                file, f"its parameters up to {name} hold more than {MAX_VALUES} values: take some out"
            )


def in_one_line(text: str) -> str:
    """Return a message in one line; of an element that it shows, only the start."""
    line = " ".join(text.split())
    return _XML.sub(lambda element: f", in {shortened(element[1])}", line)


def shortened(text: str) -> str:
    """Return a text in one line, without its middle where it is long."""
    line = " ".join(text.split())
    half = _SHOWN // 2
    return line if len(line) <= _SHOWN else f"{line[:half]} ... {line[-half:]}"


def _size(value: Any, most: int) -> int:
    """Return how many values a value holds, or that they are more than the most."""
    count, rest = 0, [value]
    while rest and count <= most:
        item = rest.pop()
        count += 1
        rest += item.values() if isinstance(item, dict) else item if isinstance(item, (list, tuple, set)) else ()
    return count


def _parse(text: str, name: str) -> Any:
    """Return what a YAML text says, by PyYAML's safe loader, which roslaunch uses, without Python in angles.

    Raises:
        YamlError: it is no YAML, is too large, is nested or expanded too far, or has a key that is no text.
    """
    if len(text) > MAX_YAML:
        raise YamlError(f"{len(text)} characters are too many (at most {MAX_YAML}): make it smaller")
    try:
        loader = _YamlLoader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        _Measure().of(node, name)
        return loader.construct_document(node)
    except YamlError:
        raise
    except yaml.YAMLError as error:
        found = explained(error)
        raise YamlError(f"parameter {name}: roslaunch can't read it: {found.problem}", found.place) from error
    except Exception as error:  # whatever PyYAML's constructors make of dates, numbers and angles
        what = "nested too deep" if isinstance(error, RecursionError) else f"{type(error).__name__}: {error}"
        raise YamlError(f"parameter {name}: roslaunch can't read it: {what}: correct the YAML") from error


class _YamlLoader(yaml.SafeLoader):
    """PyYAML's safe loader, which computes the angles of rosparam: rosparam gives them to Python's `eval`.

    It refuses long numbers: the time that PyYAML takes for base 60 (`1:59:59`) grows with the square of their length.
    """

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Return what a node says."""
        if node.tag in _ANGLES and node.tag in self.yaml_constructors:  # rosparam adds them when it is imported
            return self._angle(node)
        if node.tag in _NUMBERS and len(node.value) > MAX_DIGITS:
            problem = f"a number has {len(node.value)} characters (at most {MAX_DIGITS})"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
        return super().construct_object(node, deep=deep)

    def _angle(self, node: Any) -> float:
        text = str(self.construct_scalar(node)).strip()
        kind = node.tag[1:]
        prefix, compute = _ANGLES[node.tag]
        try:
            return compute(text[len(prefix) : -1] if text.startswith(prefix) else text)
        except Exception as error:  # whatever an expression makes of its numbers
            problem = f"{text[:_SHOWN]!r} is no angle in {kind}: {type(error).__name__}: {error}"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark) from error


_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")
_ANGLES: dict[str, tuple[str, Callable[[str], float]]] = {
    "!radians": ("rad(", lambda text: float(evaluate(text, {"pi": math.pi}.__getitem__))),
    "!degrees": ("deg(", lambda text: float(text) * math.pi / 180.0),
}
"""How rosparam writes angles in YAML: how a text may begin, and the angle in radians of what follows."""


class _Measure:
    """Measures how much YAML nodes hold, aliases counted as often as they stand."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[int, int] | None] = {}  # by the node's id; None while it is measured

    def of(self, node: yaml.Node, name: str) -> tuple[int, int]:
        """Return the number of values of a node and all in it, and how deep they are nested.

        Raises:
            YamlError: there are too many, or a key is no text; names the parameter.
        """
        if id(node) in self._known:
            known = self._known[id(node)]
            if known is None:
                raise _wrong(node, name, "an alias stands within what it repeats: take it out")
            return known
        self._known[id(node)] = None
        values, depth = 1, 0
        for inner, item in _inner(node, name):
            more, deeper = self.of(item, inner)
            values, depth = values + more, max(depth, deeper)
            if values > MAX_VALUES:
                raise _wrong(item, inner, f"there are more than {MAX_VALUES} values: correct the aliases")
        if depth >= MAX_NESTING:
            raise _wrong(node, name, f"values are nested deeper than {MAX_NESTING} levels: correct them")
        self._known[id(node)] = values, depth + 1
        return values, depth + 1


def _inner(node: yaml.Node, name: str) -> Iterator[tuple[str, yaml.Node]]:
    """Yield what is in a node, each with the name of its parameter."""
    if isinstance(node, yaml.SequenceNode):
        yield from ((name, item) for item in node.value)
    elif isinstance(node, yaml.MappingNode):
        for key, item in node.value:
            if key.tag not in _TEXT_KEYS:
                shown = f"key {key.value}" if isinstance(key, yaml.ScalarNode) else "a key"
                kind = key.tag.rpartition(":")[2]
                raise _wrong(key, name, f"{shown} is no text, but of the type {kind}: put it in quotes")
            yield ns_join(name, key.value), item


def _wrong(node: yaml.Node, name: str, problem: str) -> YamlError:
    mark = node.start_mark
    return YamlError(f"parameter {name}: {problem}", (mark.line + 1, mark.column + 1))
