"""What processes use: from samples to percent, and over the wire."""

import pytest
from rosgraph_launcher.ros.node_messages import samples_from, usage_messages
from rosgraph_launcher.usage import Sample, Use, cpu_percent


def test_cpu_is_the_share_of_one_core_of_the_processes_that_live():
    before = Sample(0.0, {(1, 0.0): Use(1.0, 0.0), (2, 0.0): Use(5.0, 0.0)})
    after = Sample(2.0, {(1, 0.0): Use(1.5, 0.0), (3, 1.0): Use(0.5, 0.0)})
    assert cpu_percent(before, after) == 50.0
    assert cpu_percent(after, after) is None


def test_memory_is_that_of_all_processes():
    assert Sample(0.0, {(1, 0.0): Use(0.0, 2.5), (2, 0.0): Use(0.0, 3.0)}).memory == pytest.approx(5.5)


def test_messages_bring_the_samples_of_a_host():
    with_child = Sample(3.0, {(7, 1.0): Use(1.0, 2.0), (8, 1.5): Use(0.5, 4.0)})
    samples = {7: with_child, 9: Sample(3.1, {(9, 2.0): Use(0.0, 1.0)})}
    assert samples_from(usage_messages(samples)) == samples
