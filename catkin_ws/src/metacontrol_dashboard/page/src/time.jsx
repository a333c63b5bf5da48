// What happened when: a strip of time, and the same as lines.

import { Component } from "preact";
import { DECISION_STATES, change, moment } from "./words.js";

const STEPS = {
  R1: "watched",
  R2: "analysed",
  R3: "planned",
  R4: "carried out",
  "!": "injected",
  "-": "mission",
  O: "operator",
};
const LIVE_SPAN = 300; // s that the strip shows live
const MOST = 300; // lines that are shown

// Pieces of time: of each function its configurations, of each component its failures.
export function lanes(whole, start, end) {
  const found = [];
  const byFunction = {};
  for (const [at, name, configuration, state] of whole.log("configuration")) (byFunction[name] ??= []).push({ at, configuration, state });
  for (const [name, points] of Object.entries(byFunction)) {
    const pieces = points.map((point, i) => ({
      from: Math.max(point.at, start),
      to: Math.min(points[i + 1]?.at ?? end, end),
      text: point.configuration || "nothing",
      kind: !point.configuration || point.state === "FAILED" ? "bad" : point.state === "STABLE" ? "ok" : "warn",
      title: `${name}: ${point.configuration || "nothing"} ${point.state}`,
    }));
    found.push({ name, pieces: pieces.filter((piece) => piece.to > piece.from) });
  }
  for (const [name, component] of whole.entries("component")) {
    const points = component.history;
    const pieces = points
      .map(([at, status, reason], i) => ({
        from: Math.max(at, start),
        to: Math.min(points[i + 1]?.[0] ?? end, end),
        text: status === "FALSE" ? "failed" : "",
        kind: status === "FALSE" ? "bad" : "none",
        title: `${name} has failed${reason ? `: ${reason}` : ""}`,
      }))
      .filter((piece) => piece.kind === "bad" && piece.to > piece.from);
    if (pieces.length) found.push({ name, pieces });
  }
  return found;
}

export function Strip({ whole, start, end, now, recorded, onSeek, onDecision }) {
  const from = recorded ? start : Math.max(start, end - LIVE_SPAN);
  const span = Math.max(end - from, 1);
  const at = (stamp) => `${Math.min(100, Math.max(0, ((stamp - from) / span) * 100))}%`;
  const decisions = whole.entries("decision").filter(([, decision]) => decision.first >= from);
  return (
    <div class="strip">
      {lanes(whole, from, end).map(({ name, pieces }) => (
        <div class="lane" key={name}>
          <span class="name">{name}</span>
          <div class="track">
            {pieces.map((piece) => (
              <span
                key={piece.from}
                class={`piece ${piece.kind}`}
                style={{ left: at(piece.from), width: `${((piece.to - piece.from) / span) * 100}%` }}
                title={piece.title}
              >
                {piece.text}
              </span>
            ))}
            {recorded && <span class="now" style={{ left: at(now) }} />}
          </div>
        </div>
      ))}
      <div class="lane">
        <span class="name">decisions</span>
        <div class="track">
          {decisions.map(([id, decision]) => (
            <button
              key={id}
              type="button"
              class={`dot ${decision.state.toLowerCase()}`}
              style={{ left: at(decision.first) }}
              title={`${moment(decision.first, start)}: ${change(decision)}, ${DECISION_STATES[decision.state]?.[1]}`}
              aria-label={`Decision at ${moment(decision.first, start)}: ${change(decision)}`}
              onClick={() => {
                if (recorded) onSeek(decision.first);
                onDecision(id);
              }}
            >
              {DECISION_STATES[decision.state]?.[0]}
            </button>
          ))}
        </div>
      </div>
      <div class="lane scale" aria-hidden="true">
        <span class="name" />
        <div class="track">
          <span>{moment(from, recorded ? start : 0)}</span>
          <span>{moment(end, recorded ? start : 0)}</span>
        </div>
      </div>
    </div>
  );
}

export class Lines extends Component {
  state = { only: "all" };

  render({ state, start, recorded, onSeek, onDecision }, { only }) {
    const fits = { all: () => true, bad: (line) => line.bad, decisions: (line) => line.decision, operator: (line) => line.step === "O" }[only];
    const lines = state.log("timeline").filter(fits).slice(-MOST).reverse();
    return (
      <div>
        <div class="bar" role="group" aria-label="Which lines">
          {[["all", "All"], ["bad", "Faults"], ["decisions", "Decisions"], ["operator", "Operator"]].map(([key, text]) => (
            <label key={key}>
              <input type="radio" name="lines" checked={only === key} onChange={() => this.setState({ only: key })} /> {text}
            </label>
          ))}
        </div>
        <ol class="lines" tabIndex={0} aria-label="What happened, the latest first">
          {lines.map((line, i) => (
            <li key={`${line.t}-${lines.length - i}`} class={line.bad ? "bad" : ""}>
              {recorded ? (
                <button type="button" class="link time" onClick={() => onSeek(line.t)}>
                  {moment(line.t, start)}
                </button>
              ) : (
                <span class="time">{moment(line.t)}</span>
              )}
              <span class="step" title={STEPS[line.step]}>
                {STEPS[line.step] ?? line.step}
              </span>
              <span>
                {line.bad && <span aria-label="fault">✖ </span>}
                {line.text}
                {line.decision && (
                  <button type="button" class="link" onClick={() => onDecision(line.decision)}>
                    why
                  </button>
                )}
              </span>
            </li>
          ))}
          {!lines.length && <li>Nothing yet.</li>}
        </ol>
      </div>
    );
  }
}
