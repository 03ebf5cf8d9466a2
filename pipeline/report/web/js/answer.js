// SPDX-License-Identifier: AGPL-3.0-or-later
// The answer first.
"use strict";
(() => {
  const { data, el, shown, command, at } = supine;

  const tile = (value, name) => el("div", { class: "tile" }, el("b", {}, value, el("small", {}, " mm")), el("span", {}, name));
  const tiles = () => {
    const error = data.answer.error;
    if (!error) return "";
    // The diagnosis fits under all errors and so has another figure than the calibration; the sentence above quotes it.
    const held_out = [["diagnosis.json", ["base_held_out_rms_mm"]], ["calibration.json", ["held_out_rms_mm"]]].find((place) => at(...place) !== null);
    return el("div", { class: "tiles" },
      tile(shown(error.file, ["rms_mm"]), `RMS error now (${error.of})`),
      tile(shown(error.file, ["mae_mm"]), "mean absolute error"),
      error.file !== "comparison.json" && at("comparison.json", ["rms_mm"]) !== null
        ? tile(shown("comparison.json", ["rms_mm"]), "RMS of the model as given") : "",
      held_out ? tile(shown(...held_out), "RMS on skin that was not fitted") : "",
      error.noise_mm !== null ? tile(shown(error.file, ["noise_mm"]), "scanner noise, 1 σ") : "");
  };
  const warnings = () => data.stages.filter((s) => s.stale).map((s) =>
    el("div", { class: "warning" }, `Out of date: ${s.stale}. `, command(`make CASE=… ${s.name}`)));

  supine.answer = () =>
    el("section", { id: "answer", class: "answer " + data.answer.kind, "aria-label": "answer" },
      el("p", { class: "sentence" }, data.answer.sentence), tiles(),
      data.answer.facts.map((fact) => el("p", {}, supine.prose(fact))),
      data.answer.next ? el("p", {}, el("strong", {}, "Next: "), supine.prose(data.answer.next)) : "",
      data.answer.command ? command(data.answer.command) : "", warnings());
})();
