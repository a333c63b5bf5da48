"""The bag of a small run, for tests: written as those of the reasoner's tests, of a small application of its own."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "unit" / "mros1_reasoner"))

from bag_helpers import Bag, Life
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.loop.entries import ActiveFact, ComponentFact, LevelFact, Pause, Resume
from mros1_reasoner.loop.mape import Mape
from reasoner_helpers import application

START = 100.0
NAME = "reasoner-1"
PARAMETERS = {
    "model_file": "/not/here/application.owl",
    "nfr_safety": 0.6,
    "nfr_energy": 0.62,
    "qa_direction": {"performance": "higher_is_better"},
    "correct_expected": False,
}


@pytest.fixture
def bag(tmp_path):
    """Return a function that writes the bag of a run in which the laser fails after 5 s; an operator pauses at 1 s.

    Images are given as (stamp, shade); `ends` is when a mission ends, s after the start.
    """

    def write(name="run.bag", space="", journal=True, images=(), ends=None):
        model = tmp_path / "application.owl"
        model.write_text(application())
        parameters = Parameters(PARAMETERS)
        kb = parameters.knowledge_base([model])
        engine = RuleEngine()
        engine.load(kb.ontology)
        life = Life(Mape(kb, engine, parameters.objectives(kb), parameters.settings(kb), name=NAME))
        given = [
            (START, ActiveFact("f_move", "scan_slow", "STABLE")),
            (START + 1.0, Pause()),
            (START + 2.0, Resume()),
            (START + 5.0, ComponentFact("laser", "FALSE", START + 5.0, "dead")),
            *((START + i / 10, LevelFact("safety", 0.28, "", START + i / 10)) for i in range(1, 40)),
        ]
        life.live(START + 10.0, given, START)
        path = tmp_path / name
        files = {f"/elsewhere/{file.name}": file.read_text() for file in kb.files}
        with Bag(path) as bag:
            bag.active(START, "f_move", "scan_slow", space=space)
            if journal:
                bag.journal(START, [], 0, NAME, PARAMETERS, files, topic=f"{space}/mros1_reasoner/journal")
            for number, item in enumerate(life.entries):
                if journal:
                    bag.journal(item.now, [item], number, NAME, topic=f"{space}/mros1_reasoner/journal")
            for i in range(100):
                stamp = START + i / 10
                laser = "FALSE" if i >= 50 else "TRUE"
                values = (("laser", laser), *([("reason", "dead")] if i >= 50 else []))
                statuses = [("Component status", "laser", 2 if i >= 50 else 0, values)]
                statuses.append(("QA status", "", 0, (("safety", "0.28"),)))
                bag.statuses(
                    stamp, *statuses, publisher=f"{space}/rosgraph_monitor", hardware_id=f"robot:{space or '/'}"
                )
            for now, record in life.decisions:
                bag.decision(record, now, f"{space}/mros1_reasoner/decision")
            bag.active(START + 6.0, "f_move", "camera_slow", space=space)
            if ends is not None:
                bag.event(START + ends, "MISSION_END", space, outcome="reached")
            for stamp, shade in images:
                bag.image(stamp, shade, f"{space}/eye/image_raw")
        return path

    return write
