"""Makes the managers of this package: plug-ins of its package.xml. What they decide is in the room `managers`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.io.reasoners import RULES, make_reasoner
from mros1_reasoner.loop.mape import Mape
from node_kit.io.input_files import InputFileError, read_text, read_yaml
from ros_model.io.files import resolve
from ros_model.project.tables import parse_table

from metacontrol_experiments.io.input_files import simulation_package
from metacontrol_experiments.io.warm_reasoner import WarmReasoner
from metacontrol_experiments.managers.d2_rules import RuleError, by_rules, variants_of
from metacontrol_experiments.managers.manager import Manager, ManagerError
from metacontrol_experiments.managers.mros import AsPublishedManager, MrosManager
from metacontrol_experiments.managers.reactive import ReactiveManager, at_random
from metacontrol_experiments.managers.respawn import LOOK_S, RESPAWN_S, RespawnManager

if TYPE_CHECKING:
    from metacontrol_experiments.managers.manager import Situation


def none(_situation: Situation) -> Manager:
    """Return the baseline: nothing adapts."""
    return Manager()


def mros(situation: Situation) -> Manager:
    """Return the meta-controller, with a reasoner that no other mission uses."""
    return _reasoning(MrosManager, situation)


def as_published(situation: Situation) -> Manager:
    """Return the meta-controller with the behaviour of the published one.

    Raises:
        ManagerError: the profile of that behaviour cannot be read.
    """
    path = resolve("package://mros1_reasoner/config/as_published.yaml")
    try:
        profile = read_yaml(path)
    except InputFileError as error:
        raise ManagerError(str(error)) from error
    return _reasoning(AsPublishedManager, replace(situation, parameters={**situation.parameters, **profile}))


def respawn(situation: Situation) -> Manager:
    """Return roslaunch's respawn of dead drivers."""
    return RespawnManager(LOOK_S if situation.starts_take_time else RESPAWN_S)


def random(situation: Situation) -> Manager:
    """Return the choice of any variant that can run."""
    return ReactiveManager("random", situation, at_random(situation.seed))


def rules(situation: Situation) -> Manager:
    """Return the rules for D2.

    Raises:
        RuleError: the table of variants cannot be used.
    """
    path = simulation_package() / "models" / "variants.csv"
    try:
        table = parse_table(read_text(path), path)
    except InputFileError as error:
        raise RuleError(str(error)) from error
    return ReactiveManager("rules", situation, by_rules(variants_of({r.name: r.cells for r in table.rows}, str(path))))


def _reasoning(kind: type[MrosManager], situation: Situation) -> Manager:
    """Return a manager of a kind that lets a reasoner decide by the parameters.

    Raises:
        ManagerError: there is no model.
    """
    if situation.knowledge is None:
        raise ManagerError("a manager that reasons needs a model: set the reasoner's ~model_file")
    parameters = Parameters(situation.parameters)
    behaviour = parameters.settings(situation.knowledge)
    reasoner = make_reasoner(RULES) if parameters.reasoner == RULES else WarmReasoner()
    try:
        reasoner.load(situation.knowledge.ontology)
        loop = Mape(situation.knowledge, reasoner, situation.objectives, behaviour, wall=lambda: 0.0, name="lockstep")
    except BaseException:
        reasoner.close()
        raise
    return kind(loop, reasoner)
