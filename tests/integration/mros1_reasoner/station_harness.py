"""An assembly station: assembling needs grasping, and grasping needs looking."""

from generated_harness import GeneratedSystemTest
from helpers.waiting import wait_for_equal
from reasoner_harness import node_pid

PARTS = {"f_assemble": "assembler", "f_grasp": "grasper", "f_look": "looker"}
BEST = {"f_assemble": "screw", "f_grasp": "grasp_fine", "f_look": "look_left"}


class StationTest(GeneratedSystemTest):
    """Tests of a station in a namespace of its own, or in none."""

    package = "station"

    def wait_for_configurations(self, **configurations):
        expected = {function: (name, "STABLE") for function, name in {**BEST, **configurations}.items()}
        wait_for_equal(lambda: self.active, expected, "what runs")

    def pids(self, *functions):
        return {function: node_pid(self.name(PARTS[function])) for function in functions}
