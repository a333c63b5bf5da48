"""The C++ sources of a program: their declarations, their calls, and the values of texts as far as the source tells."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from tree_sitter import Node

from ros_model_extraction.cpp.declarations import (
    Declared,
    File,
    Place,
    appended_text,
    declarations,
    is_in_branch,
    reset_pointer,
)
from ros_model_extraction.cpp.reachable_code import ReachableCode
from ros_model_extraction.cpp.syntax import (
    arguments_of,
    child_of,
    class_name,
    function_name,
    last_name,
    literal_text,
    parameters,
    text,
    type_text,
    walk,
)
from ros_model_extraction.python.values import Const, Hole, Text, joined

MAX_DEPTH = 16
MAX_VALUES = 16

_TEXT_TYPES = ("std::string", "string")
_KNOWN_TEXTS = {"ros::this_node::getName": "~", "ros::this_node::getNamespace": ""}
_SAME_TEXT = ("std::string", "string", "ros::names::resolve", "ros::names::remap", "ros::names::clean")
_INCLUDED_TYPE = re.compile(r'[<"]([a-z]\w*)/([A-Z]\w*)\.h[>"]')


@dataclass
class _Index:
    functions: dict[str, list[tuple[Node, Place]]] = field(default_factory=lambda: defaultdict(list))
    calls: dict[str, list[tuple[tuple[Node, ...], Place]]] = field(default_factory=lambda: defaultdict(list))
    globals: dict[str, list[Declared]] = field(default_factory=lambda: defaultdict(list))
    members: dict[tuple[str, str], list[Declared]] = field(default_factory=lambda: defaultdict(list))
    given: list[tuple[str, tuple[Node, ...], Place]] = field(default_factory=list)
    initialised: list[tuple[str, tuple[Node, ...], Place]] = field(default_factory=list)
    macros: dict[str, str] = field(default_factory=dict)
    numbers: dict[str, str] = field(default_factory=dict)
    namespace_aliases: dict[str, str] = field(default_factory=dict)
    namespaces: set[str] = field(default_factory=set)
    aliases: dict[tuple[str, str], str] = field(default_factory=dict)
    """By the class or file that declares it, and by name; under "" that of any."""
    constructors: dict[str, list[Node]] = field(default_factory=lambda: defaultdict(list))
    message_packages: dict[str, str] = field(default_factory=dict)
    defaults: dict[tuple[str, str, int], int] = field(default_factory=dict)
    """How many parameters have a default by a class's declaration, by class, name, and number of all."""


class Program:
    """The sources of an executable, with the headers of its package that they include.

    Attributes:
        fill_count: how many variables calls have filled so far; what is found may change with each.
    """

    def __init__(self, files: Sequence[File], nodelet: str = "") -> None:
        """Index the files: sources, then the headers that they include; `nodelet` is the class that is loaded."""
        self._files = files
        self._code = ReachableCode(files, nodelet)
        self._run: dict[int, bool] = {}
        self._passed: dict[tuple[int, str], list[tuple[Node, Place]]] = {}
        self._parameters: dict[int, dict[str, tuple[int, str, Node | None]]] = {}
        self._index = _Index()
        self._locals: dict[int, dict[str, list[Declared]]] = {}
        self._fills: dict[tuple[str, str], list[tuple[Node | str | None, Place, str]]] = defaultdict(list)
        self.fill_count = 0
        for file in reversed(files):  # headers, which declare, before the sources that include them
            self._index_file(file)
        for name, values, place in self._index.initialised:  # a base class, or a member of some class
            kinds = {declared.type for declared in self._index.members.get((place.owner, name), ())} - {""} or {name}
            for kind in kinds:
                self._index.calls[last_name(kind)].append((values, place))
        for home, alias in list(self._index.aliases):
            name = last_name(self.alias(alias))
            if not home and alias in self._index.calls and name != alias:
                self._index.calls[name] += self._index.calls[alias]
        for name, values, place in self._index.given:  # only now all declarations are known, wherever they stand
            if self.is_run(place):
                self._give(name, values, place)

    def expressions(self) -> Iterator[tuple[Node, Place]]:
        """Yield every node that can be run, with its place."""
        for file in self._files:
            yield from ((node, place) for node, place in self._walk(file.root, Place(file)) if self.is_run(place))

    def alias(self, type_name: str, place: Place | None = None) -> str:
        """Return a type with the names that `typedef` and `using` gave replaced by what they stand for.

        Args:
            type_name: the type.
            place: where it is named; several classes may give one name to different types.
        """
        homes = [place.owner, place.file.shown, ""] if place else [""]
        for _ in range(MAX_DEPTH):
            base, bracket, rest = type_name.partition("<")
            outer, _, name = base.rpartition("::")
            keys = [(class_name(outer), name)] if outer else [(home, base) for home in homes]
            known = next((self._index.aliases[key] for key in keys if key in self._index.aliases), None)
            if known is None:
                first, colons, rest = type_name.partition("::")
                return f"{self._index.namespace_aliases.get(first, first)}{colons}{rest}"
            type_name = known + bracket + rest
        return type_name

    def full_names(self, type_name: str) -> list[str]:
        """Return a type's names: as it is, and in each namespace that the sources use."""
        return [type_name, *(f"{namespace}::{type_name}" for namespace in sorted(self._index.namespaces))]

    def filled(self, name: str, place: Place) -> list[tuple[Node | str | None, Place]]:
        """Return the values that calls like `param(name, variable, value)` fill a variable with."""
        return [(value, at) for value, at, _ in self._filled(name.removeprefix("this->"), place)]

    def macro(self, name: str) -> str | None:
        """Return what a macro stands for that has no parameters and is no text; None for none."""
        return self._index.numbers.get(name)

    def message_package(self, name: str) -> str:
        """Return the package of a message that is named without it, by its header; "" for none, and for two."""
        return self._index.message_packages.get(name, "")

    def is_run(self, place: Place) -> bool:
        """Return whether the code at a place can be run: `main` reaches it, by calls that fit."""
        function = place.function
        if function is None:
            return self._code.has_class(place.owner)
        if function.id not in self._run:
            self._run[function.id] = self._code.has_function(function) and self._is_called(function)
        return self._run[function.id]

    def _is_called(self, function: Node) -> bool:
        """Return whether a function can be called: no constructor that fits no call, where another one does."""
        name = function_name(function).rpartition("::")[2]
        others = self._index.constructors.get(name, ())
        if function not in others or len(others) == 1:
            return True
        calls = self._index.calls.get(name, ())
        fitting = [one for one in others if any(self._takes(one, arguments, at) for arguments, at in calls)]
        return function in fitting or not fitting

    def function(self, name: str, owner: str = "") -> tuple[Node, Place] | None:
        """Return the definition of a function; the one in a class, where several have the name."""
        found = self._index.functions.get(name.rpartition("::")[2], [])
        wanted = name.rpartition("::")[0].rpartition("::")[2] or owner
        of_class = [entry for entry in found if entry[1].owner == wanted] or found
        defined = [entry for entry in of_class if entry[0].type == "function_definition"]
        return next(iter(defined or of_class), None)

    def note_fill(self, variable: Node, value: Node | str | None, place: Place, note: str) -> None:
        """Note that a call like `param(name, variable, value)` fills a variable."""
        owner = "" if self._is_local(text(variable), place) else place.owner
        self.fill_count += 1
        self._fills[owner or _key(place), text(variable)].append((value, place, note))

    def declared(self, name: str, place: Place) -> list[Declared]:
        """Return what a name may have been declared as: a local variable, a member, a global one."""
        plain = name.removeprefix("this->")
        if place.function is not None and (found := self._local(place).get(plain)):
            return found
        if place.owner and (found := self._index.members.get((place.owner, plain), [])):
            return found
        outer, _, inner = plain.replace("->", ".").rpartition(".")
        if outer and inner.isidentifier() and outer.count(".") < MAX_DEPTH:  # a member of an object
            kinds = {class_name(self.alias(one.type, one.place)) for one in self.declared(outer, place)}
            return [one for kind in sorted(kinds) for one in self._index.members.get((kind, inner), [])]
        return self._index.globals.get(plain.rpartition("::")[2], [])

    def texts(self, node: Node, place: Place, depth: int = 0) -> list[tuple[Const | Text, str]]:
        """Return the texts that an expression may be, each with a note ("" for none); unknown parts are holes."""
        unknown: list[tuple[Const | Text, str]] = [(Text((Hole(text(node)),)), "")]
        if depth > MAX_DEPTH:
            return unknown
        found = self._texts(node, place, depth)
        return found[:MAX_VALUES] if found else unknown

    def passed(self, name: str, place: Place, depth: int = 0) -> list[tuple[Node, Place]]:
        """Return what the calls of a function pass for one of its parameters.

        A call that only passes on what nobody passes to it is left out, where there are others.
        """
        if place.function is None or name not in self.parameters(place.function):
            return []
        key = place.function.id, name
        if key not in self._passed:
            self._passed[key] = []  # what is asked for while it is being found: a call of itself
            self._passed[key] = self._find_passed(name, place, depth)
        return self._passed[key]

    def parameters(self, function: Node) -> dict[str, tuple[int, str, Node | None]]:
        """Return place, type and default of a function's parameters by name."""
        if function.id not in self._parameters:
            self._parameters[function.id] = parameters(function)
        return self._parameters[function.id]

    def _find_passed(self, name: str, place: Place, depth: int) -> list[tuple[Node, Place]]:
        if place.function is None:
            return []
        index, _, default = self.parameters(place.function)[name]
        called = function_name(place.function).rpartition("::")[2]
        found = []
        for arguments, at in self._index.calls.get(called, ()):
            if not self._takes(place.function, arguments, at) or not self.is_run(at):
                continue
            if index < len(arguments):
                found.append((arguments[index], at))
            elif default is not None:
                found.append((default, place))
        given = [(argument, at) for argument, at in found if not self._is_never_passed(argument, at, depth + 1)]
        return given or found

    def _is_never_passed(self, argument: Node, at: Place, depth: int) -> bool:
        if depth > MAX_DEPTH or argument.type not in ("identifier", "type_identifier") or at.function is None:
            return False
        return text(argument) in self.parameters(at.function) and not self.passed(text(argument), at, depth)

    def _takes(self, function: Node, arguments: Sequence[Node], at: Place) -> bool:
        """Return whether a function may be what a call means, by the number of arguments, and by node handles."""
        known = sorted(self.parameters(function).values(), key=lambda parameter: parameter[0])
        owner, _, name = function_name(function).rpartition("::")
        defaults = self._index.defaults.get((class_name(owner), name, len(known)), 0)
        needed = len(known) - max(defaults, sum(default is not None for _, _, default in known))
        if not needed <= len(arguments) <= len(known):
            return False
        pairs = list(zip(arguments, known, strict=False))
        if any(kind in _TEXT_TYPES and _is_no_text(argument) for argument, (_, kind, _) in pairs):
            return False
        return all("NodeHandle" not in kind or self._may_be_handle(argument, at) for argument, (_, kind, _) in pairs)

    def _may_be_handle(self, argument: Node, at: Place) -> bool:
        name = text(argument).lstrip("*&")
        if "NodeHandle" in name or argument.type in ("number_literal", "string_literal"):
            return "NodeHandle" in name
        kinds = [self.alias(declared.type) for declared in self.declared(name, at)]
        if at.function is not None and name in (given := self.parameters(at.function)):
            kinds.append(given[name][1])
        return not kinds or any("NodeHandle" in kind or kind == "auto" for kind in kinds)

    # --- texts

    def _texts(self, node: Node, place: Place, depth: int) -> list[tuple[Const | Text, str]]:
        children = node.named_children
        found: list[tuple[Const | Text, str]] = []
        match node.type:
            case "string_literal":
                found = [(Const(literal_text(text(node))), "")]
            case "concatenated_string":
                found = [(Const("".join(literal_text(text(child)) for child in children)), "")]
            case "raw_string_literal":
                found = [(Const("".join(text(n) for n in children if n.type == "raw_string_content")), "")]
            case "number_literal" | "true" | "false":
                found = [(Const(text(node)), "")]
            case "parenthesized_expression" | "initializer_list" if len(children) == 1:
                found = self.texts(children[0], place, depth + 1)
            case "binary_expression" if text(node.child_by_field_name("operator")) == "+":
                left, right = (self.texts(child_of(node, side), place, depth + 1) for side in ("left", "right"))
                found = [
                    (joined([as_text(one), as_text(two)]), note or other) for one, note in left for two, other in right
                ]
            case "call_expression":
                found = self._called_text(node, place, depth)
            case "qualified_identifier" if text(node) in _KNOWN_TEXTS:  # `Type name(call());` looks like a function
                found = [(Const(_KNOWN_TEXTS[text(node)]), "")]
            case "identifier" | "field_expression" | "qualified_identifier" | "field_identifier" | "type_identifier":
                found = self._variable_texts(node, place, depth)
        return found

    def _called_text(self, node: Node, place: Place, depth: int) -> list[tuple[Const | Text, str]]:
        function, arguments = child_of(node, "function"), arguments_of(node)
        name = text(function)
        if name in _KNOWN_TEXTS:
            return [(Const(_KNOWN_TEXTS[name]), "")]
        if name in _SAME_TEXT and len(arguments) == 1:
            return self.texts(arguments[0], place, depth + 1)
        if function.type == "field_expression" and (found := self._method_text(function, arguments, place, depth)):
            return found
        if definition := self.function(name, place.owner):
            body = definition[0].child_by_field_name("body")
            returned = [n for n in walk(body) if n.type == "return_statement" and n.named_child_count] if body else []
            if len(returned) == 1:
                return self.texts(returned[0].named_children[0], definition[1], depth + 1)
        return []

    def _method_text(
        self, function: Node, arguments: Sequence[Node], place: Place, depth: int
    ) -> list[tuple[Const | Text, str]]:
        method = text(child_of(function, "field")).partition("<")[0]
        if method in ("c_str", "str") and not arguments:
            return self.texts(child_of(function, "argument"), place, depth + 1)
        if method == "resolveName" and arguments:
            return self.texts(arguments[0], place, depth + 1)
        if method == "param" and len(arguments) == 2:
            note = f"the default of the parameter {text(arguments[0])}"
            return [(value, note) for value, _ in self.texts(arguments[1], place, depth + 1)]
        return []

    def _variable_texts(self, node: Node, place: Place, depth: int) -> list[tuple[Const | Text, str]]:
        name = text(node).removeprefix("this->")
        last = name.rpartition("::")[2]
        found: list[tuple[Const | Text, str]] = []
        if last in self._index.macros:
            return [(Const(self._index.macros[last]), "")]
        for value, at, note in self._filled(name, place):
            if isinstance(value, str):
                found.append((Const(value), ""))
            elif value is not None:
                found += [(known, note) for known, _ in self.texts(value, at, depth + 1)]
            else:
                found.append((Text((Hole(name),)), ""))
        if found:
            return found
        for declared in self.declared(name, place):
            if len(declared.values) == 1:
                found += self.texts(declared.values[0], declared.place, depth + 1)
        if not found:
            for argument, at in self.passed(name, place):
                found += self.texts(argument, at, depth + 1)
        return self._appended(node, found, place, depth) if self._is_local(name, place) else found

    def _appended(
        self, use: Node, found: list[tuple[Const | Text, str]], place: Place, depth: int
    ) -> list[tuple[Const | Text, str]]:
        """Return the texts that a local variable may be after what the function appends to it before its use."""
        for node in walk(place.function):
            if node.start_byte >= use.start_byte:
                break
            given = appended_text(node)
            if given is None or given[0] != text(use):
                continue
            more = self.texts(given[1], place, depth + 1)
            longer = [
                (joined([as_text(one), as_text(two)]), note or other) for one, note in found for two, other in more
            ]
            found = [*found, *longer] if is_in_branch(node, use) else longer
        return found

    def _filled(self, name: str, place: Place) -> list[tuple[Node | str | None, Place, str]]:
        keys = (_key(place), place.owner)
        return next((self._fills[key, name] for key in keys if key and (key, name) in self._fills), [])

    # --- the index

    def _index_file(self, file: File) -> None:
        for node, place in self._walk(file.root, Place(file)):
            match node.type:
                case "function_definition":
                    name = function_name(node).rpartition("::")[2]
                    self._index.functions[name].append((node, place))
                    if name == place.owner:
                        self._index.constructors[name].append(node)
                    self._initialised(node, place)
                case "preproc_include":
                    if match := _INCLUDED_TYPE.fullmatch(text(child_of(node, "path"))):
                        known = self._index.message_packages.setdefault(match[2], match[1])
                        self._index.message_packages[match[2]] = match[1] if known == match[1] else ""
                case "preproc_def":
                    self._index_macro(text(child_of(node, "name")), text(node.child_by_field_name("value")).strip())
                case "namespace_alias_definition" | "using_declaration" | "type_definition" | "alias_declaration":
                    self._index_name(node, place)
                case "declaration" | "field_declaration":
                    self._index_declaration(node, place)
                case "call_expression" | "new_expression":
                    self._index_call(node, place)
                case "assignment_expression" if text(node.child_by_field_name("operator")) == "=":
                    self._index.given.append((text(child_of(node, "left")), (child_of(node, "right"),), place))

    def _index_name(self, node: Node, place: Place) -> None:
        """Note a name that the code gives to a namespace or type, or a namespace whose names it uses."""
        if node.type == "namespace_alias_definition":
            first, *_, last = node.named_children
            self._index.namespace_aliases[text(first)] = text(last)
        elif node.type == "using_declaration":
            if text(node).startswith("using namespace"):
                self._index.namespaces.add(text(node.named_children[-1]))
        else:
            declarator = node.child_by_field_name("declarator") or node.child_by_field_name("name")
            for home in (place.owner or place.file.shown, ""):
                self._index.aliases[home, text(declarator)] = type_text(child_of(node, "type"))

    def _index_call(self, node: Node, place: Place) -> None:
        if reset := reset_pointer(node):
            self._index.given.append((*reset, place))
        name = text(node.child_by_field_name("function") or node.child_by_field_name("type"))
        made = re.match(r"(?:\w+::)*make_(?:shared|unique)<(.*)>$", name)
        arguments = tuple(arguments_of(node))
        self._index.calls[last_name(made[1] if made else name)].append((arguments, place))

    def _index_macro(self, name: str, value: str) -> None:
        if value.startswith('"') and value.endswith('"') and len(value) > 1:
            self._index.macros[name] = literal_text(value)
        elif value:
            self._index.numbers[name] = value

    def _index_declaration(self, node: Node, place: Place) -> None:
        if name := function_name(node):
            self._index.functions[name.rpartition("::")[2]].append((node, place))
            known = parameters(node).values()
            count = sum(default is not None for _, _, default in known)
            self._index.defaults[place.owner, name.rpartition("::")[2], len(known)] = count
        for name, declared in declarations(node, place):
            if place.function is None and place.owner:
                self._index.members[place.owner, name].append(declared)
            elif place.function is None:
                self._index.globals[name].append(declared)
            self._index.calls[last_name(declared.type)].append((declared.values, place))

    def _initialised(self, function: Node, place: Place) -> None:
        """Note what a constructor's initialisers give the members."""
        for node in function.named_children:
            if node.type != "field_initializer_list":
                continue
            for initialiser in node.named_children:
                if initialiser.type != "field_initializer" or not initialiser.named_children:
                    continue
                name = f"this->{text(initialiser.named_children[0])}"
                values = tuple(initialiser.named_children[-1].named_children)
                at = Place(place.file, function, place.owner)
                self._index.given.append((name, values, at))
                self._index.initialised.append((name.removeprefix("this->"), values, at))

    def _give(self, name: str, values: tuple[Node, ...], place: Place) -> None:
        """Note what a member or a global variable is given outside its declaration."""
        plain = name.removeprefix("this->")
        if plain == name and self._is_local(name, place):
            return
        if place.owner and ((place.owner, plain) in self._index.members or plain not in self._index.globals):
            known = self._index.members[place.owner, plain]
        elif plain in self._index.globals:
            known = self._index.globals[plain]
        else:
            return
        kind = known[0].type if known else ""
        known[:] = [*(declared for declared in known if declared.values), Declared(kind, values, place)]

    def _walk(self, root: Node, start: Place) -> Iterator[tuple[Node, Place]]:
        todo = [(root, start)]
        while todo:
            node, place = todo.pop()
            inner = place
            if node.type == "function_definition":
                name = function_name(node)
                owner = class_name(name.rpartition("::")[0]) or place.owner
                inner = Place(place.file, node, owner)
                place = Place(place.file, place.function, owner)
            elif node.type in ("class_specifier", "struct_specifier") and node.child_by_field_name("body"):
                inner = Place(place.file, None, class_name(text(node.child_by_field_name("name"))))
            yield node, inner if node.type == "function_definition" else place
            todo += [(child, inner) for child in reversed(node.named_children)]

    def _local(self, place: Place) -> dict[str, list[Declared]]:
        function = place.function
        if function is None:
            return {}
        if function.id not in self._locals:
            found: dict[str, list[Declared]] = defaultdict(list)
            for node in walk(function):
                if node.type == "declaration":
                    for name, declared in declarations(node, place):
                        found[name].append(declared)
                    continue
                given = reset_pointer(node)
                if node.type == "assignment_expression" and text(node.child_by_field_name("operator")) == "=":
                    given = text(child_of(node, "left")), (child_of(node, "right"),)
                whole = given[0].partition("[")[0] if given else ""  # an array, for one of its items
                if given and whole in found:
                    kept = [declared for declared in found.get(given[0], ()) if declared.values]
                    found[given[0]] = [*kept, Declared(found[whole][0].type, given[1], place)]
            self._locals[function.id] = dict(found)
        return self._locals[function.id]

    def _is_local(self, name: str, place: Place) -> bool:
        return place.function is not None and (name in self._local(place) or name in self.parameters(place.function))


def _is_no_text(argument: Node) -> bool:
    return argument.type in ("new_expression", "null", "number_literal") or text(argument) in ("NULL", "nullptr")


def _key(place: Place) -> str:
    return f"{place.file.shown}:{place.function.start_byte}" if place.function is not None else ""


def as_text(value: Const | Text) -> Text:
    """Return a value as a text."""
    return value if isinstance(value, Text) else Text((str(value.value),))
