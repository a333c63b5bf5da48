// Each decision with its causes, its ranked candidates, and why each of them lost.

import { Sign, Table } from "./panel.jsx";
import { DECISION_STATES, change, moment, number, seconds } from "./words.js";

const KINDS = { PROPOSED: "warn", ADVISED: "muted", DECIDED: "changing", EXECUTED: "ok", FAILED: "bad" };

export function Decisions({ state, start, open, onOpen, recorded, appears, onSeek }) {
  const all = state.entries("decision").sort(([, a], [, b]) => b.first - a.first);
  if (!all.length) return <p class="hint">No decision was made yet.</p>;
  return (
    <div class="decisions">
      {all.map(([id, decision]) => (
        <details key={id} id={`decision-${id}`} open={open === id} onToggle={(event) => event.currentTarget.open && onOpen(id)}>
          <summary>
            <span class="time">{moment(decision.first, start)}</span>{" "}
            <Sign sign={DECISION_STATES[decision.state]?.[0]} kind={KINDS[decision.state]} text={DECISION_STATES[decision.state]?.[1]} />{" "}
            <b>{change(decision)}</b> <span class="because">because {decision.causes[0] ?? decision.trigger}</span>
          </summary>
          {open === id && <Decision decision={decision} start={start} recorded={recorded} onSeek={() => onSeek(appears[id] ?? decision.first)} />}
        </details>
      ))}
    </div>
  );
}

export function Decision({ decision, start, recorded, onSeek }) {
  const qualities = [...new Set(decision.candidates.flatMap((candidate) => Object.keys({ ...candidate.expected, ...candidate.levels })))].sort();
  const ranked = decision.candidates;
  return (
    <div>
      <p>{decision.explanation}</p>
      {decision.degraded && <p class="warn">No design keeps every limit: the one that violates them least was taken.</p>}
      <h3>What called for it</h3>
      <ul>
        {decision.reasons.map((cause, i) => (
          <li key={i}>
            {moment(cause.stamp, start)}: {cause.text}
            {cause.rules && <span class="hint"> (concluded by rule {cause.rules})</span>}
          </li>
        ))}
        {!decision.reasons.length && decision.causes.map((cause) => <li key={cause}>{cause}</li>)}
      </ul>
      {decision.corrections?.length > 0 && <p class="hint">Expected levels were corrected: {decision.corrections.join("; ")}</p>}
      <p class="hint">
        Found {moment(decision.stamp_monitored, start)}, analysed in {seconds(decision.analyse_wall_s)}, planned in{" "}
        {seconds(decision.plan_wall_s)}
        {decision.execute_wall_s > 0 && `, carried out in ${seconds(decision.execute_wall_s)}`} of wall time.{" "}
        {recorded && (
          <button type="button" class="link" onClick={onSeek}>
            show this moment
          </button>
        )}
      </p>
      <h3>Candidates, the best first</h3>
      <p class="hint">Levels are those that were expected at that moment: what the model expects, corrected by what was measured.</p>
      <Table label="Candidates" columns={["rank", "design", "utility", ...qualities, "why it was not taken"]}>
        {ranked.map((candidate, i) => (
          <tr key={candidate.name} class={candidate.chosen ? "chosen" : candidate.refused_because ? "refused" : ""}>
            <td>{i + 1}</td>
            <th scope="row">{candidate.name}</th>
            <td>{number(candidate.utility)}</td>
            {qualities.map((name) => (
              <td key={name}>{number(candidate.levels[name] ?? candidate.expected[name])}</td>
            ))}
            <td>{candidate.chosen ? "✔ taken" : candidate.lost_because || candidate.refused_because || "it is less useful"}</td>
          </tr>
        ))}
      </Table>
    </div>
  );
}
