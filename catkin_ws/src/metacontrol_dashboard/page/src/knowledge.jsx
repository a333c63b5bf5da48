// Functions, designs and groundings as the ontology has them, and the components.

import { Sign, Table } from "./panel.jsx";
import { moment, number, plural, short } from "./words.js";

export function Functions({ state }) {
  const functions = Object.fromEntries(state.entries("function"));
  const objectives = state.entries("objective");
  const designs = state.entries("design");
  const names = [...new Set([...designs.map(([, design]) => design.function), ...Object.keys(functions), ...objectives.map(([, o]) => o.function)])].sort();
  if (!names.length) return <p class="hint">Nothing is deployed, and no reasoner has told what it knows.</p>;
  return (
    <div>
      {names.map((name) => {
        const own = designs.filter(([, design]) => design.function === name);
        const active = functions[name];
        return (
          <article key={name} class="function">
            <h3>
              {name}{" "}
              {active?.configuration ? (
                <Sign sign={active.state === "STABLE" ? "●" : "↻"} kind={active.state === "STABLE" ? "ok" : active.state === "FAILED" ? "bad" : "warn"} text={`${active.configuration} ${active.state}`} />
              ) : (
                <Sign sign="○" kind="muted" text="nothing deployed" />
              )}
            </h3>
            {objectives.filter(([, objective]) => objective.function === name).map(([key, objective]) => <Objective key={key} name={key} objective={objective} />)}
            {own.length > 0 && <Designs designs={own} />}
          </article>
        );
      })}
    </div>
  );
}

function Objective({ name, objective }) {
  const limits = Object.entries(objective.limits).map(([quality, limit]) => `${quality} ${number(limit)}`);
  return (
    <div class="objective">
      <p>
        Objective <b>{name}</b>: <Sign sign={objective.fulfilled ? "●" : "✖"} kind={objective.fulfilled ? "ok" : "bad"} text={objective.fulfilled ? "in order" : objective.statuses.join(", ")} />
        {objective.locked && <Sign sign="=" kind="warn" text="locked by an operator" />}
        {objective.degraded && <Sign sign="!" kind="warn" text="degraded: not every limit is kept" />}
      </p>
      {limits.length > 0 && <p class="hint">limits: {limits.join(", ")}</p>}
      {!objective.fulfilled && objective.why && <p>{objective.why}</p>}
      {objective.causes.length > 0 && (
        <ul>
          {objective.causes.map((cause) => (
            <li key={cause.trigger}>
              {cause.text}
              {cause.rules && <span class="hint"> (rule {cause.rules})</span>}
            </li>
          ))}
        </ul>
      )}
    </div>
  );
}

function Designs({ designs }) {
  const can = designs.filter(([, design]) => !design.blocked && !design.lacks.length);
  const qualities = [...new Set(designs.flatMap(([, design]) => Object.keys(design.expected)))].sort();
  const rank = ([, design]) => (design.runs ? 0 : design.blocked || design.lacks.length ? 2 : design.failed ? 1 : 0.5);
  const sorted = [...designs].sort((a, b) => rank(a) - rank(b) || a[0].localeCompare(b[0]));
  return (
    <details>
      <summary>
        {plural(designs.length, "design")}, {can.length} can be deployed
      </summary>
      <Table label="Designs" columns={["design", "can it be deployed?", ...qualities.map((name) => `${name}, as modelled`), "requires"]}>
        {sorted.map(([name, design]) => (
          <tr key={name} class={design.runs ? "chosen" : design.blocked ? "refused" : ""}>
            <th scope="row">{name}</th>
            <td>
              {design.runs ? "✔ it runs" : design.blocked ? `✖ no: ${design.blocked_by.join(", ") || "a rule says so"}` : design.lacks.length ? `✖ no: ${design.lacks.join(", ")}` : design.failed ? `not now: ${design.failed}` : "yes"}
            </td>
            {qualities.map((quality) => (
              <td key={quality}>{number(design.expected[quality])}</td>
            ))}
            <td>{[...design.components, ...design.requires].join(", ")}</td>
          </tr>
        ))}
      </Table>
    </details>
  );
}

export function Components({ state, start }) {
  const known = Object.fromEntries(state.entries("component"));
  const model = Object.fromEntries(state.entries("part_of"));
  const names = [...new Set([...Object.keys(known), ...Object.keys(model)])];
  if (!names.length) return <p class="hint">No component was reported yet.</p>;
  const rank = (name) => (known[name]?.status === "FALSE" ? 0 : known[name]?.failures ? 1 : 2);
  names.sort((a, b) => rank(a) - rank(b) || a.localeCompare(b));
  return (
    <Table label="Components" columns={["component", "health", "failures", "history", "repair", "required by"]}>
      {names.map((name) => {
        const component = known[name];
        const about = model[name];
        const status = component?.status ?? about?.status;
        const [sign, kind, text] = { TRUE: ["●", "ok", "works"], RECOVERED: ["●", "ok", "works again"], FALSE: ["✖", "bad", "has failed"] }[status] ?? ["○", "muted", "not reported"];
        return (
          <tr key={name}>
            <th scope="row">{name}</th>
            <td>
              <Sign sign={sign} kind={kind} text={text} />
              {component?.reason && <div class="hint">{component.reason}</div>}
            </td>
            <td>{component?.failures ?? 0}</td>
            <td>
              {(component?.history ?? []).length > 1 && (
                <details>
                  <summary>{plural(component.history.length, "change")}</summary>
                  <ul>
                    {component.history.map(([at, what, reason]) => (
                      <li key={at}>
                        {moment(at, start)} {what} {reason}
                      </li>
                    ))}
                  </ul>
                </details>
              )}
            </td>
            <td>{about?.repair ? `takes ${number(about.repair.duration)} s, succeeds in ${Math.round(about.repair.success * 100)} %` : "–"}</td>
            <td>{!about ? "–" : about.required_by.length || !about.node_of_designs ? plural(about.required_by.length, "design") : "part of designs"}</td>
          </tr>
        );
      })}
    </Table>
  );
}

export function Usage({ usage }) {
  const rows = Object.entries(usage).sort(([, a], [, b]) => (b.cpu ?? 0) - (a.cpu ?? 0));
  if (!rows.length) return <p class="hint">Nobody has measured the nodes yet.</p>;
  const most = Math.max(100, ...rows.map(([, cost]) => cost.cpu ?? 0));
  return (
    <Table label="What nodes cost" columns={["node", "CPU, % of a core", "memory, MB"]}>
      {rows.map(([name, cost]) => (
        <tr key={name}>
          <th scope="row">{short(name)}</th>
          <td>
            <meter min={0} max={most} value={cost.cpu ?? 0} aria-hidden="true" /> {number(cost.cpu)}
          </td>
          <td>{number(cost.memory)}</td>
        </tr>
      ))}
    </Table>
  );
}
