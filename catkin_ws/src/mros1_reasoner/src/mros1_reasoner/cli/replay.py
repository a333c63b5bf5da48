"""The command `replay`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
from metacontrol_bags.decision import Decision
from metacontrol_bags.decision_tables import render
from node_kit.parameters import ParameterError
from node_kit.yaml_text import YamlError, parse_yaml
from rich.console import Console
from rich.table import Table
from ros_model.io.files import resolve

from mros1_reasoner.cli.output import ERRORS, NAMESPACE, console, refuse
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.io.reasoner_bag import read_recording
from mros1_reasoner.io.reasoners import make_reasoner
from mros1_reasoner.io.replaying import replay_run
from mros1_reasoner.knowledge.reasoner import Reasoner
from mros1_reasoner.replay.comparison import Pair, pairs
from mros1_reasoner.replay.recording import Recording, Run
from mros1_reasoner.replay.rerun import Replayed

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
        limits = dict(_assignments(nfrs))
        changes = {f"nfr_{name}": value for name, value in limits.items()} | dict(_assignments(settings))
        for line in Parameters(dict(_assignments(settings))).strangers:
            raise ParameterError(f"--set: {line}")
        recording = read_recording(bag, namespace)
        files = [resolve(model) for model in models]
        first = recording.runs[0].parameters if recording.runs else {}
        reasoner = make_reasoner(Parameters({**first, **changes}).reasoner)
        found = [
            replay_run(recording, run, reasoner, changes, files, initial, duration, limits=limits)
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
