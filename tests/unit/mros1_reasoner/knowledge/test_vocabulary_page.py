"""The page of the vocabulary is that of the ontologies, and rules of other ontologies can be read."""

import pytest
from click.testing import CliRunner
from mros1_reasoner.cli.vocabulary import vocabulary
from mros1_reasoner.io.ontology_files import own_ontologies, read_triples
from mros1_reasoner.knowledge.rules import rules_of
from mros1_reasoner.knowledge.triples import Graph

COMMAND = "./mros run rosrun mros1_reasoner vocabulary > catkin_ws/src/mros1_reasoner/owl/README.md"


def test_page_is_that_of_the_ontologies():
    page = CliRunner().invoke(vocabulary).stdout
    assert (own_ontologies()[0].parent / "README.md").read_text() == page, f"make it again: {COMMAND}"


@pytest.mark.parametrize("path", own_ontologies(), ids=lambda path: path.name)
def test_every_rule_and_property_says_what_it_is_for(path):
    graph = Graph(read_triples(path))
    rules = rules_of(graph)
    assert rules and all(rule.label and rule.comment and rule.body and rule.head for rule in rules)
    page = CliRunner().invoke(vocabulary, [str(path)]).stdout
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    assert rows and all(line.rstrip(" |").rpartition("|")[2].strip() for line in rows)
    assert not any("unknown(" in line for line in rows)


def test_rule_is_told_as_its_atoms():
    rules = {rule.label: str(rule) for path in own_ontologies() for rule in rules_of(Graph(read_triples(path)))}
    assert rules["S1a"] == (
        'solvesO(?fg, ?o), fg_cause(?fg, "IN_ERROR_COMPONENT") -> o_cause(?o, "IN_ERROR_COMPONENT")'
    )
    assert "greaterThan(?level, ?limit) -> " in rules["QA"]


def test_file_that_is_no_ontology_is_refused_in_one_line(tmp_path):
    (tmp_path / "bad.owl").write_text("no ontology")
    for path in (tmp_path / "bad.owl", tmp_path / "absent.owl"):
        result = CliRunner().invoke(vocabulary, [str(path)])
        assert result.exit_code == 2 and str(path) in result.output and len(result.output.splitlines()) == 1
