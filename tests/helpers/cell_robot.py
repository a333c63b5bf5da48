"""The simulated mobile manipulator without ROS, as a program that builds the pyramid sees it."""

import math
from functools import cached_property

import numpy as np
from arm_motion.timing import Trajectory
from metacontrol_manipulation.handling.deeds import Move
from metacontrol_manipulation.perception.camera import Camera, mounted
from metacontrol_manipulation.perception.tags import find_cell
from pybullet_simulator.physics.cell_simulation import STEP, CellSimulation
from pybullet_simulator.robot.manipulator import MAST_CAMERA
from robot_formulas.geometry import Pose

FORCE_LIMIT = 25.0


class CellRobot:
    """Steps the simulation while it acts. It knows by the truth where the cell is, if it need not see a tag."""

    def __init__(self, seed=0):
        self.needs_tags = False
        self.simulation = CellSimulation(seed)
        self.blocked = set()
        self.ways = {"left": [], "right": []}
        """Targets of each arm's trajectories; the last one leads to where the arm is."""
        self.under_way, self.results, self.most_at_once = {}, [], 0
        for _ in range(40):
            self.step()

    def close(self):
        self.simulation.close()

    def step(self):
        self.simulation.step()

    @property
    def joints(self):
        return {name: arm.positions for name, arm in self.simulation.arms.items()}

    @property
    def held(self):
        return frozenset(name for name, arm in self.simulation.arms.items() if arm.is_holding)

    @property
    def working(self):
        return frozenset(self.simulation.arms) - self.blocked

    @property
    def cell(self):
        return Pose(*self.simulation.base_pose).inverse()

    @cached_property
    def camera(self):
        view = MAST_CAMERA
        pose = mounted(view.x, view.y, view.z, view.pitch)
        return Camera(view.width, view.height, view.focal_length, view.focal_length, *view.principal_point, pose)

    def sees_cell(self):
        if not self.needs_tags:
            return True
        light = self.simulation.look()[0]
        return find_cell((np.clip(light, 0.0, 1.0) * 255).astype(np.uint8), self.camera) is not None

    def depth(self):
        assert self.sees_cell(), "it is not known where the cell is"
        return self.simulation.look()[1], self.camera

    def do(self, arm, deeds):
        self.begin(arm, deeds)
        while True:
            name, succeeded = self.ended()
            if name == arm:
                return succeeded
            self.results.append((name, succeeded))

    def begin(self, arm, deeds):
        self.under_way[arm] = self._work(arm, deeds)

    def ended(self):
        if self.results:
            return self.results.pop(0)
        while True:
            self.most_at_once = max(self.most_at_once, len(self.under_way))
            for arm, work in list(self.under_way.items()):
                try:
                    next(work)
                except StopIteration as end:
                    del self.under_way[arm]
                    return arm, end.value
            self.step()

    def halt(self):
        self.under_way, self.results = {}, []
        for arm in self.simulation.arms.values():
            arm.command(arm.positions)
        self.wait(0.5)

    def _work(self, arm, deeds):
        """Do something; each turn of the generator is a step of the simulation. Return whether it was done."""
        for deed in deeds:
            if isinstance(deed, Move):
                if not (yield from self._follow(arm, deed.trajectory)):
                    return False
            else:
                self.simulation.arms[arm].command_gripper(deed.width, deed.force)
                for _ in range(round(0.5 / STEP)):
                    yield
        return True

    def retreat(self, arm):
        if not self.ways[arm]:
            return False
        for target in reversed(self.ways[arm].pop()):
            self.simulation.arms[arm].command(target)
            for _ in range(2):
                self.step()
        return True

    def wait(self, duration):
        for _ in range(round(duration / STEP)):
            self.step()

    def move_base(self, y):
        until = self.simulation.time + 30.0
        while self.simulation.time < until:
            cell = self.cell.inverse()
            error = y - cell.y
            if abs(error) < 0.003 and abs(self.simulation.base_velocity[1]) < 0.01:
                return True
            self.simulation.drive(0.0, max(-0.3, min(0.3, 1.5 * error)), -cell.yaw)
            self.step()
        return False

    def _follow(self, name, trajectory: Trajectory):
        if name in self.blocked:
            return False
        arm, began = self.simulation.arms[name], self.simulation.time
        self.ways[name].append([])
        while (elapsed := self.simulation.time - began) < trajectory.duration + 0.15:
            target = trajectory.at(elapsed)[0]
            self.ways[name][-1].append(target)
            arm.command(target)
            yield
            if arm.contact_force > FORCE_LIMIT:
                arm.command(arm.positions)
                self.blocked.add(name)
                return False
        return True


def errors(simulation, slots):
    """Return, for each slot, how far in m the nearest block is from it."""
    return {
        slot: min(math.dist(slot.position, position) for position, _ in simulation.blocks.values()) for slot in slots
    }
