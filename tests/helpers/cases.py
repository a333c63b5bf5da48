"""Cases of one test: rostest's report leaves out what fails in unittest's `subTest`."""

import contextlib


@contextlib.contextmanager
def case(*what, **details):
    """Name the case in the error, where an assertion fails in it."""
    try:
        yield
    except AssertionError as error:
        named = ", ".join([*map(str, what), *(f"{key} {value}" for key, value in details.items())])
        raise AssertionError(f"{named}: {error}") from error
