// SPDX-License-Identifier: AGPL-3.0-or-later
// The controls beside the picture: native buttons, sliders and boxes, so that keyboard and screen reader work as usual.
const { el } = supine;

// Buttons of which one is pressed. choices: [{id, label}] or [{id, label, note}]
export function choice(legend, choices, chosen, on_choose, cls = "row") {
  const buttons = choices.map(({ id, label, note }) => el("button", { type: "button", "data-id": id, "aria-pressed": String(id === chosen), onclick: () => set(id) },
    note === undefined ? label : [el("span", {}, label), el("span", {}, note)]));
  const set = (id) => {
    buttons.forEach((b) => b.setAttribute("aria-pressed", String(b.dataset.id === id)));
    on_choose(id);
  };
  return { set, node: el("fieldset", { "data-choice": legend }, el("legend", {}, legend), el("div", { class: cls }, buttons)) };
}

export function group(legend, ...content) {
  return el("fieldset", { "data-choice": legend }, el("legend", {}, legend), content);
}

export function box(label, checked, on_change, colour) {
  const input = el("input", { type: "checkbox", checked, onchange: () => on_change(input.checked) });
  return el("label", {}, input, colour ? el("span", { class: "swatch", style: `background:rgb(${colour.join(",")})` }) : "", label);
}

export function slider(label, value, low, high, on_input) {
  const input = el("input", { type: "range", min: low, max: high, step: 1, value, "aria-label": label, oninput: () => on_input(+input.value) });
  return input;
}

export function picker(label, choices, chosen, on_change) {
  const select = el("select", { onchange: () => on_change(select.value) }, choices.map(([id, name]) => el("option", { value: id, selected: id === chosen }, name)));
  return el("label", {}, label, select);
}
