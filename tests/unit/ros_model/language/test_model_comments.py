"""Comments survive formatting, each with the element that it is beside."""

import re
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ros_model.cli.format import formatted_text
from ros_model.cli.rosmodel import main
from ros_model.language.any_language import parse_all

SYSTEM = """// The robot.
/* Drawn up by hand. */
RosSystem { Name x // one of two
    RosComponents ( // all that runs
        // Drives the arm.
        ComponentInterface { name arm
            RosParameters { RosParameter rate { value 5 /* Hz */ } } // slow
            // What it tells.
            RosPublishers {
                /* Positions,
                 * not angles. */
                RosPublisher joints { }, // of all joints
                RosPublisher state { }
                // RosPublisher torque { }
            }
        } // end of arm
        ComponentInterface { name plan }
    )
    Parameters { // none yet
    }
} // the end
"""
FORMATTED = """// The robot.
// Drawn up by hand.
RosSystem {
    // one of two
    Name 'x'
    RosComponents (
        // all that runs
        // Drives the arm.
        ComponentInterface {
            name arm
            RosPublishers {
                // What it tells.
                // Positions,
                // not angles.
                // of all joints
                RosPublisher 'joints' { },
                // RosPublisher torque { }
                // end of arm
                RosPublisher 'state' { }
            }
            RosParameters {
                // Hz
                // slow
                RosParameter 'rate' { value 5 }
            }
        },
        // none yet
        ComponentInterface {
            name plan
        }
    )
}
// the end
"""
PACKAGES = """// Packages.
PackageSet { // of the arm
    CatkinPackage arm {
        Specs { // own messages
            TopicSpec T { message { int8 a /* up to 5 */ int8 b } } }
        // runs it
        Artifact a { Node { name n // the only one
            Publishers { Publisher { name x } /* late */ } } } } }
"""


@pytest.fixture
def formatted(tmp_path, capsys):
    def run(text, name):
        path = tmp_path / name
        path.write_text(text)
        with pytest.raises(SystemExit) as done:
            main(["format", str(path)])
        assert done.value.code == 0, capsys.readouterr().err
        return path.read_text()

    return run


def test_comments_stand_above_their_elements(formatted):
    assert formatted(SYSTEM, "m.rossystem") == FORMATTED


def test_formatted_file_is_left_as_it_is(formatted):
    assert formatted(FORMATTED, "m.rossystem") == FORMATTED


def test_comments_of_packages_stand_above_their_elements(formatted):
    lines = [line.strip() for line in formatted(PACKAGES, "m.ros").splitlines()]
    comments = {
        lines[n]: next(x for x in lines[n:] if not x.startswith("//")) for n, x in enumerate(lines) if x[:2] == "//"
    }
    assert comments == {
        "// Packages.": "PackageSet {",
        "// of the arm": "CatkinPackage arm {",
        "// own messages": "TopicSpec T { message { int8 a int8 b } }",
        "// up to 5": "TopicSpec T { message { int8 a int8 b } }",
        "// runs it": "Artifact a {",
        "// the only one": "Node {",
        "// late": "Publisher { name 'x' }",
    }


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("RosSystem { Name a // of a\n}\n// last\n// ,", "RosSystem {\n    // of a\n    Name 'a'\n}\n// last\n// ,\n"),
        ("RosSystem { // of a\nName a }", "RosSystem {\n    // of a\n    Name 'a'\n}\n"),
        ("// top\nRosSystem /* a */ { Name a } // end", "// top\nRosSystem {\n    // a\n    Name 'a'\n}\n// end\n"),
    ],
)  # fmt: skip
def test_comments_of_the_system_and_behind_it_stay_there(formatted, text, expected):
    assert formatted(text, "m.rossystem") == expected
    assert formatted(expected, "m.rossystem") == expected


@pytest.mark.parametrize("inside", ["// none yet\n", "Package p { }\n"])
def test_comments_behind_packages_stay_there(formatted, inside):
    text = formatted(f"PackageSet {{ {inside}}} // last\n/* of all */", "m.ros")
    assert text.endswith("}\n// last\n// of all\n")
    assert text.startswith("PackageSet {\n")
    assert formatted(text, "m.ros") == text


@settings(max_examples=100, deadline=None)
@given(st.sampled_from([(SYSTEM, "m.rossystem"), (PACKAGES, "m.ros")]), st.integers(0, 10**6))
def test_no_comment_is_lost_and_the_model_stays(sample, seed):
    text, name = sample
    random = Random(seed)
    words = re.sub(r"//.*|/\*(?s:.*?)\*/", "", text).split(" ")
    for number in range(random.randrange(1, 6)):
        note = random.choice([f"/* note {number} */", f"// note {number}\n", f"\n/*note {number}\n*/\n"])
        words.insert(random.randrange(len(words)), note)
    text = " ".join(words)
    result = formatted_text(text, name)
    assert parse_all(result, name) == parse_all(text, name)
    assert result.count("note") == text.count("note")
    assert formatted_text(result, name) == result
