"""A decision as one line of a log. What else is known of it, `rosrun mros1_reasoner explain` shows."""

from __future__ import annotations

from metacontrol_bags.decision import ADVISED, PROPOSED, Decision

_STATES = {
    ADVISED: "dry run, nobody is asked",
    PROPOSED: "waits for approval",
}


def line(decision: Decision) -> str:
    """Return a decision as one line for a log: cause, change and reason, and by how much a limit is passed."""
    text = decision.explanation
    for correction in decision.corrections:
        text = text.replace(f"; {correction}", "")
    parts = [text]
    if excesses := [f"{cause.quality} by {cause.excess:.0%}" for cause in decision.reasons if cause.passes_limit]:
        parts.append(f"limit passed: {', '.join(excesses)}")
    if decision.state in _STATES:
        parts.insert(0, _STATES[decision.state])
    return "; ".join(parts)
