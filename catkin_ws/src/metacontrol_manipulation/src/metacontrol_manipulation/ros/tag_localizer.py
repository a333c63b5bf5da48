"""Node tag_localizer: finds the cell by its tags, the camera set for one light (designs FD2.1 and FD2.2)."""

from __future__ import annotations

import threading
from collections import deque
from typing import Any

import rospy
from dynamic_reconfigure import DynamicReconfigureCallbackException, DynamicReconfigureParameterException
from dynamic_reconfigure.client import Client
from dynamic_reconfigure.server import Server
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.lifetime import Lifetime
from node_kit.ros.reconfigure_server import Strict
from robot_formulas.geometry import Pose, quaternion_of
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Float32
from visualization_msgs.msg import Marker, MarkerArray

from metacontrol_manipulation.cfg import TagLocalizerConfig
from metacontrol_manipulation.perception.camera import Camera, CameraError
from metacontrol_manipulation.perception.localisation import CellTracker
from metacontrol_manipulation.perception.tags import SIDE, TAGS, TILT
from metacontrol_manipulation.ros.errors import RobotError
from metacontrol_manipulation.ros.images import LARGE, camera_of, read_pixels
from metacontrol_manipulation.ros.places import BaseOdometry, at_home, home_of

_SHARE_OF = 10
"""Images over which the share of those with a tag is taken: 2 s at 5 Hz."""
_LOOK_PERIOD = 0.2
"""s, wall, between two looks at whether the camera has the settings that it should have."""


class _Server(Strict, Server):
    """dynamic_reconfigure's, which refuses what it does not have."""


class TagLocalizer:
    """Publishes `cell_pose`, `tag_detection`, `tag_share` and `tag_markers`; sets up the camera."""

    def __init__(self) -> None:
        """Read the parameters and connect.

        Raises:
            ParameterError: a parameter cannot be used.
        """
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        self._camera_node = parameters.text("camera", "camera")
        self._odometry = BaseOdometry()
        self._home = home_of(parameters)
        self._begin()
        self._odometry.when_set_back(self._begin)
        self._camera: Camera | None = None
        self._with_tags: deque[bool] = deque(maxlen=_SHARE_OF)
        self._wanted: dict[str, float] = {}
        self._set: dict[str, float] = {}
        self._changed = threading.Event()
        self._pose = rospy.Publisher("cell_pose", PoseWithCovarianceStamped, queue_size=1, latch=True)
        self._detection = rospy.Publisher("tag_detection", PoseStamped, queue_size=1)
        self._share = rospy.Publisher("tag_share", Float32, queue_size=1)
        self._markers = rospy.Publisher("tag_markers", MarkerArray, queue_size=1)
        self._server = _Server(TagLocalizerConfig, self._on_settings)
        self._inputs = (
            rospy.Subscriber("camera/camera_info", CameraInfo, self._on_info, queue_size=1),
            rospy.Subscriber("camera/image_raw", Image, self._on_image, queue_size=1, buff_size=LARGE),
        )

    def keep_camera_set(self) -> None:
        """Give the camera its settings, also when its driver was started again, until the node ends."""
        client: Any = None
        while not rospy.is_shutdown():
            self._changed.wait(_LOOK_PERIOD)
            self._changed.clear()
            if self._set == self._wanted:
                continue
            try:
                client = client or Client(self._camera_node, timeout=2.0, config_callback=self._on_camera)
                wanted = dict(self._wanted)
                client.update_configuration(wanted)
                self._set = wanted
            except (
                rospy.ROSException,
                rospy.ServiceException,
                DynamicReconfigureCallbackException,
                DynamicReconfigureParameterException,
            ) as error:
                rospy.logwarn_throttle(10.0, f"the camera {self._camera_node} can't be set: {error}")

    # Callbacks

    def _begin(self) -> None:
        self._tracker = CellTracker(at_home(self._home))

    def _on_settings(self, config: TagLocalizerConfig, _level: int) -> TagLocalizerConfig:
        self._wanted = {"exposure": config["exposure"], "gain": config["gain"]}
        self._with_tags.clear()  # what was not seen with other settings says nothing of these
        self._changed.set()
        return config

    def _on_camera(self, config: dict[str, Any]) -> None:
        """Take the settings that the camera has: its driver may have been started again, or somebody has set it."""
        self._set = {name: config.get(name, 0.0) for name in self._wanted}
        self._changed.set()

    def _on_info(self, message: CameraInfo) -> None:
        try:
            self._camera = camera_of(message)
        except CameraError as error:
            rospy.logwarn_throttle(10.0, f"camera/camera_info ignored: {error}")

    def _on_image(self, image: Image) -> None:
        tracker = self._tracker
        base = self._odometry.at(image.header.stamp)
        if self._camera is None or base is None:
            return
        try:
            view = tracker.look(read_pixels(image), self._camera, base)
        except RobotError as error:
            rospy.logwarn_throttle(10.0, f"camera/image_raw ignored: {error}")
            return
        self._with_tags.append(view is not None)
        self._share.publish(sum(self._with_tags) / len(self._with_tags))
        self._markers.publish(_markers(view.cell if view else None, view.ids if view else (), image.header.stamp))
        known = tracker.known
        if view is None or known is None:
            return
        detection = PoseStamped(pose=_message(view.cell))
        detection.header.stamp, detection.header.frame_id = image.header.stamp, "base_link"
        self._detection.publish(detection)
        cell = PoseWithCovarianceStamped()
        cell.header.stamp, cell.header.frame_id = image.header.stamp, "odom"
        cell.pose.pose = _message(known.cell)
        cell.pose.covariance[0] = cell.pose.covariance[7] = known.deviation**2
        cell.pose.covariance[35] = known.turn**2
        self._pose.publish(cell)


def _message(pose: Pose) -> PoseMessage:
    message = PoseMessage()
    message.position.x, message.position.y = pose.x, pose.y
    message.orientation.z, message.orientation.w = quaternion_of(pose.yaw)
    return message


def _markers(cell: Pose | None, ids: tuple[int, ...], stamp: rospy.Time) -> MarkerArray:
    """Return a green board for each tag that was found; the others are deleted."""
    markers = []
    for tag, (x, y, z) in TAGS.items():
        marker = Marker(ns="tags", id=tag, type=Marker.CUBE)
        marker.header.stamp, marker.header.frame_id = stamp, "base_link"
        marker.action = Marker.ADD if cell and tag in ids else Marker.DELETE
        if cell and tag in ids:
            there = cell @ Pose(x, y)
            marker.pose.position.x, marker.pose.position.y, marker.pose.position.z = there.x, there.y, z
            tilt_z, tilt_w = quaternion_of(TILT)
            yaw_z, yaw_w = quaternion_of(cell.yaw)
            q = marker.pose.orientation  # the turn about z, then that about y
            q.x, q.y, q.z, q.w = -yaw_z * tilt_z, yaw_w * tilt_z, yaw_z * tilt_w, yaw_w * tilt_w
            marker.scale.x, marker.scale.y, marker.scale.z = 0.004, SIDE, SIDE
            marker.color.g, marker.color.a = 1.0, 0.8
        markers.append(marker)
    return MarkerArray(markers)


def main() -> None:
    """Run the node; exit status 2 when a parameter cannot be used."""
    with Lifetime("tag_localizer", ParameterError) as life:
        life.start()
        TagLocalizer().keep_camera_set()
