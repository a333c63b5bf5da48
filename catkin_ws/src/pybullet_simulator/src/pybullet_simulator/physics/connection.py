"""Connection to PyBullet, with its window or without."""

from __future__ import annotations

import pybullet
from node_kit.io.x_display import DisplayError, held_display


class PhysicsError(RuntimeError):
    """PyBullet cannot start with the requested settings."""


def connect(gui: bool) -> int:
    """Return a PyBullet client, with a window or without.

    Raises:
        PhysicsError: the window cannot open, or PyBullet has too many clients.
    """
    if gui:
        try:
            with held_display():  # PyBullet itself would end the process
                client = int(pybullet.connect(pybullet.GUI))
        except DisplayError as error:
            raise PhysicsError(f"{error} (gui:=false)") from error
    else:
        client = int(pybullet.connect(pybullet.DIRECT))
    if client < 0:
        raise PhysicsError("PyBullet does not start; run without its window (gui:=false)")
    return client


def look_at(client: int, distance: float, yaw: float, pitch: float, middle: tuple[float, float, float]) -> None:
    """Let the window show a place.

    Args:
        client: one with a window.
        distance: m from the place.
        yaw: deg; 0 looks north.
        pitch: deg; negative looks down.
        middle: the place.
    """
    pybullet.configureDebugVisualizer(pybullet.COV_ENABLE_GUI, 0, physicsClientId=client)
    pybullet.configureDebugVisualizer(pybullet.COV_ENABLE_SHADOWS, 0, physicsClientId=client)
    pybullet.resetDebugVisualizerCamera(distance, yaw, pitch, middle, physicsClientId=client)


def disconnect(client: int) -> None:
    """Free a client's world; it cannot be used any more."""
    if pybullet.isConnected(client):
        pybullet.disconnect(client)
