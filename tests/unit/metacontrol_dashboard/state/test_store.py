"""The state that viewers see: whoever follows its changes, at whatever pace, has it as it is."""

from hypothesis import given
from hypothesis import strategies as st
from metacontrol_dashboard.state.store import Store


class Viewer:
    """Applies changes as the page does."""

    def __init__(self):
        self.version, self.sections, self.logs = 0, {}, {}

    def take(self, change):
        if change.get("whole"):
            self.sections, self.logs = {}, {}
        for section, values in change["set"].items():
            self.sections.setdefault(section, {}).update(values)
        for section, keys in change["drop"].items():
            for key in keys:
                self.sections.get(section, {}).pop(key, None)
        for log, items in change["add"].items():
            self.logs.setdefault(log, []).extend(items)
        self.version = change["version"]

    @property
    def filled(self):
        return {section: values for section, values in self.sections.items() if values}


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("set"), st.sampled_from("ab"), st.sampled_from("xyz"), st.integers(0, 3)),
        st.tuples(st.just("drop"), st.sampled_from("ab"), st.sampled_from("xyz")),
        st.tuples(st.just("append"), st.sampled_from("mn"), st.integers(0, 9)),
        st.tuples(st.just("look"), st.integers(0, 2)),
    ),
    max_size=60,
)


@given(STEPS)
def test_viewers_of_any_pace_have_the_whole_state(steps):
    store, viewers = Store(), [Viewer(), Viewer(), Viewer()]
    entries, logs = {}, {}
    for kind, *values in steps:
        if kind == "look":
            viewers[values[0]].take(store.changes(viewers[values[0]].version))
            continue
        getattr(store, kind)(*values)
        if kind == "set":
            entries.setdefault(values[0], {})[values[1]] = values[2]
        elif kind == "drop":
            entries.get(values[0], {}).pop(values[1], None)
        else:
            logs.setdefault(values[0], []).append(values[1])
    for viewer in viewers:
        viewer.take(store.changes(viewer.version))
        assert viewer.filled == {section: values for section, values in entries.items() if values}
        assert viewer.logs == logs


def test_slow_viewer_gets_the_last_value_only():
    store = Store()
    store.set("a", "x", 0)
    version = store.changes()["version"]
    for number in range(1, 1000):
        store.set("a", "x", number)
    assert store.changes(version)["set"] == {"a": {"x": 999}}


def test_same_value_is_no_change():
    store = Store()
    store.set("a", "x", [1])
    assert not store.set("a", "x", [1])
    assert store.version == 1


def test_log_forgets_its_oldest_items():
    store = Store(kept=3)
    for number in range(5):
        store.append("m", number)
    assert store.changes()["add"] == {"m": [2, 3, 4]}


def test_replaced_section_holds_the_new_entries_alone():
    store = Store()
    store.replace("a", {"x": 1, "y": 2})
    store.replace("a", {"y": 2, "z": 3})
    assert {key: store.get("a", key) for key in store.keys("a")} == {"y": 2, "z": 3}


def test_viewer_of_an_earlier_server_gets_all():
    store = Store()
    store.set("a", "x", 1)
    assert store.changes(77)["whole"]
