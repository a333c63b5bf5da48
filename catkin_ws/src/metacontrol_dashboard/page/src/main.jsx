// The page: it shows a running system, or a recorded run.

import { Component, render } from "preact";
import { Decisions } from "./decisions.jsx";
import { Graph } from "./graph.jsx";
import { Components, Functions, Usage } from "./knowledge.jsx";
import { MapView } from "./map.jsx";
import { Operator } from "./operator.jsx";
import { Panel, Sign } from "./panel.jsx";
import { Qualities, violates } from "./plots.jsx";
import { Replay } from "./replay.jsx";
import { Live, Player } from "./sources.js";
import "./style.css";
import { Lines, Strip } from "./time.jsx";
import { SIGNS, change, moment, short } from "./words.js";

const SPEEDS = [0.5, 1, 2, 5, 10, 20];

// What is the case, in a few sentences: [sign, kind, text] each.
export function summary(state) {
  const found = [];
  for (const [name, { configuration, state: how }] of state.entries("function")) {
    const isGood = how === "STABLE" && configuration;
    found.push([isGood ? "●" : how === "FAILED" ? "✖" : "↻", isGood ? "ok" : how === "FAILED" ? "bad" : "warn", `${name}: ${configuration || "nothing"}${how === "STABLE" ? "" : ` ${how}`}`]);
  }
  const over = state.get("mission", "end");
  if (over) found.push([over.ok ? "✔" : "✖", over.ok ? "ok" : "bad", `mission over: ${over.text}`]);
  const failed = state.entries("component").filter(([, component]) => component.status === "FALSE");
  if (failed.length) found.push(["✖", "bad", `failed: ${failed.map(([name]) => name).join(", ")}`]);
  for (const [kind, states] of [["bad", ["missing", "hung"]], ["warn", ["drifted", "wrong", "additional"]]]) {
    for (const key of states) {
      const names = state.entries("node").filter(([, node]) => node.state === key).map(([name]) => short(name));
      if (names.length) found.push([SIGNS[key][0], kind, `${SIGNS[key][1]}: ${names.slice(0, 4).join(", ")}${names.length > 4 ? ` and ${names.length - 4} more` : ""}`]);
    }
  }
  for (const [name, quality] of state.entries("quality")) {
    const about = state.get("limit", name);
    if (quality.level === null) found.push(["∅", "warn", `${name} is stale`]);
    else if (Object.values(about?.of ?? {}).some((of) => of.limit !== null && violates(quality.level, about.operator, of.limit))) found.push(["✖", "bad", `${name} violates its limit`]);
  }
  for (const [node, part] of state.entries("part")) if (part.silent) found.push(["✖", "bad", `${part.part} (${short(node)}) is silent`]);
  const waits = state.entries("decision").find(([, decision]) => decision.state === "PROPOSED");
  if (waits) found.push(["?", "warn", `waits for approval: ${change(waits[1])}`]);
  return found;
}

class App extends Component {
  state = { tick: 0, source: null, runs: [], problem: "", open: null };

  async componentDidMount() {
    const embedded = document.getElementById("recording");
    if (embedded) {
      this.play(JSON.parse(embedded.textContent), "");
      return;
    }
    try {
      const offered = await (await fetch("/api/runs")).json();
      this.setState({ runs: offered.runs });
      const wanted = decodeURIComponent(location.hash.replace(/^#run=/, ""));
      if (offered.live) this.setState({ source: new Live(this.redraw) });
      else if (offered.runs.length) await this.load(offered.runs.includes(wanted) ? wanted : offered.runs[0]);
    } catch {
      this.setState({ problem: "The server does not answer." });
    }
  }

  load = async (name) => {
    this.state.source?.pause?.();
    this.setState({ problem: `Reading ${name} …`, source: null, open: null });
    const answer = await fetch(`/api/runs/${encodeURIComponent(name)}`);
    if (!answer.ok) {
      this.setState({ problem: (await answer.text()).trim() });
      return;
    }
    this.play(await answer.json(), name);
  };

  play(recording, name) {
    const source = new Player(recording, name, this.redraw);
    const last = source.whole.entries("decision").filter(([, decision]) => decision.trigger !== "initial").sort(([, a], [, b]) => a.first - b.first)[0];
    this.setState({ source, problem: "", open: last?.[0] ?? null });
  }

  redraw = () => {
    if (this.waits) return;
    this.waits = true;
    requestAnimationFrame(() => {
      this.waits = false;
      this.setState(({ tick }) => ({ tick: tick + 1 }));
    });
  };

  openDecision = (id) => {
    this.setState({ open: id }, () => document.getElementById(`decision-${id}`)?.scrollIntoView({ block: "nearest", behavior: "smooth" }));
  };

  render(_, { source, runs, problem, open }) {
    if (!source) {
      return (
        <main class="alone">
          <h1>Dashboard</h1>
          <p role="status">{problem || "Connecting …"}</p>
          {runs.length > 1 && <Runs runs={runs} onChoose={this.load} />}
        </main>
      );
    }
    const recorded = source instanceof Player;
    const { state } = source;
    const whole = recorded ? source.whole : state;
    const now = source.now;
    const start = recorded ? source.recording.start : 0;
    const end = recorded ? source.recording.end : now;
    const seek = recorded ? (at) => source.seek(at) : () => {};
    const shared = { state, whole, now, start, recorded, appears: source.appears ?? {}, onSeek: seek };
    const hasPlace = ["pose", "camera"].some((key) => whole.get("robot", key) !== undefined) || whole.get("map", "map") !== undefined;
    const trail = this.trail(source, recorded);
    const still = recorded ? now : "";
    return (
      <>
        <a class="skip" href="#summary">Skip to the summary</a>
        <header class={recorded || !source.lostAt ? "" : "lost"}>
          <h1>{recorded ? source.recording.name : `Robot ${state.get("system", "name") ?? ""}`}</h1>
          <Connection source={source} recorded={recorded} />
          <nav aria-label="Parts of the page">
            {[["graph", "Graph"], ["functions", "Functions"], ["qualities", "Qualities"], ["timeline", "Timeline"], ["decisions", "Decisions"], ["components", "Components"], ...(!recorded ? [["operator", "Operator"]] : source.name ? [["replay", "Other limits"]] : [])].map(([id, text]) => (
              <a key={id} href={`#${id}`}>{text}</a>
            ))}
          </nav>
        </header>
        {recorded && <Controls player={source} runs={runs} onChoose={this.load} />}
        <main>
          <section id="summary" class="summary" aria-label="Summary">
            {summary(state).map(([sign, kind, text]) => <Sign key={text} sign={sign} kind={kind} text={text} />)}
            {!state.entries("function").length && !state.entries("component").length && <p class="hint">Nothing is reported yet. The page fills as the monitor, the reasoner and the manipulator speak.</p>}
            {recorded && source.recording.problems.map((text) => <p key={text} class="warn">{text}</p>)}
            {state.get("system", "reasoner") && <p class="hint">What the reasoner knows is not shown: {state.get("system", "reasoner")}</p>}
          </section>
          <Panel id="timeline" title="Timeline" wide mark={state.mark("timeline", "decision", "configuration", "component", "clock") + still} draw={() => (
            <>
              <Strip {...shared} end={end} onDecision={this.openDecision} />
              <Lines {...shared} onDecision={this.openDecision} />
            </>
          )} />
          <Panel id="qualities" title="Qualities" mark={state.mark("quality", "limit", "level", "clock") + still} draw={() => <Qualities {...shared} />} />
          <Panel id="functions" title="Functions and designs" mark={state.mark("function", "objective", "design")} draw={() => <Functions state={state} />} />
          <Panel id="decisions" title="Decisions" wide mark={state.mark("decision") + open} draw={() => <Decisions {...shared} open={open} onOpen={(id) => this.setState({ open: id })} />} />
          <Panel id="graph" title="Nodes and topics" wide mark={state.mark("node", "topic")} draw={() => <Graph nodes={state.sections.node ?? {}} topics={state.sections.topic ?? {}} usage={state.sections.usage ?? {}} />} />
          {hasPlace && <Panel id="map" title="Where the robot is" mark={state.mark("robot", "map") + still} draw={() => <MapView state={state} trail={trail} />} />}
          {recorded ? (
            <Panel id="replay" title="With other limits" hint="What the reasoner would have decided." mark={source.name} draw={() => <Replay {...shared} name={source.recording.can_replay ? source.name : ""} />} />
          ) : (
            <Panel id="operator" title="Operator" mark={state.mark("operator", "decision", "limit", "part_of", "design") + source.control + source.connected} draw={() => <Operator state={state} control={source.control} connected={source.connected} />} />
          )}
          <Panel id="components" title="Components" mark={state.mark("component", "part_of")} draw={() => <Components state={state} start={start} />} />
          <Panel id="usage" title="CPU and memory of nodes" mark={state.mark("usage")} draw={() => <Usage usage={state.sections.usage ?? {}} />} />
        </main>
        <footer>
          {recorded && source.name && <a href={`/api/runs/${encodeURIComponent(source.name)}/page`}>Save this run as one HTML file</a>}{" "}
          {!document.getElementById("recording") && <a href="licences.txt">Licences of what this page is made of</a>}
        </footer>
      </>
    );
  }

  // Where the robot has been.
  trail(source, recorded) {
    if (!recorded) {
      const pose = source.state.get("robot", "pose");
      this.driven ??= [];
      const last = this.driven.at(-1);
      if (pose && (!last || Math.hypot(last[0] - pose[0], last[1] - pose[1]) > 0.05)) this.driven = [...this.driven.slice(-2000), [pose[0], pose[1]]];
      return this.driven;
    }
    if (this.trailOf !== source) {
      this.trailOf = source;
      this.poses = source.recording.frames.flatMap(([at, change]) => (change.set?.robot?.pose ? [[at, ...change.set.robot.pose]] : []));
    }
    return this.poses.filter(([at]) => at <= source.now).map(([, x, y]) => [x, y]);
  }
}

function Connection({ source, recorded }) {
  if (recorded) return <span class="connection">recorded</span>;
  if (source.connected) return <span class="connection ok">● live, {moment(source.now)}</span>;
  if (!source.lostAt) return <span class="connection">connecting …</span>;
  return <span class="connection bad" role="alert">✖ connection lost since {source.lostAt.toLocaleTimeString()}: what you see is from before; it is tried again</span>;
}

function Runs({ runs, chosen, onChoose }) {
  return (
    <label>
      Run{" "}
      <select value={chosen} onChange={(event) => onChoose(event.currentTarget.value)}>
        {runs.map((name) => <option key={name}>{name}</option>)}
      </select>
    </label>
  );
}

function Controls({ player, runs, onChoose }) {
  const { start, end } = player.recording;
  const jump = (direction) => {
    const marks = player.marks;
    const next = direction > 0 ? marks.find((at) => at > player.now + 0.05) : marks.findLast((at) => at < player.now - 0.05);
    player.seek(next ?? (direction > 0 ? end : start));
  };
  return (
    <div class="controls" role="group" aria-label="Player">
      <button type="button" class="primary" onClick={() => (player.playing ? player.pause() : player.play())}>
        {player.playing ? "Pause" : "Play"}
      </button>
      <button type="button" onClick={() => jump(-1)} aria-label="To the decision before">‹ decision</button>
      <button type="button" onClick={() => jump(1)} aria-label="To the next decision">decision ›</button>
      <input type="range" min={start} max={end} step={0.1} value={player.now} aria-label="Moment of the run" aria-valuetext={moment(player.now, start)} onInput={(event) => player.seek(Number(event.currentTarget.value))} />
      <output>{moment(player.now, start)} of {moment(end, start)}</output>
      <label>
        Speed{" "}
        <select value={player.speed} onChange={(event) => { player.speed = Number(event.currentTarget.value); }}>
          {SPEEDS.map((speed) => <option key={speed} value={speed}>{speed}×</option>)}
        </select>
      </label>
      {runs.length > 1 && <Runs runs={runs} chosen={player.name} onChoose={onChoose} />}
    </div>
  );
}

const root = document.getElementById("app");
root.replaceChildren();
render(<App />, root);
