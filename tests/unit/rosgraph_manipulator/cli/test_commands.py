"""The commands where no master runs: arguments, output, exit status."""

import socket

import pytest
from helpers.ports import QUIET_HOST
from metacontrol_msgs.msg import ActiveConfiguration, FunctionGrounding, LaunchedFunction
from rosgraph_manipulator.cli import plan, request, status

NODE = '<node name="{}" pkg="move_base" type="move_base"/>'


@pytest.fixture(autouse=True)
def _no_master(monkeypatch):
    with socket.create_server((QUIET_HOST, 0)) as server:
        port = server.getsockname()[1]
    monkeypatch.setenv("ROS_MASTER_URI", f"http://{QUIET_HOST}:{port}")


@pytest.fixture
def run(monkeypatch, capsys):
    def call(command, *words):
        monkeypatch.setattr("sys.argv", [command.__name__, *words])
        with pytest.raises(SystemExit) as end:
            command.main()
        output = capsys.readouterr()
        return end.value.code, output.out, output.err

    return call


@pytest.fixture
def launch_files(tmp_path):
    for name in ("a", "b"):
        (tmp_path / f"{name}.launch").write_text(f"<launch>{NODE.format(name)}</launch>")
    return str(tmp_path / "a.launch"), str(tmp_path / "b.launch")


def test_plan_prints_each_way(run, launch_files):
    code, output, _ = run(plan, *launch_files)
    assert code == 0
    assert output == "restart\n  1. stop /a; start /b; store the configuration's parameters\n"


def test_plan_names_the_hosts_that_need_a_launcher(run, launch_files, tmp_path):
    path = tmp_path / "far.launch"
    node = NODE.format("n").replace("/>", ' machine="arm"/>')
    path.write_text(f'<launch><machine name="arm" address="192.0.2.7"/>{node}</launch>')
    code, output, _ = run(plan, "", str(path))
    assert code == 0
    assert "node /n is for host 192.0.2.7: a rosgraph_launcher must run there" in output.splitlines()


def test_status_leaves_out_a_function_that_was_released():
    released = LaunchedFunction(function="f_go", state="STABLE")
    picks = LaunchedFunction(
        function="f_pick", configuration="softly", state="RECOVERING", nodes=["/arm"], dead=["/arm"], message="it died"
    )
    assert status.process_lines([released]) == []
    assert status.process_lines([released, picks]) == ["  f_pick: softly RECOVERING", "    /arm (dead)", "    it died"]


def test_status_says_why_a_function_failed_even_after_its_release():
    goes = FunctionGrounding("f_go", "fast", "STABLE")
    failures = {"f_pick": "softly: node /arm has died"}
    failed = ActiveConfiguration(functions=[goes, FunctionGrounding("f_pick", "softly", "FAILED")])
    assert status.function_lines(failed, failures) == [
        "f_go: fast STABLE",
        "f_pick: softly FAILED",
        "  softly: node /arm has died",
    ]
    failed.message = "node /arm has died"  # printed below
    assert status.function_lines(failed, failures) == ["f_go: fast STABLE", "f_pick: softly FAILED"]
    released = ActiveConfiguration(functions=[goes], message="fast is deployed by restart")
    assert status.function_lines(released, failures) == [
        "f_go: fast STABLE",
        "f_pick: released after it had failed",
        "  softly: node /arm has died",
    ]
    released.message = "f_pick is released: nothing ran for it, because softly: node /arm has died"
    assert status.function_lines(released, failures) == ["f_go: fast STABLE", "f_pick: released after it had failed"]
    assert status.function_lines(released, {}) == ["f_go: fast STABLE"]


@pytest.mark.parametrize("remapping", ["__ns:=/robot", "__name:=x", "a:=b", "_rate:=1"])
def test_remapping_arguments_are_left_to_ros(run, launch_files, remapping):
    assert run(plan, remapping, *launch_files)[0] == 0


def test_empty_text_stands_for_nothing(run, launch_files):
    code, output, _ = run(plan, "", launch_files[0])
    assert (code, output.splitlines()[0]) == (0, "replace")


def test_configurations_can_come_from_a_file(run, launch_files, tmp_path):
    path = tmp_path / "c.yaml"
    path.write_text(f"configurations: {{a: {{launch: {launch_files[0]}}}, b: {{launch: {launch_files[1]}}}}}")
    assert run(plan, "a", "b", "--config", str(path))[1].startswith("restart\n")
    code, _, error = run(plan, "a", "c", "--config", str(path))
    assert (code, error) == (2, "unknown configuration 'c'; known are: a, b\n")


def test_configuration_without_its_package_refuses_no_plan_of_the_others(run, launch_files, tmp_path):
    path = tmp_path / "c.yaml"
    missing = "{command: roslaunch no_such_package x.launch}"
    path.write_text(f"configurations: {{a: {{launch: {launch_files[0]}}}, c: {missing}}}")
    assert run(plan, "", "a", "--config", str(path))[0] == 0
    code, _, error = run(plan, "a", "c", "--config", str(path))
    assert code == 2
    assert error.startswith("configurations/c: ")
    assert "no_such_package" in error


@pytest.mark.parametrize(
    ("command", "words", "told"),
    [
        (plan, ("a", "b"), "a: no ROS master knows the configurations: start the manipulator or give --config\n"),
        (plan, ("/no/such.launch", ""), "/no/such.launch"),
        (request, ("a",), f"no ROS master answers at http://{QUIET_HOST}:"),
        (status, (), f"no ROS master answers at http://{QUIET_HOST}:"),
    ],
)
def test_refusal_is_one_line_and_status_2(run, command, words, told):
    code, output, error = run(command, *words)
    assert (code, output) == (2, "")
    assert told in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(("command", "words"), [(plan, ("a",)), (request, ()), (status, ("a",)), (plan, ("--x",))])
def test_wrong_arguments_end_with_status_2(run, command, words):
    assert run(command, *words)[0] == 2


@pytest.mark.parametrize("option", ["-h", "--help"])
@pytest.mark.parametrize("command", [plan, request, status])
def test_help_is_there(run, command, option):
    code, output, _ = run(command, option)
    assert code == 0
    assert output.startswith("Usage: ")


def test_status_tells_failed_components_and_why_as_far_as_it_is_known():
    assert status.failure_lines({}) == []
    assert status.failure_lines({"sonar": "hung", "arm": ""}) == ["failed components:", "  arm", "  sonar: hung"]
