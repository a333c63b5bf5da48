"""One model, written as many hands write it: dialects, orders, commas, quotes, comments. All are read as the same."""

import re
from dataclasses import replace
from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st
from ros_model.language.metamodel import PortKind
from ros_model.language.packages_reader import parse_packages
from ros_model.language.system_reader import parse_system

SYSTEM = """RosSystem { Name robot
    RosComponents (
        ComponentInterface { name arm NameSpace left FromRosNode 'arm.arm_node.arm'
            RosPublishers {
                RosPublisher '/joint_states' { ns left RefPublisher 'arm.arm_node.arm./joint_states' },
                RosPublisher temperature { RefPublisher 'arm.arm_node.arm.temperature' } }
            RosSrvServers { RosServiceServer reset { RefServer 'arm.arm_node.arm.reset' } }
            RosActionServers { RosActionServer move { RefServer 'arm.arm_node.arm.move' } }
            RosParameters {
                RosParameter rate { RefParameter 'arm.arm_node.arm.rate' value 12.5 },
                RosParameter joints { RefParameter 'arm.arm_node.arm.joints' value { 1, true, { x } } } } },
        ComponentInterface { name planner
            RosSubscribers { RosSubscriber '/joint_states' { RefSubscriber 'planner.planner.planner./joint_states' } }
            RosSrvClients { RosServiceClient reset { RefClient 'planner.planner.planner.reset' } }
            RosActionClients { RosActionClient move { RefClient 'planner.planner.planner.move' } } } )
    TopicConnections {
        TopicConnection states { From ( 'arm./joint_states' ) To ( 'planner./joint_states', 'planner.other' ) } }
    ServiceConnections { ServiceConnection reset { From ( 'arm.reset' ) To 'planner.reset' } }
    ActionConnections { ActionConnection move { From 'arm.move' To 'planner.move' } }
    Parameters {
        Parameter { name qa_speed type Double default 0.1 value 0.5 },
        Parameter { name limits NameSpace robot
            type Struct { low Double, axes List { Integer, String }, all Array { type Boolean } }
            value { { low { value -1.5 } }, { axes { value { 1, x } } } } } }
}"""

PACKAGES = """PackageSet {
    CatkinPackage arm { FromGitRepo 'https://example.org/arm.git'
        Specs {
            TopicSpec Torque { message { Header header float64[36] 'values' 'geometry_msgs.Pose'[] poses int8 OK=1 } },
            ServiceSpec Ask { request { string message } response { bool ok } },
            ActionSpec Move { goal { float32 goal } result { } feedback { time time } } }
        Artifact arm_node {
            Node { name arm
                Publishers { Publisher { name '/joint_states' message 'sensor_msgs.JointState' },
                    Publisher { name torque message 'arm.Torque' namespace GlobalNamespace { parts { robot, arm } } } }
                Subscribers { Subscriber { name command message 'std_msgs.String' } }
                ServiceServers { ServiceServer { name reset service 'std_srvs.Trigger' } }
                ServiceClients { ServiceClient { name ask service 'arm.Ask' } }
                ActionServers { ActionServer { name move action 'arm.Move' } }
                ActionClients { ActionClient { name grip action 'control_msgs.GripperCommand' } }
                Parameters { Parameter { name rate type Double default 1.5 }, Parameter { name mode type String } } } },
        Artifact spare { }
        Dependencies { PackageDependency roscpp, ExternalDependency eigen } },
    Package other { }
}"""

TOKEN = re.compile(r"'[^']*'|[{}(),]|[^\s{}(),']+")
FIELDS = re.compile(
    "[Nn]ame|NameSpace|ns|FromRosNode|Ref(Publisher|Subscriber|Server|Client|Parameter)|type|value|From|To|FromGitRepo"
    "|Ros(Components|Publishers|Subscribers|SrvServers|SrvClients|ActionServers|ActionClients|Parameters)"
    "|(Topic|Service|Action)Connections|message|service|action|namespace|request|response|goal|result|feedback"
    "|Publishers|Subscribers|ServiceServers|ServiceClients|ActionServers|ActionClients|Parameters"
)
SECTIONS_OF_2019 = {
    "Publishers": "publisher",
    "Subscribers": "subscriber",
    "ServiceServers": "serviceserver",
    "ServiceClients": "serviceclient",
    "ActionServers": "actionserver",
    "ActionClients": "actionclient",
    "Parameters": "parameter",
    "Specs": "spec",
    "Dependencies": "dependency",
}
OLDER = {
    "RosActionServer": "RosServer",
    "RosActionClient": "RosClient",
    "Struct": "Struc",
    "FromGitRepo": "fromGitRepo",
}
BARE = re.compile(r"[A-Za-z_./][A-Za-z0-9_./]*")


class Bracket(list):
    """Tokens and brackets, in braces or parentheses."""

    def __init__(self, opening, before):
        super().__init__()
        self.opening = opening
        self.before = before  # the words before it


class Hand:
    """Writes the tokens of a model in another way that means the same."""

    def __init__(self, random, old=False):
        self.random = random
        self.old = old  # whether sections may have the names of 2019

    def write(self, text):
        stack = [Bracket("", [])]
        for found in TOKEN.findall(text):
            if found in "{(":
                inside = Bracket(found, [word for word in stack[-1][-2:] if isinstance(word, str)])
                stack[-1].append(inside)
                stack.append(inside)
            elif found in "})":
                stack.pop()
            else:
                stack[-1].append(found)
        return self.gap() + self.gap().join(self.tokens(stack[0])) + self.gap()

    def maybe(self, chance=0.5):
        return self.random.random() < chance

    def gap(self):
        gaps = [" ", "\n", "\t ", "\r\n", " // it's { a comment\n", " /* and\n'another } */ "]
        return self.random.choice([" ", " ", " ", *gaps])

    def tokens(self, bracket, in_value=False):
        for number, item in enumerate(self.arranged(bracket)):
            if isinstance(item, Bracket):
                yield from self.bracket(item, in_value or item.before[-1:] in (["value"], ["default"]))
            elif item == ",":
                if in_value or self.maybe(0.7):
                    yield ","
            else:
                yield from self.word(item, number, bracket)

    def bracket(self, bracket, in_value):
        opening = bracket.opening
        if bracket.before[-1:] in (["RosComponents"], ["From"], ["To"], ["RosParameters"]):
            opening = self.random.choice("{(")
        yield opening
        yield from self.tokens(bracket, in_value)
        if "," in bracket and self.maybe(0.3):
            yield ","
        yield {"{": "}", "(": ")"}[opening]

    def word(self, word, number, bracket):
        if word[0] == "'":
            inside = word[1:-1]
            if '"' not in inside and self.maybe(0.3):
                word = f'"{inside}"'
            elif BARE.fullmatch(inside) and not FIELDS.fullmatch(inside) and self.maybe(0.3):
                word = inside
        elif self.old or word in {"RosActionServer", "RosActionClient", "Struct"}:
            word = {**SECTIONS_OF_2019, **OLDER}.get(word, word) if self.maybe(0.9 if self.old else 0.3) else word
        yield word

    def arranged(self, bracket):
        """Return what is in a bracket, its fields in any order where they are no list."""
        starts = [n for n, item in enumerate(bracket) if isinstance(item, str) and FIELDS.fullmatch(item)]
        is_element = starts and starts[0] == 0 and "," not in bracket
        if not is_element or bracket.before[-1:] in (["request"], ["response"], ["goal"], ["message"], ["value"]):
            return bracket
        fields = [bracket[a:b] for a, b in zip(starts, [*starts[1:], len(bracket)], strict=True)]
        self.random.shuffle(fields)
        return [item for field in fields for item in field]


def in_2019(text):
    """Return packages with the keywords and braces that stood around each level in 2019."""
    text = re.sub(r"PackageSet \{(.*)\}", r"PackageSet { package {\1} }", text, flags=re.DOTALL)
    text = re.sub(r"(Artifact arm_node .*Artifact spare \{ \})", r"artifact { \1 }", text, flags=re.DOTALL)
    text = re.sub(r"\bNode \{", "node Node {", text)
    text = re.sub(r"type (\w+) default (\S+)", r"type \1 { default \2 }", text)
    text = re.sub(r"type String", "type String { }", text)
    return re.sub(r"PackageDependency (\w+)", r"PackageDependency { package \1 }", text)


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 10**6))
def test_systems_are_read_from_any_hand(seed):
    text = Hand(Random(seed)).write(SYSTEM)
    assert replace(parse_system(text), header="") == parse_system(SYSTEM), text


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 10**6), st.booleans())
def test_packages_are_read_from_any_hand(seed, old):
    text = Hand(Random(seed), old).write(in_2019(PACKAGES) if old else PACKAGES)
    assert replace(parse_packages(text), header="") == parse_packages(PACKAGES), text


def test_samples_are_read_whole():
    system, packages = parse_system(SYSTEM), parse_packages(PACKAGES)
    assert {port.kind for component in system.components for port in component.ports} == set(PortKind)
    assert {port.kind for port in packages.node("arm", "arm_node", "arm").ports} == set(PortKind)
    assert parse_packages(in_2019(PACKAGES)) == packages
