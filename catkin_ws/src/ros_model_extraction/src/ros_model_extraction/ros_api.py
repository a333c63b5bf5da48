"""The functions of ROS that make interfaces, and what each makes."""

from __future__ import annotations

from dataclasses import dataclass

from ros_model.language.metamodel import ENDS, PortKind

TF = "tf2_msgs/TFMessage"


@dataclass(frozen=True)
class Maker:
    """A function that makes one interface: where its arguments have the name and the type (place, keyword)."""

    kind: PortKind
    name: tuple[int, str]
    type: tuple[int, str]


@dataclass(frozen=True)
class Made:
    """An interface whose name and type are fixed."""

    kind: PortKind
    name: str
    type: str


_PUBLISHER, _SUBSCRIBER = PortKind.PUBLISHER, PortKind.SUBSCRIBER
_LISTENS = (Made(_SUBSCRIBER, "/tf", TF), Made(_SUBSCRIBER, "/tf_static", TF))

PYTHON_MAKERS = {
    "rospy.Publisher": Maker(_PUBLISHER, (0, "name"), (1, "data_class")),
    "rospy.Subscriber": Maker(_SUBSCRIBER, (0, "name"), (1, "data_class")),
    "rospy.wait_for_message": Maker(_SUBSCRIBER, (0, "topic"), (1, "topic_type")),
    "rospy.Service": Maker(PortKind.SERVICE_SERVER, (0, "name"), (1, "service_class")),
    "rospy.ServiceProxy": Maker(PortKind.SERVICE_CLIENT, (0, "name"), (1, "service_class")),
    "actionlib.SimpleActionServer": Maker(PortKind.ACTION_SERVER, (0, "name"), (1, "ActionSpec")),
    "actionlib.ActionServer": Maker(PortKind.ACTION_SERVER, (0, "ns"), (1, "ActionSpec")),
    "actionlib.SimpleActionClient": Maker(PortKind.ACTION_CLIENT, (0, "ns"), (1, "ActionSpec")),
    "actionlib.ActionClient": Maker(PortKind.ACTION_CLIENT, (0, "ns"), (1, "ActionSpec")),
    "message_filters.Subscriber": Maker(_SUBSCRIBER, (0, "name"), (1, "data_class")),
}

PYTHON_FIXED = {
    "tf.TransformBroadcaster": (Made(_PUBLISHER, "/tf", TF),),
    "tf.TransformListener": _LISTENS,
    "tf2_ros.TransformBroadcaster": (Made(_PUBLISHER, "/tf", TF),),
    "tf2_ros.StaticTransformBroadcaster": (Made(_PUBLISHER, "/tf_static", TF),),
    "tf2_ros.TransformListener": _LISTENS,
    "diagnostic_updater.Updater": (Made(_PUBLISHER, "/diagnostics", "diagnostic_msgs/DiagnosticArray"),),
}

RECONFIGURE_SERVER = (
    Made(_PUBLISHER, "parameter_descriptions", "dynamic_reconfigure/ConfigDescription"),
    Made(_PUBLISHER, "parameter_updates", "dynamic_reconfigure/Config"),
    Made(PortKind.SERVICE_SERVER, "set_parameters", "dynamic_reconfigure/Reconfigure"),
)
"""Below the server's namespace; a client has the counterparts."""

COUNTERPART = {end: other for ends in ENDS.values() for end, other in zip(ends, reversed(ends), strict=True)}

CPP_FIXED = {
    "tf::TransformBroadcaster": (Made(_PUBLISHER, "/tf", TF),),
    "tf::TransformListener": _LISTENS,
    "tf2_ros::TransformBroadcaster": (Made(_PUBLISHER, "/tf", TF),),
    "tf2_ros::StaticTransformBroadcaster": (Made(_PUBLISHER, "/tf_static", TF),),
    "tf2_ros::TransformListener": _LISTENS,
    "diagnostic_updater::Updater": PYTHON_FIXED["diagnostic_updater.Updater"],
}
