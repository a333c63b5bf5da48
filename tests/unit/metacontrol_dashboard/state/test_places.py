"""Topics that tell where a robot is and what it sees are known by type and usual name."""

import pytest
from metacontrol_dashboard.state.places import CAMERA, topics_of_places

IMAGE, SMALL = "sensor_msgs/Image", "sensor_msgs/CompressedImage"


@pytest.mark.parametrize(
    "topics, chosen",
    [
        ({"/head/depth/image_raw": IMAGE, "/head/rgb/image_raw": IMAGE}, "/head/rgb/image_raw"),
        ({"/head/depth/image_raw": IMAGE}, "/head/depth/image_raw"),
        ({"/usb_cam/image_raw": IMAGE, "/usb_cam/image_raw/compressed": SMALL}, "/usb_cam/image_raw"),
        ({"/raspicam_node/image/compressed": SMALL}, "/raspicam_node/image/compressed"),
        ({"/left/image_raw": IMAGE, "/left/image_rect_color": IMAGE}, "/left/image_rect_color"),
        ({"/image_raw": "std_msgs/String"}, None),
    ],
)
def test_camera_that_people_would_look_at(topics, chosen):
    assert topics_of_places(topics.items()).get(CAMERA) == chosen
