// A panel of the page: it is drawn again only when what it shows has changed.

import { Component } from "preact";

export class Panel extends Component {
  shouldComponentUpdate(next) {
    return next.mark !== this.props.mark;
  }

  render({ id, title, hint, wide, children, draw }) {
    return (
      <section id={id} class={wide ? "panel wide" : "panel"} aria-labelledby={`${id}-title`}>
        <h2 id={`${id}-title`}>{title}</h2>
        {hint && <p class="hint">{hint}</p>}
        {draw ? draw() : children}
      </section>
    );
  }
}

export function Sign({ sign, kind, text }) {
  return (
    <span class={`sign ${kind}`}>
      <span aria-hidden="true">{sign}</span> {text}
    </span>
  );
}

// A table that scrolls by itself, also by keys; its rows are the children.
export function Table({ label, columns, children }) {
  return (
    <div class="scroll" tabIndex={0} role="region" aria-label={label}>
      <table>
        <thead>
          <tr>
            {columns.map((name, i) => (
              <th scope="col" key={i}>
                {name}
              </th>
            ))}
          </tr>
        </thead>
        <tbody>{children}</tbody>
      </table>
    </div>
  );
}
