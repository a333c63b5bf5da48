"""Routes as a file has them."""

import pytest
from metacontrol_experiments.io.input_files import read_route
from metacontrol_experiments.mission.routes import RouteError
from robot_formulas.geometry import Pose


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def test_route_is_read(tmp_path):
    path = write(tmp_path / "routes.yaml", "routes:\n  r1: {start: [1, 2, 0.5], goal: [3.0, 4.0]}\n")
    route = read_route(path, "r1")
    assert (route.start, route.goal) == (Pose(1.0, 2.0, 0.5), Pose(3.0, 4.0))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("routes: {r2: {start: [0, 0], goal: [1, 1]}}", "no route 'r1'; there are r2"),
        ("routes: {r1: {start: [0, 0]}}", "'r1', goal"),
        ("routes: {r1: {start: [0, .nan], goal: [1, 1]}}", "'r1', start"),
        ("routes: {r1: 7}", "needs a start"),
        ("routes: [1", "correct the YAML"),
        ("7", "no route"),
    ],
)
def test_bad_route_is_named(tmp_path, text, said):
    with pytest.raises(RouteError, match=said):
        read_route(write(tmp_path / "routes.yaml", text), "r1")
