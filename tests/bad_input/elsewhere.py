"""What opens files, listens to topics or answers requests, and is not tried by itself: for each module, why."""

from __future__ import annotations

_CALLED = "is called by a reader that is tried"
_OWN = "reads what the program itself has written or brings along, or what the system has"
_OUTPUT = "only writes"
_COMMAND = "gives a path from the command line to a reader that is tried"
_CLIENT = "gets messages through actionlib or services, whose fields are those of other listeners"
_ONE = "takes one message of a kind that other listeners take"

FILES: dict[str, str] = {
    "metacontrol_bags/bag.py": _CALLED,
    "metacontrol_bags/cli/info.py": _COMMAND,
    "metacontrol_dashboard/io/page.py": _OWN,
    "metacontrol_dashboard/ros/dashboard.py": "deserialises what rospy has received; what follows is tried",
    "metacontrol_dashboard/state/pictures.py": "its conversions are tried with the dashboard",
    "metacontrol_experiments/campaign/progress.py": _CALLED,
    "metacontrol_experiments/cli/campaign.py": _COMMAND,
    "metacontrol_experiments/cli/options.py": _COMMAND,
    "metacontrol_experiments/cli/pyramid_campaign.py": _OWN,
    "metacontrol_experiments/cli/run.py": _COMMAND,
    "metacontrol_experiments/cli/yardstick.py": _OWN,
    "metacontrol_experiments/io/campaign_child.py": _OWN,
    "metacontrol_experiments/io/campaign_driver.py": _OWN,
    "metacontrol_experiments/io/campaign_on_ros.py": _OWN,
    "metacontrol_experiments/io/code_version.py": _OWN,
    "metacontrol_experiments/io/end_of_system.py": _OWN,
    "metacontrol_experiments/io/display.py": _OUTPUT,
    "metacontrol_experiments/io/managers.py": _OWN,
    "metacontrol_experiments/io/processes.py": _OUTPUT,
    "metacontrol_experiments/io/recorder.py": _OWN,
    "metacontrol_experiments/pyramid/record.py": "reads a bag of a mission of D1 by the reader of bags, which is tried",
    "metacontrol_experiments/report/missions.py": _CALLED,
    "metacontrol_experiments/ros/fault_injection.py": _OWN,
    "metacontrol_sim/ros/send_goal.py": _CALLED,
    "move_base/parameters/costmaps.py": _CALLED,
    "mros1_reasoner/cli/replay.py": _COMMAND,
    "mros1_reasoner/io/first_look.py": _OWN,
    "mros1_reasoner/pellet/child.py": _OWN,
    "mros1_reasoner/pellet/process.py": _OWN,
    "mros1_reasoner/ros/journal.py": "copies the text of files that were read before",
    "node_kit/io/input_files.py": _CALLED,
    "node_kit/io/output_files.py": _OUTPUT,
    "node_kit/io/supervisor.py": _OWN,
    "node_kit/io/xml_rpc.py": "reads answers of the master and of nodes, which test_xml_rpc.py makes up",
    "node_kit/plugins.py": "reads manifests of installed packages",
    "node_kit/ros/resumed_goal.py": "gives rospy what decode_parameter, which is tried, returns",
    "node_kit/takeover.py": _CALLED,
    "node_kit/yaml_text.py": _CALLED,
    "pybullet_simulator/io/manipulator_file.py": _OWN,
    "ros_model/cli/format.py": _COMMAND,
    "ros_model/cli/init.py": _COMMAND,
    "ros_model/cli/observer_wizard.py": _COMMAND,
    "ros_model/cli/rosmodel.py": _OUTPUT,
    "ros_model/generators/__init__.py": _OUTPUT,
    "ros_model/generators/observer.py": "reads a text to keep it, whatever it says",
    "ros_model/io/excerpts.py": "shows a line of a file, whatever it says",
    "ros_model/language/builder.py": "has a method of that name",
    "ros_model/language/parser.py": _OWN,
    "ros_model/language/typed_values.py": _CALLED,
    "ros_model/project/schema_check.py": _OWN,
    "ros_model/project/settings.py": _CALLED,
    "ros_model/project/tables.py": _CALLED,
    "ros_model/project/yaml_file.py": _CALLED,
    "ros_model_extraction/io/live_nodes.py": _OWN,
    "ros_model_extraction/packages/catkin_package.py": _CALLED,
    "ros_model_extraction/packages/nodelet_files.py": _CALLED,
    "rosgraph_launcher/io/processes.py": _OWN,
    "rosgraph_launcher/io/secret.py": _OWN,
    "rosgraph_launcher/io/scripts.py": "looks at the first line of a program that it is to start",
    "rosgraph_launcher/io/warm_start/sitecustomize.py": "reads a program that is about to be run",
    "rosgraph_manipulator/ros/goal.py": "reads a parameter that the manipulator itself has written",
    "rosgraph_monitor/ros/topics.py": _CALLED,
    "rosgraph_monitor/ros/watch.py": _OUTPUT,
}
"""Modules that open or parse something."""

TOPICS: dict[str, str] = {
    "metacontrol_experiments/ros/manager.py": "reads diagnostics and configurations as the reasoner does",
    "metacontrol_experiments/ros/recorded_reports.py": "passes messages on",
    "metacontrol_manipulation/ros/approach.py": _CLIENT,
    "metacontrol_manipulation/ros/builder.py": _CLIENT,
    "metacontrol_manipulation/ros/images.py": "its conversions are tried with the work cell",
    "metacontrol_manipulation/ros/one_arm_builder.py": _CLIENT,
    "metacontrol_sim/ros/send_goal.py": "only waits for a message",
    "mros1_reasoner/ros/arrivals.py": "only notes when a message came",
    "mros1_reasoner/ros/asking.py": _CLIENT,
    "mros1_reasoner/ros/repairs.py": _CLIENT,
    "mros1_reasoner/ros/requests.py": _CLIENT,
    "node_kit/ros/parts.py": "its conversion is tried with the monitor's views",
    "pybullet_simulator/ros/window.py": "draws in a window of the demonstrator",
    "rosgraph_manipulator/ros/client.py": _ONE,
}
"""Modules that listen to topics."""

SERVICES: dict[str, str] = {}
"""Modules that answer requests."""
