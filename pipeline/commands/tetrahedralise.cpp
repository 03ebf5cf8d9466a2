// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/tetrahedralise.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "common/error.h"
#include "meshing/anatomy.h"
#include "meshing/mesh_check.h"
#include "meshing/mesh_io.h"
#include "meshing/quality.h"
#include "meshing/supports.h"
#include "meshing/surface/sheet_check.h"
#include "meshing/tetrahedra/curve.h"
#include "meshing/tetrahedra/grade.h"
#include "meshing/tetrahedra/ligament_ring.h"
#include "meshing/tetrahedra/part_fractions.h"
#include "meshing/tetrahedra/tissue_fractions.h"
#include "meshing/topology.h"
#include "pipeline/case/body_places.h"
#include "pipeline/picture/picture.h"
#include "pipeline/results/mesh_report.h"
#include "pipeline/tool/tool.h"
#include "reconstruction/regions.h"
#include "reconstruction/surface_io.h"
#include "segmentation/formats/labels_io.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using meshing::QualityReport;
using meshing::TetMesh;

constexpr double good_dihedral_deg = 5;    // below, stiffness matrices suffer
constexpr double good_cells_share = 0.25;  // how far --cells may be missed

std::string place(const Eigen::Vector3d& p) { return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p.x(), p.y(), p.z()); }

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
           "  supine-tetrahedralise coarse.vtp muscle.vtp --case samples/silicone_bar/e --order 2\n"
           "  supine-tetrahedralise --check mesh.vtu -o report.json\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("surface", surface_, "closed surface with regions (.vtp); with --check also a mesh (.vtu)")
        ->required();
    app.add_option("muscle", muscle_, "breast-facing muscle sheet (.vtp)");
    app.add_option("labels", labels_, "label volume (.vti)");
    app.add_option("--case", case_folder_,
                   "the case, where its image is a surface: names supports and parts; there are no labels then");
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
    declare_png(app, png_, "the boundary of the mesh, coloured by region");
    app.add_flag("--check", check_,
                 "print the report, write no mesh (-o X.json: the report); exit code 1 when the mesh is not good");
  }

  Outcome run(Run& run) override {
    MeshFindings findings;
    if (check_ && !png_.empty()) throw InputError("--png draws the mesh that is written; with --check there is none");
    announce_png(run, png_, target());
    if (check_ && fs::path(surface_).extension() == ".vtu") {
      const TetMesh mesh = meshing::read_mesh(run.input(surface_));
      findings.order = mesh.order();
      findings.quality = meshing::measure_quality(mesh);
      say(findings, run);
      if (!output.empty()) write_report(run, findings);
      return judge(run, findings.quality);
    }
    const TetMesh mesh = make_mesh(run, findings);
    say(findings, run);
    findings.order = order_;
    if (!check_) write(run, mesh, findings);
    if (check_ && !output.empty()) write_report(run, findings);
    return judge(run, findings.quality);
  }

 private:
  TetMesh make_mesh(Run& run, MeshFindings& findings) const {
    if (muscle_.empty() || (labels_.empty() && case_folder_.empty())) {
      throw InputError(
          "three files are needed: SURFACE.vtp MUSCLE.vtp LABELS.vti (or --check MESH.vtu; or two and --case "
          "where the image is a surface)");
    }
    std::optional<Case> body;
    if (!case_folder_.empty()) body = read_body(run);
    run.stage("read");
    reconstruction::Surface surface = reconstruction::read_surface(run.input(surface_));
    const reconstruction::Surface muscle = reconstruction::read_surface(run.input(muscle_));
    if (muscle.region.size() > 0)
      throw InputError(
          fmt::format("{}: has regions: it is the surface of the body, not that of the muscle; "
                      "supine-reconstruct writes both",
                      muscle_));
    meshing::check_sheet(surface, muscle, muscle_);
    segmentation::LabelImage labels;
    if (!body) labels = segmentation::read_labels(run.input(labels_));
    findings.side = body ? body->side : find_side();
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
    segmentation::SupportVoxels supports;
    if (!body) supports = segmentation::read_label_supports(labels_);
    // Each support of an object has a distance of its own; one field for all would round the edge where two meet.
    bend(run, mesh, findings.side != "none" || supports.names.size() < 2, findings);
    run.stage("tissue");
    run.progress("reading tissue fractions from the labels");
    if (body)
      name_places(run, *body, mesh, findings);
    else
      findings.fractions = meshing::assign_tissue(mesh, labels, segmentation::read_gland_share(labels_));
    if (!body) name_supports(mesh, supports, labels.grid, findings.side);
    measure_supports(mesh, options.edge_mm, findings);
    if (!inside.interfaces.empty()) meshing::impose_interfaces(mesh, enclosing, inside.interfaces);
    run.stage("anatomy");
    run.progress("finding the foot of the mound");
    mark_ring(run, mesh, findings);
    run.stage("check");
    meshing::check_mesh(mesh);
    findings.quality = meshing::measure_quality(mesh);
    return mesh;
  }

  Case read_body(Run& run) const {
    run.input(case_folder_ / "case.toml");
    Case measured = read_case(case_folder_);
    if (measured.image_kind != "surface")
      throw InputError(fmt::format("--case {}: [image] kind is \"{}\"; give labels.vti instead", case_folder_.string(),
                                   measured.image_kind));
    if (!labels_.empty())
      throw InputError("--case stands for the labels of a body that came as a surface: give one of them");
    return measured;
  }

  static void name_places(Run& run, const Case& body, TetMesh& mesh, MeshFindings& findings) {
    meshing::assign_supports(mesh, read_supports(run, body));
    meshing::assign_parts(mesh, read_parts(run, body));
    for (std::size_t p = 0; p < mesh.part_names.size(); ++p) {
      double volume = 0;
      for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
        volume +=
            mesh.part_fraction(c, static_cast<Eigen::Index>(p)) * meshing::cell_volume_mm3(mesh.points, mesh.cells, c);
      findings.parts_ml.emplace_back(mesh.part_names[p], volume / 1000);
    }
  }

  /// Supports of a label map. Where it names none, what it calls support or muscle is the one support of an object.
  static void name_supports(TetMesh& mesh, const segmentation::SupportVoxels& supports, const segmentation::Grid& grid,
                            const std::string& side) {
    if (!supports.names.empty()) {
      meshing::assign_supports(mesh, supports, grid);
    } else if (side == "none") {
      mesh.support_names = {"support"};
      mesh.muscle_support = Eigen::VectorXi::Zero(mesh.muscle.triangles.rows());
    }
  }

  void measure_supports(const TetMesh& mesh, double edge_mm, MeshFindings& findings) const {
    const Eigen::VectorXi of_face = meshing::support_of_faces(mesh);
    for (std::size_t s = 0; s < mesh.support_names.size(); ++s) {
      const double mm2 = meshing::support_area(mesh, of_face, static_cast<int>(s)).area_mm2;
      if (mm2 == 0)
        throw InputError(fmt::format(
            "{}: no face of the mesh lies on support '{}': it touches the body on less than {:g} mm2, which "
            "count as noise of the labels, or than a triangle of the surface takes (edges of {:.1f} mm). "
            "Label more of it, take a finer surface (supine-decimate --triangles), or leave it out",
            surface_, mesh.support_names[s], reconstruction::smallest_island_mm2, edge_mm));
      findings.supports_cm2.emplace_back(mesh.support_names[s], mm2 / 100);
    }
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

  /// @param onto_muscle  inner nodes go on to the smooth distance of the sheet
  void bend(Run& run, TetMesh& mesh, bool onto_muscle, MeshFindings& findings) const {
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
    std::optional<meshing::MuscleDistance> muscle;
    if (onto_muscle) muscle.emplace(mesh.muscle, box);
    findings.curve = meshing::curve_boundary(mesh, fine, muscle ? &*muscle : nullptr, curving_);
  }

  std::string find_side() const {
    std::string side = side_, from = "--side";
    const segmentation::LabelNotes notes = segmentation::read_label_notes(labels_);
    if (side.empty()) {
      side = notes.contains("side") ? notes.at("side") : "left";
      from = labels_;
    } else if (notes.contains("side") && notes.at("side") != side) {
      throw InputError(
          fmt::format("--side {}: {} is of side \"{}\", as its case says; leave --side out, or correct "
                      "side in case.toml and segment again",
                      side, labels_, notes.at("side")));
    }
    if (side != "left" && side != "right" && side != "both" && side != "none") {
      throw InputError(
          fmt::format("{}: side is \"{}\"; left, right, both or (of an object) none is expected", from, side));
    }
    return side;
  }

  void mark_ring(Run& run, TetMesh& mesh, MeshFindings& findings) const {
    try {
      findings.anatomy = meshing::compute_anatomy(mesh, findings.side);
      if (findings.anatomy->is_object()) return;
      if (meshing::mark_ligament_ring(mesh, *findings.anatomy) == 0) {
        run.warn(fmt::format("no inner face lies within {} mm of the mound's foot; no ligament ring is marked",
                             meshing::ligament_half_width_mm));
      }
    } catch (const InputError& error) {
      run.warn(fmt::format("no ligament ring is marked: {}", error.what()));
    }
  }

  void write(Run& run, const TetMesh& mesh, const MeshFindings& findings) const {
    run.stage("write");
    const fs::path file = target();
    if (file.extension() != ".vtu") throw InputError(fmt::format("-o {}: the mesh file ends in .vtu", file.string()));
    meshing::write_mesh(mesh, run.output(file), findings.side);
    fill(run.figures(file), findings);
    if (!png_.empty())
      draw_mesh(run.output(file),
                fmt::format("{} tetrahedra of order {}, smallest dihedral angle {:.1f} degrees", findings.quality.cells,
                            order_, findings.quality.min_dihedral_deg),
                run.output(png_));
    run.say(file.string());
  }

  fs::path target() const { return output.empty() ? fs::path(surface_).parent_path() / "mesh.vtu" : output; }

  void write_report(Run& run, const MeshFindings& findings) const {
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

  std::string surface_, muscle_, labels_, side_, fine_, error_from_;
  fs::path png_, case_folder_;
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
