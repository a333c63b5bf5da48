// Levels of the qualities over time, with limit and expected level.

import { Component } from "preact";
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { Sign } from "./panel.jsx";
import { number } from "./words.js";

const WINDOW = 120; // s that are shown live
const HEIGHT = 150; // px
const OLD = 5; // s without a level after which it counts as old

function colours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(name).trim();
  return { text: of("--text"), line: of("--line"), level: of("--ok"), limit: of("--bad"), expected: of("--warn") };
}

// A horizontal line over the whole plot.
function across(plot, value, colour, dash) {
  if (value === null || value === undefined) return;
  const y = plot.valToPos(value, "y", true);
  const { left, width } = plot.bbox;
  const { ctx } = plot;
  ctx.save();
  ctx.strokeStyle = colour;
  ctx.lineWidth = 2 * devicePixelRatio;
  ctx.setLineDash(dash.map((part) => part * devicePixelRatio));
  ctx.beginPath();
  ctx.moveTo(left, y);
  ctx.lineTo(left + width, y);
  ctx.stroke();
  ctx.restore();
}

function down(plot, value, colour) {
  const x = plot.valToPos(value, "x", true);
  const { top, height, left, width } = plot.bbox;
  if (x < left || x > left + width) return;
  plot.ctx.save();
  plot.ctx.strokeStyle = colour;
  plot.ctx.lineWidth = devicePixelRatio;
  plot.ctx.beginPath();
  plot.ctx.moveTo(x, top);
  plot.ctx.lineTo(x, top + height);
  plot.ctx.stroke();
  plot.ctx.restore();
}

class Plot extends Component {
  componentDidMount() {
    const paint = colours();
    const axis = { stroke: paint.text, grid: { stroke: paint.line, width: 1 }, ticks: { stroke: paint.line } };
    this.plot = new uPlot(
      {
        width: this.box.clientWidth || 300,
        height: HEIGHT,
        cursor: { y: false, drag: { x: false, y: false } },
        legend: { show: false },
        scales: { x: { time: this.props.now > 1e9 }, y: { range: (_, low, high) => this.range(low, high) } },
        axes: [
          { ...axis, size: 30 },
          { ...axis, size: 46, values: (_, ticks) => ticks.map((tick) => number(tick)) },
        ],
        series: [{}, { stroke: paint.level, width: 2, spanGaps: false, points: { size: 3 } }],
        hooks: {
          draw: [
            (plot) => {
              across(plot, this.props.limit, paint.limit, [8, 5]);
              across(plot, this.props.expected, paint.expected, [2, 4]);
              if (this.props.recorded) down(plot, this.props.now - this.props.start, paint.text);
            },
          ],
        },
      },
      this.data(),
      this.box,
    );
    this.watch = new ResizeObserver(() => this.plot.setSize({ width: this.box.clientWidth || 300, height: HEIGHT }));
    this.watch.observe(this.box);
    this.box.addEventListener("click", () => {
      if (this.props.recorded && this.plot.cursor.left >= 0) {
        this.props.onSeek(this.plot.posToVal(this.plot.cursor.left, "x") + this.props.start);
      }
    });
  }

  componentDidUpdate() {
    this.plot.setData(this.data());
  }

  componentWillUnmount() {
    this.watch.disconnect();
    this.plot.destroy();
  }

  range(low, high) {
    const known = [low, high, this.props.limit, this.props.expected].filter(Number.isFinite);
    const least = Math.min(0, ...known);
    const most = Math.max(...known, least + 0.01);
    return [least, most + (most - least) * 0.08];
  }

  data() {
    const { samples, now, recorded, start } = this.props;
    const shown = recorded ? samples : samples.filter(([at]) => at > now - WINDOW);
    const origin = recorded ? start : 0;
    const times = shown.map(([at]) => at - origin);
    const levels = shown.map(([, level]) => level);
    if (!recorded) {
      times.push(now);
      levels.push(null);
    }
    return [times, levels];
  }

  render() {
    return <div class="plot" aria-hidden="true" ref={(element) => (this.box = element ?? this.box)} />;
  }
}

export function Qualities({ state, whole, now, start, recorded, onSeek }) {
  const names = Object.keys(whole.sections.quality ?? {}).sort();
  if (!names.length) return <p class="hint">No level was observed yet.</p>;
  return (
    <div class="plots">
      {names.map((name) => {
        const quality = state.get("quality", name);
        const known = state.get("limit", name);
        const objectives = Object.entries(known?.of ?? {});
        const limit = objectives.map(([, of]) => of.limit).find((value) => value !== null && value !== undefined);
        const expected = objectives.map(([, of]) => of.expected).find((value) => value !== null && value !== undefined);
        return (
          <figure key={name}>
            <figcaption>
              <b>{name}</b> <Standing quality={quality} known={known} limit={limit} expected={expected} now={now} />
            </figcaption>
            <Plot
              samples={whole.log(`level/${name}`)}
              limit={limit}
              expected={expected}
              now={now}
              start={start}
              recorded={recorded}
              onSeek={onSeek}
            />
          </figure>
        );
      })}
    </div>
  );
}

function Standing({ quality, known, limit, expected, now }) {
  if (!quality) return <Sign sign="…" kind="muted" text="not observed yet" />;
  const age = now - quality.stamp;
  if (quality.level === null) return <Sign sign="∅" kind="warn" text="stale: nobody knows its level now" />;
  const passes = known?.operator ?? ">";
  const isViolated = limit !== undefined && violates(quality.level, passes, limit);
  const wanted = limit === undefined ? "no limit" : `limit: ${passes.startsWith(">") ? "at most" : "at least"} ${number(limit)}`;
  const sign = isViolated ? ["✖", "bad", "violated"] : limit === undefined ? ["●", "muted", ""] : ["●", "ok", "kept"];
  return (
    <span>
      {number(quality.level)} <Sign sign={sign[0]} kind={sign[1]} text={sign[2]} />
      <small>
        {" "}
        <span class={limit === undefined ? "hint" : "key limit"}>{wanted}</span>
        {expected !== undefined && <span class="key expected">modelled {number(expected)}</span>}
        {age > OLD && <span class="warn"> {age.toFixed(0)} s old</span>}
      </small>
    </span>
  );
}

export function violates(level, operator, limit) {
  return { ">": level > limit, ">=": level >= limit, "<": level < limit, "<=": level <= limit }[operator] ?? false;
}
