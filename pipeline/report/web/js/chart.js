// SPDX-License-Identifier: AGPL-3.0-or-later
// Kinds of charts that more than one part of the page draws.
"use strict";
(() => {
  const { number } = supine;
  const { node, text, line, ticks, scale, bottom_axis, left_axis, picture } = supine.svg;

  // Rows of horizontal bars: {label, value, cls, note}. Values of both signs go to both sides of zero.
  const bars = (title, rows, unit, { digits = 2, low, high, sign = false } = {}) => {
    const values = rows.map((r) => r.value).filter((v) => typeof v === "number");
    const top = high === undefined ? Math.max(0, ...values) : high, bottom = low === undefined ? Math.min(0, ...values) : low;
    const list = ticks(bottom, top, 4), height = 26 * rows.length + 46;
    const x = scale(Math.min(bottom, list[0]), Math.max(top, list[list.length - 1]), 190, 470);
    return picture(540, height, title, bottom_axis(x, height - 42, list, unit, 4), rows.map((row, i) => {
      const y = 8 + 26 * i, given = typeof row.value === "number";
      const from = Math.min(x(0), x(given ? row.value : 0)), width = given ? Math.abs(x(row.value) - x(0)) : 0;
      return [text(182, y + 13, row.label, "end"), node("rect", { x: from, y, width: Math.max(width, 1), height: 17, class: row.cls || "s1" }),
        text((row.value > 0 ? from + width : x(0)) + 6, y + 13, row.note || (sign ? supine.signed(row.value, digits) : number(row.value, digits)), "small")];
    }), line(x(0), 4, x(0), height - 42, "axis"));
  };

  // Columns of counts: edges has one more entry than counts.
  const histogram = (title, edges, counts, label, { marks: lines = [] } = {}) => {
    const most = Math.max(1, ...counts), y = scale(0, most, 200, 24), x = scale(edges[0], edges[edges.length - 1], 50, 520);
    return picture(540, 244, title, left_axis(y, 50, ticks(0, most, 4), "count", 520),
      counts.map((c, i) => node("rect", { x: x(edges[i]) + 0.5, y: y(c), width: Math.max(x(edges[i + 1]) - x(edges[i]) - 1, 0.5), height: 200 - y(c), class: "s1" })),
      bottom_axis(x, 200, ticks(edges[0], edges[edges.length - 1], 6), label),
      lines.map(({ at, name, cls }, i) => [line(x(at), 200, x(at), 20, `line dash ${cls || "s2"}`), text(x(at) + 5, 32 + 16 * i, name, "small")]));
  };
  const binned = (values, count) => {
    const low = Math.min(...values), high = Math.max(...values), width = (high - low) / count || 1;
    const counts = new Array(count).fill(0);
    for (const v of values) counts[Math.min(count - 1, Math.floor((v - low) / width))] += 1;
    return { edges: Array.from({ length: count + 1 }, (_, i) => low + i * width), counts };
  };
  supine.chart = { bars, histogram, binned };
})();
