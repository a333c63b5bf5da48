// Where the robot is, and what it sees: the map, its way and its goal, the image of its camera.

import { Component } from "preact";

const SHADES = { map: [150, 255, 200, 120, 0], costmap: [null, null, 60, 120, 190] };

export class MapView extends Component {
  state = { costmap: false };

  componentDidMount() {
    this.draw();
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(this.box);
  }

  componentDidUpdate() {
    this.draw();
  }

  componentWillUnmount() {
    this.watch.disconnect();
  }

  draw() {
    const { state, trail } = this.props;
    const map = state.get("map", "map");
    const pose = state.get("robot", "pose");
    const frame = map ?? around(trail);
    const canvas = this.canvas;
    canvas.style.display = frame ? "" : "none";
    if (!frame) return;
    const width = this.box.clientWidth || 300;
    const scale = (width / frame.columns) * devicePixelRatio;
    canvas.width = width * devicePixelRatio;
    canvas.height = frame.rows * scale;
    canvas.style.height = `${canvas.height / devicePixelRatio}px`;
    const context = canvas.getContext("2d");
    context.imageSmoothingEnabled = false;
    context.clearRect(0, 0, canvas.width, canvas.height);
    for (const layer of ["map", "costmap"]) {
      const grid = state.get("map", layer);
      if (!grid || (layer === "costmap" && !this.state.costmap)) continue;
      const [left, top] = place(frame, scale, canvas, grid.x, grid.y + grid.rows * grid.resolution);
      const size = (grid.resolution / frame.resolution) * scale;
      context.drawImage(this.image(layer, grid), left, top, grid.columns * size, grid.rows * size);
    }
    const at = (x, y) => place(frame, scale, canvas, x, y);
    const line = (points, colour, dash, thick) => {
      context.beginPath();
      points.forEach(([x, y], i) => context[i ? "lineTo" : "moveTo"](...at(x, y)));
      context.strokeStyle = colour;
      context.lineWidth = thick * devicePixelRatio;
      context.setLineDash(dash.map((part) => part * devicePixelRatio));
      context.stroke();
      context.setLineDash([]);
    };
    if (trail.length > 1) line(trail, "#0072b2", [], 2);
    const way = state.get("robot", "way");
    if (way?.length > 1) line(way, "#d55e00", [6, 4], 2);
    const goal = state.get("robot", "goal");
    if (goal) mark(context, ...at(...goal), "#d55e00", 7 * devicePixelRatio);
    if (pose) arrow(context, ...at(pose[0], pose[1]), pose[2], 11 * devicePixelRatio);
  }

  // The grid as an image, made once.
  image(layer, grid) {
    this.images ??= {};
    if (this.images[layer]?.grid === grid) return this.images[layer].image;
    const image = document.createElement("canvas");
    image.width = grid.columns;
    image.height = grid.rows;
    const pixels = new ImageData(grid.columns, grid.rows);
    let cell = 0;
    for (let i = 0; i < grid.runs.length; i += 2) {
      const shade = SHADES[layer][grid.runs[i]];
      for (let n = 0; n < grid.runs[i + 1]; n += 1, cell += 1) {
        const row = grid.rows - 1 - Math.floor(cell / grid.columns); // row 0 is at the bottom
        const place = (row * grid.columns + (cell % grid.columns)) * 4;
        if (layer === "map") pixels.data.set([shade, shade, shade, 255], place);
        else if (shade) pixels.data.set([204, 121, 167, shade], place);
      }
    }
    image.getContext("2d").putImageData(pixels, 0, 0);
    this.images[layer] = { grid, image };
    return image;
  }

  render({ state }) {
    const pose = state.get("robot", "pose");
    const where = pose ? `The robot is at ${pose[0].toFixed(1)} m, ${pose[1].toFixed(1)} m.` : "Nobody tells where the robot is.";
    return (
      <div ref={(element) => (this.box = element ?? this.box)}>
        <canvas ref={(element) => (this.canvas = element)} class="map" role="img" aria-label={where} />
        {state.get("map", "costmap") && (
          <label>
            <input type="checkbox" checked={this.state.costmap} onChange={(event) => this.setState({ costmap: event.currentTarget.checked })} /> costs of the way
          </label>
        )}
        <p class="hint">
          {where} <span class="key way">planned way</span> <span class="key trail">driven</span>
        </p>
        {state.get("robot", "camera") && <img class="map" src={state.get("robot", "camera")} alt="What the camera of the robot sees" />}
      </div>
    );
  }
}

// A frame for a robot without a map.
function around(trail) {
  if (trail.length < 2) return null;
  const xs = trail.map(([x]) => x);
  const ys = trail.map(([, y]) => y);
  const resolution = 0.1;
  const [x, y] = [Math.min(...xs) - 2, Math.min(...ys) - 2];
  return { x, y, resolution, columns: (Math.max(...xs) + 2 - x) / resolution, rows: (Math.max(...ys) + 2 - y) / resolution };
}

function place(frame, scale, canvas, x, y) {
  return [((x - frame.x) / frame.resolution) * scale, canvas.height - ((y - frame.y) / frame.resolution) * scale];
}

function mark(context, x, y, colour, size) {
  context.strokeStyle = colour;
  context.lineWidth = size / 3;
  context.beginPath();
  context.arc(x, y, size, 0, 2 * Math.PI);
  context.stroke();
}

function arrow(context, x, y, yaw, size) {
  context.save();
  context.translate(x, y);
  context.rotate(-yaw);
  context.fillStyle = "#0072b2";
  context.strokeStyle = "#ffffff";
  context.lineWidth = size / 8;
  context.beginPath();
  context.moveTo(size, 0);
  context.lineTo(-size * 0.7, size * 0.65);
  context.lineTo(-size * 0.35, 0);
  context.lineTo(-size * 0.7, -size * 0.65);
  context.closePath();
  context.fill();
  context.stroke();
  context.restore();
}
