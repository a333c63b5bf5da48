"""A full disk ends nobody who writes to the log."""

import logging

import pytest
from node_kit.io.forgiving_logs import forgive
from rosgraph.roslogging import RosStreamHandler


class Disk:
    """A file, whose disk is full for a while."""

    def __init__(self):
        self.is_full, self.text = False, ""

    def write(self, text):
        if self.is_full:
            raise OSError(28, "No space left on device")
        self.text += text


@pytest.fixture
def logged():
    disk = Disk()
    handler = RosStreamHandler(colorize=False, stdout=disk, stderr=disk)
    logger = logging.getLogger("test_forgiving_logs")
    logger.setLevel(logging.INFO)
    logger.addHandler(handler)
    yield logger, disk
    logger.removeHandler(handler)


@pytest.mark.parametrize("times", [1, 2])
def test_lines_are_left_out_while_the_disk_is_full(logged, times):
    logger, disk = logged
    disk.is_full = True
    with pytest.raises(OSError, match="No space"):
        logger.warning("this is how it was")
    for _ in range(times):
        forgive()
    logger.warning("one")
    logger.info("two")
    disk.is_full = False
    logger.warning("three")
    assert [line.split()[-1] for line in disk.text.splitlines()] == ["three"]
