// SPDX-License-Identifier: AGPL-3.0-or-later
// Where the error is: areas of the skin, landmarks, hot spots, for every model and pose that was compared.
"use strict";
(() => {
  const { data, el, gap, section, number } = supine;

  // Comparisons there are: {file, model, pose, figures}.
  const comparisons = () => {
    const models = [["", "as given"], ["calibrated/", "calibrated"]];
    const ladder = data.figures[supine.first_file("ladder/ladder.json", "ladder.json")];
    if (ladder) ladder.rungs.forEach((rung, r) => r && models.push([`ladder/${r}/`, "+\u00a0" + supine.words(rung.added)]));
    return models.flatMap(([folder, model]) => data.case.poses.map(({ name }) => {
      const file = `${folder}comparison${name === "supine" ? "" : "_" + name}.json`;
      return { file, model, pose: name, figures: data.figures[file] };
    })).filter((c) => c.figures);
  };

  const summary = (all) => {
    const rows = all.map((c) => ({ model: c.model, pose: c.pose + (data.case.calibrated_poses.includes(c.pose) ? "" : " (not fitted)"), ...c.figures, file: c.file }));
    const cell = (key, digits = 2) => ({ key, digits, show: (v, row) => supine.shown(row.file, [key], digits, key.includes("signed")) });
    return supine.table_figure("comparisons", "Distance to the measured surface, mm", [{ title: "model", key: "model" }, { title: "pose", key: "pose" },
      { title: "RMS", ...cell("rms_mm") }, { title: "MAE", ...cell("mae_mm") }, { title: "MAE, model to scan", ...cell("mae_study_mm") }, { title: "median", ...cell("median_mm") },
      { title: "95 %", ...cell("p95_mm") }, { title: "largest", ...cell("hausdorff_mm") }, { title: "signed mean", ...cell("mean_signed_mm") },
      { title: "skin covered", key: "covered_fraction", n: true, show: (v) => number(100 * v, 0) + " %" }], rows);
  };
  const areas = (all) => {
    const shown = all.filter((c) => c.pose === data.case.predicted && c.figures.areas && c.figures.areas.length);
    if (!shown.length) return "";
    const names = shown[0].figures.areas.map((a) => a.name);
    const last = shown[shown.length - 1];
    const rows = names.map((name) => {
      const row = { area: name };
      shown.forEach((c, k) => {
        const a = c.figures.areas.find((x) => x.name === name) || {};
        row["signed" + k] = a.mean_signed_mm; row["mae" + k] = a.mae_mm; row.area_cm2 = a.area_cm2;
      });
      return row;
    });
    const columns = [{ title: "area", key: "area" }, { title: "cm²", key: "area_cm2", digits: 0 }, ...shown.flatMap((c, k) => [
      { title: `signed mean, ${c.model}`, key: "signed" + k, n: true, show: (v) => supine.signed(v, 2) }, { title: `MAE, ${c.model}`, key: "mae" + k, digits: 2 }])];
    return [supine.figure("areas-chart", `Mean signed distance per area, ${last.model}, mm`, supine.chart.bars("Mean signed distance per area",
      last.figures.areas.map((a) => ({ label: a.name, value: a.mean_signed_mm, cls: a.mean_signed_mm > 0 ? "s2" : "s1" })), `mm; right: the ${supine.of_body("breast", "body")} reaches further than the model`, { sign: true, digits: 1 }),
    { rows: last.figures.areas, columns: [{ title: "area", key: "name" }, { title: "signed mean, mm", key: "mean_signed_mm", digits: 2 }] }),
    supine.table_figure("areas", `Areas of the skin, ${data.case.predicted}, mm`, columns, rows)];
  };
  const landmarks = (all) => {
    const shown = all.filter((c) => c.figures.landmarks && c.figures.landmarks.length);
    if (!shown.length) return "";
    const rows = shown[0].figures.landmarks.map(({ name }) => {
      const row = { landmark: name };
      shown.forEach((c, k) => { row["e" + k] = (c.figures.landmarks.find((l) => l.name === name) || {}).error_mm; });
      return row;
    });
    return [supine.table_figure("landmarks", "Landmarks: predicted to measured place, mm",
      [{ title: "landmark", key: "landmark" }, ...shown.map((c, k) => ({ title: `${c.pose}, ${c.model}`, key: "e" + k, digits: 1 }))], rows,
      { caption: "They show skin that slid along itself, which the distance to a surface cannot." }), agreement(shown.filter((c) => c.figures.landmark_test))];
  };
  // Landmarks against where all else that is known has them; the same for every model of a pose.
  const agreement = (tested) => {
    const poses = tested.filter((c, k) => tested.findIndex((other) => other.pose === c.pose) === k);
    return poses.map(({ pose, file, figures }) => supine.table_figure(`landmark-test-${pose}`, `Landmarks in ${pose}, from where all else has them, mm`,
      [{ title: "landmark", key: "name" }, { title: "off", key: "off_expected_mm", digits: 1 }, { title: "to be expected (rms)", key: "expected_mm", digits: 1 }], figures.landmarks,
      { caption: supine.el("span", {}, "All together: p = ", supine.p_value(figures.landmark_test.p_value), ", χ² = ", supine.shown(file, ["landmark_test", "chi_squared"], 1), " with ",
        supine.shown(file, ["landmark_test", "degrees"], 0), " degrees of freedom.") }));
  };
  const hot_spots = () => {
    const d = data.figures[supine.first_file("diagnosis.json", "ladder/diagnosis.json")];
    if (!d || !d.hot_spots || !d.hot_spots.length) return "";
    return supine.table_figure("hot-spots", "Connected hot spots of the fitted model", [{ title: "area", key: "area" }, { title: "pose", key: "pose" }, { title: "cm²", key: "area_cm2", digits: 0 },
      { title: "signed mean, mm", key: "mean_signed_mm", n: true, show: (v) => supine.signed(v, 2) }], d.hot_spots);
  };

  supine.comparisons = comparisons;
  supine.places = () => {
    const all = comparisons();
    if (!all.length) return section("places", "Where the error is", gap("compare"));
    return section("places", "Where the error is", summary(all), areas(all), landmarks(all), hot_spots());
  };
})();
