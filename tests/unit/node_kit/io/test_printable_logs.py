"""Names that somebody else has chosen control no terminal by way of the log."""

import io
import logging

import pytest
from node_kit.io.printable_logs import print_safely


@pytest.fixture
def logged():
    former = logging.getLogRecordFactory()
    print_safely()
    text = io.StringIO()
    handler = logging.StreamHandler(text)
    logger = logging.getLogger("test_printable_logs")
    logger.addHandler(handler)
    yield logger, text
    logger.removeHandler(handler)
    logging.setLogRecordFactory(former)


def test_escapes_of_a_terminal_are_shown_and_not_obeyed(logged):
    logger, text = logged
    logger.warning("node %s is lost: é\nsecond line", "/a\x1b[2J\r\x07\x9b\u202e")
    assert text.getvalue() == "node /a\\x1b[2J\\r\\x07\\x9b\\u202e is lost: é\nsecond line\n"
