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
    "tf2_ros.Buffer": (Made(PortKind.SERVICE_SERVER, "~tf2_frames", "tf2_msgs/FrameGraph"),),
    "diagnostic_updater.Updater": (Made(_PUBLISHER, "/diagnostics", "diagnostic_msgs/DiagnosticArray"),),
}

PYTHON_UNLESS = {"tf2_ros.Buffer": (1, "debug")}
"""The argument that is false where a call makes nothing of PYTHON_FIXED (place, keyword)."""

RECONFIGURE_SERVER = (
    Made(_PUBLISHER, "parameter_descriptions", "dynamic_reconfigure/ConfigDescription"),
    Made(_PUBLISHER, "parameter_updates", "dynamic_reconfigure/Config"),
    Made(PortKind.SERVICE_SERVER, "set_parameters", "dynamic_reconfigure/Reconfigure"),
)
"""Below the server's namespace; a client has the counterparts."""


@dataclass(frozen=True)
class Below:
    """Interfaces below a namespace that an object is given: by a node handle, and by a name in it.

    Attributes:
        made: the interfaces.
        handle: place of the node handle among the arguments, None where there is none.
        name: place of the name, None where there is none.
        inner: a name that all interfaces have before their own.
    """

    made: tuple[Made, ...]
    handle: int | None = None
    name: int | None = None
    inner: str = ""


_MARKERS = (
    Made(_PUBLISHER, "update", "visualization_msgs/InteractiveMarkerUpdate"),
    Made(_PUBLISHER, "update_full", "visualization_msgs/InteractiveMarkerInit"),
    Made(_SUBSCRIBER, "feedback", "visualization_msgs/InteractiveMarkerFeedback"),
)
_CONTROLLERS = (
    ("list_controller_types", "ListControllerTypes"),
    ("list_controllers", "ListControllers"),
    ("load_controller", "LoadController"),
    ("reload_controller_libraries", "ReloadControllerLibraries"),
    ("switch_controller", "SwitchController"),
    ("unload_controller", "UnloadController"),
)

PYTHON_BELOW = {
    "interactive_markers.interactive_marker_server.InteractiveMarkerServer": (_MARKERS, (0, "topic_ns")),
}
"""The interfaces, and which argument has the namespace that they are below (place, keyword)."""

CPP_BELOW = {
    "interactive_markers::InteractiveMarkerServer": Below(_MARKERS, name=0),
    "camera_info_manager::CameraInfoManager": Below(
        (Made(PortKind.SERVICE_SERVER, "set_camera_info", "sensor_msgs/SetCameraInfo"),), handle=0
    ),
    "controller_manager::ControllerManager": Below(
        tuple(Made(PortKind.SERVICE_SERVER, name, f"controller_manager_msgs/{kind}") for name, kind in _CONTROLLERS),
        handle=1,
        inner="controller_manager",
    ),
}

NODELET_MANAGER = (
    Made(PortKind.SERVICE_SERVER, "~load_nodelet", "nodelet/NodeletLoad"),
    Made(PortKind.SERVICE_SERVER, "~unload_nodelet", "nodelet/NodeletUnload"),
    Made(PortKind.SERVICE_SERVER, "~list", "nodelet/NodeletList"),
)

PYTHON_CALLS = frozenset(
    {
        *("rospy.init_node", "rospy.get_param", "rospy.get_param_cached", "rospy.has_param"),
        *("dynamic_reconfigure.server.Server", "dynamic_reconfigure.client.Client"),
        *PYTHON_MAKERS,
        *PYTHON_FIXED,
        *PYTHON_BELOW,
    }
)
"""What `from module import *` may bring, by full name."""

COUNTERPART = {end: other for ends in ENDS.values() for end, other in zip(ends, reversed(ends), strict=True)}

CPP_FIXED = {
    "tf::TransformBroadcaster": (Made(_PUBLISHER, "/tf", TF),),
    "tf::TransformListener": _LISTENS,
    "tf2_ros::TransformBroadcaster": (Made(_PUBLISHER, "/tf", TF),),
    "tf2_ros::StaticTransformBroadcaster": (Made(_PUBLISHER, "/tf_static", TF),),
    "tf2_ros::TransformListener": _LISTENS,
    "diagnostic_updater::Updater": PYTHON_FIXED["diagnostic_updater.Updater"],
}
