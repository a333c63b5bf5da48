// Where the state comes from: a running system over a WebSocket, or a recording that is played here.

import { State } from "./state.js";

const KEPT = 2000; // items of a log
const FIRST_WAIT = 500; // ms
const LONGEST_WAIT = 5000; // ms
const SILENT = 45000; // ms without anything from the server after which the connection counts as lost

export class Live {
  constructor(onChange) {
    this.state = new State();
    this.connected = false;
    this.lostAt = null;
    this.control = "no";
    this.onChange = onChange;
    this.wait = FIRST_WAIT;
    this.connect();
  }

  connect() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/live`);
    let watch = null;
    const heard = () => {
      clearTimeout(watch);
      watch = setTimeout(() => socket.close(), SILENT);
    };
    socket.onopen = heard;
    socket.onmessage = (event) => {
      heard();
      const message = JSON.parse(event.data);
      if (message.hello) {
        this.control = message.hello.control;
        this.connected = true;
        this.lostAt = null;
        this.wait = FIRST_WAIT;
      } else {
        this.state.apply(message, KEPT);
      }
      this.onChange();
    };
    socket.onclose = () => {
      clearTimeout(watch);
      this.lostAt ??= new Date();
      this.connected = false;
      this.onChange();
      setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(this.wait * 2, LONGEST_WAIT);
    };
  }

  get now() {
    return this.state.get("clock", "now") ?? 0;
  }
}

export class Player {
  constructor(recording, name, onChange) {
    this.recording = recording;
    this.name = name;
    this.onChange = onChange;
    this.state = new State();
    this.speed = 1;
    this.playing = false;
    this.next = 0; // index of the first frame that is not applied yet
    // What the plots and the strip of time show: all of the run, whatever the moment is.
    this.whole = new State();
    this.appears = {}; // when each decision is first shown, by its id
    for (const [at, change] of recording.frames) {
      this.whole.apply(change);
      for (const id of Object.keys(change.set?.decision ?? {})) this.appears[id] ??= at;
    }
    this.now = recording.start;
    this.seek(recording.end);
  }

  seek(moment) {
    const { start, end, frames } = this.recording;
    const target = Math.min(Math.max(moment, start), end);
    if (target < this.now || this.next === 0) {
      this.state.clear();
      this.next = 0;
    }
    while (this.next < frames.length && frames[this.next][0] <= target + 1e-6) {
      this.state.apply(frames[this.next][1]);
      this.next += 1;
    }
    this.now = target;
    this.onChange();
  }

  play() {
    if (this.playing) return;
    if (this.now >= this.recording.end) this.seek(this.recording.start);
    this.playing = true;
    let last = performance.now();
    const step = (at) => {
      if (!this.playing) return;
      const passed = ((at - last) / 1000) * this.speed;
      last = at;
      this.seek(this.now + passed);
      if (this.now >= this.recording.end) this.playing = false;
      else requestAnimationFrame(step);
      this.onChange();
    };
    requestAnimationFrame(step);
    this.onChange();
  }

  pause() {
    this.playing = false;
    this.onChange();
  }

  // The moments of decisions, to jump to.
  get marks() {
    return Object.values(this.appears).sort((a, b) => a - b);
  }
}
