// The state as the server sends it: sections of entries, and logs. `counts` tells panels which sections have changed.

export class State {
  constructor() {
    this.clear();
  }

  clear() {
    this.sections = {};
    this.logs = {};
    this.counts = {};
    this.version = (this.version ?? 0) + 1;
  }

  get(section, key) {
    return this.sections[section]?.[key];
  }

  entries(section) {
    return Object.entries(this.sections[section] ?? {});
  }

  log(name) {
    return this.logs[name] ?? [];
  }

  // What a panel compares to see whether it has to be drawn again.
  mark(...names) {
    return names.map((name) => this.counts[name] ?? 0).join(".") + `.${this.version}`;
  }

  apply(change, kept = Infinity) {
    if (change.whole) this.clear();
    for (const [section, values] of Object.entries(change.set ?? {})) {
      this.sections[section] = { ...this.sections[section], ...values };
      this.#count(section);
    }
    for (const [section, keys] of Object.entries(change.drop ?? {})) {
      const values = { ...this.sections[section] };
      for (const key of keys) delete values[key];
      this.sections[section] = values;
      this.#count(section);
    }
    for (const [log, items] of Object.entries(change.add ?? {})) {
      const all = [...(this.logs[log] ?? []), ...items];
      this.logs[log] = all.length > kept ? all.slice(-kept) : all;
      this.#count(log.split("/")[0]);
    }
  }

  #count(name) {
    this.counts[name] = (this.counts[name] ?? 0) + 1;
  }
}
