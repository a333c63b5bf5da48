// Other limits for a recorded run: what was done beside what would have been done.

import { Component } from "preact";
import { Table } from "./panel.jsx";
import { change, moment, number } from "./words.js";

export class Replay extends Component {
  state = { told: "", pairs: null };

  run = async (event) => {
    event.preventDefault();
    const limits = {};
    for (const [name, value] of new FormData(event.currentTarget).entries()) if (value !== "") limits[name] = Number(value);
    this.setState({ told: "It decides again …" });
    try {
      const answer = await fetch(`/api/runs/${encodeURIComponent(this.props.name)}/replay`, {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify(limits),
      });
      const found = await answer.json();
      this.setState(found.ok ? { told: "", pairs: found.pairs, limits } : { told: found.message, pairs: null });
    } catch {
      this.setState({ told: "The server does not answer: start `metacontrol view` again." });
    }
  };

  render({ whole, start, name, onSeek }, { told, pairs, limits }) {
    const qualities = whole.entries("limit").filter(([, about]) => Object.values(about.of).some((of) => of.limit !== null && of.limit !== undefined));
    if (!name) return <p class="hint">An exported page can't decide again: open the bag with `metacontrol view`.</p>;
    return (
      <div>
        <form class="bar" onSubmit={this.run}>
          {qualities.map(([quality, about]) => (
            <label key={quality}>
              {quality} <input type="number" step="any" name={quality} placeholder={number(Object.values(about.of)[0]?.limit)} />
            </label>
          ))}
          <button>Decide again</button>
        </form>
        <p role="status">{told}</p>
        {pairs && (
          <>
            <Table
              label="Decisions side by side"
              columns={["when", "done", `with ${Object.entries(limits).map(([quality, limit]) => `${quality} ${limit}`).join(", ") || "the same limits"}`]}
            >
              {pairs.map((pair, i) => (
                <tr key={i}>
                  <td>
                    <button type="button" class="link" onClick={() => onSeek(pair.t)}>
                      {moment(pair.t, start)}
                    </button>
                  </td>
                  {["recorded", "replayed"].map((side) => (
                    <td key={side}>
                      {pair[side] ? (
                        <>
                          <b>{change(pair[side])}</b>
                          <div class="hint">{pair[side].causes[0]}</div>
                        </>
                      ) : (
                        "–"
                      )}
                    </td>
                  ))}
                </tr>
              ))}
              {!pairs.length && (
                <tr>
                  <td colSpan={3}>No decision, neither recorded nor with these limits.</td>
                </tr>
              )}
            </Table>
            <p class="hint">From the first difference on, levels and components are taken as they were observed.</p>
          </>
        )}
      </div>
    );
  }
}
