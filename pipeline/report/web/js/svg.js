// SPDX-License-Identifier: AGPL-3.0-or-later
// SVG elements, scales and axes.
"use strict";
(() => {
  const node = (tag, attributes, ...children) =>
    supine.fill(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);
  const text = (x, y, content, cls = "") => node("text", { x, y, class: cls }, content);
  const line = (x1, y1, x2, y2, cls) => node("line", { x1, y1, x2, y2, class: cls });

  // Round numbers that span low to high, about `count` of them.
  const ticks = (low, high, count = 5) => {
    const raw = (high - low) / count || 1;
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 2.5, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
    const list = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) list.push(k === 0 ? 0 : k * step);
    return list;
  };
  const digits_of = (list) => Math.min(4, Math.max(0, ...list.map((v) => (String(+v.toPrecision(8)).split(".")[1] || "").length)));
  const scale = (low, high, from, to) => {
    const map = (value) => from + ((value - low) / (high - low || 1)) * (to - from);
    return Object.assign(map, { low, high, from, to });
  };
  const log_scale = (low, high, from, to) => {
    const inner = scale(Math.log(low), Math.log(high), from, to);
    return Object.assign((value) => inner(Math.log(value)), { low, high, from, to });
  };
  // 1, 2, 5 × powers of ten between low and high, at most about six.
  const log_ticks = (low, high) => {
    const all = [];
    for (let p = Math.floor(Math.log10(low)); p <= Math.ceil(Math.log10(high)); ++p)
      for (const m of [1, 2, 5]) if (m * 10 ** p >= low * 0.999 && m * 10 ** p <= high * 1.001) all.push(m * 10 ** p);
    if (all.length >= 2) return all;
    return ticks(low, high, 4).filter((v) => v > 0);
  };
  const bottom_axis = (x, y, list, label, grid_to) => {
    const digits = digits_of(list);
    return node("g", {}, line(x.from, y, x.to, y, "axis"),
      list.map((v) => [grid_to === undefined ? "" : line(x(v), y, x(v), grid_to, "grid"), text(x(v), y + 17, supine.number(v, digits), "small middle soft")]),
      text((x.from + x.to) / 2, y + 36, label, "middle soft"));
  };
  const left_axis = (y, x, list, label, grid_to) => {
    const digits = digits_of(list);
    return node("g", {}, line(x, y.from, x, y.to, "axis"),
      list.map((v) => [grid_to === undefined ? "" : line(x, y(v), grid_to, y(v), "grid"), text(x - 6, y(v) + 4, supine.number(v, digits), "small end soft")]),
      text(x, y.to - 12, label, "soft small"));
  };
  const marks = {
    dot: (x, y, cls) => node("circle", { cx: x, cy: y, r: 5, class: cls }),
    square: (x, y, cls) => node("rect", { x: x - 5, y: y - 5, width: 10, height: 10, class: cls }),
    diamond: (x, y, cls) => node("path", { d: `M${x} ${y - 7}L${x + 7} ${y}L${x} ${y + 7}L${x - 7} ${y}Z`, class: cls }),
    cross: (x, y, cls) => node("path", { d: `M${x - 5} ${y - 5}L${x + 5} ${y + 5}M${x - 5} ${y + 5}L${x + 5} ${y - 5}`, class: cls + " line" }),
  };
  const path = (points, cls) => node("path", { d: points.map(([x, y], i) => `${i ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join(""), class: "line " + cls });
  // The picture itself: its title is what a screen reader says. Never larger than drawn, so that letters have one size.
  const picture = (width, height, title, ...children) =>
    node("svg", { viewBox: `0 0 ${width} ${height}`, style: `max-width: ${width}px`, role: "img", "aria-label": title }, node("title", {}, title), ...children);

  supine.svg = { node, text, line, ticks, scale, log_scale, log_ticks, bottom_axis, left_axis, marks, path, picture, digits_of };
})();
