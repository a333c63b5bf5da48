"""roscpp nodes from their source."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ros_model.language.metamodel import PortKind, Position
from tree_sitter import Node

from ros_model_extraction.cpp.constants import Constants
from ros_model_extraction.cpp.declarations import File, Place
from ros_model_extraction.cpp.handles import Handles, in_namespace
from ros_model_extraction.cpp.program import Program
from ros_model_extraction.cpp.syntax import (
    arguments_of,
    child_of,
    literal_text,
    parameter_types,
    parameters,
    template_arguments,
    text,
    type_text,
    walk,
)
from ros_model_extraction.node_facts import (
    Configurations,
    FoundParameter,
    FoundPort,
    LoadedNodelet,
    NodeSource,
    Remark,
    unique,
    unresolved,
)
from ros_model_extraction.python.values import Const, Text
from ros_model_extraction.ros_api import CPP_BELOW, CPP_FIXED, NODELET_MANAGER, RECONFIGURE_SERVER, Below

Name = Const | Text

_ACTIONS = {
    "actionlib::SimpleActionServer": PortKind.ACTION_SERVER,
    "actionlib::ActionServer": PortKind.ACTION_SERVER,
    "actionlib::SimpleActionClient": PortKind.ACTION_CLIENT,
    "actionlib::ActionClient": PortKind.ACTION_CLIENT,
}
_KINDS = {
    **dict.fromkeys(("double", "float"), "Double"),
    **dict.fromkeys(("int", "unsigned", "unsignedint", "long", "size_t", "int32_t", "uint32_t", "int64_t"), "Integer"),
    "bool": "Boolean",
    "string": "String",
}
_LOADER = "nodelet::Loader"
_LOADERS = ("pluginlib::ClassLoader", _LOADER)
_FILTER_CHAINS = ("filters::FilterChain", "filters::MultiChannelFilterChain")
_HANDLE_AND_NAME = {
    "message_filters::Subscriber": PortKind.SUBSCRIBER,
    "realtime_tools::RealtimePublisher": PortKind.PUBLISHER,
}
_KNOWN = {*_LOADERS, *CPP_FIXED, *CPP_BELOW, *_ACTIONS, *_HANDLE_AND_NAME, "dynamic_reconfigure::Server"}
_METHODS = ("advertise", "subscribe", "advertiseService", "serviceClient", "advertiseCamera", "subscribeCamera")
_OPTIONS = {  # the class whose `create` makes what may be given to a method alone
    "advertise": (PortKind.PUBLISHER, "AdvertiseOptions"),
    "subscribe": (PortKind.SUBSCRIBER, "SubscribeOptions"),
    "advertiseService": (PortKind.SERVICE_SERVER, "AdvertiseServiceOptions"),
    "serviceClient": (PortKind.SERVICE_CLIENT, "ServiceClientOptions"),
}
_GETTERS = {"param": 2, "getParam": 1, "getParamCached": 1, "hasParam": 1}
_FREE_GETTERS = {"ros::param::get": 1, "ros::param::getCached": 1, "ros::param::param": 2, "ros::param::has": 1}
_TYPE_NAME = r"(?P<name>[A-Z]\w*?)_?(?:::(?:Const)?Ptr|::Request|::Response|(?:Const)?Ptr)?"
_TYPE = re.compile(rf"(?P<package>[a-z]\w*)::{_TYPE_NAME}")
_NO_PACKAGES = ("ros", "std", "boost")
_PLAIN_TYPE = re.compile(_TYPE_NAME)
_POINTER = re.compile(r"(?:boost|std)::shared_ptr<(.*)>|ros::MessageEvent<(.*)>")
_IMAGE = "sensor_msgs/Image"
_CAMERA_INFO = "sensor_msgs/CameraInfo"


@dataclass(frozen=True)
class Entry:
    """Where a node's code starts, and what its package adds.

    Attributes:
        nodelet: the class that is loaded, with its namespaces; "" for a program, which starts at `main`.
        configurations: the parameters of dynamic_reconfigure by the name of the class that is generated.
    """

    nodelet: str = ""
    configurations: Configurations = field(default_factory=dict)


PROGRAM = Entry()


def node_of(
    files: Sequence[File],
    remarks: Iterable[Remark] = (),
    parameters: Callable[[str], Any] | None = None,
    entry: Entry = PROGRAM,
) -> NodeSource:
    """Return what C++ sources make of a node, as far as `main` or the class of a nodelet can reach them.

    Args:
        files: the sources, then the headers that they include.
        remarks: what is to be said of the files.
        parameters: the value of a parameter by its name as the code has it, or KeyError; without it, defaults count.
        entry: where its code starts.
    """
    program = Program(files, entry.nodelet)
    reader = _Reader(program, parameters, entry.configurations)
    nodes = list(program.expressions())
    for node, place in nodes:  # first what parameters fill variables with, which names may depend on
        if node.type == "call_expression":
            reader.parameter(node, place)
    for node, place in nodes:
        reader.read(node, place)
    said = unique([*remarks, *reader.remarks])
    return NodeSource(
        reader.node_name,
        tuple(reader.ports),
        tuple(reader.parameters),
        said,
        reader.position,
        tuple(reader.nodelets),
    )


class _Reader:
    """Keeps what the calls and declarations of ROS make."""

    def __init__(
        self, program: Program, parameters: Callable[[str], Any] | None, configurations: Configurations
    ) -> None:
        self.ports: list[FoundPort] = []
        self.parameters: list[FoundParameter] = []
        self.remarks: list[Remark] = []
        self.nodelets: list[LoadedNodelet] = []
        self.node_name = ""
        self.position = Position()
        self._program = program
        self._handles = Handles(program)
        self._constants = Constants(program)
        self._values = parameters
        self._configurations = configurations

    def read(self, node: Node, place: Place) -> None:
        """Look at a node: a call, or the declaration of an object."""
        if node.type == "call_expression":
            self._call(node, place)
        elif node.type in ("declaration", "field_declaration"):
            self._declaration(node, place)
        elif node.type == "new_expression":
            self._object(type_text(node.child_by_field_name("type")), arguments_of(node), node, place)
        elif node.type == "field_initializer" and node.named_child_count > 1:
            name, given = node.named_children[0], node.named_children[-1]
            kinds = {declared.type for declared in self._program.declared(text(name), place)}
            for kind in kinds - {""} if not _is_null(given.named_children) else ():
                self._object(kind, list(given.named_children), node, place)

    # --- parameters

    def parameter(self, node: Node, place: Place) -> None:
        """Look whether a call reads a parameter."""
        function, arguments = node.child_by_field_name("function"), arguments_of(node)
        if function is None or not arguments:
            return
        name = text(function).partition("<")[0].strip()
        if name in _FREE_GETTERS:
            handles: list[Name] = [Const("")]
            default_at, is_filling = _FREE_GETTERS[name], name != "ros::param::has"
        elif function.type == "field_expression":
            method = text(function.child_by_field_name("field")).partition("<")[0].strip()
            if method not in _GETTERS or arguments[0].type == "lambda_expression":
                return
            owner = function.child_by_field_name("argument")
            handles = self._handles.of(owner, place)
            default_at, is_filling = _GETTERS[method], method != "hasParam"
        else:
            return
        default: Node | None
        variable: Node | None
        if len(arguments) == 2 and default_at == 2:  # the default comes second, and the value is returned
            variable, default = None, arguments[1]
        else:
            default = arguments[2] if default_at == 2 and len(arguments) > 2 else None
            variable = arguments[1] if is_filling and len(arguments) > 1 else None
        position = place.file.position(node)
        kind = self._kind(text(function), variable, place)
        value = self._constants.of(default if default is not None else _otherwise(node, variable), place)
        for namespace in handles:
            for key, _ in self._program.texts(arguments[0], place):
                if key == Const(""):  # all of a namespace, or a name that is found at run time
                    continue
                shown = self._name("parameter", in_namespace(namespace, key), position)
                self.parameters.append(FoundParameter(shown, value, position, kind))
        if variable is not None:
            note = f"the default of the parameter {text(arguments[0])}"
            self._program.note_fill(variable, self._given(handles, arguments[0], place) or default, place, note)

    def _kind(self, called: str, variable: Node | None, place: Place) -> str:
        """Return the kind of a parameter, by the template argument of the call or by the variable that it fills."""
        kinds = template_arguments(called.replace(" ", ""))
        if variable is not None:
            kinds += [
                self._program.alias(declared.type, declared.place)
                for declared in self._program.declared(text(variable), place)
            ]
        known = (_KINDS.get(kind.removeprefix("std::"), "") for kind in kinds)
        return next((kind for kind in known if kind), "")

    def _given(self, handles: Sequence[Name], name: Node, place: Place) -> str | None:
        """Return the value of a parameter, where values are given and it is a text."""
        for namespace in handles if self._values else ():
            for key, _ in self._program.texts(name, place):
                full = in_namespace(namespace, key)
                if self._values and isinstance(full, Const):
                    try:
                        value = self._values(str(full.value))
                    except KeyError:
                        continue
                    return value if isinstance(value, str) else None
        return None

    # --- interfaces

    def _call(self, node: Node, place: Place) -> None:
        function, arguments = node.child_by_field_name("function"), arguments_of(node)
        if function is None:
            return
        name = text(function)
        plain = name.partition("<")[0].strip()
        if plain == "ros::init" and len(arguments) > 2:
            self._node(arguments[2], node, place)
        elif plain == "ros::topic::waitForMessage" and arguments:
            kind = self._template(name)
            self._port(PortKind.SUBSCRIBER, [Const("")], arguments[0], kind, node, place)
        elif plain in ("ros::service::call", "ros::service::createClient") and arguments:
            kind = self._template(name) or self._of_variable(arguments[1:], place)
            self._port(PortKind.SERVICE_CLIENT, [Const("")], arguments[0], kind, node, place)
        elif plain.endswith(("make_shared", "make_unique")):
            for made in template_arguments(name.replace(" ", "")):
                self._object(made, arguments, node, place)
        elif function.type == "field_expression" and arguments:
            owner = function.child_by_field_name("argument")
            method = text(function.child_by_field_name("field"))
            if owner is not None:
                self._method(owner, method, arguments, node, place)

    def _method(self, owner: Node, method: str, arguments: list[Node], node: Node, place: Place) -> None:
        name = method.partition("<")[0].strip()
        if name == "load" and len(arguments) > 1:
            self._loaded(owner, arguments, node, place)
        if name == "configure" and arguments:
            self._filter_chain(owner, arguments, node, place)
        if name not in _METHODS:
            return
        kinds = {
            self._program.alias(declared.type, declared.place)
            for declared in self._program.declared(text(owner), place)
        }
        if any("ImageTransport" in kind for kind in kinds) or text(owner).startswith(
            "image_transport::ImageTransport("
        ):
            self._image(name, owner, arguments, node, place)
            return
        if any("message_filters::Subscriber" in kind for kind in kinds) and name == "subscribe":
            if len(arguments) > 1:
                types = [template_arguments(kind)[0] for kind in kinds if template_arguments(kind)]
                handles = self._handles.of(arguments[0], place)
                self._port(PortKind.SUBSCRIBER, handles, arguments[1], self._type(types[0]), node, place)
            return
        if any("SubscriberFilter" in kind for kind in kinds) and name == "subscribe" and len(arguments) > 1:
            self._image(name, arguments[0], arguments[1:], node, place)
            return
        handles = self._handles.of(owner, place)
        if (
            name in _OPTIONS
            and len(arguments) == 1
            and "<" not in method
            and self._options(name, handles, arguments[0], place)
        ):
            return
        if name == "advertise":
            self._port(PortKind.PUBLISHER, handles, arguments[0], self._template(method), node, place)
        elif name == "serviceClient":
            self._port(PortKind.SERVICE_CLIENT, handles, arguments[0], self._template(method), node, place)
        elif name == "subscribe":
            kind = self._template(method) or self._of_callback(arguments[1:], place)
            self._port(PortKind.SUBSCRIBER, handles, arguments[0], kind, node, place)
        elif name == "advertiseService":
            kind = self._template(method) or self._of_callback(arguments[1:], place)
            self._port(PortKind.SERVICE_SERVER, handles, arguments[0], kind, node, place)

    def _loaded(self, owner: Node, arguments: list[Node], node: Node, place: Place) -> None:
        """Look at `loader.load(name, "package/Class", remappings, arguments)`."""
        kinds = {self._program.alias(d.type) for d in self._program.declared(text(owner), place)}
        if place.function is not None and text(owner) in (given := parameters(place.function)):
            kinds.add(given[text(owner)][1])
        if _LOADER not in kinds:
            return
        position = place.file.position(node)
        for number, (name, _) in enumerate(self._program.texts(arguments[0], place)):
            remappings = self._remappings(arguments[2], node, place, number) if len(arguments) > len("ab") else {}
            shown = str(name.value) if isinstance(name, Const) else str(name)
            if shown.startswith("~") and len(shown) > 1:  # the node's own name, and more
                shown = f"{{ros::this_node::getName()}}{shown[1:]}"
            for loaded, _ in self._program.texts(arguments[1], place):
                if isinstance(loaded, Const):
                    self.nodelets.append(LoadedNodelet(shown, str(loaded.value), remappings, position))

    def _filter_chain(self, owner: Node, arguments: list[Node], node: Node, place: Place) -> None:
        """Look at `chain.configure(name, node_handle)`: it reads the filters from a parameter."""
        kinds = (self._program.alias(d.type, d.place) for d in self._program.declared(text(owner), place))
        if not any(kind.partition("<")[0] in _FILTER_CHAINS for kind in kinds):
            return
        position = place.file.position(node)
        for namespace in self._handles.of(arguments[1] if len(arguments) > 1 else None, place):
            for name, _ in self._program.texts(arguments[0], place):
                shown = self._name("parameter", in_namespace(namespace, name), position)
                ends = ["", "/filter_chain"] if isinstance(name, Const) and name.value else ["/filter_chain"]
                self.parameters += [FoundParameter(f"{shown}{end}", None, position) for end in ends]

    def _remappings(self, given: Node, call: Node, place: Place, number: int) -> dict[str, str]:
        """Return what a map of remappings holds at a call, as its function fills it before.

        Args:
            given: the map.
            call: where it is given.
            place: of the call.
            number: of the call of the function, where it is called several times with other texts.
        """
        found: dict[str, str] = {}
        for node in walk(place.function):
            if node.start_byte >= call.start_byte:
                break
            if node.type == "call_expression" and text(node.child_by_field_name("function")) == f"{text(given)}.clear":
                found = {}
            left = node.child_by_field_name("left") if node.type == "assignment_expression" else None
            if left is None or left.type != "subscript_expression" or text(child_of(left, "argument")) != text(given):
                continue
            inside = [n for n in walk(left) if n.type == "string_literal"]
            values = self._program.texts(child_of(node, "right"), place)
            if len(inside) == 1 and values:
                value = values[number if number < len(values) else 0][0]
                shown = (
                    str(value.value) if isinstance(value, Const) else unresolved(str(value), place.file.position(node))
                )
                found[literal_text(text(inside[0]))] = shown
        return found

    def _options(self, method: str, handles: list[Name], given: Node, place: Place) -> bool:
        """Look at a method that is given options alone; return whether what they are made with is known."""
        kind, options = _OPTIONS[method]
        made = [(given, place)]
        if given.type != "call_expression":
            made = [(d.values[0], d.place) for d in self._program.declared(text(given), place) if len(d.values) == 1]
        is_known = False
        for value, at in made:
            function, arguments = value.child_by_field_name("function"), arguments_of(value)
            name = text(function)
            if function is not None and name.startswith(f"ros::{options}::create") and arguments:
                type_name = self._template(name) or self._of_callback(arguments[1:], at)
                self._port(kind, handles, arguments[0], type_name, value, at)
                is_known = True
        return is_known

    def _image(self, name: str, owner: Node, arguments: list[Node], node: Node, place: Place) -> None:
        """Ports of image_transport; those of its plug-ins (`image/compressed`) depend on what is installed."""
        kind = PortKind.PUBLISHER if name.startswith("advertise") else PortKind.SUBSCRIBER
        handles: list[Name] = []
        for declared in self._program.declared(text(owner), place):
            handles += self._handles.of(declared.values[0] if declared.values else owner, declared.place)
        handles = handles or self._handles.of(owner, place)
        self._port(kind, handles, arguments[0], _IMAGE, node, place)
        if name.endswith("Camera"):
            for namespace in handles:
                for topic, _ in self._program.texts(arguments[0], place):
                    base = in_namespace(namespace, topic)
                    if isinstance(base, Const):
                        before, between, _ = str(base.value).rpartition("/")
                        start = "~" if not before and str(base.value).startswith("~") else f"{before}{between}"
                        info = f"{start}camera_info"
                        self.ports.append(FoundPort(kind, info, _CAMERA_INFO, place.file.position(node)))

    def _declaration(self, node: Node, place: Place) -> None:
        kind = type_text(node.child_by_field_name("type"))
        for declarator in node.children_by_field_name("declarator"):
            name = text(declarator.child_by_field_name("declarator") or declarator).lstrip("*& ")
            if not name or "*" in text(declarator).partition(name)[0]:
                continue  # a pointer: what it points to is made elsewhere
            own = [d for d in self._program.declared(name, place) if d.place.file is place.file and d.type == kind]
            values = next((list(d.values) for d in own if d.values), [])
            is_member = node.type == "field_declaration" and place.function is None
            self._object(kind, values, node, place, is_member=is_member)

    def _object(
        self, type_name: str, arguments: list[Node], node: Node, place: Place, *, is_member: bool = False
    ) -> None:
        """Look at an object that is made: some of them are interfaces."""
        kind = self._program.alias(type_name, place)
        bases = self._program.full_names(kind.partition("<")[0])
        base = next((name for name in bases if name in _KNOWN), bases[0])
        position = place.file.position(node)
        if base in _LOADERS and node.type != "field_initializer":
            said = f"of the classes that {base} loads, only those of this package count that a text in its source names"
            self.remarks.append(Remark(position, said))
            if base == _LOADER and not (arguments and text(arguments[0]) == "false"):
                self._add([FoundPort(made.kind, made.name, made.type, position) for made in NODELET_MANAGER])
        elif base in CPP_FIXED:
            self._add([FoundPort(made.kind, made.name, made.type, position) for made in CPP_FIXED[base]])
        elif base in _ACTIONS and arguments and not is_member:
            handles, rest = self._leading_handle(arguments, place)
            if rest:
                self._port(_ACTIONS[base], handles, rest[0], self._template(kind), node, place)
        elif base in _HANDLE_AND_NAME and len(arguments) > 1 and not is_member and text(arguments[1]) != '""':
            handles = self._handles.of(arguments[0], place)
            self._port(_HANDLE_AND_NAME[base], handles, arguments[1], self._template(kind), node, place)
        elif base in CPP_BELOW and not (is_member and arguments):
            self._below(CPP_BELOW[base], arguments, node, place)
        elif base == "dynamic_reconfigure::Server" and kind.endswith(">") and not (is_member and arguments):
            handles = [Const("~")]
            if arguments and self._handles.of(arguments[-1], place):
                handles = self._handles.of(arguments[-1], place)
            for namespace in handles:
                for made in RECONFIGURE_SERVER:
                    shown = self._name(made.kind.value, in_namespace(namespace, Const(made.name)), position)
                    self._add([FoundPort(made.kind, shown, made.type, position)])
                self._reconfigurable(kind, namespace, position, place)

    def _reconfigurable(self, server: str, namespace: Name, position: Position, place: Place) -> None:
        """Add the parameters of a server of dynamic_reconfigure, which the package's `.cfg` file lists."""
        name = self._program.alias(template_arguments(server)[0], place).rpartition("::")[2]
        if name not in self._configurations:
            self.remarks.append(Remark(position, f"the parameters of {name} are not known: its .cfg is elsewhere"))
        for found in self._configurations.get(name, ()):
            shown = self._name("parameter", in_namespace(namespace, Const(found.name)), position)
            self.parameters.append(replace(found, name=shown))

    def _below(self, below: Below, arguments: list[Node], node: Node, place: Place) -> None:
        """Look at an object that makes interfaces below a namespace."""
        position = place.file.position(node)
        handle = arguments[below.handle] if below.handle is not None and below.handle < len(arguments) else None
        given = arguments[below.name] if below.name is not None and below.name < len(arguments) else None
        names = [value for value, _ in self._program.texts(given, place)] if given is not None else [Const("")]
        for namespace in self._handles.of(handle, place):
            for name in names:
                for made in below.made:
                    inner = "/".join(part for part in (below.inner, made.name) if part)
                    full = in_namespace(namespace, in_namespace(name, Const(inner)))
                    shown = self._name(made.kind.value, full, position)
                    self._add([FoundPort(made.kind, shown, made.type, position)])

    def _leading_handle(self, arguments: list[Node], place: Place) -> tuple[list[Name], list[Node]]:
        """Take a node handle off the front of a constructor's arguments."""
        first = arguments[0]
        if first.type in ("string_literal", "concatenated_string", "binary_expression"):
            return [Const("")], arguments
        kinds = {declared.type for declared in self._program.declared(text(first).lstrip("*&"), place)}
        if len(arguments) > 1 and (any("NodeHandle" in k for k in kinds) or arguments[1].type == "string_literal"):
            return self._handles.of(first, place), arguments[1:]
        return [Const("")], arguments

    def _port(self, kind: PortKind, handles: list[Name], name: Node, type_name: str, node: Node, place: Place) -> None:
        position = place.file.position(node)
        for namespace in handles:
            for value, note in self._program.texts(name, place):
                shown = self._name(kind.value, in_namespace(namespace, value), position)
                if note:
                    self.remarks.append(Remark(position, f"{kind.value} {shown}: {note}"))
                self._add([FoundPort(kind, shown, type_name, position)])
        if not type_name:
            self.remarks.append(Remark(position, f"{kind.value}: its type is not known: {text(node)[:60]}"))

    def _add(self, ports: Sequence[FoundPort]) -> None:
        self.ports += [port for port in ports if port not in self.ports]

    def _name(self, what: str, value: Name, position: Position) -> str:
        shown = str(value) if isinstance(value, Text) else str(value.value)
        shown = f"~{shown[2:]}" if shown.startswith("~/") else shown
        if isinstance(value, Const):
            return shown
        self.remarks.append(Remark(position, f"{what}: its name is not known: {shown}"))
        return unresolved(shown, position)

    def _node(self, name: Node, node: Node, place: Place) -> None:
        self.position = place.file.position(node)
        for value, _ in self._program.texts(name, place)[:1]:
            if isinstance(value, Const):
                self.node_name = str(value.value)
            else:
                self.node_name = "{}"
                self.remarks.append(Remark(self.position, f"the node's own name is not known: {value}"))

    # --- types

    def _template(self, method: str) -> str:
        given = template_arguments(method.replace(" ", ""))
        return self._type(given[0]) if given else ""

    def _type(self, name: str) -> str:
        """Return `package/Type` of a message's class, of a pointer to one, of a service's request."""
        name = self._program.alias(re.sub(r"\bconst\b|[\s&*]", "", name))
        if match := _POINTER.fullmatch(name):
            return self._type(match[1] or match[2])
        match = _TYPE.fullmatch(name)
        if match and match["package"] not in _NO_PACKAGES:
            return f"{match['package']}/{match['name']}"
        match = _PLAIN_TYPE.fullmatch(name)
        package = self._program.message_package(match["name"]) if match else ""
        return f"{package}/{match['name']}" if match and package else ""

    def _of_variable(self, arguments: Sequence[Node], place: Place) -> str:
        """Return the type that the first of some arguments, a variable, is declared with."""
        declared = self._program.declared(text(arguments[0]), place) if arguments else []
        return next((found for found in (self._type(d.type) for d in declared) if found), "")

    def _of_callback(self, arguments: list[Node], place: Place) -> str:
        """Return the type that a callback takes, from its definition."""
        for argument in arguments:
            for function in self._callbacks(argument, place):
                for kind in parameter_types(function):
                    if found := self._type(kind):
                        return found
        return ""

    def _callbacks(self, argument: Node, place: Place) -> Iterator[Node]:
        inner = argument.named_children[0] if argument.type == "unary_expression" else argument
        if inner.type == "lambda_expression":
            yield inner
            return
        shown = re.sub(r"<[^<>]*>", "", text(argument))
        names = re.findall(r"(?:\w+::)*\w+", shown)
        for name in names if argument.type == "call_expression" else names[:1]:
            if found := self._program.function(name, place.owner):
                yield found[0]


def _otherwise(call: Node, variable: Node | None) -> Node | None:
    """Return what a variable is set to where `getParam` fails: `if (!nh.getParam("x", x)) x = 1;`."""
    negated = call.parent
    if variable is None or negated is None or negated.type != "unary_expression" or not text(negated).startswith("!"):
        return None
    branch = negated.parent
    while branch is not None and branch.type in ("condition_clause", "parenthesized_expression"):
        branch = branch.parent
    if branch is None or branch.type != "if_statement":
        return None
    given = (node for node in walk(branch.child_by_field_name("consequence")) if node.type == "assignment_expression")
    return next((child_of(node, "right") for node in given if text(child_of(node, "left")) == text(variable)), None)


def _is_null(arguments: Sequence[Node]) -> bool:
    return len(arguments) == 1 and text(arguments[0]) in ("NULL", "nullptr", "0")
