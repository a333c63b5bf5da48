"""Converts the node's parameters, from a mapping of the parameter server or a bag, to the loop's settings."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import rospkg
from node_kit.io.input_files import real_path
from node_kit.parameters import ParameterError, ParameterTree, named_entries
from ros_model.io.files import resolve

from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.io.reasoners import NAMES, PELLET
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.model import Direction, Objective
from mros1_reasoner.loop.estimate import MOST
from mros1_reasoner.loop.settings import Settings, setting_names
from mros1_reasoner.planning.utility import UtilityError, known_utility

_log = logging.getLogger(__name__)

DEFAULT_ACTION = "rosgraph_manipulator_action_server"
_NFR = "nfr_"
_SAVED = "knowledge_bases"  # folder in ROS_HOME
PARAMETERS = (
    *setting_names(),
    "asked",
    "components",
    "default_nfrs",
    "default_objectives",
    "desired_configuration",
    "execution_deadline",
    "model_file",
    "qa_direction",
    "reasoning_rate",
    "reconfigure_srv_name",
    "remembered",
    "save_folder",
    "spares",
    "task_actions",
    "tomasys_file",
    "use_reconfigure_srv",
)
"""Names of all parameters, but for the limits."""
_NAMED_OTHERWISE = ("desired", "start_grace", "utility")  # settings whose parameter needs more than its default's type


@dataclass(frozen=True)
class Parameters:
    """The private parameters of the node reasoner; the package's README tells what they mean.

    Every property and method raises ParameterError if a value can't be used.
    """

    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def strangers(self) -> list[str]:
        """What to say of each parameter that nobody reads."""
        return self._tree.strangers(PARAMETERS, (_NFR,))

    @property
    def _tree(self) -> ParameterTree:
        return ParameterTree(self.values)

    @property
    def period(self) -> float:
        """Period of reasoning while only levels change, s."""
        return self._tree.number("reasoning_rate", 2.0, low=0.0, above=True)

    @property
    def execution_deadline(self) -> float:
        """Time after which a request without a result has failed, s of wall time."""
        return self._tree.number("execution_deadline", 60.0, low=0.0)

    @property
    def asks(self) -> bool:
        """Whether the node asks a manipulator; if not, each decision counts as carried out."""
        return self._tree.flag("use_reconfigure_srv", True)

    @property
    def action(self) -> str:
        """Name of the manipulator's action."""
        return self._tree.text("reconfigure_srv_name") or DEFAULT_ACTION

    @property
    def save_folder(self) -> Path:
        """The folder in which knowledge bases are saved; ROS_HOME itself has files that nobody may replace."""
        if self._tree.text("save_folder"):
            return real_path(self._tree.path("save_folder"))
        return real_path(Path(rospkg.get_ros_home()) / _SAVED)

    @property
    def asked(self) -> object:
        """What an operator had asked of a reasoner of this name that has died, as `loop.asked` writes it."""
        return self.values.get("asked")

    @property
    def remembered(self) -> object:
        """What a reasoner of this name that has died has left, as `loop.remembered` writes it."""
        return self.values.get("remembered")

    @property
    def nodes(self) -> dict[str, str]:
        """Component by node, from `~components`: {component: {node: name}}."""
        return {
            str(entry["node"]).strip("/"): str(component)
            for component, entry in named_entries(self._tree.mapping("components", "component -> {node: name}"))
            if isinstance(entry, dict) and entry.get("node")
        }

    @property
    def reasoner(self) -> str:
        """Name of the reasoner."""
        return self._tree.choice("reasoner", PELLET, NAMES)

    @property
    def task_actions(self) -> dict[str, str]:
        """Action that pursues the task of an objective, by the objective's name."""
        given = self._tree.mapping("task_actions", "objective -> action")
        return {str(objective): str(action) for objective, action in given.items() if action}

    @property
    def model_files(self) -> list[Path]:
        """The application's ontologies."""
        files = self._files("model_file")
        if not files:
            raise ParameterError("parameter ~model_file is not set: give the application's OWL file")
        return files

    @property
    def vocabulary_files(self) -> list[Path]:
        """Ontologies to load beside the package's own."""
        return self._files("tomasys_file")

    def knowledge_base(
        self, models: Sequence[Path] | None = None, vocabularies: Sequence[Path] | None = None
    ) -> KnowledgeBase:
        """Return the knowledge base of the parameters' files, or of the given files.

        Raises:
            KnowledgeBaseError, ModelError: a file can't be used.
        """
        directions = {}
        for quality, direction in _leaves(self._tree.mapping("qa_direction", "QA -> direction")):
            try:
                directions[quality] = Direction(direction)
            except ValueError as error:
                known = " or ".join(d.value for d in Direction)
                raise ParameterError(f"parameter ~qa_direction/{quality} is {direction!r}: expected {known}") from error
        models = self.model_files if models is None else models
        vocabularies = self.vocabulary_files if vocabularies is None else vocabularies
        utility = self.values.get("utility", Settings.utility)
        spares = self._tree.flag("spares", True)
        quality = utility if isinstance(utility, str) else ""
        return read_knowledge_base(models, vocabularies, directions, quality, spares=spares)

    def objectives(self, knowledge_base: KnowledgeBase) -> tuple[Objective, ...]:
        """Return the model's objectives with the given NFRs.

        Where it asks for none, there is one for each function that no design requires, unless tasks ask for them.
        """
        objectives = knowledge_base.objectives
        if all(objective.when_required for objective in objectives) and self._tree.flag("default_objectives", True):
            required = {function for design in knowledge_base.designs.values() for function in design.requires}
            given = ParameterTree(dict(_leaves(self._tree.mapping("default_nfrs", "QA -> limit"))), "~default_nfrs")
            known: dict[str, float] = {}
            for quality in sorted(given.values):
                known |= _limits(given, quality, quality, knowledge_base)
            objectives += tuple(
                Objective(f"o_{function.removeprefix('f_')}A", function, known)
                for function in knowledge_base.functions
                if function not in required
            )
        limits = self.limits(knowledge_base)
        return tuple(replace(o, limits={**o.limits, **limits}) for o in objectives)

    def limits(self, knowledge_base: KnowledgeBase) -> dict[str, float]:
        """Return the limits of `~nfr_<quality>`, for all objectives."""
        limits: dict[str, float] = {}
        nfrs = ParameterTree(dict(_leaves({k: v for k, v in self.values.items() if str(k).startswith(_NFR)})))
        for name in sorted(nfrs.values):
            quality = name.removeprefix(_NFR)
            found = _limits(nfrs, name, quality, knowledge_base)
            if not found:
                _log.warning("parameter ~%s: Unsupported QA TYPE received: %s: left out", name, quality)
                continue
            limits |= found
        return limits

    def settings(self, knowledge_base: KnowledgeBase) -> Settings:
        """Return the loop's settings: each has a parameter of its name, `desired` is `~desired_configuration`."""
        defaults = Settings()
        desired = self._tree.text("desired_configuration")
        if desired and desired not in knowledge_base.designs:
            raise ParameterError(f"parameter ~desired_configuration is {desired!r}: no FunctionDesign of the model")
        utility = self.values.get("utility", defaults.utility)
        try:
            known_utility(utility, knowledge_base.qualities, knowledge_base.designs.values())
        except UtilityError as error:
            raise ParameterError(f"parameter ~utility: {error}") from error
        others: dict[str, Any] = {}
        for item in fields(Settings):
            default = getattr(defaults, item.name)
            if item.name in _NAMED_OTHERWISE:
                continue
            if isinstance(default, bool):
                others[item.name] = self._tree.flag(item.name, default)
            elif isinstance(default, float):
                others[item.name] = self._tree.number(item.name, default, low=0.0)
        others["history"] = self._tree.number("history", defaults.history, low=1.0, high=MOST)
        others["confidence"] = self._tree.number("confidence", defaults.confidence, low=0.5, high=0.9999)
        grace = self._tree.number("start_grace", defaults.start_grace, low=0.0)
        return Settings(**others, start_grace=grace if self.asks else 0.0, utility=utility, desired=desired)

    def _files(self, name: str) -> list[Path]:
        """Return the files that a parameter names: one, several separated by commas, or a list."""
        return [resolve(path.strip()) for path in self._tree.texts(name) if path.strip()]


def _limits(tree: ParameterTree, name: str, quality: str, knowledge_base: KnowledgeBase) -> dict[str, float]:
    """Return the limits that a parameter gives: a number, or the two of a band, the least first; none if unknown."""
    if not isinstance(tree.value(name), list):
        limit = tree.number(name, 0.0)
        return _possible(tree, name, {quality: limit} if knowledge_base.admit(quality) else {}, knowledge_base)
    match tree.numbers(name):
        case [least, most] if least < most:
            kind = knowledge_base.qualities.get(quality)
            limits = kind.band(quality, least, most) if kind else {}
            admitted = {limit: level for limit, level in limits.items() if knowledge_base.admit(limit)}
            return _possible(tree, name, admitted, knowledge_base)
    raise tree.error(name, "one number, or two, the least one first", tree.value(name))


def _possible(
    tree: ParameterTree, name: str, limits: dict[str, float], knowledge_base: KnowledgeBase
) -> dict[str, float]:
    """Return limits, each of which is a level that its quality may have."""
    for quality, limit in limits.items():
        kind = knowledge_base.qualities[quality]
        if not kind.holds(limit):
            raise tree.error(name, f"a level within its range, {kind.range}", tree.value(name))
    return limits


def _leaves(tree: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield name and value of each parameter: the server makes levels of the slashes in a quality's name."""
    for key, value in tree.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{above}{key}/")
        else:
            yield f"{above}{key}", value
