// SPDX-License-Identifier: AGPL-3.0-or-later
// A case with everything the report can show, made of the small run in seconds: a second and a third model are simulated and
// compared by the real tools; what would take minutes (diagnosis, ladder) is written here, with names that try to break the page.
import { spawnSync } from "node:child_process";
import { cpSync, existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

export function run(bin, tool, ...words) {
  const done = spawnSync(join(bin, "supine-" + tool), words, { encoding: "utf8" });
  if (done.status !== 0) throw new Error(`supine-${tool} ${words.join(" ")}: exit code ${done.status}\n${done.stderr}`);
  return done.stdout;
}

const candidate = (effect, more) => ({ effect, probability: 0.02, p_value: 1, predicted_rms_mm: 2, refit_rms_mm: null, held_out_rms_mm: 2.2,
  parameters: [{ name: effect + ".size_mm", value: 1.5, unit: "mm", interval95: [1, 2] }], not_told_apart_from: [], same_shape_as: [], power: 0.9,
  wrong_sign: false, beyond_range: false, at_border: null, ...more });

const diagnosis = { verdict: "missing", missing: ["ligament"], why: "probability 0.95 or more",
  candidates: [candidate("ligament", { probability: 0.97, p_value: 0.001, predicted_rms_mm: 1.4, refit_rms_mm: 1.3, held_out_rms_mm: 1.35, at_border: false }),
    candidate("<b onload=alert(1)>own_effect", { power: 0.2, wrong_sign: true }), candidate("adhesion", { not_told_apart_from: ["friction"] })],
  hypotheses: [{ effects: ["ligament"], probability: 0.95, refitted: true, unexplained_mm: 0.5, unexplained95: [0.3, 0.8] },
    { effects: [], probability: 0.01, refitted: true, unexplained_mm: 1.9, unexplained95: [1.6, 2.3] }],
  unexplained_mm: 0.5, unexplained95: [0.3, 0.8],
  registration: [{ pose: "supine", shift_mm: [1, -2, 0.5], turn_deg: [0.2, 0.1, -0.4], sd: [0.4, 0.4, 0.4, 0.2, 0.2, 0.2] }],
  creased_points: 361, base_mae_mm: 1.7, base_rms_mm: 2.1, base_held_out_rms_mm: 2.3,
  budget_mm: { total: 2.1, noise: 0.7, registration: 0.3, numerical: 0.4, parameters: 0.1, patchiness: 0.5, model_form: 0.5 },
  hot_spots: [{ area: "upper inner", pose: "supine", area_cm2: 30.5, mean_signed_mm: -1.25, centre_mm: [10, -20, 20] }],
  cannot_see: [{ effect: "creep", power: 0.07 }],
  next_measurement: [{ measurement: "upright", separation: 24.2, closest_pair: "adhesion, friction", mean_power_of_unseen: 0.7, shows: "creep" }], warnings: [] };

const figures = (added, scale) => ({ added, mae_mm: 1.7 * scale, rms_mm: 2.1 * scale, held_out_rms_mm: 2.3 * scale });
const ladder = { rungs: [{ ...figures("", 1), p_value: 0.001, probability: 1, unexplained_mm: 1.9 },
  { ...figures("ligament", 0.6), p_value: 0.4, probability: 0.97, unexplained_mm: 0.5, controls: { refit_only: figures("", 1), random_other: figures("creep", 0.95) } }],
  verdict: "missing", missing: ["ligament"], stopped: "nothing_missing: no effect lowers the held-out error", noise_floor_mm: 0.8 };

// Two landmarks and two places inside the small body, marked in prone; where the landmarks were measured.
function mark(folder) {
  const table = (rows) => ["name,x,y,z", ...rows.map((r) => r.join(","))].join("\n") + "\n";
  writeFileSync(join(folder, "prone.csv"), table([["nipple", 0, -39, 0], ["upper", 3, -29.2, 24]]));
  writeFileSync(join(folder, "supine.csv"), table([["nipple", 0, -31.5, 0], ["upper", 3, -24.2, 24]]));
  writeFileSync(join(folder, "inside.csv"), table([["near the skin", 0, -33, 4], ["deep", 12, -18, -10]]));
  const file = join(folder, "case.toml"), text = readFileSync(file, "utf8").replace('surface = "supine.ply"', 'surface = "supine.ply"\nlandmarks = "supine.csv"');
  writeFileSync(file, text + '[landmarks]\nprone = "prone.csv"\n');
}

// The case in `folder`, from a copy of the small run.
export function make_case(bin, small_run, folder) {
  cpSync(small_run, folder, { recursive: true });
  const out = join(folder, "out"), model = readFileSync(join(folder, "model.toml"), "utf8");
  mark(folder);
  run(bin, "targets", folder, join(out, "mesh.vtu"), "--points", join(folder, "inside.csv"), "--no-other-meshes", "--no-further-scans", "-o", join(out, "targets"), "--force", "--quiet");
  for (const [name, stiffness] of [["calibrated", 1.3], ["ladder/1", 2]]) {
    const target = join(out, name);
    mkdirSync(target, { recursive: true });
    const file = join(target, "model.toml");
    writeFileSync(file, model.replace(/young_modulus_kpa = (\{ value = )?([0-9.]+)/, (_, open, value) => `young_modulus_kpa = ${open || ""}${value * stiffness}`));
    run(bin, "simulate", folder, join(out, "mesh.vtu"), "--model", file, "-o", target, "--force", "--quiet");
    run(bin, "compare", folder, join(target, "supine.vtu"), "--expected", join(out, "targets/supine_landmarks.json"), "-o", target, "--force", "--quiet");
  }
  run(bin, "warp", folder, "--dir", join(out, "calibrated"), "--labels", join(out, "labels.vti"), "--no-transform", "-o", join(out, "warp"), "--force", "--quiet");
  writeFileSync(join(out, "diagnosis.json"), JSON.stringify(diagnosis));
  writeFileSync(join(out, "ladder/ladder.json"), JSON.stringify(ladder));
  if (!existsSync(join(out, "overlays"))) run(bin, "segment", folder, "-o", join(folder, "again.vti"), "--overlays", join(out, "overlays"), "--quiet");
  return folder;
}
