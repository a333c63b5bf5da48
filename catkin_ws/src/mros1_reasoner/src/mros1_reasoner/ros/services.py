"""The services of the node reasoner, for operators and mission logic."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rospy
from metacontrol_msgs import srv as services
from metacontrol_msgs.msg import FunctionFeasibility
from std_srvs.srv import Trigger, TriggerResponse

from mros1_reasoner.io.ontology_files import place_to_save, save_knowledge_base
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop import entries
from mros1_reasoner.loop.readable_state import MapeError

if TYPE_CHECKING:
    from mros1_reasoner.ros.reasoner import ReasonerNode

_ERRORS = (MapeError, KnowledgeBaseError, ReasonerError, ValueError)
_TRIGGERS = {"pause": entries.Pause, "resume": entries.Resume, "lock": entries.Lock, "unlock": entries.Unlock}
_SAVED = "knowledge_base.owl"


class Services:
    """Offers the services. Each works in the loop's thread; if it fails, the answer says why."""

    def __init__(self, node: ReasonerNode, save_folder: Path) -> None:
        """Offer them from now on.

        Args:
            node: does the work.
            save_folder: knowledge bases are saved in it.
        """
        self._node = node
        self._save_folder = save_folder
        for name, kind in _TRIGGERS.items():
            rospy.Service(f"~{name}", Trigger, lambda _, kind=kind: self._trigger(kind()))
        rospy.Service("~approve", services.ApproveDecision, lambda request: self._settle(entries.Approve, request.id))
        rospy.Service("~reject", services.ApproveDecision, lambda request: self._settle(entries.Reject, request.id))
        rospy.Service("~add_objective", services.AddObjective, self._add_objective)
        rospy.Service("~remove_objective", services.RemoveObjective, self._remove_objective)
        rospy.Service("~set_nfr", services.SetNfr, self._set_nfr)
        rospy.Service("~feasible", services.Feasible, self._feasible)
        rospy.Service("~save_knowledge_base", services.SaveKnowledgeBase, self._save)

    def _trigger(self, command: entries.Command) -> TriggerResponse:
        ok, message = self._answer(lambda: self._node.command(command))
        return TriggerResponse(ok, message)

    def _settle(
        self, kind: type[entries.Approve | entries.Reject], decision_id: str
    ) -> services.ApproveDecisionResponse:
        def work() -> None:
            waits = self._node.core.proposal
            if waits is None:
                raise MapeError("no decision waits for approval")
            self._node.command(kind(decision_id or waits.id))

        return services.ApproveDecisionResponse(*self._answer(work))

    def _add_objective(self, request: Any) -> services.AddObjectiveResponse:
        def work() -> None:
            limits = self._node.core.operator.limits_of((nfr.name, nfr.value) for nfr in request.nfrs)
            self._node.command(entries.AddObjective(request.name, request.function, limits))

        return services.AddObjectiveResponse(*self._answer(work))

    def _remove_objective(self, request: Any) -> services.RemoveObjectiveResponse:
        command = entries.RemoveObjective(request.name)
        return services.RemoveObjectiveResponse(*self._answer(lambda: self._node.command(command)))

    def _set_nfr(self, request: Any) -> services.SetNfrResponse:
        command = entries.SetNfr(request.objective, request.quality, request.value)
        return services.SetNfrResponse(*self._answer(lambda: self._node.command(command)))

    def _feasible(self, request: Any) -> services.FeasibleResponse:
        found: list[FunctionFeasibility] = []

        def work() -> None:
            designs = self._node.core.feasible()
            if request.function and request.function not in designs:
                raise MapeError(f"no Function is called {request.function!r}: known: {', '.join(designs)}")
            for function in [request.function] if request.function else sorted(designs):
                names = list(designs[function])
                why_not = "" if names else "each function design needs a component or a function that does not work"
                found.append(FunctionFeasibility(function, bool(names), names, why_not))

        ok, message = self._answer(work)
        return services.FeasibleResponse(ok, message, found)

    def _save(self, request: Any) -> services.SaveKnowledgeBaseResponse:
        saved = []

        def work() -> None:
            path = place_to_save(self._save_folder, request.path or _SAVED)
            core = self._node.core
            save_knowledge_base(path, self._node.knowledge_base, core.known, core.analysis)
            saved.append(str(path))

        ok, message = self._answer(work)
        return services.SaveKnowledgeBaseResponse(ok, saved[0] if ok else message)

    def _answer(self, work: Callable[[], None]) -> tuple[bool, str]:
        """Have the loop's thread do some work; return whether it succeeded, and if not, why."""
        try:
            self._node.ask(work)
        except _ERRORS as error:
            return False, str(error)
        except TimeoutError:
            return False, "the reasoner is busy: try again"
        return True, ""
