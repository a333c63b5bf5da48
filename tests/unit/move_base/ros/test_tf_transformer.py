"""Frame names that tf2 does not take."""

import pytest
from geometry_msgs.msg import TransformStamped
from move_base.ros import frames


@pytest.fixture
def transformer(monkeypatch):
    monkeypatch.setattr(frames, "_Listener", lambda _: None)
    transformer = frames.TfTransformer()
    known = TransformStamped()
    known.header.frame_id, known.child_frame_id = "map", "base_link"
    known.transform.rotation.w = 1.0
    transformer.buffer.set_transform_static(known, "test")
    return transformer


def test_known_frame_is_found(transformer):
    assert transformer.lookup("map", "base_link", None) is not None
    assert transformer.newest("map", "base_link") is not None


@pytest.mark.parametrize("name", ["attic", "", "/map", "a\0b", "\udc80"])
def test_odd_name_is_an_unknown_frame(transformer, name):
    for frame_names in (("map", name), (name, "map")):
        assert transformer.lookup(*frame_names, None) is None
        assert transformer.lookup(*frame_names, 5.0) is None
        assert transformer.newest(*frame_names) is None
