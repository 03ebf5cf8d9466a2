// SPDX-License-Identifier: AGPL-3.0-or-later
// What the error is made of: what each source still leaves to doubt after the fit, beside the whole.
"use strict";
(() => {
  const { data, gap, section } = supine;
  const parts = [["noise", "scan noise", "s5"], ["registration", "how it was measured", "s3"], ["numerical", "mesh", "s4"],
    ["parameters", supine.of_body("moduli, springs, gland", "moduli, springs"), "s6"],
    ["patchiness", supine.of_body("uneven tissue and skin", "uneven material"), "s6"],
    ["model_form", "what no effect explains", "s2"], ["total", "whole error, RMS", "s1"]];

  supine.budget = () => {
    const file = supine.first_file("diagnosis.json", "ladder/diagnosis.json");
    if (!file) return section("budget", "What the error is made of", gap("diagnose"));
    const b = data.figures[file].budget_mm;
    const rows = parts.filter(([key]) => typeof b[key] === "number").map(([key, name, cls]) => ({ part: key, name, cls, mm: b[key] }));
    const bars = rows.map((row) => ({ label: row.name, value: row.mm, cls: row.cls }));
    return section("budget", "What the error is made of", supine.figure("budget", "Error budget of the fitted model",
      supine.chart.bars("Error budget", bars, "mm RMS", { low: 0, high: Math.max(...rows.map((row) => row.mm)) }), {
        rows, columns: [{ title: "part", key: "name" }, { title: "mm", key: "mm", digits: 3 }],
        caption: "Doubt that is left of each source after the fit; it takes most of each away, so the parts do not add up to the whole. " +
          "What no effect explains is the model's own." }));
  };
})();
