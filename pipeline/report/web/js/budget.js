// SPDX-License-Identifier: AGPL-3.0-or-later
// What the error is made of. Squares add up, so the steps are drawn in mm² and labelled in mm.
"use strict";
(() => {
  const { data, gap, section, number } = supine;
  const { node, text, line, ticks, scale, left_axis, picture } = supine.svg;
  const parts = [["noise", "scan noise", "s5"], ["registration", "place of scan and imaged skin", "s3"], ["numerical", "mesh", "s4"],
    ["parameters", "unsure parameters", "s6"], ["model_form", "the model itself", "s2"]];

  const draw = (rows, total) => {
    const most = Math.max(total ** 2, rows.reduce((sum, r) => sum + r.mm ** 2, 0)), y = scale(0, most * 1.08, 230, 30);
    let below = 0;
    const columns = rows.map((r, i) => {
      const from = below, to = (below += r.mm ** 2), x = 70 + 92 * i;
      return [node("rect", { x, y: y(to), width: 64, height: Math.max(y(from) - y(to), 1), class: r.cls }),
        line(x + 64, y(to), x + 92, y(to), "axis"), text(x + 32, y(to) - 6, number(r.mm) + " mm", "middle small strong"), label(x + 32, r.name)];
    });
    const x = 70 + 92 * rows.length;
    return picture(640, 282, "Error budget: squares add up to the whole", left_axis(y, 56, ticks(0, y.high, 4), "mean square, mm²", 620), columns,
      node("rect", { x, y: y(total ** 2), width: 64, height: 230 - y(total ** 2), class: "s1" }),
      text(x + 32, y(total ** 2) - 6, number(total) + " mm", "middle small strong"), label(x + 32, "whole error, RMS"));
  };
  // Two lines where one would run into the neighbour's.
  const label = (x, name) => {
    const words = name.split(" "), lines = [""];
    for (const word of words) {
      if ((lines[lines.length - 1] + " " + word).length > 13 && lines[lines.length - 1]) lines.push(word);
      else lines[lines.length - 1] = (lines[lines.length - 1] + " " + word).trim();
    }
    return lines.map((part, i) => text(x, 248 + 15 * i, part, "middle small"));
  };

  supine.budget = () => {
    const file = supine.first_file("diagnosis.json", "ladder/diagnosis.json");
    if (!file) return section("budget", "What the error is made of", gap("diagnose"));
    const b = data.figures[file].budget_mm;
    const rows = parts.filter(([key]) => typeof b[key] === "number").map(([key, name, cls]) => ({ part: key, name, cls, mm: b[key], mm2: b[key] ** 2 }));
    return section("budget", "What the error is made of", supine.figure("budget", "Error budget of the fitted model", draw(rows, b.total), {
      rows: [...rows, { part: "total", name: "whole error, RMS", mm: b.total, mm2: b.total ** 2 }],
      columns: [{ title: "part", key: "name" }, { title: "mm", key: "mm", digits: 3 }, { title: "mm²", key: "mm2", digits: 3 }],
      caption: "Only the last step is a matter of physics; the others would be there with a perfect model." }));
  };
})();
