"""Several errors of a file are told at once, and an error tells no consequences of another."""

import re

import pytest
from ros_model.errors import ModelError
from ros_model.language.packages_reader import parse_packages
from ros_model.language.system_reader import parse_system

SYSTEM = """RosSystem {
    Name x
    RosComponents (
        ComponentInterface { name a
            RosPublishers {
                RosPublisher one { RefPublisher 'p.a.n.one' },
                RosPublisher two { RefPublisher 'p.a.n.two' }
            }
            RosSubscribers { RosSubscriber three { RefSubscriber 'p.a.n.three' } }
        },
        ComponentInterface { name b }
    )
    TopicConnections { TopicConnection one { From ( 'a.one' ) To ( 'b.one' ) } }
    Parameters { Parameter { name p type Integer value 1 } }
}
"""


def lines_of(text, parse=parse_system):
    with pytest.raises(ModelError) as caught:
        parse(text, "m")
    return [error.position.line for error in caught.value.all]


def damaged(*changes):
    text = SYSTEM
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize(
    ("changes", "lines"),
    [
        ([("Name x", "Naem x")], [2]),
        ([("Name x", "Name x Colour red")], [2]),
        ([("RosPublisher one {", "RosPub one {")], [6]),
        ([("RosPublisher one {", "RosPub one {"), ("RosPublisher two {", "RosPub two {")], [6, 7]),
        ([("RefPublisher 'p.a.n.one'", "RefSubscriber 'p.a.n.one'"), ("value 1", "val 1")], [6, 14]),
        ([("RefPublisher 'p.a.n.one'", ""), ("name b", "nam b")], [11]),
        ([("RosPublishers {", "RosPubs {"), ("RosSubscribers {", "RosSubs {")], [5, 9]),
        ([("From ( 'a.one' )", "Form ( 'a.one' )"), ("type Integer", "type Int")], [13, 14]),
        ([("TopicConnection one {", "TopicConnection {"), ("ComponentInterface { name b", "Component { name b")], [11]),
        ([("RosPublisher one { RefPublisher 'p.a.n.one' }", "RosPublisher one RefPublisher 'p.a.n.one'")], [6]),
        ([("'p.a.n.one'", "'p..n.one'"), ("'p.a.n.three'", "'.a.n.three'")], [6, 9]),
        ([("Name x", "Name x Name y"), ("name b", "nam b")], [2, 11]),
        ([("name b", ""), ("Name x", "")], [1, 11]),
        ([("value 1", "value"), ("type Integer", "type")], [14]),
    ],
)  # fmt: skip
def test_each_error_is_told_once_in_the_order_of_the_file(changes, lines):
    assert lines_of(damaged(*changes)) == lines


@pytest.mark.parametrize("instead", ["Xyz", "", "Xyz Xyz"])
def test_one_damaged_word_is_one_error(instead):
    words = list(re.finditer(r"'[^']*'|[^\s{}(),']+", SYSTEM))
    told = []
    for word in words:
        text = SYSTEM[: word.start()] + instead + SYSTEM[word.end() :]
        try:
            parse_system(text, "m")
        except ModelError as error:
            told.append(len(error.all))
    assert len(told) > len(words) / 3
    assert told.count(1) >= 0.95 * len(told)


@pytest.mark.parametrize(("word", "parse"), [("RosSystem", parse_system), ("PackageSet", parse_packages)])
def test_wrong_first_word_is_one_error(word, parse):
    assert lines_of("Xyz { Name x }", parse) == [1]
    assert lines_of(f"{word} {{\n Xyz a }} }}", parse) == [2]


def test_only_the_first_error_is_told_where_brackets_do_not_match():
    assert lines_of(damaged(("RosPublisher two {", "RosPublisher two"), ("value 1", "val 1"))) == [7]


def test_errors_of_packages_are_told_together():
    text = """PackageSet {
    CatkinPackage p {
        Artefact a { Node { name n } },
        Artifact b { Node { name n
            Publishers { Publisher { name x massage 'a.B' }, Publisher { name y message 'a.B' } }
            Parameters { Parameter { name r type Float } } } } }
    Package m { Specs { TopicSpec T { message { int8 } } } }
}"""
    assert lines_of(text, parse_packages) == [3, 5, 6, 7]


def test_no_more_than_twenty_errors_are_told():
    wrong = "\n".join(f"Wrong{number} {{ }}" for number in range(100))
    assert len(lines_of(f"RosSystem {{ Name x {wrong} }}")) == 20


def test_text_of_an_error_with_others_is_its_own():
    with pytest.raises(ModelError) as caught:
        parse_system("RosSystem { Name x A b C d }", "m")
    assert str(caught.value).count("\n") == 0
    assert str(caught.value).startswith("m:1:20: expected ")
    assert all(not error.others for error in caught.value.others)
