"""Makes bad inputs from good ones: bytes, tokens, and the nodes of YAML, JSON, XML and tables."""

from __future__ import annotations

import copy
import csv
import io
import json
import re
from functools import lru_cache
from itertools import islice
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import yaml

from bad_input import hostile

if TYPE_CHECKING:
    from collections.abc import Sequence
    from random import Random

LARGEST = 200_000
"""Bytes of the largest input that is made."""
_UNCHANGED = 0.02
"""Share of inputs that are a seed as it is: a reader that refuses all of these is not tested."""
_BY_BYTES = 0.35
"""Share of inputs of a known structure that are changed by bytes nevertheless."""
_PLACES = 5000
"""Places of a tree that are looked at; circles would have no end of them."""
_TOKEN = re.compile(r"\s+|\w+|.", re.DOTALL)


def mutated(rng: Random, seeds: Sequence[bytes], kind: str) -> bytes:
    """Return a bad input.

    Args:
        rng: the only source of chance.
        seeds: good inputs.
        kind: of their structure: yaml, json, xml, csv, text or binary.
    """
    data = rng.choice(seeds)
    if rng.random() < _UNCHANGED:
        return data
    if kind in _STRUCTURES and rng.random() > _BY_BYTES:
        data = _STRUCTURES[kind](rng, data, seeds)
        if rng.random() < 0.8:
            return data[:LARGEST]
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        data = _changed_bytes(rng, data, seeds)[:LARGEST]  # each time: one step may make it 21 times as long
    return data


def _changed_bytes(rng: Random, data: bytes, seeds: Sequence[bytes]) -> bytes:  # noqa: PLR0911
    begin, end = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    near = min(end, begin + 1 + rng.randrange(16))
    match rng.randrange(9):
        case 0:  # flip a bit
            if not data:
                return b"\x01"
            place = rng.randrange(len(data))
            return data[:place] + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1 :]
        case 1:
            return data[:begin] + data[near:]
        case 2:
            return data[:begin] + data[end:]
        case 3:
            return data[:end] + data[begin:end] * rng.choice((1, 1, 2, 20)) + data[end:]
        case 4:
            return data[:begin]
        case 5:
            other = rng.choice(seeds)
            return data[:begin] + other[rng.randrange(len(other) + 1) :]
        case 6:
            return data[:begin] + rng.choice(hostile.TOKENS) + data[begin:]
        case 7:
            return data[:begin] + rng.choice(hostile.TOKENS) + data[near:]
        case _:
            word = rng.choice(hostile.WORDS)
            return data[:begin] + word + data[begin + len(word) :]


def _changed_text(rng: Random, data: bytes, seeds: Sequence[bytes]) -> bytes:
    tokens = _TOKEN.findall(data.decode(errors="replace"))
    for _ in range(rng.choice((1, 1, 2, 4))):
        if not tokens:
            break
        first, second = rng.randrange(len(tokens)), rng.randrange(len(tokens))
        match rng.randrange(6):
            case 0:
                del tokens[first]
            case 1:
                tokens.insert(first, tokens[second])
            case 2:
                tokens[first], tokens[second] = tokens[second], tokens[first]
            case 3:
                tokens[first] = rng.choice(hostile.TEXTS)
            case 4:
                begin, end = sorted((first, second))
                tokens[begin:begin] = tokens[begin:end] * rng.choice((1, 2))
            case _:
                others = _TOKEN.findall(rng.choice(seeds).decode(errors="replace"))
                tokens[first] = rng.choice(others or [""])
    return "".join(tokens).encode(errors="surrogatepass")


# -- trees: YAML and JSON ----------------------------------------------------------------------------------------------


def _changed_yaml(rng: Random, data: bytes, _seeds: Sequence[bytes]) -> bytes:
    tree = changed_tree(rng, _yaml(data), cycles=True)
    try:
        text: str = yaml.dump(tree, Dumper=yaml.CSafeDumper, allow_unicode=True, sort_keys=False)
    except (yaml.YAMLError, ValueError, RecursionError):  # a half of a surrogate pair can't be written
        text = repr(tree)
    return text.encode(errors="surrogatepass")


def _changed_json(rng: Random, data: bytes, _seeds: Sequence[bytes]) -> bytes:
    return json.dumps(changed_tree(rng, _json(data))).encode()


def changed_tree(rng: Random, tree: Any, *, cycles: bool = False) -> Any:
    """Return a changed copy of plain data."""
    tree = {"": copy.deepcopy(tree)}
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = list(islice(_places(tree), _PLACES))
        if not places:
            tree = {"": copy.deepcopy(rng.choice(hostile.VALUES))}
            continue
        holder, key = rng.choice(places)
        try:
            _change_value(rng, holder, key, places, cycles)
        except (IndexError, KeyError):  # an earlier change has taken the place out
            continue
    return tree.get("")


def _change_value(rng: Random, holder: Any, key: Any, places: list[tuple[Any, Any]], cycles: bool) -> None:
    value = holder[key]
    match rng.randrange(10):
        case 0:
            del holder[key]
        case 1 | 2 | 3:
            holder[key] = copy.deepcopy(rng.choice(hostile.VALUES))
        case 4:
            other, there = rng.choice(places)
            holder[key] = copy.deepcopy(other[there])
        case 5:
            holder[key] = rng.choice(([value], {"a": value}, [value] * 3, {str(value)[:50]: None}, str(value)))
        case 6 if isinstance(holder, dict):
            holder[rng.choice((*hostile.TEXTS, 1, None, True, 1.5))] = holder.pop(key)
        case 6 | 7 if isinstance(value, list) and value:
            holder[key] = (value * (1 + 20 // len(value)))[:20]
        case 8:
            for _ in range(rng.choice((3, 60, 150))):
                value = [value] if rng.random() < 0.5 else {"a": value}
            holder[key] = value
        case 9 if cycles and isinstance(value, list | dict):
            if isinstance(value, list):
                value.append(value)
            else:
                value[rng.choice((*value, "a"))] = value
        case _:
            holder[key] = -value if isinstance(value, int | float) else rng.choice(hostile.NUMBERS)


def _places(node: Any, depth: int = 0) -> Any:
    if depth > 40:
        return
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in list(items):
        yield node, key
        yield from _places(value, depth + 1)


@lru_cache(maxsize=256)
def _yaml(data: bytes) -> Any:
    return yaml.load(data, yaml.CSafeLoader)


@lru_cache(maxsize=256)
def _json(data: bytes) -> Any:
    return json.loads(data)


# -- XML ---------------------------------------------------------------------------------------------------------------


def _changed_xml(rng: Random, data: bytes, seeds: Sequence[bytes]) -> bytes:
    try:
        root = ElementTree.fromstring(data)  # noqa: S314 - our own seeds
    except ElementTree.ParseError:
        return _changed_text(rng, data, seeds)
    for _ in range(rng.choice((1, 1, 2, 3))):
        _change_element(rng, root)
    text = ElementTree.tostring(root, encoding="unicode")
    match rng.randrange(12):
        case 0:
            bomb = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">' for n in range(1, 8))
            text = f'<!DOCTYPE a [<!ENTITY e0 "eeeeeeeeee">{bomb}]>' + text.replace(">", ">&e7;", 1)
        case 1:
            text = "<?xml version='1.0' encoding='utf-16'?>" + text
    return text.encode(errors="surrogatepass")


def _change_element(rng: Random, root: ElementTree.Element) -> None:
    elements = list(root.iter())
    element, other = rng.choice(elements), rng.choice(elements)
    match rng.randrange(9):
        case 0 if len(element):
            element.remove(rng.choice(list(element)))
        case 1:
            if other not in element.iter() or rng.random() < 0.1:
                other.append(copy.deepcopy(element))
        case 2 | 3 | 4 if element.attrib:
            element.set(rng.choice(list(element.attrib)), str(rng.choice(hostile.VALUES))[:6000])
        case 5 if element.attrib:
            del element.attrib[rng.choice(list(element.attrib))]
        case 6:
            element.set(rng.choice(list(other.attrib) or ["a"]), rng.choice(list(other.attrib.values()) or [""]))
        case 7:
            element.tag = other.tag
        case 8:
            for _ in range(rng.choice((3, 30, 300))):
                element = ElementTree.SubElement(element, other.tag, other.attrib)
        case _:
            element.text = rng.choice(hostile.TEXTS)


# -- tables ------------------------------------------------------------------------------------------------------------


def _changed_csv(rng: Random, data: bytes, _seeds: Sequence[bytes]) -> bytes:
    rows = list(csv.reader(io.StringIO(data.decode(errors="replace"), newline=""))) or [[""]]
    for _ in range(rng.choice((1, 1, 2, 4))):
        row = rng.choice(rows)
        place = rng.randrange(len(row)) if row else 0
        match rng.randrange(8):
            case 0 | 1 | 2 if row:
                row[place] = str(rng.choice(hostile.VALUES))[:6000]
            case 3 if row:
                del row[place]
            case 4:
                row.insert(place, rng.choice(rng.choice(rows) or [""]))
            case 5:
                rows.insert(rng.randrange(len(rows)), list(row))
            case 6 if len(rows) > 1:
                rows.remove(row)
            case _:
                rows[0], rows[rng.randrange(len(rows))] = rows[rng.randrange(len(rows))], rows[0]
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator=rng.choice(("\n", "\n", "\r\n", "\r"))).writerows(rows)
    return text.getvalue().encode(errors="surrogatepass")


_STRUCTURES = {
    "yaml": _changed_yaml,
    "json": _changed_json,
    "xml": _changed_xml,
    "csv": _changed_csv,
    "text": _changed_text,
}
