"""Node battery_load_control: measures the power load of the robot once per second."""

from __future__ import annotations

import threading

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from node_kit.ros.lifetime import Lifetime
from robot_formulas.power import PowerError, PowerMeter, check_factor
from sensor_msgs.msg import Imu
from std_msgs.msg import Float32

from metacontrol_sim.srv import (
    IncreaseConsumptionFactor,
    IncreaseConsumptionFactorRequest,
    IncreaseConsumptionFactorResponse,
)

PERIOD = 1.0
"""s between two measurements (published node)."""


class BatteryLoadControlNode:
    """Publishes power_load from odom, imu/data and cmd_vel; serves /increase_power_consumption."""

    def __init__(self) -> None:
        """Connect."""
        self._lock = threading.Lock()
        self._meter = PowerMeter(rospy.get_time() or None)  # ROS time is 0 before the first /clock
        self._load = rospy.Publisher("power_load", Float32, queue_size=1)
        self._factor = rospy.Publisher("power_consumption_factor", Float32, queue_size=1, latch=True)
        self._factor.publish(self._meter.factor)
        self._inputs = (
            rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=10, tcp_nodelay=True),
            rospy.Subscriber("imu/data", Imu, self._on_imu, queue_size=20, tcp_nodelay=True),
            rospy.Subscriber("cmd_vel", Twist, self._on_command, queue_size=20, tcp_nodelay=True),
        )
        self._service = rospy.Service(
            "increase_power_consumption", IncreaseConsumptionFactor, self._on_increase_consumption
        )
        self._timer = rospy.Timer(rospy.Duration(PERIOD), self._on_tick, reset=True)

    def _on_odometry(self, odometry: Odometry) -> None:
        try:
            with self._lock:
                self._meter.add_speed(odometry.twist.twist.linear.x)
        except PowerError as error:
            rospy.logwarn_throttle(10.0, f"odom ignored: {error}")

    def _on_imu(self, imu: Imu) -> None:
        try:
            with self._lock:
                self._meter.add_acceleration(imu.linear_acceleration.x)
        except PowerError as error:
            rospy.logwarn_throttle(10.0, f"imu/data ignored: {error}")

    def _on_command(self, _command: Twist) -> None:
        with self._lock:
            self._meter.add_command()

    def _on_tick(self, _event: rospy.timer.TimerEvent) -> None:
        """Publish the load (called by rospy, whose timer an error would end for good)."""
        try:
            with self._lock:
                load = self._meter.tick(rospy.get_time())
            if load is not None:
                self._load.publish(load)
        except PowerError as error:
            rospy.logwarn_throttle(10.0, f"no power load: {error}")
        except rospy.ROSException as error:  # the topic is closed while the node ends
            if not rospy.core.is_shutdown_requested():
                rospy.logwarn_throttle(10.0, f"power_load is not published: {error}")

    def _on_increase_consumption(self, request: IncreaseConsumptionFactorRequest) -> IncreaseConsumptionFactorResponse:
        try:
            factor = check_factor(request.increase_consumption)
        except PowerError as error:
            rospy.logwarn(str(error))
            return IncreaseConsumptionFactorResponse(success=False)
        with self._lock:
            self._meter.factor = factor
        self._factor.publish(factor)
        rospy.loginfo(f"power consumption is multiplied by {factor:g} from now on")
        return IncreaseConsumptionFactorResponse(success=True)


def main() -> None:
    """Run the node."""
    with Lifetime("battery_load_control") as life:
        life.start()
        BatteryLoadControlNode()
        rospy.spin()
