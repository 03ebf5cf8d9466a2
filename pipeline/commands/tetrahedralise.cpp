// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedralise.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <span>

#include "common/error.h"
#include "meshing/anatomy.h"
#include "meshing/curve.h"
#include "meshing/grade.h"
#include "meshing/ligament_ring.h"
#include "meshing/mesh_check.h"
#include "meshing/mesh_io.h"
#include "meshing/quality.h"
#include "meshing/tissue_fractions.h"
#include "meshing/topology.h"
#include "pipeline/tool.h"
#include "reconstruction/surface_io.h"
#include "segmentation/labels_io.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using meshing::QualityReport;
using meshing::TetMesh;
using segmentation::tissue_names;

constexpr double good_dihedral_deg = 5;    // below, stiffness matrices suffer
constexpr double good_cells_share = 0.25;  // how far --cells may be missed

/// Everything a run finds out besides the mesh itself.
struct Findings {
  int order = 1;
  std::string side;
  QualityReport quality;
  std::optional<meshing::CurveReport> curve;
  std::optional<meshing::FractionReport> fractions;
  std::optional<meshing::Anatomy> anatomy;
};

Json numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

std::string place(const Eigen::Vector3d& p) { return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p.x(), p.y(), p.z()); }

std::string histogram(std::string line, std::span<const Eigen::Index> counts) {
  for (const Eigen::Index count : counts) line += fmt::format(" {}", count);
  return line;
}

class TetrahedraliseTool : public Tool {
 public:
  std::string name() const override { return "supine-tetrahedralise"; }

  std::string summary() const override {
    return "Fills the decimated breast surface with tetrahedra that carry tissue fractions and boundary regions, and "
           "prints their quality.\n"
           "Writes mesh.vtu (default: beside the surface).\n\n"
           "Examples:\n"
           "  supine-tetrahedralise coarse.vtp muscle.vtp labels.vti --side left\n"
           "  supine-tetrahedralise coarse.vtp muscle.vtp labels.vti --order 2 --fine breast.vtp\n"
           "  supine-tetrahedralise coarse.vtp muscle.vtp labels.vti --cells 20000 --order 2 -o fine.vtu\n"
           "  supine-tetrahedralise coarse.vtp muscle.vtp labels.vti --interface gland=gland_coarse.vtp\n"
           "  supine-tetrahedralise coarse.vtp muscle.vtp labels.vti --error-from supine.vtu --cells 20000 -o "
           "fine.vtu\n"
           "  supine-tetrahedralise --check mesh.vtu -o report.json\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("surface", surface_, "closed surface with regions (.vtp); with --check also a mesh (.vtu)")
        ->required();
    app.add_option("muscle", muscle_, "breast-facing muscle sheet (.vtp)");
    app.add_option("labels", labels_, "label volume (.vti)");
    app.add_option("--order", order_, "1: linear, 2: quadratic tetrahedra")->check(CLI::IsMember({1, 2}));
    app.add_option(
        "--fine", fine_,
        "the surface before decimation (.vtp with regions): quadratic tetrahedra are bent onto it; without it "
        "their edges are straight");
    app.add_option("--skin-edge-mm", skin_edge_mm_,
                   "edge length where skin and cut face meet, mm; 0 = as elsewhere on the surface");
    app.add_option("--least-jacobian", curving_.least_jacobian,
                   "scaled Jacobian every bent tetrahedron keeps, or else is bent less; between 0 and 1")
        ->capture_default_str();
    app.add_option("--fine-smooth", curving_.smooth_share,
                   "neighbourhood of the fine surface a node follows, in mean edges around it, 0 to 2")
        ->capture_default_str();
    app.add_option("--muscle-reach-mm", curving_.muscle_reach_mm,
                   "how far off the fine surface inner nodes follow the muscle's smooth distance, mm, >= 0")
        ->capture_default_str();
    app.add_option("--cells", options_.cells, "about so many tetrahedra, 0 = as the surface's triangles suggest");
    app.add_option("--radius-edge", options_.radius_edge, "circumradius over shortest edge aimed at, 1.2 to 3");
    app.add_option("--min-dihedral", options_.min_dihedral_deg, "smallest dihedral angle aimed at, degrees, 0 to 18");
    app.add_option("--side", side_, "which breast it is, left, right or both; default: what the labels say, or left");
    app.add_option(
        "--interface", interfaces_,
        "TISSUE=FILE: a closed surface inside (.vtp .ply .stl .obj) that no tetrahedron crosses, the border of "
        "that tissue; may be repeated, what lies inside another comes after it");
    app.add_option("--error-from", error_from_,
                   "a pose computed on another mesh of this case (.vtu): tetrahedra and surface become finer where its "
                   "displacement gradient jumps, --cells of them (default: as many as that mesh has)");
    app.add_flag("--check", check_,
                 "print the report, write no mesh (-o X.json: the report); exit code 1 when the mesh is not good");
  }

  Outcome run(Run& run) override {
    Findings findings;
    if (check_ && fs::path(surface_).extension() == ".vtu") {
      const TetMesh mesh = meshing::read_mesh(run.input(surface_));
      findings.order = mesh.order();
      findings.quality = meshing::measure_quality(mesh);
      say(run, findings);
      if (!output.empty()) write_report(run, findings);
      return judge(run, findings.quality);
    }
    const TetMesh mesh = make_mesh(run, findings);
    say(run, findings);
    findings.order = order_;
    if (!check_) write(run, mesh, findings);
    if (check_ && !output.empty()) write_report(run, findings);
    return judge(run, findings.quality);
  }

 private:
  TetMesh make_mesh(Run& run, Findings& findings) const {
    if (muscle_.empty() || labels_.empty()) {
      throw InputError("three files are needed: SURFACE.vtp MUSCLE.vtp LABELS.vti (or --check MESH.vtu)");
    }
    run.stage("read");
    reconstruction::Surface surface = reconstruction::read_surface(run.input(surface_));
    const reconstruction::Surface muscle = reconstruction::read_surface(run.input(muscle_));
    const segmentation::LabelImage labels = segmentation::read_labels(run.input(labels_));
    findings.side = find_side();
    run.stage("tetrahedra");
    run.progress("filling the surface with tetrahedra");
    meshing::TetrahedraliseOptions options = options_;
    options.edge_mm = meshing::mean_edge_mm(surface);
    meshing::Inside inside{read_interfaces(run), nullptr};
    const std::optional<meshing::SizeField> sizes = read_sizes(run, options);
    if (sizes) {
      surface = meshing::refine_to_sizes(surface, *sizes);
      inside.sizes = &*sizes;
    }
    if (skin_edge_mm_ != 0) surface = meshing::refine_skin_edge(surface, skin_edge_mm_);
    auto [mesh, enclosing] = meshing::tetrahedralise(surface, inside, options, surface_);
    mesh.muscle = muscle;
    if (order_ == 2) mesh = meshing::to_quadratic(mesh);
    bend(run, mesh, findings);
    run.stage("tissue");
    run.progress("reading tissue fractions from the labels");
    findings.fractions = meshing::assign_tissue(mesh, labels);
    if (!inside.interfaces.empty()) meshing::impose_interfaces(mesh, enclosing, inside.interfaces);
    run.stage("anatomy");
    run.progress("finding the foot of the mound");
    mark_ring(run, mesh, findings);
    run.stage("check");
    meshing::check_mesh(mesh);
    findings.quality = meshing::measure_quality(mesh);
    return mesh;
  }

  std::vector<meshing::Interface> read_interfaces(Run& run) const {
    std::vector<meshing::Interface> interfaces;
    for (const std::string& text : interfaces_) {
      const std::size_t equals = text.find('=');
      const auto tissue = segmentation::tissue_from_name(text.substr(0, equals));
      if (equals == std::string::npos || !tissue)
        throw InputError(
            fmt::format("--interface {}: TISSUE=FILE is expected, for example gland=gland_coarse.vtp", text));
      const std::string file = text.substr(equals + 1);
      interfaces.push_back({reconstruction::read_surface(run.input(file)), *tissue, file});
    }
    return interfaces;
  }

  std::optional<meshing::SizeField> read_sizes(Run& run, meshing::TetrahedraliseOptions& options) const {
    if (error_from_.empty()) return std::nullopt;
    const meshing::PoseMesh pose = meshing::read_pose(run.input(error_from_));
    if (options.cells == 0) options.cells = static_cast<std::size_t>(pose.mesh.cells.rows());
    return meshing::sizes_from_pose(pose, options.cells);
  }

  void bend(Run& run, TetMesh& mesh, Findings& findings) const {
    if (fine_.empty()) return;
    if (order_ == 1) {
      run.say("linear tetrahedra have straight edges: --fine is not used");
      return;
    }
    run.stage("curve");
    run.progress("bending the boundary onto the fine surface");
    const reconstruction::Surface fine = reconstruction::read_surface(run.input(fine_));
    Eigen::Matrix<double, 2, 3> box;
    box << mesh.points.colwise().minCoeff(), mesh.points.colwise().maxCoeff();
    const meshing::MuscleDistance muscle(mesh.muscle, box);
    findings.curve = meshing::curve_boundary(mesh, fine, &muscle, curving_);
  }

  std::string find_side() const {
    std::string side = side_, from = "--side";
    if (side.empty()) {
      const segmentation::LabelNotes notes = segmentation::read_label_notes(labels_);
      side = notes.contains("side") ? notes.at("side") : "left";
      from = labels_;
    }
    if (side != "left" && side != "right" && side != "both") {
      throw InputError(fmt::format("{}: side is \"{}\"; left, right or both is expected", from, side));
    }
    return side;
  }

  void mark_ring(Run& run, TetMesh& mesh, Findings& findings) const {
    if (findings.side == "both") {
      run.warn("both sides in one mesh: no ligament ring is marked; the anatomy is that of one breast");
      return;
    }
    try {
      findings.anatomy = meshing::compute_anatomy(mesh, findings.side);
      if (meshing::mark_ligament_ring(mesh, *findings.anatomy) == 0) {
        run.warn(fmt::format("no inner face lies within {} mm of the mound's foot; no ligament ring is marked",
                             meshing::ligament_half_width_mm));
      }
    } catch (const InputError& error) {
      run.warn(fmt::format("no ligament ring is marked: {}", error.what()));
    }
  }

  void write(Run& run, const TetMesh& mesh, const Findings& findings) const {
    run.stage("write");
    const fs::path target = output.empty() ? fs::path(surface_).parent_path() / "mesh.vtu" : output;
    if (target.extension() != ".vtu")
      throw InputError(fmt::format("-o {}: the mesh file ends in .vtu", target.string()));
    meshing::write_mesh(mesh, run.output(target), findings.side);
    fill(run.figures(target), findings);
    run.say(target.string());
  }

  void write_report(Run& run, const Findings& findings) const {
    if (output.extension() != ".json")
      throw InputError(
          fmt::format("-o {}: with --check the report is written, its file ends in .json", output.string()));
    fill(run.figures(output), findings);
  }

  Outcome judge(Run& run, const QualityReport& q) const {
    Outcome outcome = Outcome::done;
    if (q.inverted > 0 || q.min_dihedral_deg < good_dihedral_deg) {
      run.warn(fmt::format(
          "{} inverted tetrahedra, smallest dihedral angle {:.2f} degrees (at least {} is good); the worst is at "
          "{}: smooth or decimate the surface differently there",
          q.inverted, q.min_dihedral_deg, good_dihedral_deg, place(q.smallest_angle_place_mm)));
      outcome = Outcome::target_not_met;
    }
    const double wanted = static_cast<double>(options_.cells);
    if (wanted > 0 && std::abs(static_cast<double>(q.cells) - wanted) > good_cells_share * wanted) {
      run.warn(fmt::format("{} tetrahedra instead of {}: the surface's {} triangles are kept and ask for about so many",
                           q.cells, options_.cells, q.faces));
      outcome = Outcome::target_not_met;
    }
    if (check_ && outcome == Outcome::done)
      run.say(fmt::format("good: no tetrahedron is inverted, smallest dihedral angle {:.1f} degrees (bound {})",
                          q.min_dihedral_deg, good_dihedral_deg));
    return outcome;
  }

  static Json anatomy_json(const meshing::Anatomy& a) {
    Json json;
    json["side"] = a.side;
    json["foot_radius_mm"] = a.foot_radius_mm;
    json["rim_thickness_mm"] = a.rim_thickness_mm;
    json["mound_height_mm"] = a.mound_height_mm;
    json["foot_centre_mm"] = numbers(a.foot_centre_mm);
    json["outward"] = numbers(a.outward);
    json["lateral"] = numbers(a.lateral);
    json["head"] = numbers(a.head);
    json["nipple_point"] = a.nipple_point;
    json["foot_fourier_mm"] = std::vector<double>(a.foot_fourier.begin(), a.foot_fourier.end());
    json["muscle_fit_rms_mm"] = a.muscle->fit_rms_mm();
    return json;
  }

  static Json curve_json(const meshing::CurveReport& c) {
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

  void fill(Json& json, const Findings& findings) const {
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
    if (findings.curve) json["curve"] = curve_json(*findings.curve);
    if (findings.anatomy) json["anatomy"] = anatomy_json(*findings.anatomy);
  }

  static void say_curve(const Run& run, const meshing::CurveReport& c) {
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
    run.say(
        fmt::format("pulled back for the sake of the tetrahedra: {} of {} corners, {} of {} middles, by {:.3f} mm "
                    "on the mean, {:.2f} at most",
                    c.corners_pulled_back, c.corners, c.middles_pulled_back, c.middles, c.pulled_back_mean_mm,
                    c.pulled_back_max_mm));
  }

  static void say(const Run& run, const Findings& findings) {
    const QualityReport& q = findings.quality;
    run.say(fmt::format("{} nodes, {} tetrahedra, {} boundary triangles, {:.1f} ml", q.nodes, q.cells, q.faces,
                        q.volume_ml));
    run.say(fmt::format("dihedral angles {:.1f} to {:.1f} degrees, radius ratio min {:.3f} mean {:.3f}, {} inverted",
                        q.min_dihedral_deg, q.max_dihedral_deg, q.min_radius_ratio, q.mean_radius_ratio, q.inverted));
    run.say(fmt::format("smallest angle: tetrahedron {} at {}; smallest radius ratio: tetrahedron {} at {}",
                        q.smallest_angle_cell, place(q.smallest_angle_place_mm), q.worst_cell,
                        place(q.worst_place_mm)));
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
    if (!findings.anatomy) return;
    const meshing::Anatomy& a = *findings.anatomy;
    run.say(fmt::format("{} breast: foot radius {:.1f} mm, rim {:.1f} mm thick, mound {:.1f} mm high", a.side,
                        a.foot_radius_mm, a.rim_thickness_mm, a.mound_height_mm));
  }

  std::string surface_, muscle_, labels_, side_, fine_, error_from_;
  std::vector<std::string> interfaces_;
  meshing::TetrahedraliseOptions options_;
  meshing::CurveOptions curving_;
  double skin_edge_mm_ = 0;
  int order_ = 1;
  bool check_ = false;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::TetrahedraliseTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
