import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pybullet_simulator.physics.simulation import Settings, Simulation, SimulationError
from pybullet_simulator.robot.motion_sensors import REAL, VIBRATION, Errors
from pybullet_simulator.world.obstacles import CLUTTER_MASS, CLUTTER_SIZE, ObstacleError
from pybullet_simulator.world.walking import CLEARANCE, Walker
from pybullet_simulator.world.world import MAPPED, Box, World
from robot_formulas.geometry import Pose

WALL = Box("wall", "wall", 4.5, 0.0, 1.0, 8.0, 2.0)
"""Its near face is at x = 4."""


@pytest.fixture
def simulate():
    running = []

    def make(boxes=(WALL,), **settings):
        simulation = Simulation(World("hall", -20.0, 20.0, -20.0, 20.0, tuple(boxes)), Settings(**settings))
        running.append(simulation)
        return simulation

    yield make
    for simulation in running:
        simulation.close()


def drive(simulation, seconds, *command):
    for step in range(round(seconds * 100)):
        if command and step % 5 == 0:
            simulation.command(*command)
        simulation.step()


def test_front_rays_see_a_wall_at_its_distance(simulate):
    simulation = simulate()
    laser = simulation.robot.front_laser
    ranges = simulation.scan(laser)
    assert ranges.shape == (361,)
    assert ranges[180] == pytest.approx(4.0 - laser.mount.x, abs=1e-3)
    angle = laser.angle_min + 200 * laser.angle_increment
    assert ranges[200] == pytest.approx((4.0 - laser.mount.x) / math.cos(angle), abs=1e-3)
    assert np.isinf(ranges[0])


def test_rays_follow_the_robot_and_never_hit_it(simulate):
    simulation = simulate(initial_pose=Pose(2.0, 1.0, math.pi))
    assert np.isinf(simulation.scan(simulation.robot.front_laser)[90:271]).all()
    rear = simulation.scan(simulation.robot.rear_laser)
    assert rear[180] == pytest.approx(4.0 - 2.0 - simulation.robot.front_laser.mount.x, abs=1e-3)


def test_rays_pass_through_robot_and_floor(simulate):
    physics = simulate().physics
    assert physics.sweep(Pose(-2.0, 0.0), 0.18, np.zeros(1), 10.0) == pytest.approx([4.0 - -2.0], abs=1e-3)
    assert np.isinf(physics.sweep(Pose(-2.0, 0.0), -0.2, np.zeros(1), 10.0))


@pytest.fixture(scope="module")
def physics_of_everything():
    """Walls, boxes that stand askew, a loose one, a person and a wall of a map, and the robot at the origin."""
    mapped = Box("map", MAPPED, -6.0, 0.0, 0.1, 3.0, 2.0, 0.4)
    boxes = (
        WALL,
        Box("low", "box", 0.0, 2.0, 0.5, 1.0, 0.1, 0.7),
        Box("askew", "box", -2.0, -2.0, 2.0, 0.1, 1.0, -0.5),
    )
    simulation = Simulation(World("hall", -20.0, 20.0, -20.0, 20.0, (*boxes, mapped)), Settings())
    simulation.spawn(Box("", "clutter", 2.0, -2.0, *CLUTTER_SIZE), CLUTTER_MASS)
    simulation.spawn_walker(Walker("ann", ((-3.0, 3.0), (-3.0, 5.0)), 1.0))
    yield simulation.physics
    simulation.close()


@given(
    x=st.floats(-8.0, 8.0),
    y=st.floats(-6.0, 6.0),
    height=st.sampled_from([0.06, 0.18]),
    reach=st.floats(0.01, 3.0),
)
def test_rays_hit_nothing_where_it_is_empty(physics_of_everything, x, y, height, reach):
    empty = physics_of_everything.is_empty(Pose(x, y), height, reach)
    lengths = physics_of_everything.sweep(Pose(x, y), height, np.linspace(-math.pi, math.pi, 180), reach)
    assert not empty or np.isinf(lengths).all()


def test_robot_and_floor_leave_it_empty(physics_of_everything):
    assert physics_of_everything.is_empty(Pose(0.0, 0.0), 0.06, 1.0)
    for x, y in ((4.0, 0.0), (-2.0, -2.0), (2.0, -2.0), (-3.0, 3.0), (-6.0, 0.0)):
        assert not physics_of_everything.is_empty(Pose(x - 0.5, y), 0.06, 1.0)


def test_depth_image_sees_wall_and_floor(simulate):
    simulation = simulate()
    depth = simulation.depth_image()
    assert depth.shape == (120, 160)
    assert depth[60, 80] == pytest.approx(4.0 - simulation.robot.camera.mount.x, abs=0.02)
    assert depth[119, 80] < depth[60, 80]


def test_command_expires_and_the_base_stops(simulate):
    simulation = simulate(boxes=())
    drive(simulation, 0.5, 0.5, 0.0, 0.3)
    assert simulation.velocity[0] == pytest.approx(0.5, abs=1e-3)
    drive(simulation, 0.4)
    assert simulation.velocity[0] == pytest.approx(0.5, abs=1e-3)
    drive(simulation, 0.4)
    assert np.abs(simulation.velocity).max() < 1e-6


def test_no_command_no_motion(simulate):
    simulation = simulate(boxes=())
    drive(simulation, 1.0)
    assert simulation.pose == Pose(0.0, 0.0, 0.0)
    assert simulation.acceleration == (0.0, 0.0)


def test_acceleration_is_limited(simulate):
    simulation = simulate(boxes=())
    limits = simulation.robot.max_acceleration, simulation.robot.max_turn_acceleration
    last = simulation.velocity
    simulation.command(0.6, 0.8, 2.0)
    for _ in range(25):
        simulation.step()
        velocity = simulation.velocity
        turned = abs(velocity[2]) * 0.01 * math.hypot(*velocity[:2])  # turning the frame changes the components
        assert math.hypot(velocity[0] - last[0], velocity[1] - last[1]) <= limits[0] * 0.01 + turned + 1e-6
        assert abs(velocity[2] - last[2]) <= limits[1] * 0.01 + 1e-6
        last = velocity
    assert math.hypot(*last[:2]) == pytest.approx(1.0, abs=1e-3)


def test_commands_are_clipped_and_drive_all_directions(simulate):
    simulation = simulate(boxes=())
    drive(simulation, 1.0, 0.0, 30.0, 0.0)
    assert simulation.velocity[:2] == pytest.approx((0.0, simulation.robot.max_speed), abs=1e-3)
    assert simulation.pose.y > 0.9


@pytest.mark.parametrize("command", [(math.nan, 0.0, 0.0), (0.0, math.inf, 0.0), (0.0, 0.0, -math.inf)])
def test_command_that_is_not_finite_is_refused(simulate, command):
    simulation = simulate(boxes=())
    with pytest.raises(SimulationError, match="not finite"):
        simulation.command(*command)
    drive(simulation, 0.2)
    assert simulation.pose == Pose(0.0, 0.0, 0.0)


def test_pushing_into_a_wall_is_one_contact(simulate):
    simulation = simulate(initial_pose=Pose(3.0, 0.0, 0.0))
    drive(simulation, 3.0, 0.5, 0.0, 0.0)
    assert simulation.contacts == 1
    assert simulation.touching() == ("wall",)
    assert simulation.pose.x == pytest.approx(4.0 - 0.48, abs=0.01)


def test_coming_back_to_the_wall_is_a_second_contact(simulate):
    simulation = simulate(initial_pose=Pose(3.4, 0.0, 0.0))
    drive(simulation, 1.0, 0.5, 0.0, 0.0)
    drive(simulation, 1.5, -0.5, 0.0, 0.0)
    assert simulation.contacts == 1
    drive(simulation, 2.5, 0.5, 0.0, 0.0)
    assert simulation.contacts == 2


def test_same_seed_same_run(simulate):
    def run(seed):
        simulation = simulate(seed=seed, errors=REAL)
        drive(simulation, 3.0, 0.5, 0.1, 0.2)
        return simulation.pose, simulation.acceleration, simulation.odometry.wheels, simulation.localised

    assert run(3) == run(3)
    assert all(one != other for one, other in zip(run(3), run(4), strict=True))


def test_vibration_grows_with_speed(simulate):
    for speed in (0.3, 0.75):
        simulation = simulate(boxes=(), seed=1)
        drive(simulation, 0.5, speed, 0.0, 0.0)
        samples = []
        for _ in range(8):
            simulation.command(speed, 0.0, 0.0)
            for _ in range(50):
                simulation.step()
                samples.append(simulation.acceleration[0])
        middle = np.quantile(np.abs(samples), 0.683)  # a normal distribution's standard deviation; jolts do not matter
        assert middle == pytest.approx(VIBRATION * speed, rel=0.15)


def test_risk_near_a_wall_and_none_at_rest_or_driving_away(simulate):
    simulation = simulate(initial_pose=Pose(2.6, 0.0, 0.0))
    drive(simulation, 0.2)
    assert simulation.safety == 0.0
    drive(simulation, 0.3, 0.5, 0.0, 0.0)
    distance = 4.0 - simulation.pose.x - simulation.robot.front_laser.mount.x
    assert simulation.safety == pytest.approx(1.0 - distance / (0.5 / 0.4), abs=0.01)
    drive(simulation, 0.5, -0.5, 0.0, 0.0)
    assert simulation.safety == 0.0


def test_risk_of_driving_backwards_is_seen_from_the_rear_laser(simulate):
    simulation = simulate(initial_pose=Pose(2.6, 0.0, math.pi))
    drive(simulation, 0.4, -0.5, 0.0, 0.0)
    distance = 4.0 - simulation.pose.x + simulation.robot.rear_laser.mount.x
    assert simulation.safety == pytest.approx(1.0 - distance / (0.5 / 0.4), abs=0.02)
    drive(simulation, 0.5, 0.5, 0.0, 0.0)
    assert simulation.safety == 0.0


def test_robot_that_only_backs_off_is_seen_from_the_front_laser(simulate):
    simulation = simulate(initial_pose=Pose(3.45, 0.0, math.pi))
    drive(simulation, 0.4, -0.1, 0.0, 0.0)
    assert simulation.velocity[0] == pytest.approx(-0.1, abs=0.02)
    assert simulation.safety == 0.0


def test_risk_counts_what_is_too_low_for_the_laser(simulate):
    simulation = simulate(boxes=[Box("sill", "box", 1.0, 0.0, 0.2, 1.0, 0.1)])
    drive(simulation, 0.3, 0.5, 0.0, 0.0)
    assert np.isinf(simulation.scan(simulation.robot.front_laser)).all()
    assert simulation.safety > 0.5


def test_energy_follows_the_consumption_factor(simulate):
    simulation = simulate(boxes=(), seed=2)
    drive(simulation, 1.0, 0.5, 0.0, 0.0)
    drive(simulation, 1.0, 0.5, 0.0, 0.0)
    usual = simulation.energy
    simulation.set_consumption_factor(1.6)
    drive(simulation, 1.0, 0.5, 0.0, 0.0)
    assert 0.25 < usual < 0.65
    assert simulation.energy > 1.3 * usual
    assert simulation.battery.charge < 1.0
    assert simulate(boxes=(), charge=0.25).battery.charge == 0.25


def test_odometry_starts_at_zero_and_localisation_closes_the_chain(simulate):
    start = Pose(1.0, -2.0, 1.0)
    simulation = simulate(boxes=(), initial_pose=start, errors=Errors(odometry_drift=0.05))
    assert simulation.odometry.filtered == simulation.odometry.wheels == Pose(0.0, 0.0, 0.0)
    drive(simulation, 4.0, 0.5, 0.0, 0.0)
    truth, odometry = start.inverse() @ simulation.pose, simulation.odometry
    assert odometry.filtered.x == pytest.approx(1.05 * truth.x, rel=1e-6)
    assert odometry.filtered.yaw == pytest.approx(0.0, abs=1e-9)
    assert odometry.wheels.yaw == pytest.approx(0.05 * truth.x, rel=1e-6)
    found = simulation.map_to_odom @ odometry.filtered
    assert (found.x, found.y, found.yaw) == pytest.approx(
        (simulation.pose.x, simulation.pose.y, simulation.pose.yaw), abs=1e-6
    )


def test_perfect_sensors_tell_the_truth(simulate):
    simulation = simulate(boxes=(), initial_pose=Pose(1.0, 2.0, 0.5))
    drive(simulation, 4.0, 0.4, 0.2, 0.5)
    found = Pose(1.0, 2.0, 0.5) @ simulation.odometry.wheels
    assert (found.x, found.y, found.yaw) == pytest.approx(
        (simulation.pose.x, simulation.pose.y, simulation.pose.yaw), abs=1e-6
    )
    assert simulation.odometry.velocity == pytest.approx(simulation.velocity)


def test_slipping_base_moves_otherwise_than_its_wheels_turn(simulate):
    gaps = []
    for seed in range(3):
        simulation = simulate(boxes=(), seed=seed, errors=Errors(slip=0.05))
        drive(simulation, 5.0, 0.5, 0.0, 0.0)
        gaps.append(simulation.pose.x - simulation.odometry.wheels.x)
        assert simulation.odometry.velocity[0] == pytest.approx(0.5, abs=0.01)  # the wheels do as they are told
    assert 0.001 < max(map(abs, gaps)) < 0.2
    assert len(set(gaps)) == 3


def test_initial_pose_in_an_obstacle_is_refused(simulate):
    with pytest.raises(SimulationError, match="puts the robot into 'wall'"):
        simulate(initial_pose=Pose(3.7, 0.0, 0.0))
    with pytest.raises(SimulationError, match="off the floor"):
        simulate(initial_pose=Pose(50.0, 0.0, 0.0))


def test_window_without_a_display_is_refused(simulate, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(SimulationError, match="gui:=false"):
        simulate(gui=True)


def test_spawned_obstacle_is_seen_touched_and_taken_away(simulate):
    simulation = simulate(boxes=())
    name = simulation.spawn(Box("", "clutter", 2.0, 0.0, *CLUTTER_SIZE), CLUTTER_MASS)
    laser = simulation.robot.front_laser
    assert simulation.scan(laser)[180] == pytest.approx(2.0 - 0.15 - laser.mount.x, abs=1e-3)
    drive(simulation, 5.0, 0.5, 0.0, 0.0)
    assert simulation.contacts == 1 and simulation.touching() == (name,)
    assert simulation.pose.x == pytest.approx(2.0 - 0.15 - 0.48, abs=0.05)
    simulation.obstacles.delete(name)
    drive(simulation, 2.0, 0.5, 0.0, 0.0)
    assert np.isinf(simulation.scan(laser)).all()
    assert simulation.pose.x > 2.0


@pytest.mark.parametrize(
    ("box", "said"),
    [
        (Box("a", "clutter", 0.3, 0.0, 0.3, 0.3, 1.0), "'a': the robot stands at"),
        (Box("a", "clutter", 4.2, 0.0, 0.3, 0.3, 1.0), "'a': .* lies in 'wall'"),
        (Box("a", "clutter", 0.0, 25.0, 0.3, 0.3, 1.0), "'a': .* is off the floor"),
        (Box("a", "clutter", math.nan, 0.0, 0.3, 0.3, 1.0), "'a': every number must be finite"),
        (Box("a", "clutter", 2.0, 2.0, 0.3, -0.3, 1.0), "'a': sizes must be"),
        (Box("a", "clutter", 2.0, 2.0, 0.3, 50.0, 1.0), "'a': sizes must be"),
        (Box("wall", "clutter", 2.0, 2.0, 0.3, 0.3, 1.0), "the name is taken"),
        (Box("b", "clutter", -2.1, 0.0, 0.3, 0.3, 1.0), "'b': .* lies in 'first'"),
    ],
)
def test_obstacle_that_cannot_stand_there_is_refused(simulate, box, said):
    simulation = simulate()
    simulation.spawn(Box("first", "clutter", -2.0, 0.0, 0.3, 0.3, 1.0))
    with pytest.raises(ObstacleError, match=said):
        simulation.spawn(box)
    assert [obstacle.name for obstacle in simulation.obstacles.shown()] == ["first"]


def test_person_walks_to_and_fro_and_waits_for_the_robot(simulate):
    simulation = simulate(boxes=(), initial_pose=Pose(0.0, 0.0, 0.0))
    simulation.spawn_walker(Walker("ann", ((3.0, 3.0), (3.0, 5.0)), 1.0))
    simulation.spawn_walker(Walker("bob", ((4.0, 0.0), (-4.0, 0.0)), 1.0))
    drive(simulation, 3.0)
    ann, bob = (obstacle.pose for obstacle in simulation.obstacles.shown())
    assert (ann.x, ann.y) == pytest.approx((3.0, 4.0), abs=0.02)
    drive(simulation, 3.0)
    bob = simulation.obstacles.shown()[1].pose
    assert bob.x == pytest.approx(0.48 + 0.25 + CLEARANCE, abs=0.02)
    assert simulation.contacts == 0
    assert simulation.scan(simulation.robot.front_laser)[180] == pytest.approx(bob.x - 0.25 - 0.393, abs=0.03)


@pytest.mark.parametrize(
    ("walker", "said"),
    [
        (Walker("a", ((1.0, 1.0),)), "waypoints: give two or more"),
        (Walker("a", ((1.0, math.inf), (1.0, 2.0))), "of finite numbers"),
        (Walker("a", ((1.0, 1.0), (1.0, 2.0)), 9.0), "speed: is 9; give"),
        (Walker("a", ((1.0, 1.0), (1.0, 90.0))), "off the floor"),
        (Walker("a", ((0.0, 0.0), (3.0, 0.0))), "the robot stands at the first waypoint"),
        (Walker("a", ((3.0, 2.0), (7.0, 2.0))), r"the way leads into 'wall' at \(4, 2\)"),
    ],
)
def test_person_without_a_way_is_refused(simulate, walker, said):
    with pytest.raises(ObstacleError, match=said):
        simulate().spawn_walker(walker)


def test_deleting_what_is_not_there_names_what_is(simulate):
    simulation = simulate(boxes=())
    simulation.spawn(Box("crate", "clutter", 2.0, 0.0, 0.3, 0.3, 1.0))
    with pytest.raises(ObstacleError, match="no obstacle 'chair'; there are: crate"):
        simulation.obstacles.delete("chair")
    simulation.obstacles.delete("")
    assert simulation.obstacles.shown() == ()


@pytest.mark.parametrize("light", [-0.1, 1.1, math.nan])
def test_bad_light_is_refused(simulate, light):
    with pytest.raises(SimulationError, match="light"):
        simulate(boxes=()).set_light(light)


def test_same_seed_same_run_with_clutter_and_people(simulate):
    def run():
        simulation = simulate(seed=5, errors=REAL)
        simulation.spawn(Box("crate", "clutter", 1.5, 0.1, *CLUTTER_SIZE), CLUTTER_MASS)
        simulation.spawn_walker(Walker("ann", ((3.0, 3.0), (0.0, -3.0)), 1.2))
        drive(simulation, 6.0, 0.5, 0.05, 0.02)
        return simulation.pose, simulation.contacts, simulation.obstacles.shown(), simulation.odometry.wheels

    assert run() == run()
