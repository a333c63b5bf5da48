"""The bill of materials lists all that the project needs of others, each with a licence that fits the project's own."""

import json
import re
from pathlib import Path

ROOT = Path(__file__).parents[3]
COMPONENTS = json.loads((ROOT / "packaging" / "bill_of_materials.json").read_text())["components"]
PAGE = json.loads((ROOT / "catkin_ws/src/metacontrol_dashboard/page/package-lock.json").read_text())["packages"]
APART = {"Pellet", "make", "cmake", "openjdk-17-jre-headless"}
"""Programs in processes of their own; no code of ours is linked with them."""


def of(kind):
    return {c["name"]: c for c in COMPONENTS if c.get("purl", "").startswith(f"pkg:{kind}/")}


def listed(pattern):
    lines = (line for path in (ROOT / "requirements").glob(pattern) for line in path.read_text().splitlines())
    return {line.split("#")[0].strip() for line in lines} - {""}


def licence(component):
    [told] = component["licenses"]
    return told.get("expression") or told["license"]["name"]


def test_bill_is_complete():
    told = {f"{c['name']}=={c['version']}" for c in of("pypi").values()}
    assert told == listed("python*.txt") | listed("node.txt"), "run packaging/bill_of_materials.py"
    assert set(of("deb")) == listed("apt*.txt"), "run packaging/bill_of_materials.py"
    page = {place.removeprefix("node_modules/"): about["version"] for place, about in PAGE.items() if place}
    assert {name: c["version"] for name, c in of("npm").items()} == page, "run packaging/bill_of_materials.py"


def test_each_has_a_licence_and_none_that_the_product_is_linked_with_binds_it():
    for component in COMPONENTS:
        words = licence(component)
        assert words, component
        binds = re.search(r"(?<!L)A?GPL", words) and not re.search(r"exception| or ", words, re.IGNORECASE)
        if component.get("scope", "required") == "required" and component["name"] not in APART:
            assert not binds, component
