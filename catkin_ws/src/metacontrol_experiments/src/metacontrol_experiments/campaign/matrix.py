"""A campaign: which missions a file asks for. Every manager meets the same world, clutter, noise and contingencies."""

from __future__ import annotations

import hashlib
import itertools
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from metacontrol_bags.metrics import TIMEOUT_S
from node_kit.one_line import OneLineError
from ros_model.project.schema_check import violations

from metacontrol_experiments.contingency.contingency import Contingency, Kind
from metacontrol_experiments.contingency.parsing import ContingencyError, make, parse_contingency
from metacontrol_experiments.managers.manager import MROS
from metacontrol_experiments.mission.ground import FACTORY, Ground
from metacontrol_experiments.mission.settings import ENGINES, LOCKSTEP

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

DEADLINE_S = 600.0
"""Wall s for a run, by default: a mission in lockstep takes some seconds."""
FIRST_SEED = 2**20
"""Seeds of campaigns are not below, those of calibration are: no variant is measured on what it is tried on."""
MOST_MISSIONS = 1_000_000
"""That a part of a campaign may ask for: years of work."""

_SEEDS = 2**30
_TEXTS = {"type": "array", "minItems": 1, "items": {"type": "string", "title": "text"}, "title": "a list of names"}
_NUMBER = {"type": "number", "title": "a number"}
_NUMBERS = {"type": "array", "minItems": 1, "items": _NUMBER, "title": "a list of numbers"}
_STRIKES = {
    "type": "array",
    "items": {"type": "string", "title": "a text KIND:WHAT@WHEN"},
    "title": "a list of contingencies KIND:WHAT@WHEN",
}
_NAME = {"pattern": r"^\w+$", "title": "a name of letters, digits and _"}
_PART = {
    "type": "object",
    "title": "a mapping with the lists of a matrix",
    "required": ["routes", "initial_configurations", "managers"],
    "additionalProperties": False,
    "properties": {
        "routes": _TEXTS,
        "initial_configurations": _TEXTS,
        "clutter": _NUMBERS,
        "power": _NUMBERS,
        "failures": {
            "type": "object",
            "minProperties": 1,
            "propertyNames": _NAME,
            "additionalProperties": _STRIKES,
            "title": "a mapping of names to lists of contingencies",
        },
        "managers": {
            "type": "object",
            "minProperties": 1,
            "additionalProperties": {"type": "number", "title": "the number of repeats"},
            "title": "a mapping of managers to the number of repeats",
        },
    },
}
_SCHEMA = {
    "type": "object",
    "title": "a mapping with the key parts",
    "required": ["parts"],
    "additionalProperties": False,
    "properties": {
        "engine": {"type": "string", "enum": list(ENGINES), "title": " or ".join(ENGINES)},
        "seed": {"type": "number", "title": "a whole number"},
        "timeout": {"type": "number", "exclusiveMinimum": 0, "title": "simulated s, more than 0"},
        "deadline": {"type": "number", "exclusiveMinimum": 0, "title": "wall s for a run, more than 0"},
        "logs": {"type": "boolean", "title": "true or false"},
        "environment": {"type": "boolean", "title": "true (the surroundings are observed) or false"},
        "spares": {"type": "boolean", "title": "true (what adapts may take variants with spares) or false"},
        "world": {"type": "string", "title": "the path of a world file or of a map's YAML file"},
        "routes_file": {"type": "string", "title": "the path of a YAML file of routes"},
        "profiles": {
            "type": "object",
            "propertyNames": _NAME,
            "additionalProperties": {
                "type": "object",
                "minProperties": 1,
                "title": "a mapping of parameters to values",
            },
            "title": "a mapping of names to parameters of the reasoner",
        },
        "parts": {
            "type": "object",
            "minProperties": 1,
            "propertyNames": _NAME,
            "additionalProperties": _PART,
            "title": "a mapping of names to matrices",
        },
    },
}


class CampaignError(OneLineError, ValueError):
    """A campaign makes no sense, or its folder is not its own; the message names file, place and remedy."""


def refuse_unusable(lines: Sequence[str]) -> None:
    """Refuse the results that a folder holds and that cannot be used.

    Args:
        lines: one for each of them, which names its file and what to do.

    Raises:
        CampaignError: there is one; of several, the message has the first line, and how many more there are.
    """
    if lines:
        raise CampaignError(lines[0] + (f"; so are {len(lines) - 1} more results" if len(lines) > 1 else ""))


@dataclass(frozen=True)
class Run:
    """One mission of a campaign.

    Attributes:
        part: of the campaign.
        route: name.
        initial_configuration: the variant deployed first.
        clutter: number of unknown obstacles.
        power: factor of the power load.
        failure: name of what goes wrong beside these.
        contingencies: all that goes wrong, as users write it.
        manager: what adapts: a plug-in, or a profile.
        repeat: 1, 2, ...
        seed: of everything random; the same for all managers.
        engine: lockstep or ros.
        timeout: simulated s after which the mission has failed.
        ground: what tells the ground from others; empty for the factory.
        parameters: of the manager where that is a profile: JSON of a mapping; empty where it is a plug-in.
        environment: whether the surroundings are observed; tables without this column are of missions without.
        spares: whether what adapts may take variants with spares; tables without this column are of missions without.
    """

    part: str
    route: str
    initial_configuration: str
    clutter: int
    power: float
    failure: str
    contingencies: tuple[str, ...]
    manager: str
    repeat: int
    seed: int
    engine: str = LOCKSTEP
    timeout: float = TIMEOUT_S
    ground: str = ""
    parameters: str = ""
    environment: bool = False
    spares: bool = False

    @property
    def plug_in(self) -> str:
        """The plug-in that adapts. A profile is the meta-controller with other parameters."""
        return MROS if self.parameters else self.manager

    @property
    def name(self) -> str:
        """Its name, and its folder below that of the campaign's runs."""
        world = f"{self.route}-{self.initial_configuration}-clutter{self.clutter}-power{self.power:g}-{self.failure}"
        return f"{self.part}/{world}/{self.manager}-{self.repeat}"


@dataclass(frozen=True)
class Campaign:
    """What a file asks for.

    Attributes:
        runs: repeat by repeat, cells in a random order that is always the same: any first part is a sample of all.
        deadline: wall s for a run.
        logs: whether each run leaves its log, and on ROS its bag.
        ground: of all runs.
    """

    runs: tuple[Run, ...]
    deadline: float = DEADLINE_S
    logs: bool = False
    ground: Ground = FACTORY


@dataclass(frozen=True)
class Known:
    """Names that a campaign may use, and the ground of its routes."""

    routes: Collection[str]
    configurations: Collection[str]
    managers: Collection[str]
    components: Collection[str]
    parameters: Collection[str] = ()
    ground: Ground = FACTORY


@dataclass(frozen=True)
class _Common:
    """What the runs of all parts have in common; profiles are name -> JSON of the reasoner's parameters."""

    seed: int
    engine: str
    timeout: float
    environment: bool
    spares: bool
    profiles: Mapping[str, str]


def ground_files(content: Any, where: str) -> tuple[str | None, str | None]:
    """Return the files of world and routes that a campaign names, relative to its own; None for one that it does not.

    Raises:
        CampaignError: it is no campaign; the message names the place.
    """
    for violation in violations(content, _SCHEMA):
        raise CampaignError(f"{where}: {violation}")
    return content.get("world"), content.get("routes_file")


def parse_campaign(content: Any, known: Known, where: str, engine: str | None = None) -> Campaign:
    """Return the campaign of a YAML file's content.

    Args:
        content: as the YAML reader returns it.
        known: names that may be used.
        where: the file, for messages.
        engine: takes the place of what the content names.

    Raises:
        CampaignError: it is none; the message names the place.
    """
    ground_files(content, where)
    common = _Common(
        seed=_whole(content.get("seed", 0), 0, f"{where}: seed"),
        engine=engine or content.get("engine", LOCKSTEP),
        timeout=float(content.get("timeout", TIMEOUT_S)),
        environment=content.get("environment", True),
        spares=content.get("spares", True),
        profiles=_profiles(content.get("profiles", {}), known, f"{where}: profiles"),
    )
    runs = [
        run
        for name, part in content["parts"].items()
        for run in _runs(name, part, known, f"{where}: parts.{name}", common)
    ]
    runs.sort(key=lambda run: (run.repeat, run.seed))  # stable: the managers of a cell stay together
    deadline, logs = float(content.get("deadline", DEADLINE_S)), bool(content.get("logs", False))
    return Campaign(tuple(runs), deadline, logs, known.ground)


def check_count(count: int, where: str) -> None:
    """Check how many missions are asked for, before they are listed.

    Raises:
        CampaignError: they are more than any machine drives.
    """
    if count > MOST_MISSIONS:
        raise CampaignError(f"{where}: asks for {count:,} missions; give fewer, at most {MOST_MISSIONS:,}")


def contingencies_of(run: Run) -> tuple[Contingency, ...]:
    """Return what goes wrong in a run."""
    return tuple(parse_contingency(text) for text in run.contingencies)


def seed_of(base: int, *world: object) -> int:
    """Return the seed of a cell and repeat, the same on every machine."""
    told = "/".join(map(str, (base, *world)))
    return FIRST_SEED + int.from_bytes(hashlib.sha256(told.encode()).digest()[:8]) % _SEEDS


def _profiles(given: Mapping[str, Mapping[str, Any]], known: Known, where: str) -> dict[str, str]:
    """Return profiles of the reasoner: name -> JSON of its parameters."""
    for name, parameters in given.items():
        if name in known.managers:
            raise CampaignError(f"{where}.{name}: there is a manager of that name: take another one")
        _check_names(parameters, known.parameters, f"{where}.{name}", "parameter")
    return {name: json.dumps(parameters, sort_keys=True) for name, parameters in given.items()}


def _runs(name: str, part: Mapping[str, Any], known: Known, where: str, common: _Common) -> Iterator[Run]:
    """Yield the runs of a part."""
    _check_names(part["routes"], known.routes, f"{where}.routes", "route")
    _check_names(part["initial_configurations"], known.configurations, f"{where}.initial_configurations", "variant")
    _check_names(part["managers"], [*known.managers, *common.profiles], f"{where}.managers", "manager")
    clutter = [_whole(number, 0, f"{where}.clutter") for number in part.get("clutter", [0])]
    power = [float(number) for number in part.get("power", [1.0])]
    _check_once(clutter, f"{where}.clutter")
    _check_once(power, f"{where}.power")
    repeats = {manager: _whole(n, 1, f"{where}.managers.{manager}") for manager, n in part["managers"].items()}
    failures = part.get("failures", {"none": []})
    for failure, texts in failures.items():
        _check_contingencies(texts, known.components, f"{where}.failures.{failure}")
    cells = len(part["routes"]) * len(part["initial_configurations"]) * len(clutter) * len(power) * len(failures)
    check_count(cells * sum(repeats.values()), where)
    for repeat in range(1, max(repeats.values()) + 1):
        for cell in itertools.product(part["routes"], part["initial_configurations"], clutter, power, failures):
            contingencies = (*_disturbances(cell[2], cell[3], where), *failures[cell[4]])
            seed = seed_of(common.seed, *cell[:3], f"{cell[3]:g}", cell[4], repeat)
            for manager, count in repeats.items():
                if repeat <= count:
                    yield Run(
                        name,
                        *cell,
                        contingencies,
                        manager,
                        repeat,
                        seed,
                        engine=common.engine,
                        timeout=common.timeout,
                        ground=known.ground.mark,
                        parameters=common.profiles.get(manager, ""),
                        environment=common.environment,
                        spares=common.spares,
                    )


def _disturbances(clutter: int, power: float, where: str) -> tuple[str, ...]:
    """Return clutter and power as contingencies; power strikes on the way (paper)."""
    found = []
    try:
        if clutter:
            found.append(make(Kind.CLUTTER.value, clutter, None, f"{where}.clutter"))
        if power != 1.0:
            found.append(make(Kind.POWER.value, power, None, f"{where}.power"))
    except ContingencyError as error:
        raise CampaignError(str(error)) from error
    return tuple(map(str, found))


def _check_contingencies(texts: list[str], components: Collection[str], where: str) -> None:
    for text in texts:
        try:
            contingency = parse_contingency(text)
        except ContingencyError as error:
            raise CampaignError(f"{where}: {error}") from error
        if contingency.kind.hits_component and contingency.target not in components:
            known = ", ".join(components)
            raise CampaignError(f"{where}: {text}: no component {contingency.target!r}; there are {known}")


def _check_names(names: Collection[str], known: Collection[str], where: str, what: str) -> None:
    _check_once(names, where)
    for name in names:
        if name not in known:
            raise CampaignError(f"{where}: no {what} {name!r}; there are {', '.join(known) or 'none'}")


def _check_once(values: Collection[Any], where: str) -> None:
    twice = [value for value in values if list(values).count(value) > 1]
    if twice:
        raise CampaignError(f"{where}: {twice[0]!r} stands there more than once: leave one")


def _whole(number: float, least: int, where: str) -> int:
    if number != int(number) or number < least:
        raise CampaignError(f"{where}: is {number:g}; give a whole number, {least} or more")
    return int(number)
