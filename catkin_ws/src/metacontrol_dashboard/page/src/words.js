// Words, signs and numbers that several panels show. A state has a sign besides its colour.

export const SIGNS = {
  ok: ["●", "ok"],
  missing: ["✖", "missing"],
  hung: ["◔", "hangs"],
  silent: ["∅", "silent"],
  drifted: ["≠", "parameters drifted"],
  wrong: ["!", "interfaces differ"],
  additional: ["+", "additional"],
  changing: ["↻", "being changed"],
};

export const TROUBLE = ["missing", "hung", "silent", "drifted", "wrong", "additional"];

export function number(value) {
  if (value === null || value === undefined) return "–";
  return Math.abs(value) < 5e-5 ? "0" : Number(value.toPrecision(3)).toString();
}

export function seconds(value) {
  if (value === null || value === undefined) return "–";
  return value < 1 ? `${Math.round(value * 1000)} ms` : `${value.toFixed(value < 10 ? 2 : 1)} s`;
}

// A moment of the run; live, stamps may be dates.
export function moment(stamp, start = 0) {
  if (stamp > 1e9) return new Date(stamp * 1000).toLocaleTimeString();
  return `${(stamp - start).toFixed(1)} s`;
}

export function short(name) {
  return name.replace(/^\//, "");
}

export function plural(count, word) {
  return `${count} ${word}${count === 1 ? "" : "s"}`;
}

export function change(decision) {
  if (!decision.to_configuration) return `stays with ${decision.from_configuration || "nothing"}`;
  if (decision.from_configuration === decision.to_configuration) return `${decision.to_configuration} again`;
  return `${decision.from_configuration || "nothing"} → ${decision.to_configuration}`;
}

export const DECISION_STATES = {
  PROPOSED: ["?", "waits for approval"],
  ADVISED: ["i", "advice, not carried out"],
  DECIDED: ["↻", "being carried out"],
  EXECUTED: ["✔", "carried out"],
  FAILED: ["✖", "failed or refused"],
};
