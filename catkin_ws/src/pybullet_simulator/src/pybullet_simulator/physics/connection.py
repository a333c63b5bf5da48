"""Connection to PyBullet, with its window or without."""

from __future__ import annotations

import ctypes

import pybullet


class PhysicsError(RuntimeError):
    """PyBullet cannot start with the requested settings."""


def connect(gui: bool) -> int:
    """Return a PyBullet client, with a window or without.

    Raises:
        PhysicsError: the window cannot open, or PyBullet has too many clients.
    """
    if gui:
        _check_display()
    client = int(pybullet.connect(pybullet.GUI if gui else pybullet.DIRECT))
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


def _check_display() -> None:
    """Raise PhysicsError where no X display answers; PyBullet itself would end the process."""
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError as error:
        raise PhysicsError("PyBullet's window needs libX11: ./mros setup --gui, or gui:=false") from error
    x11.XOpenDisplay.restype = ctypes.c_void_p
    display = x11.XOpenDisplay(None)
    if not display:
        raise PhysicsError("PyBullet's window needs a display, and none answers: set DISPLAY, or use gui:=false")
    x11.XCloseDisplay(ctypes.c_void_p(display))
