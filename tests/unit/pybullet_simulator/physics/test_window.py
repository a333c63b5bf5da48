"""What the window draws."""

import math

import numpy as np
import pybullet
import pytest
from pybullet_simulator.physics.window import (
    LOCAL_HIGH,
    LOW,
    RED,
    Points,
    Window,
    cost_points,
    cross_points,
    path_points,
    scan_points,
)
from robot_formulas.geometry import Pose


def test_scan_becomes_points_in_the_lasers_frame():
    points = scan_points(np.array([1.0, math.inf, 2.0]), -math.pi / 2, math.pi / 2, 0.2)
    assert points == pytest.approx(np.array([[0.0, -1.0, 0.2], [0.0, 2.0, 0.2]]), abs=1e-9)


def test_path_becomes_close_points():
    points = path_points(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]), 0.1)
    assert points[0] == pytest.approx([0.0, 0.0, 0.1]) and points[-1] == pytest.approx([1.0, 2.0, 0.1])
    assert np.hypot(*np.diff(points[:, :2], axis=0).T).max() <= 0.0501
    assert path_points(np.empty((0, 2)), 0.1).shape == (0, 3)


def test_path_of_any_length_and_with_broken_corners_is_drawn():
    assert len(path_points(np.array([[0.0, 0.0], [1e12, 0.0]]), 0.1)) <= 4000
    points = path_points(np.array([[0.0, 0.0], [math.nan, 1.0], [1.0, 0.0]]), 0.1)
    assert np.isfinite(points).all() and points[-1] == pytest.approx([1.0, 0.0, 0.1])


def test_only_cells_that_cost_something_are_drawn():
    costs = np.array([[0, 100, -1], [1, 0, 0]], dtype=np.int8)
    points, colours = cost_points(costs, 0.5, 0.0, LOCAL_HIGH)
    assert points.tolist() == [[0.75, 0.25, 0.0], [0.25, 0.75, 0.0]]
    assert colours[0] == pytest.approx(LOCAL_HIGH) and colours[1] == pytest.approx(LOW, abs=0.02)


def test_costs_too_many_to_draw_are_drawn_as_squares_with_their_highest_cost():
    costs = np.full((301, 299), 50, dtype=np.int8)
    costs[150, 150] = 100
    points, colours = cost_points(costs, 0.05, 0.0, LOCAL_HIGH)
    assert 2000 < len(points) <= 4000
    assert (points[:, 0].max(), points[:, 1].max()) == pytest.approx((299 * 0.05, 301 * 0.05), abs=0.3)
    highest = points[np.isclose(colours, LOCAL_HIGH).all(axis=1)]
    assert np.hypot(*(highest[:, :2] - 150.5 * 0.05).T) == pytest.approx([0.0], abs=0.25)


def test_drawing_replaces_what_was_drawn_and_takes_it_away(monkeypatch):
    drawn = {}

    def draw(points, colours, size, replaceItemUniqueId, physicsClientId):  # noqa: N803
        number = replaceItemUniqueId if replaceItemUniqueId >= 0 else len(drawn) + 10
        drawn[number] = np.array(points)
        return number

    monkeypatch.setattr(pybullet, "addUserDebugPoints", draw)
    monkeypatch.setattr(pybullet, "removeUserDebugItem", lambda number, **_: drawn.pop(number))
    window = Window(0)
    window.draw("goal", Points(cross_points(1.0, 2.0), RED))
    window.draw("scan", Points(np.array([[1.0, 0.0, 0.3], [math.nan, 0.0, 0.0]]), RED, Pose(1.0, 2.0, math.pi / 2)))
    assert drawn[11] == pytest.approx(np.array([[1.0, 3.0, 0.3]]))
    window.draw("scan", Points(np.array([[2.0, 0.0, 0.3]]), RED, Pose(1.0, 2.0, math.pi / 2)))
    assert drawn[11] == pytest.approx(np.array([[1.0, 4.0, 0.3]]))
    window.draw("scan", Points(np.empty((0, 3)), RED))
    assert set(drawn) == {10}
