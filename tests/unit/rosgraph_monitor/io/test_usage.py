"""CPU and memory of processes."""

import os
import subprocess
import sys

from rosgraph_monitor.io.usage import Sample, UsageMeter, cpu_percent, read_sample


def test_cpu_is_the_share_of_one_core_of_the_processes_that_live():
    before = Sample(0.0, {(1, 0.0): 1.0, (2, 0.0): 5.0}, 0.0)
    after = Sample(2.0, {(1, 0.0): 1.5, (3, 1.0): 0.5}, 0.0)
    assert cpu_percent(before, after) == 50.0
    assert cpu_percent(after, after) is None


def test_children_count_unless_the_node_stands_alone():
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        assert len(read_sample(os.getpid(), 0.0).cpu_s) > 1
        assert len(read_sample(os.getpid(), 0.0, with_children=False).cpu_s) == 1
    finally:
        child.communicate(b"\n")


def test_meter_tells_cpu_from_the_second_time_on():
    meter = UsageMeter()
    assert [s.message for s in meter.measure({"n": os.getpid()}, 0.0)] == ["Memory Usage"]
    cpu, memory = meter.measure({"n": os.getpid()}, 1.0)
    assert (cpu.message, cpu.values[0][0], memory.message) == ("CPU Usage", "n", "Memory Usage")


def test_process_that_has_ended_is_left_out():
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    assert UsageMeter().measure({"n": child.pid}, 0.0) == []
