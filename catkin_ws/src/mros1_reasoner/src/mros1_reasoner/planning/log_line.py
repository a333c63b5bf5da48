"""A decision as one line of a log."""

from __future__ import annotations

from metacontrol_bags.decision import ADVISED, PROPOSED, Decision, milliseconds

_IN_LINE = 4  # candidates that a line names
_STATES = {
    ADVISED: "dry run, nobody is asked",
    PROPOSED: "waits for approval",
}


def line(decision: Decision) -> str:
    """Return a decision as one line for a log: the violation, its amount and rule, the ranking, durations."""
    parts = [decision.explanation]
    rules = list(dict.fromkeys(cause.rules for cause in decision.reasons if cause.rules))
    excesses = [f"{cause.quality} by {cause.excess:.0%}" for cause in decision.reasons if cause.quality]
    if excesses:
        parts.append(f"limit passed: {', '.join(excesses)}")
    if rules:
        parts.append(f"rules: {', '.join(rules)}")
    parts += [text for text in decision.corrections if text not in decision.explanation]
    if decision.candidates:
        parts.append(f"candidates: {_ranking(decision)}")
    parts.append(
        f"analysed in {milliseconds(decision.analyse_wall_s)}, planned in {milliseconds(decision.plan_wall_s)}"
    )
    if decision.state in _STATES:
        parts.insert(0, _STATES[decision.state])
    return "; ".join(parts)


def _ranking(decision: Decision) -> str:
    texts = []
    for rank, candidate in enumerate(decision.candidates[:_IN_LINE], 1):
        reason = "chosen" if candidate.chosen else candidate.lost_because
        texts.append(f"{rank} {candidate.name} ({candidate.utility:g}{f': {reason}' if reason else ''})")
    more = len(decision.candidates) - _IN_LINE
    return ", ".join(texts) + (f", and {more} more" if more > 0 else "")
