"""Makes a loop like a recorded one, from a bag or a running reasoner's journal, and runs a recording again."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from metacontrol_msgs.msg import FunctionGrounding
from node_kit.parameters import ParameterError, unknown

from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.reasoner import Reasoner
from mros1_reasoner.loop.diagnostics import DiagnosticsReader
from mros1_reasoner.loop.entries import ActiveFact
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.replay.other_limits import with_limits
from mros1_reasoner.replay.recording import Recording, RecordingError, Run
from mros1_reasoner.replay.rerun import Replayed, rerun, usual_duration, without_journal


def replay_run(
    recording: Recording,
    run: Run,
    reasoner: Reasoner,
    changes: Mapping[str, Any],
    models: Sequence[Path] = (),
    initial: str | None = None,
    duration: float | None = None,
    *,
    limits: Mapping[str, Any] | None = None,
) -> Replayed:
    """Run one life of a recorded reasoner again.

    Args:
        recording: of the bag.
        run: one of its runs; an empty one where the bag has no journal.
        reasoner: what analyses.
        changes: parameters in place of the recorded ones.
        models: ontologies in place of the recorded ones; none: those.
        initial: the configuration that ran at first, for a bag that does not tell.
        duration: of a reconfiguration, s; None: as in the bag.
        limits: of qualities, which also hold against those that the bag has; `changes` has them as parameters, too.

    Raises:
        RecordingError: there is nothing to replay.
        ParameterError, KnowledgeBaseError, ModelError, ReasonerError: the parameters or models can't be used.
    """
    # Without a journal, nothing tells when the first configuration came.
    core, knowledge_base, parameters = make_loop(run, reasoner, changes, models, waits=bool(run.entries))
    for quality in limits or {}:
        if not knowledge_base.admit(quality):
            raise ParameterError(f"--nfr: no quality {quality!r}: {unknown(quality, knowledge_base.qualities)}")
    given = Parameters({f"nfr_{quality}": limit for quality, limit in (limits or {}).items()})
    entries = run.entries or without_journal(
        recording,
        DiagnosticsReader(
            {*knowledge_base.qualities, *knowledge_base.environment}, knowledge_base.components, parameters.nodes
        ),
        _initial(knowledge_base, recording, initial),
    )
    if not entries:
        raise RecordingError("the bag holds neither a reasoner's journal nor diagnostics: nothing to replay")
    usual = usual_duration(recording.decisions) if duration is None else duration
    others, told = with_limits(entries, given.limits(knowledge_base))
    found = rerun(core, others, usual, follow=bool(run.entries))
    return replace(found, remarks=(*told, *found.remarks))


def make_loop(
    run: Run,
    reasoner: Reasoner,
    changes: Mapping[str, Any] | None = None,
    models: Sequence[Path] = (),
    *,
    waits: bool = True,
) -> tuple[Mape, KnowledgeBase, Parameters]:
    """Return a new loop that is set as a recorded one, with its knowledge base and parameters.

    Args:
        run: tells parameters and ontologies.
        reasoner: what analyses; it loads the ontology.
        changes: parameters in place of those.
        models: ontologies in place of those; none: those.
        waits: whether it waits at its start for what runs already, as the recorded one did.

    Raises:
        ParameterError, KnowledgeBaseError, ModelError, ReasonerError, RecordingError: the parameters or models can't
            be used.
    """
    parameters = Parameters({**run.parameters, **(changes or {})})
    knowledge_base = _knowledge_base(parameters, run, models)
    reasoner.load(knowledge_base.ontology)
    objectives, settings = parameters.objectives(knowledge_base), parameters.settings(knowledge_base)
    if not waits:
        settings = replace(settings, start_grace=0.0)
    return Mape(knowledge_base, reasoner, objectives, settings, name=run.name), knowledge_base, parameters


def _knowledge_base(parameters: Parameters, run: Run, models: Sequence[Path]) -> KnowledgeBase:
    """Return the knowledge base of the given models, else of the text in the bag, else of the parameters' files."""
    if models or not run.files:
        return parameters.knowledge_base(list(models) or None)
    with tempfile.TemporaryDirectory() as folder:
        paths: list[Path] = []
        for name, content in run.files.items():
            file_name = f"{Path(name).stem or 'model'}.owl"  # together, so that they find each other by name
            path = Path(folder) / str(sum(other.name == file_name for other in paths)) / file_name
            path.parent.mkdir(exist_ok=True)
            try:
                path.write_text(content, encoding="utf-8")
            except (OSError, ValueError) as error:  # a name that no file has, text that none holds
                raise RecordingError(f"the recorded ontology {name[:200]!r} can't be read: {error}") from error
            paths.append(path)
        return parameters.knowledge_base(paths, [])


def _initial(
    knowledge_base: KnowledgeBase, recording: Recording, configuration: str | None
) -> list[tuple[float, ActiveFact]]:
    if configuration is None:
        return []
    if configuration not in knowledge_base.designs:
        known = ", ".join(knowledge_base.designs)
        raise ParameterError(f"--initial: no FunctionDesign is called {configuration!r}: known: {known}")
    function = knowledge_base.designs[configuration].function
    return [(recording.start, ActiveFact(function, configuration, FunctionGrounding.STABLE))]
