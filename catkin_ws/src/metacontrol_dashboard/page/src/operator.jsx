// What an operator can ask for. Whatever changes the system asks first, and tells how it went.

import { Component } from "preact";
import { Decision } from "./decisions.jsx";
import { change, number } from "./words.js";

const KEPT = "metacontrol-token";

async function ask(body, token) {
  try {
    const answer = await fetch("/api/act", {
      method: "POST",
      headers: { "Content-Type": "application/json", ...(token ? { "X-Token": token } : {}) },
      body: JSON.stringify(body),
    });
    const text = await answer.text();
    try {
      return JSON.parse(text);
    } catch {
      return { ok: false, message: text.trim() || `the server says ${answer.status}` };
    }
  } catch {
    return { ok: false, message: "the server does not answer" };
  }
}

export class Operator extends Component {
  state = { told: null, busy: false, token: sessionStorage.getItem(KEPT) ?? "", question: null, supposed: null };

  // Ask the operator first where `question` is given.
  request = (body, what, question) => {
    if (question) this.setState({ question: { text: question, yes: () => this.carryOut(body, what) } }, () => this.dialog?.showModal());
    else this.carryOut(body, what);
  };

  carryOut = async (body, what) => {
    this.setState({ busy: true, told: `${what} …`, question: null });
    const answer = await ask(body, this.state.token);
    const told = answer.ok ? `${what}: done${answer.message ? `. ${answer.message}` : ""}` : `${what}: not done. ${answer.message}`;
    this.setState({ busy: false, told, failed: !answer.ok });
  };

  suppose = async (event) => {
    event.preventDefault();
    const form = new FormData(event.currentTarget);
    const failed = form.getAll("failed");
    const limits = {};
    for (const [name, value] of form.entries()) {
      if (name.startsWith("limit/") && value !== "") limits[name.slice(6)] = Number(value);
    }
    this.setState({ busy: true });
    const answer = await ask({ action: "suppose", failed, limits }, this.state.token);
    const changes = [...failed.map((name) => `${name} failed`), ...Object.entries(limits).map(([name, value]) => `the limit of ${name} were ${value}`)];
    this.setState({ busy: false, supposed: { ...answer, changes } });
  };

  render({ state, control, connected }, { told, failed, busy, token, question, supposed }) {
    const known = state.get("operator", "state");
    const proposal = known?.proposal ? state.get("decision", known.proposal) : state.entries("decision").map(([, d]) => d).find((d) => d.state === "PROPOSED");
    const may = connected && (control === "yes" || (control === "token" && token)) && !busy;
    const qualities = state.entries("limit").filter(([, about]) => Object.values(about.of).some((of) => of.limit !== null && of.limit !== undefined));
    const components = Object.keys(Object.fromEntries(state.entries("part_of"))).filter((name) => !state.get("part_of", name).node_of_designs).sort();
    const designs = state.entries("design").map(([name]) => name).sort();
    return (
      <div>
        {control === "no" && <p class="hint">This page can only look: control is switched off, or no token was set.</p>}
        {control === "token" && (
          <p>
            <label>
              Token{" "}
              <input type="password" autocomplete="off" value={token} onInput={(event) => {
                sessionStorage.setItem(KEPT, event.currentTarget.value);
                this.setState({ token: event.currentTarget.value });
              }} />
            </label>{" "}
            <span class="hint">needed for everything that changes the system</span>
          </p>
        )}
        {proposal && (
          <div class="proposal" role="alert">
            <h3>A change waits for your approval</h3>
            <p>
              <b>{change(proposal)}</b>: {proposal.explanation}
            </p>
            <button type="button" class="primary" disabled={!may} onClick={() => this.request({ action: "approve", id: proposal.id }, `Approve ${change(proposal)}`)}>
              Approve
            </button>
            <button type="button" disabled={!may} onClick={() => this.request({ action: "reject", id: proposal.id }, `Reject ${change(proposal)}`, `Reject ${change(proposal)}? The design is not proposed again for a while.`)}>
              Reject
            </button>
          </div>
        )}
        <p>
          The reasoner {known ? (known.paused ? <b>is paused: it decides nothing</b> : known.locked.length ? <b>is locked to what runs for {known.locked.join(", ")}</b> : `decides by itself${known.approval ? ", and asks for your approval" : ""}`) : "has not told how it is set"}.
        </p>
        <div class="bar">
          <button type="button" disabled={!may || known?.paused} onClick={() => this.request({ action: "pause" }, "Pause", "Pause the reasoner? It decides nothing until you resume it.")}>
            Pause
          </button>
          <button type="button" disabled={!may || (known && !known.paused)} onClick={() => this.request({ action: "resume" }, "Resume")}>
            Resume
          </button>
          <button type="button" disabled={!may} onClick={() => this.request({ action: "lock" }, "Lock", "Lock the configuration? The reasoner only tells what it would have done.")}>
            Lock
          </button>
          <button type="button" disabled={!may} onClick={() => this.request({ action: "unlock" }, "Unlock")}>
            Unlock
          </button>
        </div>
        <form class="bar" onSubmit={(event) => {
          event.preventDefault();
          const form = new FormData(event.currentTarget);
          const [quality, value] = [form.get("quality"), Number(form.get("value"))];
          this.request({ action: "set_limit", objective: "", quality, value }, `Limit of ${quality} to ${value}`, `Set the limit of ${quality} to ${value} for every objective?`);
        }}>
          <label>
            Set the limit of <select name="quality">{qualities.map(([name]) => <option key={name}>{name}</option>)}</select>
          </label>
          <label>
            to <input name="value" type="number" step="any" required size={6} />
          </label>
          <button disabled={!may || !qualities.length}>Set</button>
        </form>
        <form class="bar" onSubmit={(event) => {
          event.preventDefault();
          const configuration = new FormData(event.currentTarget).get("configuration");
          this.request({ action: "deploy", configuration }, `Deploy ${configuration}`, `Deploy ${configuration} now? Nodes may be restarted. The reasoner may change it again, unless it is paused or locked.`);
        }}>
          <label>
            Deploy <select name="configuration">{designs.map((name) => <option key={name}>{name}</option>)}</select>
          </label>
          <button disabled={!may || !designs.length}>Deploy</button>
        </form>
        <p role="status" class={failed ? "bad" : ""}>{told}</p>
        <h3>What would it do?</h3>
        <form onSubmit={this.suppose}>
          <p class="hint">Nothing of this is carried out.</p>
          <fieldset>
            <legend>if these failed</legend>
            {components.map((name) => (
              <label key={name} class="tick">
                <input type="checkbox" name="failed" value={name} /> {name}
              </label>
            ))}
            {!components.length && <span class="hint">no component is known</span>}
          </fieldset>
          <fieldset>
            <legend>with these limits</legend>
            {qualities.map(([name, about]) => (
              <label key={name}>
                {name} <input type="number" step="any" name={`limit/${name}`} placeholder={number(Object.values(about.of)[0]?.limit)} />
              </label>
            ))}
          </fieldset>
          <button disabled={!connected || busy}>Ask</button>
        </form>
        <div role="status">{supposed && <Supposed answer={supposed} />}</div>
        <dialog ref={(element) => (this.dialog = element)} onClose={() => this.setState({ question: null })}>
          <p>{question?.text}</p>
          <form method="dialog" class="bar">
            <button class="primary" onClick={() => question?.yes()}>Yes</button>
            <button>No</button>
          </form>
        </dialog>
      </div>
    );
  }
}

function Supposed({ answer }) {
  const asked = answer.changes.length ? `If ${answer.changes.join(" and ")}, ` : "As it is now, ";
  if (!answer.ok) return <p class="bad">It can't be told: {answer.message}</p>;
  if (!answer.decisions.length) return <p>{asked}it would leave all as it is. {answer.message}</p>;
  return (
    <div class="supposed">
      {answer.decisions.map((decision) => (
        <div key={decision.id}>
          <p>
            {asked}it would {decision.to_configuration ? <b>change {change(decision)}</b> : <b>find nothing better, and stay</b>}
            {answer.after > 0.05 ? ` after ${answer.after.toFixed(1)} s` : " at once"}.
          </p>
          <details>
            <summary>why</summary>
            <Decision decision={decision} start={0} />
          </details>
        </div>
      ))}
    </div>
  );
}
