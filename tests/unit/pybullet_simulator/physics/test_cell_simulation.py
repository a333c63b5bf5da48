import math

import cv2
import numpy as np
import pytest
from pybullet_simulator.physics.arm import ArmError
from pybullet_simulator.physics.cell_simulation import STEP, CellError, CellSimulation
from pybullet_simulator.robot.colour_camera import BRIGHT, DIM, take
from pybullet_simulator.robot.manipulator import ARMS, MAST_CAMERA
from pybullet_simulator.world.cell import BLOCK_SIZE, TABLE_TOP, TAGS

SPEED = np.array([2.175] * 4 + [2.61] * 3)
EFFORT = np.array([87.0] * 4 + [12.0] * 3)
LOWER = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])
UPPER = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
"""Of a Panda: rad/s, Nm, rad (data sheet)."""


@pytest.fixture
def make():
    running = []

    def start(seed=0):
        running.append(CellSimulation(seed))
        return running[-1]

    yield start
    for cell in running:
        cell.close()


@pytest.fixture
def cell(make):
    return make()


@pytest.fixture(scope="module")
def scene():
    """Light and depth that the camera sees, all at rest."""
    cell = CellSimulation(seed=0)
    cell.step()
    yield cell.look()
    cell.close()


def run(cell, seconds, *velocity):
    for step in range(round(seconds / STEP)):
        if velocity and step % 20 == 0:
            cell.drive(*velocity)
        cell.step()


def in_camera(point):
    """Return the pixel (column, row) and the depth of a point of the map, seen from the base at home."""
    camera = MAST_CAMERA
    ahead, up = point[0] + 0.95 - camera.x, point[2] - camera.z
    cos, sin = math.cos(camera.pitch), math.sin(camera.pitch)
    depth, down = cos * ahead - sin * up, -sin * ahead - cos * up
    column = (camera.width - 1) / 2.0 - camera.focal_length * (point[1] - camera.y) / depth
    return column, (camera.height - 1) / 2.0 + camera.focal_length * down / depth, depth


def tags_in(image):
    """Return the corners of the tags that OpenCV finds, by their ids."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
    return {} if ids is None else {int(number): found[0] for number, found in zip(ids.ravel(), corners, strict=True)}


def test_base_drives_within_its_limits_and_brakes_without_commands(cell):
    run(cell, 0.2, -1.0, 0.0, 5.0)
    slow, _, turn = cell.base_velocity
    assert slow == pytest.approx(-0.1, rel=0.1) and turn == pytest.approx(0.2, rel=0.1)  # 0.5 m/s2, 1 rad/s2
    run(cell, 0.8, -1.0, 0.0, 5.0)
    fast, _, turn = cell.base_velocity
    assert fast == pytest.approx(-0.3, rel=0.1) and turn == pytest.approx(0.5, rel=0.1)
    run(cell, 0.45)
    assert cell.base_velocity[0] == pytest.approx(-0.3, rel=0.1)  # the command still holds
    run(cell, 0.8)
    assert cell.base_velocity == pytest.approx((0.0, 0.0, 0.0), abs=1e-4)
    settled = cell.base_pose
    run(cell, 1.0)
    assert cell.base_pose == pytest.approx(settled, abs=1e-5)


def test_odometry_follows_with_an_error(cell):
    start = cell.base_pose
    run(cell, 4.0, 0.0, 0.3, 0.0)
    true = np.array(cell.base_pose) - start
    assert true[1] > 0.8
    error = np.abs(np.array(cell.odometry) - true)
    assert 1e-4 < error[:2].max() < 0.05
    assert error[2] < 0.02


def test_one_seed_gives_one_run_and_others_give_others(make):
    cells = [make(4), make(4), make(5)]
    assert cells[0].blocks == cells[1].blocks != cells[2].blocks
    for cell in cells:
        cell.arms["left"].command((0.5, -0.5, 0.0, -2.0, 0.0, 1.5, 0.5))
        run(cell, 0.5, 0.1, 0.2, 0.3)
    first, same, other = cells
    assert first.base_pose == same.base_pose != other.base_pose
    assert first.odometry == same.odometry
    assert first.blocks == same.blocks
    assert (first.arms["left"].positions == same.arms["left"].positions).all()
    assert (first.look()[1] == same.look()[1]).all()


def test_blocks_lie_still_where_they_were_scattered(cell):
    before = {name: pose[0] for name, pose in cell.blocks.items()}
    run(cell, 0.5)
    assert list(before) == [f"block_{number}" for number in range(1, 7)]
    for name, (position, _) in cell.blocks.items():
        assert position == pytest.approx(before[name], abs=1e-4)
        assert position[2] == pytest.approx(TABLE_TOP + BLOCK_SIZE[2] / 2.0, abs=1e-4)


@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("target", [-9.0, 9.0], ids=["down", "up"])
def test_joints_keep_their_limits_of_position_speed_and_effort(cell, joint, target):
    arm = cell.arms["left"]
    targets = arm.positions.copy()
    targets[joint] = target
    arm.command(targets)
    fastest = 0.0
    for _ in range(round(2.5 / STEP)):
        cell.step()
        assert (np.abs(arm.efforts) < EFFORT + 1e-6).all()
        assert (arm.positions < UPPER + 0.001).all() and (arm.positions > LOWER - 0.001).all()
        if arm.contact_force > 0.0:
            break  # what stands in the way may push a joint
        fastest = max(fastest, np.abs(arm.velocities)[joint])
    else:
        assert arm.positions[joint] == pytest.approx(np.clip(target, LOWER[joint], UPPER[joint]), abs=0.002)
    assert 0.9 * SPEED[joint] < fastest < 1.02 * SPEED[joint]


def test_arms_feel_each_other(cell):
    cell.arms["left"].command((-1.2, 0.3, 0.0, -1.5, 0.0, 1.571, 0.785))
    cell.arms["right"].command((1.2, 0.3, 0.0, -1.5, 0.0, 1.571, 0.785))
    forces = dict.fromkeys(cell.arms, 0.0)
    for _ in range(round(1.5 / STEP)):
        cell.step()
        forces = {name: max(force, cell.arms[name].contact_force) for name, force in forces.items()}
    assert min(forces.values()) > 20.0


def test_gripper_opens_and_closes(cell):
    arm = cell.arms["right"]
    assert arm.gripper_width == pytest.approx(0.08, abs=0.001)
    arm.command_gripper(0.03, 10.0)
    run(cell, 0.5)
    assert arm.gripper_width == pytest.approx(0.03, abs=0.001)
    assert not arm.is_holding


@pytest.mark.parametrize("positions", [(0.0,) * 6, (math.nan,) + (0.0,) * 6])
def test_targets_that_make_no_sense_are_refused(cell, positions):
    with pytest.raises(ArmError, match="must be 7 finite numbers"):
        cell.arms["left"].command(positions)
    with pytest.raises(ArmError, match="finite width and force"):
        cell.arms["left"].command_gripper(0.02, -1.0)


def test_values_that_make_no_sense_are_refused(cell):
    with pytest.raises(CellError, match="from 0"):
        cell.light = 1.5
    with pytest.raises(CellError, match="finite"):
        cell.drive(math.nan, 0.0, 0.0)
    with pytest.raises(CellError, match="size above 0"):
        cell.spawn("box", (0.0, 0.0, 0.5), (0.1, 0.0, 0.1))
    cell.spawn("box", (0.0, 0.0, 0.5), (0.1, 0.1, 0.1))
    with pytest.raises(CellError, match="there already"):
        cell.spawn("box", (0.0, 0.0, 0.5), (0.1, 0.1, 0.1))
    cell.delete("box")
    with pytest.raises(CellError, match="no obstacle 'box'"):
        cell.delete("box")


def test_camera_sees_both_tags_upright_where_they_are(scene):
    light, _ = scene
    found = tags_in(take(light, BRIGHT, np.random.default_rng(0)))
    assert set(found) == {tag.number for tag in TAGS}
    for tag in TAGS:
        corners = found[tag.number]
        assert corners.mean(axis=0) == pytest.approx(in_camera(tag.centre)[:2], abs=1.0)
        upper_left, upper_right, _, lower_left = corners
        assert upper_left[0] < upper_right[0] - 30 and upper_left[1] < lower_left[1] - 30


def test_camera_sees_table_and_blocks_at_their_depth(cell):
    light, depth = cell.look()
    assert light.shape == (480, 640, 3) and light.dtype == np.float32
    assert depth.shape == (480, 640) and depth.dtype == np.float32
    points = [(x, y, TABLE_TOP) for x in (-0.35, 0.35) for y in (-0.2, 0.2)]
    points += [(*position[:2], position[2] + BLOCK_SIZE[2] / 2.0) for position, _ in cell.blocks.values()]
    for point in points:
        column, row, distance = in_camera(point)
        area = depth[round(row) - 1 : round(row) + 2, round(column) - 1 : round(column) + 2]
        assert np.median(area) == pytest.approx(distance, abs=0.004)
    floor = depth[120, 320]
    assert floor == pytest.approx(in_camera((0.9, 0.0, 0.0))[2], abs=0.6) and floor > 2.0
    assert (depth[:40] == 0.0).all()  # beyond the camera's range
    table = depth[180:190, 300:340]
    assert 0.0003 < (table - table.mean(axis=1, keepdims=True)).std() < 0.006


def test_light_scales_the_image_and_not_the_depth(cell):
    bright, _ = cell.look()
    cell.light = 0.1
    dim, depth = cell.look()
    assert np.allclose(dim, 0.1 * bright, atol=1e-6)
    assert bright.max() <= 1.0
    assert depth[240, 320] > 0.5


@pytest.mark.parametrize(
    ("settings", "lights", "tags"),
    [
        (BRIGHT, (0.4, 0.7, 1.0), {0, 1}),
        (BRIGHT, (0.01, 0.03, 0.1), set()),
        (DIM, (0.01, 0.03, 0.1), {0, 1}),
        (DIM, (0.7, 1.0), set()),
    ],
    ids=["bright settings in bright light", "bright in dim", "dim in dim", "dim in bright"],
)
def test_tags_are_found_only_with_the_settings_that_suit_the_light(scene, settings, lights, tags):
    rng = np.random.default_rng(1)
    for light in lights:
        assert set(tags_in(take(scene[0] * np.float32(light), settings, rng))) == tags, light


def test_no_contrast_brings_back_what_the_sensor_lost(scene):
    rng = np.random.default_rng(2)
    for settings, light in ((BRIGHT, 0.02), (DIM, 1.0)):
        image = take(scene[0] * np.float32(light), settings, rng)
        stretched = np.stack([cv2.equalizeHist(image[..., channel]) for channel in range(3)], axis=-1)
        assert not tags_in(stretched)


def test_home_is_where_the_arms_start(cell):
    for mount in ARMS:
        assert cell.arms[mount.name].positions == pytest.approx(mount.home)
    assert cell.base_pose == (-0.95, 0.0, 0.0)
    assert cell.odometry == (0.0, 0.0, 0.0)
