"""Files that users name: what is wrong with one is told in one line."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from node_kit.io.input_files import InputFileError, is_file, read_bytes, read_text, read_yaml
from node_kit.yaml_text import MAX_VALUES, YamlError, parse_marked_yaml, parse_yaml

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=20,
)


@given(VALUES)
def test_yaml_is_read_as_the_library_reads_it(value):
    text = yaml.safe_dump(value)
    assert parse_yaml(text) == parse_marked_yaml(text)[0] == yaml.safe_load(text)


def test_values_of_marked_yaml_have_places():
    value, places = parse_marked_yaml("a: 1\nb:\n  - x\n  - {c: 2}\n")
    assert value == {"a": 1, "b": ["x", {"c": 2}]}
    assert (places["a",], places["b", 1, "c"]) == ((1, 1), (4, 6))


def test_key_that_stands_twice_is_refused_only_where_places_count():
    assert parse_yaml("a: 1\na: 2\n") == {"a": 2}
    with pytest.raises(YamlError, match=r"^2:1: the key 'a' stands twice"):
        parse_marked_yaml("a: 1\na: 2\n")


@pytest.mark.parametrize("largest", [int(1.7e308), -int(1.7e308)])
def test_longest_number_that_a_float_can_hold_is_read(largest):
    assert parse_yaml(f"[{largest:_}, {largest:#b}]") == [largest, largest]


BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n" for before, name in zip("abcdefg", "bcdefgh", strict=True)
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" * 50_000, "is nested too deep"),
        ("{a: " * 50_000, "is nested too deep"),
        ("- " * 20_000, "is nested too deep"),
        ("&a [*a]", "is nested too deep"),
        (BOMB, f"holds more than {MAX_VALUES} values"),
        ("a: [1,", "expected the node content"),
        ("a: 2020-13-45", "a value is not of its type"),
        ("!!bool maybe", "a value is not of its type"),
        ("!!timestamp x", "a value is not of its type"),
        ("!!int ''", "a value is not of its type"),
        ("!!python/object/apply:os.system [ls]", "could not determine a constructor"),
        ("\x00", "special characters are not allowed"),
        ("a" * 4_000_001, "are too many"),
        (f"a: 1{':1' * 700}", "1:4: a number has 1401 characters (at most 1100): correct it"),
        (f"a: 1{':1' * 700}.0", "a number has 1403 characters"),
        (f"- {'9' * 1200}", "1:3: a number has 1200 characters"),
        (f"- {'9' * 1200}.0", "a number has 1202 characters"),
        (f"!!int {{=: '{'1_' * 700}1'}}", "a number has 1401 characters"),
        (f"{'9' * 400}", "a number is too large"),
    ],
)
def test_yaml_that_can_not_be_used_is_refused_in_one_line(text, message):
    for parse in (parse_yaml, parse_marked_yaml):
        with pytest.raises(YamlError) as caught:
            parse(text)
        assert message in str(caught.value)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("text", "said"), [("rad(pi)", "{'a': 'rad(pi)'}"), ("!radians exit()", "YamlError")])
def test_what_rosparam_teaches_pyyaml_is_not_evaluated(text, said):
    code = "import rosparam, sys; from node_kit.yaml_text import parse_yaml; print(parse_yaml(sys.argv[1]))"
    ended = subprocess.run([sys.executable, "-c", code, f"a: {text}"], capture_output=True, text=True, check=False)
    assert said in ended.stdout + ended.stderr


def test_text_loses_its_byte_order_mark(tmp_path: Path):
    path = tmp_path / "a.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1\n")
    assert (read_text(path), read_yaml(path)) == ("a: 1\n", {"a": 1})


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_place_of_a_byte_that_is_no_text_is_told(tmp_path: Path, mark: bytes):
    path = tmp_path / "a.yaml"
    path.write_bytes(mark + b"a: 1\nb: \xff")
    with pytest.raises(InputFileError, match=f"^{path}:2:4: byte 0xff is not UTF-8: save the file as UTF-8 text$"):
        read_text(path)


def test_file_that_is_too_large_is_refused(tmp_path: Path):
    path = tmp_path / "a"
    path.write_bytes(b"12345")
    with pytest.raises(InputFileError, match="5 bytes are too many"):
        read_bytes(path, largest=4)


def test_file_of_the_kernel_that_tells_no_size_is_read_no_further():
    with pytest.raises(InputFileError, match="more than 10 bytes"):
        read_bytes("/proc/self/maps", 10)


@pytest.mark.parametrize("name", ["missing", "x" * 5000, "a/" * 3000, "nul\0", "folder", "loop", "pipe", "a\n\udc80b"])
def test_path_that_is_no_file_is_refused_in_one_line(tmp_path: Path, name: str):
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "pipe")
    path = f"{tmp_path}/{name}"
    for read in (read_bytes, read_text, read_yaml):
        with pytest.raises(InputFileError) as caught:
            read(path)
        assert "\n" not in str(caught.value)
        assert ": check the path" in str(caught.value) or ": give the path of one" in str(caught.value)
    assert not is_file(path)
