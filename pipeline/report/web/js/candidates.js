// SPDX-License-Identifier: AGPL-3.0-or-later
// Which effect: candidates, what cannot be told apart, what cannot be seen, what to measure next.
"use strict";
(() => {
  const { data, el, words, number, sensible, p_value, gap, section } = supine;
  const { node, text, picture } = supine.svg;

  const interval = (p) =>
    `${supine.parameter(p.name.split(".").pop())} ${sensible(p.value)} [${sensible(p.interval95[0])}, ${sensible(p.interval95[1])}]${p.unit === "1" ? "" : " " + p.unit}`;
  // Sign and size are remarked on where the size is that of one step: a fit stays within the range.
  const rows_of = (d) => d.candidates.map((c) => ({ ...c, name: words(c.effect), sizes: c.parameters.map(interval),
    predicted_fall_mm: d.base_rms_mm - c.predicted_rms_mm, refit_fall_mm: c.refit_rms_mm === null ? null : d.base_rms_mm - c.refit_rms_mm,
    apart: c.not_told_apart_from.map(words).join(", "),
    note: [c.refit_rms_mm === null && c.wrong_sign ? "wrong sign" : "", c.refit_rms_mm === null && c.beyond_range ? "implausible size" : "", c.at_border ? "place at the border of its range" : ""].filter(Boolean).join(", ") }));

  const columns = [
    { title: "effect", key: "name" }, { title: "probability", key: "probability", digits: 2 }, { title: "p", key: "p_value", n: true, show: p_value },
    { title: "fall predicted, mm", key: "predicted_fall_mm", digits: 2 }, { title: "fall after the fit, mm", key: "refit_fall_mm", digits: 2 },
    { title: "skin left out, mm", key: "held_out_rms_mm", digits: 2 }, { title: "power", key: "power", digits: 2 },
    { title: "size [95 %]", key: "sizes", show: (list) => el("div", {}, list.map((line) => el("div", { class: "whole" }, line))) },
    { title: "not told apart from", key: "apart" }, { title: "remark", key: "note" }];

  // Predicted and actual error of each candidate, from the base down.
  const falls = (d, rows) => {
    const { scale, ticks, bottom_axis, line, marks } = supine.svg;
    const fitted = rows.filter((r) => r.refit_rms_mm !== null).slice(0, 8);
    const used = fitted.length ? fitted : rows.slice(0, 8);
    const values = used.flatMap((r) => [r.predicted_rms_mm, r.refit_rms_mm]).filter((v) => typeof v === "number").concat(d.base_rms_mm);
    const x = scale(Math.min(...values) * 0.9, Math.max(...values) * 1.05, 180, 520), height = 30 * used.length + 66;
    return picture(540, height, "Error with each candidate, mm", bottom_axis(x, height - 40, ticks(x.low, x.high, 5), "RMS, mm", 18),
      line(x(d.base_rms_mm), 18, x(d.base_rms_mm), height - 40, "s5 line dash"), text(x(d.base_rms_mm), 12, "base model", "small middle"),
      used.map((r, i) => {
        const y = 36 + 30 * i;
        return [text(172, y + 4, r.name, "end"), marks.diamond(x(r.predicted_rms_mm), y, "s1 hollow"),
          r.refit_rms_mm === null ? "" : [line(x(r.predicted_rms_mm), y, x(r.refit_rms_mm), y, "s1 line thin"), marks.dot(x(r.refit_rms_mm), y, "s2")]];
      }));
  };

  const next_table = (d) => {
    const rows = d.next_measurement.map((n) => ({ ...n, pair: words(n.closest_pair), best: words(n.shows) }));
    const separates = rows.some((n) => n.separation > 0);
    return supine.table_figure("next", "Next measurement, best first", [{ title: "measure", key: "measurement" },
      ...(separates ? [{ title: "separates the set by", key: "separation", digits: 1 }, { title: "closest pair", key: "pair" }] : []),
      { title: "mean power over what is unseen", key: "mean_power_of_unseen", digits: 2 }, { title: "shows best", key: "best" }], rows,
    { caption: separates ? "Separation: squared distance of the two hypotheses in units of the error; 9 tells them apart." : "" });
  };

  const power = (d) => {
    const rows = d.candidates.map((c) => ({ effect: c.effect, power: c.power }));
    for (const c of d.cannot_see) if (!rows.some((r) => r.effect === c.effect)) rows.push({ effect: c.effect, power: c.power });
    rows.sort((a, b) => b.power - a.power);
    const low = rows.filter((r) => r.power < 0.5).length;
    return supine.figure("power", "What this scan can show",
      supine.chart.bars("Power of this scan for each effect", rows.map((r) => ({ label: words(r.effect), value: r.power, cls: r.power < 0.5 ? "s5" : "s1" })),
        "chance to find the effect at its usual size", { low: 0, high: 1 }),
      { rows, columns: [{ title: "effect", key: "effect" }, { title: "power", key: "power", digits: 3 }],
        caption: low ? `Grey: ${low} effects that this scan would more likely miss than find. That they were not named says nothing.` : "" });
  };

  // How alike the marks of two effects are on this scan, when the free parameters have taken their share.
  const alike = (d) => {
    const a = d.alike;
    if (!a || a.effects.length < 2) return "";
    const n = a.effects.length, size = 22, left = 150, top = 130;
    const rows = a.effects.flatMap((one, i) => a.effects.map((other, j) => ({ effect: one, other, alike: a.correlation[i][j] })));
    const shade = (v) => `color-mix(in srgb, var(--c1) ${Math.round(100 * v)}%, var(--paper))`;
    const cells = rows.map((r, k) => {
      const i = Math.floor(k / n), j = k % n;
      return node("rect", { x: left + size * j, y: top + size * i, width: size - 1, height: size - 1, style: `fill:${shade(r.alike)}` },
        node("title", {}, `${words(r.effect)} and ${words(r.other)}: ${number(r.alike, 2)}`));
    });
    const strong = rows.map((r, k) => (r.alike > 0.9 && Math.floor(k / n) !== k % n
      ? node("circle", { cx: left + size * (k % n) + (size - 1) / 2, cy: top + size * Math.floor(k / n) + (size - 1) / 2, r: 3.5, style: "fill:var(--paper)" }) : ""));
    return supine.figure("alike", "How alike the effects look on this scan",
      picture(left + size * n + 20, top + size * n + 6, "Likeness of the effects' shapes on the scan", cells, strong, a.effects.map((name, i) => [
        text(left - 6, top + size * i + 15, words(name), "small end"),
        node("text", { x: 0, y: 0, class: "small", transform: `translate(${left + size * i + 15} ${top - 6}) rotate(-60)` }, words(name))])),
      { rows, columns: [{ title: "effect", key: "effect" }, { title: "other", key: "other" }, { title: "alike", key: "alike", digits: 3 }],
        caption: "Dark: the two would leave the same pattern on the skin once the free parameters are fitted again, weighed by all errors (canonical correlation, " +
          "sign aside); a dot above 0.9. Refits go further than these slopes: \"not told apart\" in the table above is theirs." });
  };

  // Sets of effects, most probable first, with what each leaves unexplained.
  const hypotheses = (d) => {
    if (!d.hypotheses) return "";
    const none = d.unlisted && d.unlisted.probability >= 0.2 ? "nothing that is listed" : "nothing missing";
    const rows = d.hypotheses.map((h) => ({ ...h, name: h.effects.length ? h.effects.map(words).join(" + ") : none,
      left: `${number(h.unexplained_mm, 1)} [${number(h.unexplained95[0], 1)}, ${number(h.unexplained95[1], 1)}]` }));
    return supine.table_figure("hypotheses", "What may be missing", [{ title: "hypothesis", key: "name" },
      { title: "probability", key: "probability", digits: 2 }, { title: "unexplained, mm [95 %]", key: "left" }], rows,
    { caption: `The place of each scan, gravity, ${supine.of_body("breath, springs, the gland, uneven tissue, skin and muscle", "springs and uneven material")} are fitted in every one of them.` });
  };

  // A hint where no effect explains the rest.
  const forces = (file) => {
    const f = data.figures[file].missing_force;
    return f ? el("p", {}, "Hint, no diagnosis: forces on the skin that would explain what is left reach ", supine.shown(file, ["missing_force", "largest_kpa"]),
      " kPa; by chance alone up to ", supine.shown(file, ["missing_force", "threshold_kpa"]), " kPa. Their map: missing_force_kpa in diagnosis.vtp.") : "";
  };

  supine.candidates = () => {
    const file = supine.first_file("diagnosis.json", "ladder/diagnosis.json");
    if (!file) return section("candidates", "Which effect", gap("diagnose"));
    const d = data.figures[file], rows = rows_of(d);
    return section("candidates", "Which effect", hypotheses(d), forces(file),
      supine.table_figure("candidates", "Candidates, most probable first", columns.filter((c) => rows.some((r) => r[c.key] !== "" && r[c.key] !== null)), rows, {
        chosen: (row) => d.missing.includes(row.effect),
        caption: "Probability: that the effect is missing, over all sets. p: chance that errors alone score as high for any effect. Fall: by how much the RMS error shrinks, predicted by the linear score and found by the fit." }),
      el("div", { class: "columns" },
        supine.figure("falls", "Error with the effect: ◇ predicted, ● after the fit", falls(d, rows), { rows, columns: columns.slice(0, 6) }),
        power(d), alike(d)), next_table(d));
  };
})();
