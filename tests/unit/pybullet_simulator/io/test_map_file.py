import math

import cv2
import numpy as np
import pybullet
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.messages.grid import GridMessageError, occupancy_grid, read_grid
from pybullet_simulator.messages.state import stamp
from pybullet_simulator.physics.simulation import Settings, Simulation
from pybullet_simulator.world.grid import FREE, OCCUPIED, UNKNOWN, cover
from pybullet_simulator.world.world import MAPPED_HEIGHT, WorldError, rasterise
from robot_formulas.geometry import Pose

GOOD = {
    "image": "hall.pgm",
    "resolution": 0.1,
    "origin": [-1.0, -2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}
BLACK, GREY, WHITE = 0, 205, 254


@pytest.fixture
def make(tmp_path):
    """Writes a map of 30 x 20 pixels, white but for a black block of 4 x 5 pixels in its upper left corner."""

    def write(pixels=None, name="hall.pgm", **changes):
        if pixels is None:
            pixels = np.full((20, 30), WHITE, dtype=np.uint8)
            pixels[0:5, 0:4] = BLACK
            pixels[19, 29] = GREY
        cv2.imwrite(str(tmp_path / name), pixels)
        content = {key: value for key, value in (GOOD | {"image": name} | changes).items() if value is not None}
        path = tmp_path / "hall.yaml"
        path.write_text("\n".join(f"{key}: {value}" for key, value in content.items()) + "\n")
        return path

    return write


def cell(grid, x, y):
    cos, sin = math.cos(grid.origin_yaw), math.sin(grid.origin_yaw)
    right, up = x - grid.origin_x, y - grid.origin_y
    return grid.cells[int((cos * up - sin * right) / grid.resolution), int((cos * right + sin * up) / grid.resolution)]


def test_the_image_top_is_the_map_far_side(make):
    world = read_world(make())
    (box,) = world.boxes
    assert (box.x, box.y) == pytest.approx((-0.8, -0.25))
    assert (box.length, box.width, box.height) == pytest.approx((0.4, 0.5, MAPPED_HEIGHT))
    grid = rasterise(world)
    assert cell(grid, -0.95, -0.05) == OCCUPIED
    assert cell(grid, 0.0, -1.0) == FREE
    assert cell(grid, 1.95, -1.95) == UNKNOWN


@pytest.mark.parametrize("resolution", [0.037, 0.0123, 0.5])
def test_odd_resolution_scales_the_world(make, resolution):
    (box,) = read_world(make(resolution=resolution)).boxes
    assert (box.length, box.width) == pytest.approx((4 * resolution, 5 * resolution))


def test_turned_map_turns_world_and_message(make):
    world = read_world(make(origin=[1.0, 2.0, math.pi / 2]))
    (box,) = world.boxes
    assert (box.x, box.y) == pytest.approx((1.0 - 1.75, 2.0 + 0.2))
    assert world.nearest(-0.9, 2.3)[1] == 0.0
    assert world.contains(0.0, 4.0) and not world.contains(2.0, 4.0)
    assert (world.x_min, world.x_max, world.y_min, world.y_max) == pytest.approx((-1.0, 1.0, 2.0, 5.0))
    origin = occupancy_grid(rasterise(world), stamp(1)).info.origin
    assert (origin.orientation.z, origin.orientation.w) == pytest.approx((math.sqrt(0.5), math.sqrt(0.5)))


def test_negated_map_has_black_for_free(make):
    assert sum(box.length * box.width for box in read_world(make(negate=1)).boxes) == pytest.approx(6.0 - 0.2)


def test_scale_mode_keeps_probabilities_and_raw_mode_the_values(make):
    image = np.array([[0, 127, 254]], dtype=np.uint8)
    assert rasterise(read_world(make(image, mode="scale"))).cells[0].tolist() == [100, 67, 0]
    image = np.array([[0, 70, 100, 101, 255]], dtype=np.uint8)
    assert rasterise(read_world(make(image, mode="raw"))).cells[0].tolist() == [0, 70, 100, -1, -1]


def test_coloured_and_transparent_images_are_read(make):
    image = np.full((1, 3, 4), 255, dtype=np.uint8)
    image[0, 0, :3] = 0
    image[0, 1] = (100, 100, 100, 0)
    assert rasterise(read_world(make(image, "hall.png", mode="scale"))).cells[0].tolist() == [100, -1, 0]


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
@pytest.mark.parametrize(("depth", "channels"), [(np.uint8, 1), (np.uint8, 3), (np.uint8, 4), (np.uint16, 4)])
def test_a_large_image_is_read_as_its_parts_are(make, mode, depth, channels):
    part = np.random.default_rng(0).integers(0, np.iinfo(depth).max + 1, (30, 30, channels)).astype(depth)
    part[::2, :, -1] = np.iinfo(depth).max
    cells = [
        rasterise(read_world(make(image, "hall.png", mode=mode))).cells for image in (part, np.tile(part, (10, 10, 1)))
    ]
    np.testing.assert_array_equal(np.tile(cells[0], (10, 10)), cells[1])


def test_a_colour_is_the_mean_of_its_channels(make):
    image = np.random.default_rng(0).integers(0, 200, (30, 30, 3)).astype(np.uint8)
    mean = image.astype(np.float32).mean(axis=2)[::-1]
    cells = rasterise(read_world(make(image, "hall.png", mode="raw"))).cells
    np.testing.assert_array_equal(cells, np.where(mean <= OCCUPIED, mean, UNKNOWN).astype(np.int8))


@pytest.mark.parametrize("shape", [(4500, 4500), (1, 40_001)])
@pytest.mark.parametrize("extension", [".pgm", ".png", ".bmp", ".jpg"])
def test_a_large_image_is_refused_by_its_header(make, extension, shape):
    path = make()
    image = bytes(cv2.imencode(extension, np.zeros(shape, dtype=np.uint8))[1])
    (path.parent / "hall.pgm").write_bytes(image[:2000])
    with pytest.raises(WorldError, match=r"hall\.pgm has \d+ x \d+ pixels \(limits: 20,000,000, 40,000 along an edge"):
        read_world(path)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"resolution": 0}, "resolution: is 0; give m per cell"),
        ({"resolution": "fine"}, "resolution: is 'fine'; give a finite number"),
        ({"resolution": ".inf"}, "resolution: is inf"),
        ({"resolution": 400.0}, "resolution: 400 makes 30 x 20 pixels too large"),
        ({"resolution": None}, "resolution: is None"),
        ({"origin": None}, r"origin: is None; give \[x, y, yaw\]"),
        ({"origin": [0, 0]}, r"origin: is \[0, 0\]"),
        ({"origin": "[0, 0, .nan]"}, "origin: is nan"),
        ({"negate": 2}, "negate: is 2; give 0 or 1"),
        ({"mode": "fancy"}, "mode: is 'fancy'; give one of trinary"),
        ({"occupied_thresh": 1.5}, "occupied_thresh: is 1.5"),
        ({"free_thresh": 0.9}, "free_thresh: 0.9 is above occupied_thresh"),
        ({"image": None}, "image: is None"),
        ({"image": "nowhere.pgm"}, r"image: .*nowhere\.pgm: No such file"),
        ({"image": "hall.yaml"}, "hall.yaml is no image that can be read"),
    ],
)
def test_bad_map_is_refused_in_one_line(make, changes, said):
    with pytest.raises(WorldError, match=said) as caught:
        read_world(make(**changes))
    assert "hall.yaml" in str(caught.value) and "\n" not in str(caught.value)


def test_a_map_of_specks_is_refused(make):
    with pytest.raises(WorldError, match=r"hall\.yaml: image: .* more than 50,000 rectangles; clear the map of specks"):
        read_world(make((np.indices((400, 400)).sum(axis=0) % 2 * WHITE).astype(np.uint8)))


@settings(deadline=None)
@given(arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12))))
def test_rectangles_cover_every_occupied_cell_once_and_no_other(occupied):
    count = np.zeros(occupied.shape, dtype=int)
    for row, column, rows, columns in cover(occupied):
        count[row : row + rows, column : column + columns] += 1
    assert np.array_equal(count, occupied.astype(int))


def test_a_room_takes_few_rectangles():
    room = np.zeros((200, 300), dtype=bool)
    room[:3] = room[-3:] = room[:, :3] = room[:, -3:] = True
    assert len(cover(room)) == 4


def test_robot_sees_and_touches_a_mapped_wall(make):
    image = np.full((100, 100), WHITE, dtype=np.uint8)
    image[:, 70:72] = BLACK
    simulation = Simulation(read_world(make(image, origin=[-5.0, -5.0, 0.0])), Settings(Pose(0.5, 0.0, 0.0)))
    laser = simulation.robot.front_laser
    assert simulation.scan(laser)[180] == pytest.approx(2.0 - 0.5 - laser.mount.x, abs=1e-3)
    for _ in range(400):
        simulation.command(0.5, 0.0, 0.0)
        simulation.step()
    assert simulation.pose.x == pytest.approx(2.0 - simulation.robot.length / 2.0, abs=0.01)
    assert (simulation.contacts, simulation.touching()) == (1, ("map",))
    simulation.close()


def test_mapped_walls_rest_on_the_floor_without_contact(make):
    simulation = Simulation(read_world(make(origin=[-1.5, -1.0, 0.0])))
    simulation.step()
    assert pybullet.getContactPoints(physicsClientId=simulation.physics.client) == ()  # each would cost in every step
    simulation.close()


def test_map_survives_its_message_and_a_bad_one_is_refused(make):
    grid = rasterise(read_world(make(origin=[1.0, 2.0, 0.5])))
    message = occupancy_grid(grid, stamp(1))
    again = read_grid(message)
    assert np.array_equal(again.cells, grid.cells)
    assert (again.resolution, again.origin_x, again.origin_y, again.origin_yaw) == pytest.approx((0.1, 1.0, 2.0, 0.5))
    message.info.width = 7
    with pytest.raises(GridMessageError, match="map of 7 x 20 cells"):
        read_grid(message)
