"""PyBullet: bodies that stand, lie or walk on a floor, and the robot that slides between them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pybullet
from robot_formulas.geometry import Pose, quaternion_of, yaw_of

from pybullet_simulator.io.robot_file import planar_urdf, robot_file
from pybullet_simulator.physics.connection import connect, disconnect, look_at
from pybullet_simulator.physics.sliding_base import SlidingBase, links_of, load_urdf
from pybullet_simulator.world.walking import HEIGHT, RADIUS
from pybullet_simulator.world.world import box_mesh

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from pybullet_simulator.robot.robot import DepthCamera, Robot
    from pybullet_simulator.world.world import Box, World

GRAVITY = 9.81
"""m/s2."""

_RAY_GROUP, _ROBOT_GROUP, _FLOOR_GROUP, _MAP_GROUP, _WORLD_GROUP = 1, 2, 4, 8, 16
"""Two bodies meet if the mask of each has the other's group. Bullet gives rays the group 1. The masks of robot and
floor lack it: a mask in the call that casts rays would only drop hits that Bullet has computed already."""
_EVERYTHING = _RAY_GROUP | _ROBOT_GROUP | _FLOOR_GROUP | _MAP_GROUP | _WORLD_GROUP
_BOXES_PER_MESH = 4000  # PyBullet takes no more than 131,072 vertices at once
_COLOURS = {
    "wall": (0.75, 0.75, 0.72, 1.0),
    "rack": (0.20, 0.35, 0.60, 1.0),
    "pillar": (0.55, 0.55, 0.55, 1.0),
    "pallet": (0.70, 0.50, 0.25, 1.0),
    "box": (0.80, 0.45, 0.15, 1.0),
    "clutter": (0.75, 0.15, 0.15, 1.0),
}
_PERSON = (0.20, 0.60, 0.30, 1.0)
_FLOOR = (0.40, 0.42, 0.40, 1.0)


class Physics:
    """One PyBullet world. Poses are in the map frame; bodies are PyBullet's numbers."""

    def __init__(self, world: World, robot: Robot, start: Pose, step: float, gui: bool = False) -> None:
        """Build floor, boxes and robot.

        Args:
            world: what stands on the floor from the start; its people are not put there.
            robot: its limits; its shape is that of its URDF.
            start: of the robot.
            step: s of simulated time per step.
            gui: show PyBullet's window.

        Raises:
            PhysicsError: the window cannot open.
            RobotFileError: the robot's URDF cannot be used.
        """
        self.client = connect(gui)
        if gui:
            self._look_at(world)
        pybullet.setTimeStep(step, physicsClientId=self.client)
        pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=self.client)
        pybullet.setPhysicsEngineParameter(deterministicOverlappingPairs=1, physicsClientId=self.client)
        self._floor = self._add_floor(world)
        self.map_bodies = self._add_map([box for box in world.boxes if box.mapped])
        self._robot = self._add_robot()
        self._unseen = (self._floor, self._robot)  # by rays
        # Twice what the acceleration limits need: the motors follow, but are too weak to push through an obstacle.
        inertia = robot.mass * (robot.length**2 + robot.width**2) / 12.0
        push = 2.0 * robot.mass * robot.max_acceleration
        forces = (push, push, 2.0 * inertia * robot.max_turn_acceleration)
        self.base = SlidingBase(self._robot, start, forces, self.client)

    def close(self) -> None:
        """Free the world; it cannot be used any more."""
        disconnect(self.client)

    def step(self) -> None:
        """Advance by one step."""
        pybullet.stepSimulation(physicsClientId=self.client)

    def pressing(self) -> set[int]:
        """Return the bodies that press on the robot now."""
        points = pybullet.getContactPoints(self._robot, physicsClientId=self.client)
        return {point[2] for point in points if point[9] > 0.0}

    def sweep(self, start: Pose, height: float, angles: NDArray[np.float64], length: float) -> NDArray[np.float64]:
        """Return the lengths of level rays: (n,) m, inf if a ray hits nothing. Rays ignore the robot and the floor.

        Args:
            start: of the rays, on the map; its yaw does not matter.
            height: of the rays, m.
            angles: (n,) directions in the map frame, rad.
            length: of the rays, m.
        """
        ends = np.empty((angles.size, 3))
        ends[:, 0] = start.x + length * np.cos(angles)
        ends[:, 1] = start.y + length * np.sin(angles)
        ends[:, 2] = height
        origins = np.broadcast_to((start.x, start.y, height), ends.shape)
        hits = pybullet.rayTestBatch(origins, ends, physicsClientId=self.client)
        shares = np.array([hit[2] for hit in hits])
        return np.where(shares < 1.0, shares * length, math.inf)

    def is_empty(self, middle: Pose, height: float, reach: float) -> bool:
        """Tell whether level rays that start at a point on the map certainly hit nothing; see `sweep`.

        Args:
            middle: the start of the rays.
            height: of the rays, m.
            reach: length of the rays, m.
        """
        low = (middle.x - reach, middle.y - reach, height)
        high = (middle.x + reach, middle.y + reach, height)
        near = pybullet.getOverlappingObjects(low, high, physicsClientId=self.client) or ()
        return all(body in self._unseen for body, _ in near)

    def depth_image(self, camera: DepthCamera, base: Pose) -> NDArray[np.float32]:
        """Return a camera's image from a pose of base_link: (height, width), m along the optical axis, inf beyond."""
        eye = base @ camera.mount.pose
        ahead = (eye.x + math.cos(eye.yaw), eye.y + math.sin(eye.yaw), camera.mount.z)
        vertical = 2.0 * math.degrees(math.atan(camera.height / 2.0 / camera.focal_length))
        near, far = camera.range_min, camera.range_max
        _, _, _, buffer, _ = pybullet.getCameraImage(
            camera.width,
            camera.height,
            pybullet.computeViewMatrix((eye.x, eye.y, camera.mount.z), ahead, (0.0, 0.0, 1.0)),
            pybullet.computeProjectionMatrixFOV(vertical, camera.width / camera.height, near, far),
            shadow=0,
            renderer=pybullet.ER_TINY_RENDERER,
            flags=pybullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=self.client,
        )
        buffer = np.asarray(buffer, dtype=np.float32).reshape(camera.height, camera.width)
        depth = far * near / (far - (far - near) * buffer)
        return np.where(buffer < 1.0, depth, np.float32(np.inf)).astype(np.float32)

    def add_box(self, box: Box, mass: float = 0.0) -> int:
        """Put a box on the floor; a mass of 0 kg cannot be moved."""
        shape = {"halfExtents": (box.length / 2.0, box.width / 2.0, box.height / 2.0)}
        pose = Pose(box.x, box.y, box.yaw)
        return self._add(
            pybullet.GEOM_BOX, shape, shape, _COLOURS.get(box.kind, _COLOURS["box"]), pose, box.height, mass
        )

    def add_person(self, x: float, y: float) -> int:
        """Put a person on the floor; `move` moves the person."""
        cylinder = pybullet.GEOM_CYLINDER
        visual = {"radius": RADIUS, "length": HEIGHT}
        shape = {"radius": RADIUS, "height": HEIGHT}
        return self._add(cylinder, shape, visual, _PERSON, Pose(x, y, 0.0), HEIGHT)

    def move(self, body: int, x: float, y: float) -> None:
        """Put a person elsewhere."""
        place = (x, y, HEIGHT / 2.0)
        pybullet.resetBasePositionAndOrientation(body, place, (0.0, 0.0, 0.0, 1.0), physicsClientId=self.client)

    def place(self, body: int) -> Pose:
        """Return where a body stands."""
        (x, y, _), (_, _, z, w) = pybullet.getBasePositionAndOrientation(body, physicsClientId=self.client)
        return Pose(x, y, yaw_of(z, w))

    def remove(self, body: int) -> None:
        """Take a body away."""
        pybullet.removeBody(body, physicsClientId=self.client)

    def _add(
        self,
        kind: int,
        shape: Mapping[str, object],
        visual: Mapping[str, object],
        colour: Sequence[float],
        pose: Pose,
        height: float,
        mass: float = 0.0,
    ) -> int:
        """Put a body on the floor that rays see and that stands in the way of everything."""
        body = pybullet.createMultiBody(
            mass,
            pybullet.createCollisionShape(kind, physicsClientId=self.client, **shape),
            pybullet.createVisualShape(kind, rgbaColor=colour, physicsClientId=self.client, **visual),
            (pose.x, pose.y, height / 2.0),
            (0.0, 0.0, *quaternion_of(pose.yaw)),
            physicsClientId=self.client,
        )
        pybullet.setCollisionFilterGroupMask(body, -1, _WORLD_GROUP, _EVERYTHING, physicsClientId=self.client)
        if mass > 0.0:  # with the floor's 0.5 a coefficient of 0.5, wood on concrete: the robot cannot push 500 kg
            pybullet.changeDynamics(body, -1, lateralFriction=1.0, physicsClientId=self.client)
        return int(body)

    def _look_at(self, world: World) -> None:
        """Let the window show the whole floor, seen from above and a little from the south."""
        length, width = world.x_max - world.x_min, world.y_max - world.y_min
        middle = ((world.x_max + world.x_min) / 2.0, (world.y_max + world.y_min) / 2.0 - 0.1 * width, 0.0)
        distance = 0.72 * max(0.75 * length, width)  # the window is 4:3
        look_at(self.client, distance, 0.0, -65.0, middle)

    def _add_floor(self, world: World) -> int:
        half = ((world.x_max - world.x_min) / 2.0 + 2.0, (world.y_max - world.y_min) / 2.0 + 2.0, 0.5)
        shape = {"halfExtents": half}
        middle = Pose((world.x_max + world.x_min) / 2.0, (world.y_max + world.y_min) / 2.0, 0.0)
        floor = self._add(pybullet.GEOM_BOX, shape, shape, _FLOOR, middle, -1.0)
        pybullet.setCollisionFilterGroupMask(floor, -1, _FLOOR_GROUP, _WORLD_GROUP, physicsClientId=self.client)
        return floor

    def _add_map(self, boxes: list[Box]) -> tuple[int, ...]:
        """Put the boxes of a map on the floor, thousands in one body: a body for each would slow every step."""
        bodies = []
        for first in range(0, len(boxes), _BOXES_PER_MESH):
            vertices, indices = box_mesh(boxes[first : first + _BOXES_PER_MESH])
            visual = {"vertices": vertices, "indices": indices}
            shape = {**visual, "flags": pybullet.GEOM_FORCE_CONCAVE_TRIMESH}
            body = self._add(pybullet.GEOM_MESH, shape, visual, _COLOURS["wall"], Pose(0.0, 0.0, 0.0), 0.0)
            # Neither with the floor nor with each other: PyBullet would test their triangles in every step.
            pybullet.setCollisionFilterGroupMask(
                body, -1, _MAP_GROUP, _RAY_GROUP | _WORLD_GROUP | _ROBOT_GROUP, physicsClientId=self.client
            )
            bodies.append(body)
        return tuple(bodies)

    def _add_robot(self) -> int:
        """Load the robot."""
        client = self.client
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_MATERIAL_COLORS_FROM_MTL
        body = load_urdf(planar_urdf(robot_file()), flags, client)
        for link in links_of(body, client).values():
            pybullet.setCollisionFilterGroupMask(
                body, link, _ROBOT_GROUP, _WORLD_GROUP | _MAP_GROUP, physicsClientId=client
            )
            pybullet.changeDynamics(
                body, link, linearDamping=0.0, angularDamping=0.0, jointDamping=0.0, physicsClientId=client
            )
        return body
