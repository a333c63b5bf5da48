"""The command `replay`."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
from metacontrol_bags.decision import Decision
from metacontrol_bags.decision_tables import render
from metacontrol_msgs.msg import FunctionGrounding
from node_kit.parameters import ParameterError
from node_kit.yaml_text import YamlError, parse_yaml
from rich.console import Console
from rich.table import Table
from ros_model.io.files import resolve

from mros1_reasoner.cli.output import ERRORS, NAMESPACE, console, refuse
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.io.reasoner_bag import read_recording
from mros1_reasoner.io.reasoners import make_reasoner
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.reasoner import Reasoner
from mros1_reasoner.loop.diagnostics import DiagnosticsReader
from mros1_reasoner.loop.entries import ActiveFact
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.replay.comparison import Pair, pairs
from mros1_reasoner.replay.recording import Recording, RecordingError, Run
from mros1_reasoner.replay.rerun import Replayed, rerun, usual_duration, without_journal

_DIFFERS = 1  # exit status
_OUTCOME = {"state", "objective", "from_configuration", "to_configuration", "degraded"}


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--nfr", "nfrs", multiple=True, metavar="QA=LIMIT", help="Another limit, for all objectives.")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Another value of a parameter, as YAML.")
@click.option("--model", "models", multiple=True, metavar="FILE", help="Another ontology; also package://PACKAGE/path.")
@click.option("--initial", help="Configuration that ran at first, for a bag that does not tell.")
@click.option("--duration", type=float, help="Of a reconfiguration in s; as in the bag by default.")
@click.option("--verbose", "-v", is_flag=True, help="Explain each decision in full.")
@NAMESPACE
def replay(
    bag: Path,
    nfrs: tuple[str, ...],
    settings: tuple[str, ...],
    models: tuple[str, ...],
    initial: str | None,
    duration: float | None,
    verbose: bool,
    namespace: str | None,
) -> None:
    """Run the loop again over a BAG, and print its decisions beside the recorded ones.

    Without changes they are the same. With other limits, parameters or models they tell what it would have done.
    Exit status: 0, 1 where nothing was changed but decisions differ, 2 bad input.
    """
    out = console()
    reasoner: Reasoner | None = None
    try:
        changes = {f"nfr_{name}": value for name, value in _assignments(nfrs)} | dict(_assignments(settings))
        recording = read_recording(bag, namespace)
        files = [resolve(model) for model in models]
        first = recording.runs[0].parameters if recording.runs else {}
        reasoner = make_reasoner(Parameters({**first, **changes}).reasoner)
        found = [
            _replay_run(recording, run, changes, files, initial, duration, reasoner)
            for run in recording.runs or [Run("replay")]
        ]
    except ERRORS as error:
        refuse("replay", error)
    finally:
        if reasoner is not None:
            reasoner.close()
    is_changed = bool(changes or models)
    replayed = Replayed(
        decisions=tuple(decision for outcome in found for decision in outcome.decisions),
        parted=min((outcome.parted for outcome in found if outcome.parted is not None), default=None),
        remarks=tuple(remark for outcome in found for remark in outcome.remarks),
    )
    beside = pairs(recording, replayed)
    _print(out, recording, replayed, beside, is_changed, verbose)
    if not is_changed and recording.runs and not all(pair.is_equal for pair in beside):
        sys.exit(_DIFFERS)


def _replay_run(
    recording: Recording,
    run: Run,
    changes: Mapping[str, Any],
    models: Sequence[Path],
    initial: str | None,
    duration: float | None,
    reasoner: Reasoner,
) -> Replayed:
    parameters = Parameters({**run.parameters, **changes})
    knowledge_base = _knowledge_base(parameters, run, models)
    reasoner.load(knowledge_base.ontology)
    objectives, settings = parameters.objectives(knowledge_base), parameters.settings(knowledge_base)
    if not run.entries:  # nothing tells when the first configuration came
        settings = replace(settings, start_grace=0.0)
    core = Mape(knowledge_base, reasoner, objectives, settings, name=run.name)
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
    return rerun(core, entries, usual, follow=bool(run.entries))


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
            path.write_text(content, encoding="utf-8")
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


def _assignments(texts: Sequence[str]) -> list[tuple[str, Any]]:
    found = []
    for text in texts:
        name, is_given, value = text.partition("=")
        if not is_given or not name:
            raise ValueError(f"{text!r}: expected NAME=VALUE")
        try:
            found.append((name, parse_yaml(value)))
        except YamlError as error:
            raise ValueError(f"{text!r}: the value is no YAML: {error.problem}") from error
    return found


def _print(
    out: Console,
    recording: Recording,
    replayed: Replayed,
    beside: Sequence[Pair],
    is_changed: bool,
    verbose: bool,
) -> None:
    table = Table("at", "objective", "because of", "recorded", "replayed", "", title="decisions", title_justify="left")
    for pair in beside:
        known = pair.replayed or pair.recorded
        assert known is not None  # noqa: S101 - a pair has one of them
        does_same = is_changed and bool(pair.differences) and not set(pair.differences) & _OUTCOME
        verdict = f"differs: {', '.join(pair.differences) or 'the decision'}"
        if pair.is_equal or does_same:
            verdict = "[green]the same[/]"
        at = f"{pair.now - recording.start:.2f} s"
        table.add_row(at, known.objective, known.trigger, _change(pair.recorded), _change(pair.replayed), verdict)
    out.print(table if beside else "no decisions, neither recorded nor replayed")
    if verbose:
        for pair in beside:
            if pair.replayed:
                out.print(render(pair.replayed, recording.start))
    if not recording.runs:
        out.print("The bag has no journal of the reasoner: what it did with its decisions is assumed.")
    elif replayed.parted is not None:
        say = f"From {replayed.parted - recording.start:.2f} s on the replay decides otherwise; what was observed then"
        out.print(f"{say} is taken as it was.")
    elif is_changed:
        out.print("With the changes it would have decided the same.")
    for remark in replayed.remarks:
        out.print(f"left out: {remark}", style="dim")


def _change(decision: Decision | None) -> str:
    if decision is None:
        return "-"
    if not decision.to_configuration:
        return f"stays with {decision.from_configuration or 'nothing'}"
    return f"{decision.from_configuration or 'nothing'} -> {decision.to_configuration}"
