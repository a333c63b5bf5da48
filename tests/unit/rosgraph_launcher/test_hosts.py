"""Which launcher starts the nodes of a host."""

from rosgraph_launcher.hosts import HostLauncher, launcher_at, no_launcher

BASE = HostLauncher("/rosgraph_launcher", ("base", "ubuntu", "192.0.2.1"))
ARM = HostLauncher("/rosgraph_launcher_arm", ("Arm-PC", "ubuntu", "192.0.2.7", "10.0.0.7"))


def test_host_is_found_by_name_and_by_each_of_its_addresses():
    for address in ("arm-pc", "192.0.2.7", "10.0.0.7"):
        assert launcher_at(address, [BASE, ARM]) is ARM


def test_name_that_a_host_goes_by_counts_more_than_another_hosts_own_name():
    named = HostLauncher("/z", ("ubuntu",))
    assert launcher_at("ubuntu", [BASE, ARM, named]) is named


def test_name_that_only_the_name_service_knows_is_found_by_its_address():
    assert launcher_at("arm.local", [BASE, ARM], {"10.0.0.7"}) is ARM


def test_host_without_launcher_is_named_with_the_node_and_the_remedy():
    assert launcher_at("192.0.2.9", [BASE, ARM]) is None
    line = no_launcher("/arm/grasp", "192.0.2.9", [BASE, ARM])
    assert "node /arm/grasp is for host 192.0.2.9" in line
    assert "(hosts that have one: Arm-PC, base)" in line
    assert "roslaunch rosgraph_launcher launcher.launch host:=192.0.2.9" in line
