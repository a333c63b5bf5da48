"""The observers in lockstep: they get the messages of their topics, and are evaluated at their rates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pybullet_simulator.physics.simulation import STEP
from rosgraph_monitor.observer import ServiceObserver
from tf2_msgs.msg import TFMessage

from metacontrol_experiments.lockstep.robot_topics import (
    MESSAGE_STEPS,
    STATIC_FRAMES,
    TOPICS,
    due_messages,
    static_frames,
)
from metacontrol_experiments.lockstep.system import LockstepError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from diagnostic_msgs.msg import DiagnosticStatus
    from pybullet_simulator.physics.simulation import Simulation
    from ros_model.language.metamodel import RosSystem
    from rosgraph_monitor.observer import Observer


class Observers:
    """All observers of a system.

    What an observer publishes beside diagnostics goes nowhere: nothing in lockstep listens to it.
    """

    def __init__(self, observers: Iterable[Observer], sensors: Mapping[str, type]) -> None:
        """Check that every observer can be fed.

        Args:
            observers: made and configured.
            sensors: class of the messages by the topic of each driver.

        Raises:
            LockstepError: an observer listens to something that there is not in lockstep.
        """
        self._observers = tuple(observers)
        known = {name: topic.message_class for name, topic in TOPICS.items()}
        known |= {STATIC_FRAMES: TFMessage, **sensors}
        for observer in self._observers:
            if isinstance(observer, ServiceObserver):
                raise LockstepError(f"observer {observer.name} calls a service: lockstep has none; use --engine ros")
            for topic, message_class in observer.topics:
                if known.get(topic.strip("/")) is not message_class:
                    raise LockstepError(
                        f"observer {observer.name} listens to {topic} ({message_class.__name__}): lockstep has "
                        f"{', '.join(f'{name} ({kind.__name__})' for name, kind in known.items())}; use --engine ros"
                    )
        self._told_frames: set[str] = set()  # observers that have received the static frames

    @property
    def wanted_topics(self) -> set[str]:
        """Topics that an observer listens to now, without a leading slash."""
        return {topic.strip("/") for observer in self._observers for topic, _ in observer.topics}

    def follow(self, system: RosSystem | None) -> None:
        """Tell all which system is active."""
        for observer in self._observers:
            observer.follow(system)

    def receive(self, topic: str, message: Any, now: float) -> None:
        """Hand a message to those that listen to its topic."""
        for observer in self._observers:
            for wanted, _ in observer.topics:
                if wanted.strip("/") == topic.strip("/"):
                    observer.receive(wanted, message, now)

    def listen(self, simulation: Simulation, step: int, now: float) -> None:
        """Hand on what the robot publishes in this step."""
        if not self._observers:
            return
        self._tell_frames(simulation, now)
        if step % MESSAGE_STEPS == 0:
            for topic, message in due_messages(simulation, step, self.wanted_topics):
                self.receive(topic, message, now)

    def evaluate(self, step: int, now: float) -> Iterator[list[DiagnosticStatus]]:
        """Yield the statuses of each observer that is due in this step.

        Raises:
            LockstepError: an observer fails.
        """
        for observer in self._observers:
            if step % max(1, round(1.0 / (observer.rate_hz * STEP))):
                continue
            try:
                statuses = observer.evaluate(now)
                observer.take_outputs()
            except Exception as error:  # an observer is somebody else's code
                kind = type(error).__name__
                raise LockstepError(f"observer {observer.name} fails at {now:.2f} s: {kind}: {error}") from error
            yield statuses

    def _tell_frames(self, simulation: Simulation, now: float) -> None:
        """Hand the latched static frames to those that have not had them."""
        for observer in self._observers:
            if observer.name in self._told_frames:
                continue
            topic = next((topic for topic, _ in observer.topics if topic.strip("/") == STATIC_FRAMES), None)
            if topic is not None:
                self._told_frames.add(observer.name)
                observer.receive(topic, static_frames(simulation.robot), now)
