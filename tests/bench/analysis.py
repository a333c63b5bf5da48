"""One analysis (R2), from facts to statuses, beside owlready2's own call of Pellet on the same knowledge base.

`analysis_N` is of a model like D2's, in which many designs require the same components; in `analysis_N_unlike` no two
do. `analysis_rules_N` is by the rule engine, on the model in which they are unlike. `analysis_memory` is of the process
that asks and of Pellet's together, at the largest model.
"""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.knowledge.model import Facts, Objective
from mros1_reasoner.pellet.owlready import run_pellet
from mros1_reasoner.pellet.process import PelletReasoner
from support.figures import LIMIT, entry, seconds

SIZES = {30: 60, 300: 60, 1000: 60}  # number of FunctionDesigns -> samples
WARM_UP = 40  # analyses; the JVM compiles what runs often
PEER_SAMPLES = 3
QUALITIES = ("safety", "energy", "performance")
_HEAD = """<rdf:RDF xml:base="http://example.org/bench" xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"
  xmlns:owl="http://www.w3.org/2002/07/owl#" xmlns:t="http://metacontrol.org/tomasys#" xmlns:m="http://ros/mros#">
<owl:Ontology rdf:about="http://example.org/bench"/><t:Function rdf:about="#f"/>
"""
MEMORY_LIMIT_MB = 500.0  # node and child together


def run() -> list[dict[str, Any]]:
    """Measure at every size; times in s."""
    entries = [_measure(f"analysis_{count}", count, samples)[0] for count, samples in SIZES.items()]
    count, samples = max(SIZES.items())
    unlike, memory = _measure(f"analysis_{count}_unlike", count, samples, unlike=True)
    rules, _ = _measure(f"analysis_rules_{count}", count, samples, unlike=True, engine=RuleEngine)
    return [*entries, unlike, rules, entry("analysis_memory", memory, "MB", 1, LIMIT, MEMORY_LIMIT_MB)]


def _measure(
    name: str,
    count: int,
    samples: int,
    *,
    unlike: bool = False,
    engine: Callable[[], PelletReasoner | RuleEngine] = PelletReasoner,
) -> tuple[dict[str, Any], float]:
    """Return the entry, and the memory in MB of this process and of the reasoner's."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.owl"
        path.write_text(_model(count, unlike=unlike))
        knowledge_base = read_knowledge_base([path])
    reasoner = engine()
    try:
        reasoner.load(knowledge_base.ontology)
        for i in range(WARM_UP):
            knowledge_base.analyse(_facts(i), reasoner)
        ours = [seconds(lambda i=i: knowledge_base.analyse(_facts(i), reasoner)) for i in range(samples)]
        family = [psutil.Process(), *psutil.Process().children()]
        memory = sum(process.memory_info().rss for process in family) / 1e6
    finally:
        reasoner.close()
    peers = []
    for i in range(PEER_SAMPLES):
        world = knowledge_base.world(_facts(i))
        peers.append(seconds(lambda world=world: run_pellet(world)))
        world.close()
    value, peer = statistics.median(ours), statistics.median(peers)
    return entry(name, value, "s", samples, "owlready2 sync_reasoner_pellet", peer), memory


def _facts(i: int) -> Facts:
    """Return facts that change from one analysis to the next: a level, a component that fails and comes back."""
    return Facts(
        objectives=(Objective("o", "f", {"safety": 0.6, "energy": 0.62}),),
        groundings={"o": "fd1"},
        levels={("o", "safety"): 0.5 + i % 20 / 100, ("o", "energy"): 0.5},
        components={"laser": "FALSE" if i % 2 else "TRUE", "camera": "TRUE"},
    )


def _model(count: int, *, unlike: bool = False) -> str:
    """Return a model like D2's: every fifth design by camera, the others by laser, all by the base.

    Where they are unlike, each has a component of its own beside.
    """
    parts = [_HEAD, *(f'<t:QualityAttributeType rdf:about="#{quality}"/>' for quality in QUALITIES)]
    for i in range(count):
        levels = "".join(
            f'<t:hasQAestimation><t:QAvalue rdf:about="#fd{i}_{quality}"><t:isQAtype rdf:resource="#{quality}"/>'
            f'<t:hasValue rdf:datatype="http://www.w3.org/2001/XMLSchema#decimal">0.{i % 10}</t:hasValue></t:QAvalue>'
            "</t:hasQAestimation>"
            for quality in QUALITIES
        )
        parts.append(f'<t:FunctionDesign rdf:about="#fd{i}"><t:solvesF rdf:resource="#f"/>{levels}</t:FunctionDesign>')
    for name, designs in (
        ("laser", [i for i in range(count) if i % 5]),
        ("camera", range(0, count, 5)),
        ("base", range(count)),
        *((f"part{i}", [i]) for i in range(count if unlike else 0)),
    ):
        links = "".join(f'<m:requiredBy rdf:resource="#fd{i}"/>' for i in designs)
        parts.append(f'<t:Component rdf:about="#{name}">{links}</t:Component>')
    return "\n".join([*parts, "</rdf:RDF>"])
