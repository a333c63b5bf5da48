"""Topics that show the manipulator that a variant runs."""

import pytest
import yaml
from ros_model.generators.deployment import manipulator
from ros_model.io.project import load_project

SETTINGS = {
    "package": "ship_crane",
    "base": "crane.rossystem",
    "variants": {"component": "hoist", "table": "hoist.csv", "parameters": {"speed": ["speed"]}},
    "functions": {"f_lift": {"designs": "all"}},
    "quality_attributes": {"pace": {"direction": "higher_is_better"}},
    "utility": "pace",
    "objectives": {"o_lift": {"function": "f_lift"}},
    "components": {},
}
BASE = """RosSystem {{ Name crane RosComponents (
    ComponentInterface {{ name hoist FromRosNode 'crane.hoist.hoist'
        RosPublishers {{ RosPublisher '{port}' {{ RefPublisher 'crane.hoist.hoist.{port}' }} }} }},
    ComponentInterface {{ name bridge FromRosNode 'crane.bridge.bridge'
        RosSubscribers {{ RosSubscriber '{other}' {{ RefSubscriber 'crane.bridge.bridge.{other}' }} }} }} )
    TopicConnections {{ TopicConnection '{name}' {{ From ( 'hoist.{port}' ) To ( 'bridge.{other}' ) }} }} }}"""


@pytest.mark.parametrize(
    ("port", "name", "other", "awaited"),
    [
        ("load", "load", "load", ["load"]),
        ("/load", "load", "/load", ["/load"]),
        ("/load", "/load", "load", ["/load"]),
        ("/load", "load", "load", ["load"]),
        *((f"/{name}", name, f"/{name}", None) for name in ("tf", "tf_static", "diagnostics", "rosout", "clock")),
        ("tf", "tf", "tf", None),
    ],
)
def test_slash_stays_and_what_every_node_publishes_is_not_awaited(tmp_path, port, name, other, awaited):
    (tmp_path / "crane.rossystem").write_text(BASE.format(port=port, name=name, other=other))
    (tmp_path / "hoist.csv").write_text("name,speed\nslow,1\n")
    (tmp_path / "metacontrol.yaml").write_text(yaml.safe_dump(SETTINGS))
    assert manipulator(load_project(tmp_path))["configurations"]["slow"].get("topics") == awaited
