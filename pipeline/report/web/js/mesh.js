// SPDX-License-Identifier: AGPL-3.0-or-later
// From image to mesh, and the certificate of the undeformed shape.
"use strict";
(() => {
  const { data, el, gap, section, number, shown, at, words } = supine;

  const pictures = () => {
    const list = Object.entries(data.pictures);
    if (!list.length)
      return data.figures["labels.json"] ? el("div", { class: "gap" }, "No pictures of the segmentation. To get them: ", supine.command(overlay_command())) : "";
    return el("div", { class: "pictures" }, list.map(([name, source]) => el("figure", {},
      el("p", { class: "title" }, "Segmentation, " + name.replace(/^.*labels_|\.png$/g, "")), el("img", { src: source, alt: "Slices with the outlines of the tissues: " + name }))));
  };
  const overlay_command = () => {
    const { command } = supine.stage("segment"), folder = (command.match(/-o (\S+)\/labels\.vti/) || [])[1] || "out";
    return `build/bin/${command} --overlays ${folder}/overlays`;
  };
  const volumes = () => {
    const v = at("mesh.json", ["volumes_ml"]), voxels = at("labels.json", ["volume_ml"]);
    const names = Object.keys(voxels || (v && v.voxels) || {}).filter((t) => t !== "air" && (voxels || v.voxels)[t] > 0);
    if (!names.length) return "";
    return supine.table_figure("volumes", "Tissues, ml", [{ title: "tissue", key: "tissue" }, { title: "voxels", key: "voxels", digits: 1 }, { title: "mesh", key: "mesh", digits: 1 }],
      names.map((t) => ({ tissue: t, voxels: voxels ? voxels[t] : v.voxels[t], mesh: v && t in v.mesh ? v.mesh[t] : null })),
      at("labels.json", ["gland_by_share_ml"]) ? { caption: el("span", {}, "Outlined gland is part fat: ", shown("labels.json", ["gland_by_share_ml"], 1), " ml are gland, which is what the mesh takes.") } : {});
  };
  const regions = () => {
    const m = data.figures["mesh.json"];
    if (!m) return gap("mesh");
    const rows = Object.keys(m.faces).map((name) => ({ region: name, faces: m.faces[name], cm2: m.area_cm2[name] }));
    return supine.table_figure("regions", "Regions of the surface", [{ title: "region", key: "region" }, { title: "triangles", key: "faces", digits: 0 }, { title: "cm²", key: "cm2", digits: 1 }], rows,
      { caption: el("span", {}, shown("mesh.json", ["cells"], 0), " tetrahedra of order ", shown("mesh.json", ["order"], 0), ", ", shown("mesh.json", ["nodes"], 0), " nodes, ",
        shown("mesh.json", ["volume_ml"], 1), " ml.") });
  };
  // Without the empty columns at the end.
  const filled = (counts) => counts.slice(0, counts.length - [...counts].reverse().findIndex((c) => c > 0));
  const edges_of = (step, count) => Array.from({ length: count + 1 }, (_, i) => i * step);
  const quality = () => {
    const m = data.figures["mesh.json"];
    if (!m || !m.smallest_dihedral_histogram_10deg) return "";
    const dihedral = filled(m.smallest_dihedral_histogram_10deg), ratio = m.radius_ratio_histogram_tenths;
    const table = (counts, step) => ({ rows: counts.map((count, i) => ({ from: +(i * step).toFixed(2), to: +((i + 1) * step).toFixed(2), count })),
      columns: [{ title: "from", key: "from", n: true }, { title: "to", key: "to", n: true }, { title: "tetrahedra", key: "count", digits: 0 }] });
    return [supine.figure("dihedral", "Smallest dihedral angle of each tetrahedron", supine.chart.histogram("Smallest dihedral angles", edges_of(10, dihedral.length), dihedral, "degrees",
      { marks: [{ at: m.min_dihedral_deg, name: `least ${number(m.min_dihedral_deg, 1)}°` }] }), table(dihedral, 10)),
    ratio ? supine.figure("radius-ratio", "Radius ratio of each tetrahedron (1: regular)", supine.chart.histogram("Radius ratios", edges_of(0.1, ratio.length), ratio, "3 × inner / outer radius",
      { marks: [{ at: m.min_radius_ratio, name: `least ${number(m.min_radius_ratio, 2)}` }] }), table(ratio, 0.1)) : ""];
  };
  const surface = () => {
    const c = data.figures["coarse.json"];
    if (!c) return "";
    return el("p", {}, "Coarse surface: ", shown("coarse.json", ["triangles"], 0), " triangles for ", shown("coarse.json", ["input_triangles"], 0), ", at most ",
      shown("coarse.json", ["distance_mm"], 2), " mm from them, on average ", shown("coarse.json", ["mean_distance_to_input_mm"], 3), " mm.");
  };
  const certificate = () => {
    const { imaged, predicted } = data.case, file = `${predicted}.json`, s = data.figures[file];
    if (!s) return gap("simulate");
    if (imaged === "undeformed")
      return el("figure", { id: "figure-round-trip" }, el("p", { class: "title" }, "Undeformed shape"),
        el("p", {}, "Imaged free of load: its shape is the undeformed one, there is no inverse and no round trip."),
        el("p", {}, `Most compressed element, ${predicted}: det F = `, shown(file, ["min_det_f"], 3), "; ", shown(file, ["newton_iterations"], 0), ` Newton steps. Largest way to ${predicted}: `,
          shown(file, ["displacement_from_prone_mm", "max"], 1), " mm."));
    const holds = s.round_trip_max_mm <= 1e-6;
    return el("figure", { id: "figure-round-trip" }, el("p", { class: "title" }, "Round-trip certificate"),
      el("p", {}, el("strong", {}, holds ? "Holds. " : "Does not hold. "), `The undeformed shape, loaded with ${imaged} gravity again, ends `,
        el("span", { class: "figure", "data-file": file, "data-path": '["round_trip_max_mm"]', "data-digits": "e" }, s.round_trip_max_mm.toExponential(1).replace("-", "−")),
        " mm from the imaged nodes at most (bound 10⁻⁶ mm)."),
      el("p", {}, `Most compressed element, ${predicted}: det F = `, shown(file, ["min_det_f"], 3), "; ", shown(file, ["newton_iterations"], 0), ` Newton steps. Largest way from ${imaged} to ${predicted}: `,
        shown(file, ["displacement_from_prone_mm", "max"], 1), " mm."));
  };

  supine.mesh = () => section("mesh", "Image, mesh, certificate", certificate(), surface(), el("div", { class: "columns" }, volumes(), regions(), quality()),
    data.figures["labels.json"] || !supine.stage("segment") ? "" : gap("segment"), pictures());
})();
