"""Everything that opens files, listens to topics or answers requests is tried with bad input, or says why it is not."""

import re
from pathlib import Path

import pytest
from bad_input import elsewhere
from bad_input.listeners import LISTENERS
from bad_input.readers import READERS, SOURCES
from bad_input.servers import SERVERS
from bad_input.subjects import CORPUS, slug, subjects

OPENS = re.compile(
    r"(?<![\w.])open\(|\.open\(|read_text\(|read_bytes\(|read_yaml\(|json\.loads?\(|yaml\.(?:safe_)?load|imdecode\("
    r"|imread\(|np\.load\(|(?:ElementTree|ET)\.(?:parse|fromstring)\(|DictReader\(|csv\.reader\(|BagFile\(|minidom"
    r"|parquet\.read|expat|\.deserialize\(|parse_yaml\(|parse_marked_yaml\(|b64decode|pickle|parse_package_string"
)
LISTENS = re.compile(r"rospy\.Subscriber\(|ActionClient\(|wait_for_message\(")
SERVES = re.compile(r"rospy\.Service\(|ActionServer\(")


def modules(pattern: re.Pattern[str]) -> set[str]:
    return {name(path) for path in SOURCES.glob("*/src/**/*.py") if pattern.search(code(path))}


def name(path: Path) -> str:
    return "/".join(path.relative_to(SOURCES).parts[2:])


def code(path: Path) -> str:
    return "\n".join(line.partition("#")[0] for line in path.read_text().splitlines())


@pytest.mark.parametrize(
    ("pattern", "tried", "exempt"),
    [
        (OPENS, READERS, elsewhere.FILES),
        (LISTENS, (*LISTENERS, *SERVERS), elsewhere.TOPICS),
        (SERVES, (*LISTENERS, *SERVERS), elsewhere.SERVICES),
    ],
)
def test_every_module_is_in_a_table(pattern, tried, exempt):
    in_tables = {module for one in tried for module in one.modules} | exempt.keys()
    assert modules(pattern) - in_tables == set(), (
        "add a reader, listener or server to tests/bad_input, or a reason to elsewhere.py"
    )


def test_tables_name_modules_that_exist():
    named = {module for one in (*READERS, *LISTENERS, *SERVERS) for module in one.modules}
    known = {name(path) for path in SOURCES.glob("*/src/**/*.py")}
    exempt = elsewhere.FILES.keys() | elsewhere.TOPICS.keys() | elsewhere.SERVICES.keys()
    assert (named | exempt) - known == set()


def test_corpus_has_only_folders_of_subjects():
    assert {path.name for path in CORPUS.iterdir()} <= {slug(subject.name) for subject in subjects()}
