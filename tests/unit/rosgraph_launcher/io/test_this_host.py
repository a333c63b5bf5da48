"""The names and addresses by which a host is known."""

import socket

import pytest
import rosgraph
from rosgraph_launcher.io.this_host import addresses


@pytest.fixture(autouse=True)
def _host(monkeypatch):
    monkeypatch.delenv("ROS_HOSTNAME", raising=False)
    monkeypatch.delenv("ROS_IP", raising=False)
    monkeypatch.setattr(socket, "gethostname", lambda: "arm-pc")
    monkeypatch.setattr(rosgraph.network, "get_local_addresses", lambda: ["127.0.0.1", "192.0.2.7", "::1"])


def test_host_goes_by_its_own_name_and_is_known_by_its_addresses():
    assert addresses() == ["arm-pc", "192.0.2.7"]


def test_ros_names_the_host(monkeypatch):
    monkeypatch.setenv("ROS_IP", "10.0.0.7")
    assert addresses()[0] == "10.0.0.7"
    monkeypatch.setenv("ROS_HOSTNAME", "arm.local")
    assert addresses() == ["arm.local", "10.0.0.7", "arm-pc", "192.0.2.7"]


def test_name_that_is_given_comes_first(monkeypatch):
    monkeypatch.setenv("ROS_HOSTNAME", "arm.local")
    assert addresses("arm")[:2] == ["arm", "arm.local"]


def test_loopback_is_no_name_that_others_could_use(monkeypatch):
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    assert addresses()[0] == "arm-pc"
