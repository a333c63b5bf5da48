"""A launcher starts nothing for somebody who can't read the secret of the robot's user."""

import concurrent.futures

import pytest
from metacontrol_msgs.msg import NodeDescription
from metacontrol_msgs.srv import ChangeNodesRequest, StandByRequest
from rosgraph_launcher.io.secret import SecretError, check_signature, read_secret, secret_file, sign

LAUNCHER = "/rover/rosgraph_launcher"


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))


def asked(executable="talker", **fields):
    node = NodeDescription(name="/rover/a", executable=executable, launch_prefix="nice", respawn_delay=0.5)
    return ChangeNodesRequest(function="f", configuration="c", nodes=[node], start=["/rover/a"], **fields)


def test_signed_request_is_taken():
    request = asked()
    sign(request, LAUNCHER)
    check_signature(request, LAUNCHER)
    expected = StandByRequest(nodes=request.nodes)
    sign(expected, LAUNCHER)
    check_signature(expected, LAUNCHER)


def test_request_without_signature_is_refused_with_the_remedy():
    with pytest.raises(SecretError, match=r"is not signed: copy .*rosgraph_launcher\.key from the manipulator's host"):
        check_signature(asked(), LAUNCHER)


@pytest.mark.parametrize("signature", ["0" * 64, "ä"])
def test_made_up_signature_is_refused(signature):
    with pytest.raises(SecretError, match="another signature"):
        check_signature(asked(signature=signature), LAUNCHER)


def test_signature_of_another_request_or_for_another_launcher_is_refused():
    request = asked()
    sign(request, LAUNCHER)
    for other, launcher in (
        (asked("rm", signature=request.signature), LAUNCHER),
        (request, "/other/rosgraph_launcher"),
    ):
        with pytest.raises(SecretError):
            check_signature(other, launcher)


def test_secret_of_another_host_is_refused(monkeypatch, tmp_path):
    request = asked()
    sign(request, LAUNCHER)
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "other"))
    with pytest.raises(SecretError):
        check_signature(request, LAUNCHER)


def test_all_who_ask_at_once_get_the_same_secret():
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        assert len(set(pool.map(lambda _: read_secret(), range(8)))) == 1
    assert [path.name for path in secret_file().parent.iterdir()] == [secret_file().name]
    assert secret_file().stat().st_mode & 0o777 == 0o600


def test_secret_that_others_can_read_is_none():
    read_secret()
    secret_file().chmod(0o644)
    with pytest.raises(SecretError, match="others can read or change it: chmod 600"):
        read_secret()


def test_secret_that_can_not_be_made_is_told(tmp_path):
    (tmp_path / "home").write_text("no folder")
    with pytest.raises(SecretError, match="the user of the nodes must be able to read it"):
        read_secret()


def test_signature_tells_nothing_of_the_secret():
    request = asked()
    sign(request, LAUNCHER)
    assert len(request.signature) == 64
    assert read_secret().decode() not in str(request)
