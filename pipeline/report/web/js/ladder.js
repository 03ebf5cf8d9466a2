// SPDX-License-Identifier: AGPL-3.0-or-later
// The ladder: the error as effects are added, beside what noise leaves and what two controls reach.
"use strict";
(() => {
  const { data, words, gap, section } = supine;
  const { text, line, ticks, scale, left_axis, marks, path, picture } = supine.svg;
  const series = [
    { key: "rms_mm", name: "fitted skin", mark: "dot", cls: "s1" },
    { key: "held_out_rms_mm", name: "skin left out", mark: "square", cls: "s2" },
    { key: "unexplained_mm", name: "unexplained", mark: "diamond", cls: "s3" },
  ];
  const label = (rung, r) => (r === 0 ? "nothing added" : "+ " + words(rung.added));

  // One row per rung and control.
  const rows_of = (ladder) => {
    const row = (kind, name, r, f) => ({ rung: r, kind, name, mae_mm: f.mae_mm, rms_mm: f.rms_mm, held_out_rms_mm: f.held_out_rms_mm,
      unexplained_mm: f.unexplained_mm, probability: f.added && kind === "rung" ? f.probability : null });
    return ladder.rungs.flatMap((rung, r) => {
      const controls = rung.controls || {}, refit = controls.refit_only, other = controls.random_other;
      return [...(refit ? [row("control", "control: nothing added, fitted again", r, refit)] : []),
        ...(other && other.added ? [row("control", "control: + " + words(other.added) + " (drawn)", r, other)] : []),
        row("rung", label(rung, r), r, rung)];
    });
  };

  const draw = (ladder, rows) => {
    const rungs = rows.filter((row) => row.kind === "rung"), controls = rows.filter((row) => row.kind === "control");
    const values = rows.flatMap((row) => series.map((s) => row[s.key])).filter((v) => typeof v === "number");
    const y = scale(0, Math.max(...values, ladder.noise_floor_mm) * 1.08, 300, 30);
    const width = Math.max(680, 190 * rungs.length + 300), right = width - 150;
    const x = (r) => 150 + r * ((right - 200) / Math.max(1, rungs.length - 1));
    const ends = spread(series.filter((s) => typeof rungs[rungs.length - 1][s.key] === "number")
      .map((s) => ({ s, y: y(rungs[rungs.length - 1][s.key]) })));
    return picture(width, 346, "Error of each rung of the ladder in mm", left_axis(y, 60, ticks(0, y.high, 5), "RMS, mm", right),
      line(60, y(ladder.noise_floor_mm), right, y(ladder.noise_floor_mm), "s5 line dash"),
      text(66, y(ladder.noise_floor_mm) + 16, "what noise and mesh alone leave", "small soft"),
      series.map((s) => path(rungs.filter((row) => typeof row[s.key] === "number").map((row) => [x(row.rung), y(row[s.key])]), s.cls)),
      controls.map((row) => series.filter((s) => typeof row[s.key] === "number").map((s) =>
        marks[s.mark](x(row.rung) - (row.name.includes("nothing") ? 34 : 18), y(row[s.key]), s.cls + " hollow"))),
      rungs.map((row) => [series.filter((s) => typeof row[s.key] === "number").map((s) => marks[s.mark](x(row.rung), y(row[s.key]), s.cls)),
        text(x(row.rung), 322, row.name, "middle strong")]),
      ends.map(({ s, y: at }) => [marks[s.mark](right + 14, at, s.cls), text(right + 26, at + 4, s.name)]));
  };
  // Moves labels apart that would lie on each other.
  const spread = (labels) => {
    labels.sort((a, b) => a.y - b.y);
    for (let i = 1; i < labels.length; ++i) labels[i].y = Math.max(labels[i].y, labels[i - 1].y + 17);
    return labels;
  };

  supine.ladder = () => {
    const file = supine.first_file("ladder/ladder.json", "ladder.json");
    if (!file) return section("ladder", "The error, effect by effect", gap("ladder"));
    const ladder = data.figures[file], rows = rows_of(ladder);
    const columns = [{ title: "model", key: "name" }, { title: "MAE, mm", key: "mae_mm", digits: 2 }, { title: "RMS, mm", key: "rms_mm", digits: 2 },
      { title: "skin left out, mm", key: "held_out_rms_mm", digits: 2 }, { title: "unexplained, mm", key: "unexplained_mm", digits: 2 },
      { title: "probability", key: "probability", digits: 2 }];
    return section("ladder", "The error, effect by effect",
      supine.figure("ladder", "Error of each rung, mm RMS", draw(ladder, rows), { columns, rows,
        caption: "Filled: the ladder. Hollow: controls at the same rung, left nothing added and everything fitted again, right an effect " +
          "drawn at random; an effect that is really missing must beat both. Stopped: " + words(ladder.stopped) + "." }),
      supine.table_figure("rungs", "Rungs and controls", columns, rows, { chosen: (row) => row.kind === "rung" && row.rung > 0 }));
  };
})();
