// SPDX-License-Identifier: AGPL-3.0-or-later
// Where points lie in each pose, how sure that is, how deep they are, and what would make them surer.
"use strict";
(() => {
  const { data, el, section, number, shown } = supine;

  // What supine-targets found in a pose, or null.
  const targets_file = (pose) => `targets/${pose}_landmarks.json`;
  supine.targets_of = (pose) => data.figures[targets_file(pose)] || null;

  // Whether the regions allow for effects that the model may lack, and which are likeliest.
  const over_what = (found) => {
    if (!found.may_be_missing) return "It was taken that the model lacks nothing. ";
    const words = found.may_be_missing.slice(0, 3).map(({ effects, probability }) => `${effects.join(" and ") || "nothing"} (${number(probability, 2)})`);
    return `Over what the model may lack, likeliest first: ${words.join(", ")}. `;
  };
  const on_skin_mm = 0.5; // what is marked on the skin may lie as much outside the model's as inside
  const depth = (d) => (!d ? "–" : d.mm < on_skin_mm ? "on the skin" : `${number(d.mm, 1)} ± ${number(1.96 * d.sd_mm, 1)}`);
  const table = (pose) => {
    const found = supine.targets_of(pose);
    const rows = found.points.map((p) => ({ point: p.name, x: p.place_mm[0], y: p.place_mm[1], z: p.place_mm[2], half_axes_mm: p.half_axes_mm, nearest_skin_mm: p.nearest_skin && p.nearest_skin.mm,
      vertical_skin_mm: p.vertical_skin && p.vertical_skin.mm, most: p.shrinks.length ? p.shrinks[0].in_words : "", share: p.shrinks.length ? p.shrinks[0].share : null, p }));
    const columns = [{ title: "point", key: "point" }, ...["x", "y", "z"].map((key) => ({ title: key, key, digits: 1 })),
      { title: "95 % region, half axes", key: "half_axes_mm", n: true, show: (v) => v.map((a) => number(a, 1)).join(", ") },
      { title: "to the nearest skin", key: "nearest_skin_mm", n: true, show: (v, row) => depth(row.p.nearest_skin) },
      { title: "straight up to the skin", key: "vertical_skin_mm", n: true, show: (v, row) => depth(row.p.vertical_skin) },
      { title: "surer most by", key: "most", show: (v) => v || "–" }, { title: "less variance", key: "share", n: true, show: (v) => (v === null ? "–" : number(100 * v, 0) + " %") }];
    const file = targets_file(pose);
    return supine.table_figure(`targets-${pose}`, `Points in ${pose}, mm`, columns, rows, { caption: el("span", {}, found.scan_counts ? "With all that was measured. " : "Nothing was measured: by what the model believes. ",
      over_what(found), "Unexplained ", shown(file, ["unexplained_mm"]), " mm, mesh ", shown(file, ["mesh_mm"]), found.mesh_measured ? " mm." : " mm (a usual share of the way).", " Depths with their 95 % reach.") });
  };

  supine.targets = () => {
    const poses = data.case.poses.map((p) => p.name).filter((name) => supine.targets_of(name));
    const none = el("div", { class: "gap" }, "Places in the pose with their 95 % regions are not there yet. To get them: ", supine.command(data.commands.targets));
    return section("targets", "Targets", poses.length ? poses.map(table) : none);
  };
})();
