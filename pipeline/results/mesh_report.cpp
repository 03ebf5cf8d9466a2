// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/results/mesh_report.h"

#include <fmt/format.h>

#include <span>

#include "pipeline/tool/tool.h"

namespace supine::pipeline {
namespace {

using Json = nlohmann::ordered_json;
using meshing::QualityReport;
using segmentation::tissue_names;

Json numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

std::string place(const Eigen::Vector3d& p) { return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p.x(), p.y(), p.z()); }

std::string histogram(std::string line, std::span<const Eigen::Index> counts) {
  for (const Eigen::Index count : counts) line += fmt::format(" {}", count);
  return line;
}

Json anatomy_json(const meshing::Anatomy& a) {
  Json json;
  json["side"] = a.side;
  if (a.is_object()) {
    json["half_length_mm"] = a.foot_radius_mm;
    json["reach_mm"] = a.mound_height_mm;
    json["centre_mm"] = numbers(a.foot_centre_mm);
    json["outward"] = numbers(a.outward);
    json["along"] = numbers(a.lateral);
    json["across"] = numbers(a.head);
    return json;
  }
  json["foot_radius_mm"] = a.foot_radius_mm;
  json["rim_thickness_mm"] = a.rim_thickness_mm;
  json["mound_height_mm"] = a.mound_height_mm;
  json["foot_centre_mm"] = numbers(a.foot_centre_mm);
  json["outward"] = numbers(a.outward);
  json["lateral"] = numbers(a.lateral);
  json["head"] = numbers(a.head);
  json["nipple_point"] = a.nipple_point;
  for (const meshing::Anatomy& one : a.breasts) json["breasts"].push_back(anatomy_json(one));
  if (!a.breasts.empty()) json["sternum_x_mm"] = a.sternum_x_mm;
  json["foot_fourier_mm"] = std::vector<double>(a.foot_fourier.begin(), a.foot_fourier.end());
  json["muscle_fit_rms_mm"] = a.muscle->fit_rms_mm();
  return json;
}

Json curve_json(const meshing::CurveReport& c) {
  const auto distance = [](const meshing::SurfaceDistance& d) {
    return Json{{"mean_mm", d.mean_mm}, {"rms_mm", d.rms_mm}, {"max_mm", d.max_mm}};
  };
  Json json;
  json["distance_before"] = distance(c.before);
  json["distance_after"] = distance(c.after);
  json["skin_distance_before"] = distance(c.skin_before);
  json["skin_distance_after"] = distance(c.skin_after);
  json["volume_ml"] = {{"before", c.volume_before_ml}, {"after", c.volume_after_ml}, {"fine", c.fine_volume_ml}};
  json["boundary_corners"] = c.corners;
  json["boundary_middles"] = c.middles;
  json["corner_shift_max_mm"] = c.corner_shift_max_mm;
  json["sagitta_mean_mm"] = c.sagitta_mean_mm;
  json["sagitta_max_mm"] = c.sagitta_max_mm;
  json["corners_pulled_back"] = c.corners_pulled_back;
  json["middles_pulled_back"] = c.middles_pulled_back;
  json["pulled_back_mean_mm"] = c.pulled_back_mean_mm;
  json["pulled_back_max_mm"] = c.pulled_back_max_mm;
  return json;
}

void say_curve(const Run& run, const meshing::CurveReport& c) {
  run.say(fmt::format(
      "bent onto the fine surface: mean distance {:.3f} -> {:.3f} mm, max {:.2f} -> {:.2f} mm (skin: mean {:.3f} -> "
      "{:.3f}, max {:.2f} -> {:.2f})",
      c.before.mean_mm, c.after.mean_mm, c.before.max_mm, c.after.max_mm, c.skin_before.mean_mm, c.skin_after.mean_mm,
      c.skin_before.max_mm, c.skin_after.max_mm));
  run.say(
      fmt::format("volume {:.2f} -> {:.2f} ml (fine surface {:.2f}); corners moved by up to {:.2f} mm, middles by "
                  "{:.3f} mm on the mean, {:.2f} at most",
                  c.volume_before_ml, c.volume_after_ml, c.fine_volume_ml, c.corner_shift_max_mm, c.sagitta_mean_mm,
                  c.sagitta_max_mm));
  run.say(fmt::format(
      "pulled back for the sake of the tetrahedra: {} of {} corners, {} of {} middles, by {:.3f} mm "
      "on the mean, {:.2f} at most",
      c.corners_pulled_back, c.corners, c.middles_pulled_back, c.middles, c.pulled_back_mean_mm, c.pulled_back_max_mm));
}

}  // namespace

void fill(Json& json, const MeshFindings& findings) {
  const QualityReport& q = findings.quality;
  json["order"] = findings.order;
  json["nodes"] = q.nodes;
  json["cells"] = q.cells;
  json["triangles"] = q.faces;
  for (std::size_t r = 1; r < reconstruction::region_names.size(); ++r) {
    const std::string region(reconstruction::region_names[r]);
    json["faces"][region] = q.region_faces[r];
    json["area_cm2"][region] = q.area_cm2[r];
  }
  json["volume_ml"] = q.volume_ml;
  for (int t = 0; t < segmentation::tissue_count; ++t) {
    if (!segmentation::is_meshed(static_cast<segmentation::Tissue>(t))) continue;
    json["volumes_ml"]["mesh"][std::string(tissue_names[t])] = q.tissue_ml[t];
    if (findings.fractions)
      json["volumes_ml"]["voxels"][std::string(tissue_names[t])] = findings.fractions->voxel_ml[t];
  }
  if (findings.fractions) json["outside_labels_share"] = findings.fractions->outside_share;
  json["inverted"] = q.inverted;
  json["min_dihedral_deg"] = q.min_dihedral_deg;
  json["max_dihedral_deg"] = q.max_dihedral_deg;
  json["smallest_dihedral_histogram_10deg"] = q.smallest_dihedral;
  json["largest_dihedral_histogram_10deg"] = q.largest_dihedral;
  json["smallest_dihedral_cell"] = q.smallest_angle_cell;
  json["smallest_dihedral_place_mm"] = numbers(q.smallest_angle_place_mm);
  json["radius_ratio_histogram_tenths"] = q.radius_ratio;
  json["min_radius_ratio"] = q.min_radius_ratio;
  json["mean_radius_ratio"] = q.mean_radius_ratio;
  json["worst_cell"] = q.worst_cell;
  json["worst_place_mm"] = numbers(q.worst_place_mm);
  if (findings.order == 2) {
    json["worst_jacobian_cell"] = q.worst_jacobian_cell;
    json["worst_jacobian_place_mm"] = numbers(q.worst_jacobian_place_mm);
    json["min_scaled_jacobian"] = q.min_scaled_jacobian;
    json["mean_scaled_jacobian"] = q.mean_scaled_jacobian;
    json["scaled_jacobian_histogram_tenths"] = q.scaled_jacobian;
  }
  for (const auto& [name, ml] : findings.parts_ml) json["parts_ml"][name] = ml;
  for (const auto& [name, cm2] : findings.supports_cm2) json["supports_cm2"][name] = cm2;
  if (findings.curve) json["curve"] = curve_json(*findings.curve);
  if (findings.anatomy) json["anatomy"] = anatomy_json(*findings.anatomy);
}

void say(const MeshFindings& findings, const Run& run) {
  const QualityReport& q = findings.quality;
  run.say(
      fmt::format("{} nodes, {} tetrahedra, {} boundary triangles, {:.1f} ml", q.nodes, q.cells, q.faces, q.volume_ml));
  run.say(fmt::format("dihedral angles {:.1f} to {:.1f} degrees, radius ratio min {:.3f} mean {:.3f}, {} inverted",
                      q.min_dihedral_deg, q.max_dihedral_deg, q.min_radius_ratio, q.mean_radius_ratio, q.inverted));
  run.say(fmt::format("smallest angle: tetrahedron {} at {}; smallest radius ratio: tetrahedron {} at {}",
                      q.smallest_angle_cell, place(q.smallest_angle_place_mm), q.worst_cell, place(q.worst_place_mm)));
  if (q.worst_jacobian_cell >= 0)
    run.say(fmt::format("scaled Jacobian of the quadratic tetrahedra: min {:.3f} (tetrahedron {} at {}), mean {:.3f}",
                        q.min_scaled_jacobian, q.worst_jacobian_cell, place(q.worst_jacobian_place_mm),
                        q.mean_scaled_jacobian));
  if (findings.curve) say_curve(run, *findings.curve);
  run.say(
      histogram("smallest angle per tetrahedron, 0-10-20-...-80 degrees:", std::span(q.smallest_dihedral).first(8)));
  run.say(histogram("largest angle per tetrahedron, 60-70-...-180 degrees:", std::span(q.largest_dihedral).last(12)));
  run.say(histogram("radius ratio, 0-0.1-...-1:", q.radius_ratio));
  if (findings.order == 2) run.say(histogram("scaled Jacobian, 0-0.1-...-1:", q.scaled_jacobian));
  for (std::size_t r = 1; r < reconstruction::region_names.size(); ++r) {
    run.say(fmt::format("{:<10}{:>8} triangles{:>10.1f} cm2", reconstruction::region_names[r], q.region_faces[r],
                        q.area_cm2[r]));
  }
  for (int t = 0; t < segmentation::tissue_count; ++t) {
    const double voxels = findings.fractions ? findings.fractions->voxel_ml[t] : 0;
    if (q.tissue_ml[t] == 0 && voxels == 0) continue;
    run.say(fmt::format("{:<10}{:>9.1f} ml{}", tissue_names[t], q.tissue_ml[t],
                        findings.fractions ? fmt::format("  (voxels {:.1f} ml)", voxels) : ""));
  }
  for (const auto& [name, ml] : findings.parts_ml) run.say(fmt::format("part {:<12}{:>6.1f} ml", name, ml));
  for (const auto& [name, cm2] : findings.supports_cm2) run.say(fmt::format("support {:<12}{:>6.1f} cm2", name, cm2));
  if (!findings.anatomy) return;
  const meshing::Anatomy& a = *findings.anatomy;
  const auto say = [&run](const meshing::Anatomy& one) {
    run.say(fmt::format("{} breast: foot radius {:.1f} mm, rim {:.1f} mm thick, mound {:.1f} mm high", one.side,
                        one.foot_radius_mm, one.rim_thickness_mm, one.mound_height_mm));
  };
  if (a.is_object())
    run.say(fmt::format("body: {:.1f} mm from its supports at most", a.mound_height_mm));
  else if (a.breasts.empty())
    say(a);
  for (const meshing::Anatomy& one : a.breasts) say(one);
}

}  // namespace supine::pipeline
