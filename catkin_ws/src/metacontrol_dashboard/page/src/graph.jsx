// The graph of nodes and topics: what runs beside what should run.

import cytoscape from "cytoscape";
import dagre from "cytoscape-dagre";
import { Component } from "preact";
import { Sign } from "./panel.jsx";
import { SIGNS, TROUBLE, number, short } from "./words.js";

cytoscape.use(dagre);

const COMMON = /^\/(rosout(_agg)?|clock|tf|tf_static|diagnostics|statistics)$|\/(parameter_descriptions|parameter_updates|bond)$/;
const TOOLS = /(^|\/)(rosout|rosgraph_\w+|reasoner|metacontrol_dashboard|mission\w*|rosbag\w*|record\w*|rviz\w*|rostopic\w*|contingencies|manager)$|_\d{10,}$/;
const MANY = 350; // elements from which on the layout has to be a fast one

function palette() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(name).trim();
  return { text: of("--text"), line: of("--line"), card: of("--card"), ok: of("--ok"), bad: of("--bad"), warn: of("--warn"), extra: of("--extra"), muted: of("--muted") };
}

// The elements to draw.
export function elements(nodes, topics, { view, tools, filter }) {
  const shows = (thing) => view === "both" || (view === "seen" ? thing.seen : thing.wanted || thing.unknown);
  const hasModel = Object.values(nodes).some((node) => node.wanted);
  const found = [];
  const drawn = new Set();
  const fits = (name) => !filter || name.toLowerCase().includes(filter.toLowerCase());
  for (const [name, node] of Object.entries(nodes)) {
    if ((!tools && TOOLS.test(name) && node.state === "ok") || !shows({ ...node, unknown: !hasModel }) || !fits(name)) continue;
    drawn.add(name);
    const state = view === "wanted" ? "ok" : node.state;
    found.push({ data: { id: `n${name}`, name, label: `${SIGNS[state][0]} ${short(name)}`, kind: "node", state } });
  }
  for (const [name, topic] of Object.entries(topics)) {
    if (!tools && COMMON.test(name)) continue;
    const ends = [];
    for (const [side, wanted] of [["pub", "wanted_pub"], ["sub", "wanted_sub"]]) {
      for (const node of new Set([...topic[side], ...topic[wanted]])) {
        const seen = topic[side].includes(node);
        const isWanted = topic[wanted].includes(node);
        if (drawn.has(node) && shows({ seen, wanted: isWanted, unknown: !hasModel })) ends.push({ node, side, seen, isWanted });
      }
    }
    const sides = new Set(ends.map((end) => end.side));
    if (sides.size < 2 && topic.state === "ok" && !(tools && ends.length) && !(topic.seen_only && ends.length)) continue;
    if (!ends.length) continue;
    const state = view === "wanted" ? "ok" : topic.state;
    const sign = state === "ok" ? "" : `${SIGNS[state][0]} `;
    found.push({ data: { id: `t${name}`, name, label: sign + short(name), kind: "topic", state } });
    for (const { node, side, seen, isWanted } of ends) {
      const [source, target] = side === "pub" ? [`n${node}`, `t${name}`] : [`t${name}`, `n${node}`];
      const tells = hasModel && view === "both";
      // A node to which nobody listens may leave out what it subscribes to: the monitor does not complain, either.
      const isIdle = side === "sub" && nodes[node]?.state === "ok";
      const edge = tells && !seen ? (isIdle ? "idle" : "missing") : tells && !isWanted && nodes[node]?.wanted ? "additional" : "ok";
      found.push({ data: { id: `${source}>${target}`, source, target, kind: "edge", state: edge } });
    }
  }
  return found;
}

export class Graph extends Component {
  state = { view: "both", tools: false, filter: "", chosen: null };

  componentDidMount() {
    const paint = palette();
    const states = { missing: paint.bad, hung: paint.bad, silent: paint.warn, drifted: paint.warn, wrong: paint.warn, additional: paint.extra, changing: paint.muted };
    this.cy = cytoscape({
      container: this.canvas,
      minZoom: 0.1,
      maxZoom: 3,
      wheelSensitivity: 0.3,
      style: [
        { selector: "node", style: { label: "data(label)", color: paint.text, "font-size": 13, "text-valign": "center", "text-halign": "center", width: "label", height: 24, padding: 6, "background-color": paint.card, "border-color": paint.ok, "border-width": 2, shape: "round-rectangle" } },
        { selector: "node[kind='topic']", style: { shape: "ellipse", "font-size": 11, height: 14, padding: 5, "border-color": paint.line, "border-width": 1 } },
        ...Object.entries(states).map(([state, colour]) => ({ selector: `node[state='${state}']`, style: { "border-color": colour, "border-width": 4, "font-weight": "bold" } })),
        { selector: "node[state='missing']", style: { "border-style": "dashed" } },
        { selector: "node[state='hung']", style: { "border-style": "double", "border-width": 6 } },
        { selector: "edge", style: { width: 1.5, "line-color": paint.muted, "target-arrow-color": paint.muted, "target-arrow-shape": "triangle", "curve-style": "bezier", "arrow-scale": 0.8 } },
        { selector: "edge[state='missing']", style: { "line-style": "dashed", "line-color": paint.bad, "target-arrow-color": paint.bad, width: 2.5 } },
        { selector: "edge[state='idle']", style: { "line-style": "dashed" } },
        { selector: "edge[state='additional']", style: { "line-style": "dotted", "line-color": paint.extra, "target-arrow-color": paint.extra } },
        { selector: ":selected", style: { "background-color": paint.line } },
      ],
    });
    this.cy.on("tap", "node", (event) => this.setState({ chosen: event.target.data("name") }));
    this.watch = new ResizeObserver(() => {
      this.cy.resize();
      this.fit();
    });
    this.watch.observe(this.canvas);
    this.draw();
  }

  componentDidUpdate() {
    this.draw();
  }

  componentWillUnmount() {
    this.watch.disconnect();
    this.cy.destroy();
  }

  draw() {
    const { nodes, topics } = this.props;
    const wanted = elements(nodes, topics, this.state);
    const ids = wanted.map((element) => element.data.id).join("\n");
    if (ids === this.ids) {
      this.cy.batch(() => {
        for (const { data } of wanted) this.cy.getElementById(data.id).data(data);
      });
      return;
    }
    this.ids = ids;
    this.cy.elements().remove();
    this.cy.add(wanted);
    const layout = wanted.length > MANY ? { name: "grid", condense: true } : { name: "dagre", rankDir: this.canvas.clientWidth > 700 ? "LR" : "TB", nodeSep: 10, rankSep: 28, edgeSep: 4 };
    this.cy.layout({ ...layout, animate: false, fit: false }).run();
    this.fit();
  }

  fit() {
    this.cy.fit(undefined, 12);
    if (this.cy.zoom() > 1.2) {
      this.cy.zoom(1.2);
      this.cy.center();
    }
  }

  render({ nodes, topics, usage }, { view, tools, filter, chosen }) {
    const trouble = [...Object.entries(nodes), ...Object.entries(topics)].filter(([, thing]) => TROUBLE.includes(thing.state));
    const hasModel = Object.values(nodes).some((node) => node.wanted);
    const choose = (name) => this.setState({ chosen: name });
    return (
      <div>
        <div class="bar" role="group" aria-label="What the graph shows">
          {[["both", "Both, differences marked"], ["seen", "What runs"], ["wanted", "What should run"]].map(([key, text]) => (
            <label key={key}>
              <input type="radio" name="graph-view" checked={view === key} disabled={!hasModel && key !== "both"} title={!hasModel && key !== "both" ? "There is no model of what should run" : ""} onChange={() => this.setState({ view: key })} /> {text}
            </label>
          ))}
          <label>
            <input type="checkbox" checked={tools} onChange={(event) => this.setState({ tools: event.currentTarget.checked })} /> meta-controller, tools, loose ends
          </label>
          <label>
            filter <input type="search" value={filter} onInput={(event) => this.setState({ filter: event.currentTarget.value })} />
          </label>
        </div>
        <div class="split">
          <div class="graph" ref={(element) => (this.canvas = element)} role="img" aria-label="Graph of nodes and topics; the list beside it says the same" />
          <div class="beside">
            <h3>{trouble.length ? "What differs" : hasModel ? "All is as it should be" : "What runs"}</h3>
            <ul class="plain">
              {trouble.map(([name, thing]) => (
                <li key={name}>
                  <button type="button" class="link" onClick={() => choose(name)}>
                    <Sign sign={SIGNS[thing.state][0]} kind={thing.state} text={short(name)} />
                  </button>{" "}
                  {SIGNS[thing.state][1]}
                </li>
              ))}
            </ul>
            <label>
              Details of{" "}
              <select value={chosen ?? ""} onChange={(event) => choose(event.currentTarget.value || null)}>
                <option value="">choose a node or topic</option>
                <optgroup label="nodes">{Object.keys(nodes).sort().map((name) => <option key={name}>{name}</option>)}</optgroup>
                <optgroup label="topics">{Object.keys(topics).sort().map((name) => <option key={name}>{name}</option>)}</optgroup>
              </select>
            </label>
            {chosen && <Details name={chosen} nodes={nodes} topics={topics} usage={usage} onChoose={choose} />}
          </div>
        </div>
        <p class="hint legend">
          {Object.entries(SIGNS).map(([state, [sign, text]]) => (
            <Sign key={state} sign={sign} kind={state} text={text} />
          ))}
          <span>Dashed lines should be there and are not; dotted ones are there and not in the model.</span>
        </p>
      </div>
    );
  }
}

function Details({ name, nodes, topics, usage, onChoose }) {
  const node = nodes[name];
  const topic = topics[name];
  const thing = node ?? topic;
  if (!thing) return <p>{name} is gone.</p>;
  const lists = node
    ? [["publishes", node.pub], ["subscribes to", node.sub], ["offers services", node.srv]]
    : [["published by", topic.pub], ["subscribed by", topic.sub], ["should be published by", topic.wanted_pub], ["should be subscribed by", topic.wanted_sub]];
  const costs = usage[name];
  return (
    <div class="details" aria-live="polite">
      <h3>{name}</h3>
      <p>
        <Sign sign={SIGNS[thing.state][0]} kind={thing.state} text={SIGNS[thing.state][1]} />
        {thing.why && `: ${thing.why}`}
      </p>
      {node && !node.wanted && node.seen && <p class="hint">The model does not have it, or no model is known.</p>}
      {topic?.type && <p class="hint">{topic.type}</p>}
      {costs && <p>{number(costs.cpu)} % of a core, {number(costs.memory)} MB</p>}
      {lists.map(([title, names]) =>
        names.length ? (
          <p key={title}>
            {title}:{" "}
            {names.map((other) => (
              <button key={other} type="button" class="link" onClick={() => onChoose(other)}>
                {short(other)}
              </button>
            ))}
          </p>
        ) : null,
      )}
    </div>
  );
}
