// SPDX-License-Identifier: AGPL-3.0-or-later
// Fitted parameters, how well the data know them, the way of the fit, sensitivity.
"use strict";
(() => {
  const { data, el, words, sensible, gap, section, number } = supine;
  const { ticks, scale, log_scale, log_ticks, bottom_axis, left_axis, marks, path, picture } = supine.svg;

  const fitted_table = (c) => {
    const rows = c.parameters.map((p) => ({ ...p, low: p.interval95[0], high: p.interval95[1] }));
    const show = (value) => sensible(value);
    return supine.table_figure("parameters", "Fitted parameters", [
      { title: "parameter", key: "name", show: supine.parameter }, { title: "start", key: "start", n: true, show }, { title: "fitted", key: "value", n: true, show },
      { title: "95 % from", key: "low", n: true, show }, { title: "to", key: "high", n: true, show }, { title: "unit", key: "unit" },
      { title: "", key: "at_bound", show: (v) => (v ? "at an end of its range" : "") }], rows,
    { caption: `Interval: ${c.interval_kind}. ${(c.remarks || []).map((r) => (/^\w+[._]/.test(r) ? r : r[0].toUpperCase() + r.slice(1))).join(". ")}.` });
  };

  // 95 % ellipse of two parameters in the coordinates of the fit (logarithms of positive ones).
  const ellipse = (c, i, j) => {
    const sd = c.worth.coordinates, r = c.worth.correlation[i][j], radius = Math.sqrt(5.991);
    const place = (k, u) => (sd[k].coordinate.startsWith("ln") ? c.parameters[k].value * Math.exp(u * sd[k].sd) : c.parameters[k].value + u * sd[k].sd);
    return Array.from({ length: 97 }, (_, k) => {
      const angle = (2 * Math.PI * k) / 96, a = radius * Math.cos(angle), b = radius * Math.sin(angle);
      return [place(i, a), place(j, r * a + Math.sqrt(Math.max(0, 1 - r * r)) * b)];
    });
  };
  const axis_scale = (log, values, from, to) => {
    const low = Math.min(...values), high = Math.max(...values);
    if (log && low > 0) return log_scale(low / 1.1, high * 1.1, from, to);
    const room = 0.06 * (high - low || 1);
    return scale(low - room, high + room, from, to);
  };
  const ridge = (c, history) => {
    const n = c.parameters.length;
    if (n < 2 || !c.worth || !c.worth.correlation) return "";
    let [i, j] = [0, 1];
    for (let a = 0; a < n; ++a) for (let b = a + 1; b < n; ++b)
      if (Math.abs(c.worth.correlation[a][b]) > Math.abs(c.worth.correlation[i][j])) [i, j] = [a, b];
    const names = [c.parameters[i].name, c.parameters[j].name], outline = ellipse(c, i, j);
    const way = history.filter((h) => !h.failed).map((h) => [h[names[0]], h[names[1]], h.rms_mm]);
    const best = Math.min(...way.map((p) => p[2])), worst = Math.max(...way.map((p) => p[2]));
    const is_log = (k) => (c.worth.coordinates[k].coordinate || "").startsWith("ln");
    const x = axis_scale(is_log(i), [...outline, ...way].map((p) => p[0]), 70, 500), y = axis_scale(is_log(j), [...outline, ...way].map((p) => p[1]), 300, 30);
    const list = (s, log) => (log && s.low > 0 ? log_ticks(s.low, s.high) : ticks(s.low, s.high, 5));
    const unit = (k) => (c.parameters[k].unit === "1" ? "" : ", " + c.parameters[k].unit);
    const descent = history.some((h) => h.accepted !== undefined);
    return supine.figure("ridge", "What the data know of two parameters", picture(540, 346, `95 % region of ${names.join(" and ")}`,
      left_axis(y, 70, list(y, is_log(j)), supine.parameter(names[1]) + unit(j), 500), bottom_axis(x, 300, list(x, is_log(i)), supine.parameter(names[0]) + unit(i), 30),
      path(outline.map(([a, b]) => [x(a), y(b)]), "s1"),
      descent && way.length < 60 ? path(way.map(([a, b]) => [x(a), y(b)]), "s5 thin") : "",
      way.map(([a, b, e]) => supine.svg.node("circle", { cx: x(a), cy: y(b), r: 3 + 4 * (worst > best ? (worst - e) / (worst - best) : 1), class: "s5", "fill-opacity": 0.5 })),
      marks.dot(x(c.parameters[i].value), y(c.parameters[j].value), "s2")),
    { caption: `Blue: 95 % region at the fit (orange dot). Grey: models that were tried, the larger the smaller their error (${number(worst)} to ${number(best)} mm RMS). ` +
        `Correlation ${number(c.worth.correlation[i][j], 2)}: ${Math.abs(c.worth.correlation[i][j]) > 0.9 ? "a ridge, along it the error hardly changes" : "each has a say of its own"}.`,
      rows: outline.map(([a, b]) => ({ x: a, y: b })), columns: [{ title: names[0], key: "x", n: true, show: sensible }, { title: names[1], key: "y", n: true, show: sensible }] });
  };

  const history_figure = (history) => {
    const good = history.filter((h) => !h.failed && typeof h.rms_mm === "number");
    if (good.length < 2) return "";
    const x = scale(1, Math.max(...good.map((h) => h.evaluation)), 60, 510), y = scale(0, Math.max(...good.map((h) => h.rms_mm)) * 1.05, 200, 24);
    let best = Infinity;
    const least = good.map((h) => [x(h.evaluation), y((best = Math.min(best, h.rms_mm)))]);
    return supine.figure("history", "Calibration, run by run", picture(540, 244, "Error of each chain run of the calibration",
      left_axis(y, 60, ticks(0, y.high, 4), "RMS, mm", 510), bottom_axis(x, 200, ticks(1, x.high, 6).filter((v) => v === Math.round(v)), "chain run"),
      path(least, "s2"), good.map((h) => supine.svg.node("circle", { cx: x(h.evaluation), cy: y(h.rms_mm), r: good.length > 200 ? 1.5 : 3.5, class: "s1" }))),
    { caption: "Dots: each run. Line: the best so far.", rows: good,
      columns: Object.keys(good[0]).map((key) => ({ title: words(key), key, n: true, show: (v) => (typeof v === "number" ? sensible(v) : "–") })) });
  };

  const sensitivity = () => {
    const s = data.figures["sensitivity.json"], rows = data.texts["sensitivity.csv"] ? supine.parse_csv(data.texts["sensitivity.csv"]) : [];
    if (!s || !rows.length) return gap("sensitivity", "Not there yet: how the error depends on the parameters.");
    const values = rows.filter((r) => !r.failed).map((r) => r.mae_study_mm), { edges, counts } = supine.chart.binned(values, Math.min(30, Math.ceil(Math.sqrt(values.length)) + 3));
    return [
      supine.figure("sensitivity", "Error over what was believed of the parameters", supine.chart.histogram("Mean absolute error over the prior", edges, counts,
        "MAE, model to scan, mm", { marks: [{ at: s.mae_study_mm.mean, name: `mean ${number(s.mae_study_mm.mean)} ± ${number(s.mae_study_mm.sd)} mm` }] }),
      { rows, columns: Object.keys(rows[0]).map((key) => ({ title: words(key), key, n: true, show: (v) => (typeof v === "number" ? sensible(v) : "–") })),
        caption: `${s.samples} chain runs with parameters drawn from the model file, ${s.failed_solves} of them without equilibrium.` }),
      supine.figure("shares", "Where the spread comes from", supine.chart.bars("Share of the variance per parameter",
        [...s.parameters.filter((p) => p.variance_share !== null).map((p) => ({ label: supine.parameter(p.name), value: 100 * p.variance_share })),
          ...(s.parameters.length > 1 && s.interaction_share !== null ? [{ label: "acting together", value: 100 * s.interaction_share, cls: "s5" }] : [])], "% of the variance", { digits: 0, high: 100 }),
      { rows: s.parameters, columns: [{ title: "parameter", key: "name" }, { title: "share", key: "variance_share", digits: 3 }] })];
  };

  supine.parameters = () => {
    const c = data.figures["calibration.json"];
    const history = data.texts["history.csv"] ? supine.parse_csv(data.texts["history.csv"]) : [];
    return section("parameters", "Parameters",
      c ? [fitted_table(c), el("div", { class: "columns" }, ridge(c, history), history_figure(history))] : gap("calibrate"),
      el("div", { class: "columns" }, sensitivity()));
  };
})();
