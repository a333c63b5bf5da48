"""The planner: taut, clear of obstacles, and with a reason where there is no way."""

import numpy as np
import pytest
from move_base.costmap.costmap import Costmap
from move_base.costmap.grid import INSCRIBED
from move_base.costmap.static_map import StaticMap
from move_base.parameters.reader import read_parameters
from move_base.planning.global_planner import PlanningError, make_plan, path_cost
from robot_formulas.geometry import Pose

CELLS = 240  # 12 m


@pytest.fixture
def floor(tree):
    """Makes a snapshot of a walled floor of 12 x 12 m with blocks and unknown areas (x0, x1, y0, y1)."""

    def make(*blocks, unknown=()):
        occupancy = np.zeros((CELLS, CELLS), dtype=np.int8)
        occupancy[[0, -1]] = occupancy[:, [0, -1]] = 100
        for x0, x1, y0, y1 in blocks:
            occupancy[round(y0 / 0.05) : round(y1 / 0.05), round(x0 / 0.05) : round(x1 / 0.05)] = 100
        for x0, x1, y0, y1 in unknown:
            occupancy[round(y0 / 0.05) : round(y1 / 0.05), round(x0 / 0.05) : round(x1 / 0.05)] = -1
        costmap = Costmap(read_parameters(tree()).global_costmap)
        costmap.set_map(StaticMap.create(occupancy.ravel(), CELLS, CELLS, 0.05, (0.0, 0.0, 0.0)))
        return costmap.update(Pose(1.0, 1.0, 0.0), [])

    return make


def plan(snapshot, start, goal, **options):
    options = {"escape_radius": 1.0, "allow_unknown": True, **options}
    return make_plan(snapshot, Pose(*start, 0.0), Pose(*goal, 0.0), **options)


def length(points):
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


def test_open_floor_gives_a_straight_line(floor):
    points = plan(floor(), (1.0, 1.0), (11.0, 4.0)).points
    assert length(points) == pytest.approx(np.hypot(10.0, 3.0), rel=0.01)
    assert points[0] == pytest.approx([1.0, 1.0])
    assert points[-1] == pytest.approx([11.0, 4.0])


def test_way_round_a_rack_is_short_and_clear(floor):
    snapshot = floor((4.0, 5.0, 0.0, 8.0))
    points = plan(snapshot, (2.0, 2.0), (8.0, 2.0)).points
    rows, columns = snapshot.geometry.cells(points)
    assert snapshot.clearance[rows, columns].min() > 0.5
    # two straight lines to the rack's end, 0.5 m away from it, and the end's width with its arcs
    assert length(points) < 2 * np.hypot(2.0, 6.5) + 2.5


def test_wide_way_is_taken_rather_than_a_gap_without_room(floor):
    wall = [(5.0, 5.4, 0.0, 5.0), (5.0, 5.4, 6.1, 7.6)]  # a gap of 1.1 m around y = 5.55, open from y = 7.6 on
    points = plan(floor(*wall), (2.0, 5.5), (9.0, 5.5)).points
    assert points[:, 1].max() > 8.0
    points = plan(floor(*wall, (5.0, 5.4, 7.6, 12.0)), (2.0, 5.5), (9.0, 5.5)).points
    assert points[:, 1].max() < 6.0


def test_gap_with_half_of_the_padding_is_the_last_resort(floor):
    wall = [(5.0, 5.4, 0.0, 5.0), (5.0, 5.4, 6.0, 9.5)]  # a gap of 1.0 m around y = 5.5; the padded robot is 1.0 m wide
    assert plan(floor(*wall), (2.0, 5.5), (9.0, 5.5)).points[:, 1].max() > 9.5
    closed = (5.0, 5.4, 9.5, 12.0)
    assert plan(floor(*wall, closed), (2.0, 5.5), (9.0, 5.5)).points[:, 1].max() < 6.0
    narrower = [(5.0, 5.4, 0.0, 5.0), (5.0, 5.4, 5.8, 12.0)]
    with pytest.raises(PlanningError, match="no way"):
        plan(floor(*narrower), (2.0, 5.5), (9.0, 5.5))


def test_known_way_is_taken_unless_the_unknown_one_is_far_shorter(floor):
    strip = (5.0, 6.0, 0.05, 9.0)
    points = plan(floor(unknown=[strip]), (3.0, 7.0), (8.0, 7.0)).points
    assert points[:, 1].max() > 9.0
    points = plan(floor(unknown=[strip]), (3.0, 1.5), (8.0, 1.5)).points
    assert points[:, 1].max() < 2.0
    with pytest.raises(PlanningError, match="no way"):
        plan(floor(unknown=[(5.0, 6.0, 0.05, 11.95)]), (3.0, 1.5), (8.0, 1.5), allow_unknown=False)


def test_points_are_evenly_spaced_and_directed(floor):
    result = plan(floor((4.0, 5.0, 0.0, 8.0)), (2.0, 2.0), (8.0, 2.0))
    assert np.hypot(*np.diff(result.points, axis=0).T).max() < 0.08
    assert len(result.headings()) == len(result.points)


def test_start_among_inflated_cells_gets_out(floor):
    snapshot = floor((4.0, 5.0, 0.0, 8.0))
    points = plan(snapshot, (3.7, 4.0), (1.5, 4.0)).points
    assert length(points) == pytest.approx(2.2, rel=0.1)


def test_blocked_goal_ends_nearby_where_tolerance_allows(floor):
    snapshot = floor((4.0, 5.0, 0.0, 8.0))
    result = plan(snapshot, (1.0, 4.0), (3.6, 4.0), tolerance=0.25)
    assert result.goal.distance(Pose(3.6, 4.0, 0.0)) <= 0.25
    with pytest.raises(PlanningError, match="too close for the robot"):
        plan(snapshot, (1.0, 4.0), (3.6, 4.0))


def test_end_near_a_blocked_goal_is_one_that_can_be_reached(floor):
    snapshot = floor((6.0, 7.0, 0.0, 12.0))
    result = plan(snapshot, (2.0, 6.0), (6.9, 6.0), tolerance=2.0)  # nearer to the far side of the wall
    assert result.points[-1] == pytest.approx([5.5, 6.0], abs=0.1)


def test_end_near_a_blocked_goal_is_never_where_only_a_start_may_lie(floor):
    snapshot = floor((4.0, 5.0, 0.0, 8.0))
    result = plan(snapshot, (3.65, 4.0), (3.7, 4.5), tolerance=1.0)
    row, column = snapshot.geometry.cell(*result.points[-1])
    assert snapshot.costs[row, column] < INSCRIBED


@pytest.mark.parametrize("tolerance", [np.inf, np.nan, -1.0])
def test_tolerance_that_makes_no_sense_is_refused(floor, tolerance):
    with pytest.raises(PlanningError, match="tolerance"):
        plan(floor(), (1.0, 1.0), (2.0, 2.0), tolerance=tolerance)


@pytest.mark.parametrize(
    ("start", "goal", "reason"),
    [
        ((1.0, 1.0), (20.0, 1.0), "goal .* outside the map"),
        ((1.0, 1.0), (1e308, 1.0), "goal .* outside the map"),
        ((1.0, 1.0), (np.nan, 1.0), "goal .* outside the map"),
        ((-1.0, 1.0), (2.0, 1.0), "robot .* outside the map"),
        ((1.0, 1.0), (4.5, 4.0), "in an obstacle"),
        ((1.0, 1.0), (9.0, 6.0), "no way"),
    ],
)
def test_no_plan_has_a_reason(floor, start, goal, reason):
    snapshot = floor((4.0, 5.0, 0.0, 12.0))
    with pytest.raises(PlanningError, match=reason):
        plan(snapshot, start, goal)


def test_start_at_the_goal_is_a_plan(floor):
    assert length(plan(floor(), (2.0, 2.0), (2.0, 2.0)).points) == 0.0


def test_blocked_path_has_no_cost(floor):
    points = plan(floor(), (2.0, 2.0), (8.0, 2.0)).points
    assert path_cost(points, floor(), allow_unknown=True) == pytest.approx(6.0, rel=0.02)
    assert path_cost(points, floor((4.0, 5.0, 0.0, 8.0)), allow_unknown=True) == np.inf
    assert path_cost(points - 5.0, floor(), allow_unknown=True) == np.inf
