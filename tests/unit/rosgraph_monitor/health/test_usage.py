"""What nodes use: who can look at them, and what the figures say."""

from ros_model.graph.snapshot import GraphSnapshot, TopicState
from rosgraph_launcher.hosts import HostLauncher
from rosgraph_launcher.usage import Sample, Use
from rosgraph_monitor.health.usage import THIS_HOST, UsageMeter, host_of, launchers_in, tellers

TOPIC = "/rosgraph_launcher/functions"
BASE, ARM = HostLauncher("/rosgraph_launcher", ("base", "10.0.0.1")), HostLauncher("/arm", ("arm-pc", "10.0.0.7"))


def sample(at, cpu, memory=10.0, pid=1):
    return Sample(at, {(pid, 0.0): Use(cpu, memory)})


def test_node_of_this_host_is_looked_at_from_here_whatever_launcher_is_here():
    assert tellers({"/n": "base"}, {"base"}, [BASE, ARM], {}) == {"/n": THIS_HOST}


def test_node_of_another_host_is_asked_for_at_the_launcher_there():
    assert tellers({"/n": "ARM-pc", "/m": "10.0.0.7"}, {"base"}, [BASE, ARM], {}) == {"/n": "/arm", "/m": "/arm"}
    assert tellers({"/n": "arm.local"}, {"base"}, [BASE, ARM], {"arm.local": {"10.0.0.7"}}) == {"/n": "/arm"}


def test_node_of_a_host_without_launcher_has_nobody_who_could_look():
    assert tellers({"/n": "10.0.0.9", "/m": ""}, {"base"}, [BASE, ARM], {"10.0.0.9": {"10.0.0.9"}}) == {}


def test_host_is_in_the_address_of_a_nodes_api():
    assert host_of("http://arm-pc:41234/") == "arm-pc"
    assert host_of("http://[fe80::1]:41234/") == "fe80::1"
    assert host_of("rubbish") == host_of("http://[rubbish") == ""


def test_launchers_are_those_that_publish_the_topic_say_where_they_are_and_live():
    graph = GraphSnapshot(
        topics={TOPIC: TopicState(TOPIC, "", ("/arm", "/dead", "/odd", "/silent"))},
        parameters={"arm": {"addresses": [*ARM.addresses]}, "dead": {"addresses": ["x"]}, "odd": {"addresses": 5}},
    )
    assert launchers_in(graph, TOPIC, {"/arm", "/odd", "/silent"}) == [ARM]
    assert launchers_in(GraphSnapshot(), TOPIC, {"/arm"}) == []


def test_meter_tells_cpu_from_the_second_time_on():
    meter = UsageMeter()
    (memory,) = meter.tell({("n", THIS_HOST): sample(0.0, 1.0)})
    assert (memory.message, memory.values) == ("Memory Usage", (("n", "10.0"),))
    cpu, _ = meter.tell({("n", THIS_HOST): sample(2.0, 1.5)})
    assert (cpu.message, cpu.values) == ("CPU Usage", (("n", "25.00"),))


def test_clocks_of_two_hosts_are_not_compared():
    meter = UsageMeter()
    meter.tell({("n", "/arm"): sample(100.0, 1.0)})
    assert [status.message for status in meter.tell({("n", "/base"): sample(5000.0, 1.0)})] == ["Memory Usage"]
