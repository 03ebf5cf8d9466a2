// SPDX-License-Identifier: AGPL-3.0-or-later
// Elements, numbers, files: what every other script of the page uses. All of them add to the object `supine`.
"use strict";
const supine = (window.supine = {});
(() => {
  const data = JSON.parse(document.getElementById("supine-data").textContent);

  const fill = (node, attributes, children) => {
    for (const [key, value] of Object.entries(attributes || {}))
      if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
      else if (value !== null && value !== undefined && value !== false) node.setAttribute(key, value === true ? "" : value);
    for (const child of children.flat(3)) if (child !== null && child !== undefined && child !== "") node.append(child);
    return node;
  };
  const el = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);

  // What stands between backticks is code.
  const prose = (text) => String(text).split("`").map((part, i) => (i % 2 ? el("code", {}, part) : part));

  // A figure of a sidecar; null when the file or the key is not there.
  const at = (file, path) => {
    let value = data.figures[file];
    for (const key of path) value = value === null || value === undefined ? undefined : value[key];
    return value === undefined ? null : value;
  };
  const number = (value, digits = 2) =>
    typeof value !== "number" || !isFinite(value) ? "–" : value.toFixed(digits).replace(/^-(?=.*[1-9])/, "−").replace(/^-/, "");
  const signed = (value, digits = 1) => (value > 0 ? "+" : "") + number(value, digits);
  // As many digits as say something: 0.0321, 3.21, 321.
  const sensible = (value) => {
    if (typeof value !== "number" || !isFinite(value)) return "–";
    const size = Math.abs(value);
    if (size !== 0 && (size < 1e-3 || size >= 1e5)) return value.toExponential(1).replace(/-/g, "−");
    return number(value, size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3);
  };
  const p_value = (value) => (typeof value !== "number" ? "–" : value < 0.0005 ? "< 0.001" : number(value, 3));
  // A figure as text that remembers where it came from.
  const shown = (file, path, digits = 2, sign = false) => {
    const value = at(file, path);
    const text = sign && typeof value === "number" ? signed(value, digits) : number(value, digits);
    return el("span", { class: "figure", "data-file": file, "data-path": JSON.stringify(path), "data-digits": digits }, text);
  };
  // A body that is no breast has no side; what is said of a breast's anatomy is then said of a body.
  const is_object = data.case.side === "none";
  const of_body = (breast, object) => (is_object ? object : breast);
  const words = (name) => String(name).replace(/_/g, " ");
  // Of a parameter, without the unit that stands beside it: breast.young_modulus_kpa → breast young modulus.
  const parameter = (name) =>
    words(String(name).replace(/_(kpa_per_mm|kpa|mm|rad|kg_m3)$/, "").replace(/^breast\./, of_body("breast ", "body ")).replace(".", " "));

  const command = (text) => {
    const copy = el("button", { type: "button", onclick: () => navigator.clipboard && navigator.clipboard.writeText(text).then(
      () => { copy.textContent = "copied"; }, () => {}) }, "copy");
    return el("div", { class: "command" }, el("code", {}, text), navigator.clipboard ? copy : "");
  };
  const stage = (name) => data.stages.find((s) => s.name === name);
  // Says which command fills a gap.
  const gap = (name, what) => {
    const { fill: how, shows } = stage(name);
    const is_command = /^(make|build|supine)/.test(how);
    return el("div", { class: "gap" }, `${what || "Not there yet: " + shows + "."} ${is_command ? "To get it:" : "It needs"} `,
      is_command ? command(how) : [prose(how), "."]);
  };
  const section = (id, title, ...content) =>
    el("section", { id, "aria-labelledby": id + "-title" }, el("h2", { id: id + "-title" }, title), ...content);
  const first_file = (...names) => names.find((name) => data.figures[name]) || null;

  Object.assign(supine, { data, fill, el, prose, at, number, signed, sensible, p_value, shown, is_object, of_body, words, parameter, command, stage, gap, section, first_file });
})();
