// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>

#include <cmath>
#include <fstream>

#include "common/error.h"
#include "common/landmarks.h"
#include "common/rms.h"
#include "meshing/imaged_mesh.h"
#include "meshing/mesh_io.h"
#include "pipeline/case/case.h"
#include "pipeline/case/model_checks.h"
#include "pipeline/case/model_edit.h"
#include "pipeline/case/model_file.h"
#include "pipeline/tool/tool.h"
#include "reconstruction/surface_io.h"
#include "simulation/embedding.h"
#include "simulation/export/exported_pose.h"
#include "simulation/solve/carrying_modulus.h"
#include "simulation/solve/chain.h"
#include "simulation/solve/linear_solver.h"
#include "simulation/terms/bulk.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using simulation::ChainSolution;
using simulation::InverseMethod;
using simulation::PoseSolution;

const std::map<std::string, InverseMethod> inverse_methods = {{"newton", InverseMethod::newton},
                                                              {"fixed-point", InverseMethod::fixed_point},
                                                              {"reversed-gravity", InverseMethod::reversed_gravity}};

const std::map<std::string, simulation::Solver> solvers = {{"calculix", simulation::Solver::calculix},
                                                           {"febio", simulation::Solver::febio},
                                                           {"sofa", simulation::Solver::sofa}};

// A round trip beyond this is not a certificate; the true inverse ends orders below.
constexpr double round_trip_bound_mm = 1e-6;

// Two balanced shapes closer than this are one for whoever reads the prediction.
constexpr double second_shape_bound_mm = 0.01;

// Prone landmarks are marked on the imaged body: a little noise is to be expected, no more.
constexpr double landmark_warning_mm = 2, landmark_bound_mm = 10;

/// Surfaces and landmarks that move along with the tissue.
struct Passenger {
  std::string name;  // "gland", "tumour", …
  reconstruction::Surface surface;
  simulation::Embedding embedding;
};

struct Inputs {
  Case measured;
  simulation::Model model;
  meshing::TetMesh mesh;
  meshing::Anatomy anatomy;
  std::vector<simulation::PoseLoad> loads;
};

class SimulateTool : public Tool {
 public:
  std::string name() const override { return "supine-simulate"; }

  std::string summary() const override {
    return "Finds the gravity-free (undeformed) shape of the imaged body and from it the shape in every other pose of "
           "the case.\n"
           "Writes prone.vtu (the imaged pose), undeformed.vtu, supine.vtu (and the case's other poses), the organ "
           "surfaces and "
           "landmarks "
           "in each pose. -o names their folder (default: that of the mesh).\n\n"
           "Examples:\n"
           "  supine-simulate mycase mycase/out/mesh.vtu\n"
           "  supine-simulate mycase mycase/out/mesh.vtu --model stiff.toml --pose supine -o trial\n"
           "  supine-simulate mycase mycase/out/mesh.vtu --export calculix -o trial\n"
           "  supine-simulate mycase mycase/out/mesh.vtu --find-modulus -o trial     (then --model trial/model.toml)\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("mesh", mesh_file_, "imaged mesh, as supine-tetrahedralise writes it (.vtu)")->required();
    app.add_option("--model", model_file_, "what is believed of the tissue (default: CASE/model.toml)");
    app.add_option("--pose", pose_names_, "predict this pose only; may be given several times (default: all)");
    app.add_option("--inverse", inverse_,
                   "how the undeformed shape is found: newton (true inverse), fixed-point, "
                   "reversed-gravity")
        ->check(CLI::IsMember({"newton", "fixed-point", "reversed-gravity"}))
        ->capture_default_str();
    app.add_option("--export", export_to_,
                   "also write every pose, from the undeformed shape, as input for another solver: calculix, febio, "
                   "sofa (docs/second-opinion.md)")
        ->check(CLI::IsMember({"calculix", "febio", "sofa"}));
    app.add_flag(
           "--find-modulus", find_modulus_,
           "only find the softest breast.young_modulus_kpa (kPa, to 5 %) that carries the body in every pose, and "
           "write model.toml with it")
        ->excludes("--export")
        ->excludes("--inverse");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    const Inputs in = read(run);
    warn_of_locking(run, in);
    if (!export_to_.empty())
      simulation::check_exportable(solvers.at(export_to_), in.mesh, in.anatomy, in.model, in.loads);
    run.stage("solve");
    if (find_modulus_) return find_modulus(run, in);
    simulation::SolveOptions options;
    options.progress = [&run](const std::string& what, double load, int iteration, double share) {
      run.progress(fmt::format("{}: load {:.0f} %, iteration {}, {:.1e} of the weight unbalanced", what, 100 * load,
                               iteration, share));
    };
    const ChainSolution solution =
        simulation::solve_chain(in.mesh, in.anatomy, in.model, in.loads, inverse_methods.at(inverse_), options);
    run.stage("write");
    write(run, in, solution);
    if (!export_to_.empty()) write_exports(run, in, solution);
    say(run, in, solution);
    for (const std::string& warning : solution.warnings) run.warn(warning);
    return judge(run, solution);
  }

 private:
  void warn_of_locking(Run& run, const Inputs& in) const {
    const auto poisson = Eigen::VectorXd::Constant(in.mesh.cells.rows(), in.model.breast.poisson_ratio.value);
    const std::string warning = simulation::locking_warning(in.mesh.order(), poisson, in.model.breast.volumetric);
    if (!warning.empty()) run.warn(warning);
  }

  /// The model as it stands with the modulus that was found: a value or a table { value = … }.
  Outcome find_modulus(Run& run, const Inputs& in) const {
    simulation::ModulusSearch search;
    search.progress = [&run](double kpa) { run.progress(fmt::format("breast.young_modulus_kpa = {:.3g}", kpa)); };
    const auto found = simulation::find_carrying_modulus(in.mesh, in.anatomy, in.model, in.loads, search);
    const fs::path model = model_file_.empty() ? case_folder_ / "model.toml" : model_file_;
    const fs::path target = folder() / "model.toml";
    std::ofstream(run.output(target), std::ios::binary)
        << with_values(model, {{"breast.young_modulus_kpa", found.carries_kpa}});
    Json& f = run.figures(target);
    f["carries_kpa"] = found.carries_kpa;
    f["fails_kpa"] = found.fails_kpa ? Json(*found.fails_kpa) : Json(nullptr);
    f["chains"] = found.chains;
    run.say(fmt::format(
        "breast.young_modulus_kpa = {:.3g} carries the body in every pose, {} ({} chains); {} has it",
        found.carries_kpa,
        found.fails_kpa ? fmt::format("{:.3g} does not", *found.fails_kpa) : std::string("nothing softer was tried"),
        found.chains, target.string()));
    return Outcome::done;
  }

  Outcome judge(Run& run, const ChainSolution& solution) const {
    for (const PoseSolution& pose : solution.poses)
      if (pose.second_shape_mm > second_shape_bound_mm) return Outcome::target_not_met;
    if (solution.round_trip_max_mm <= round_trip_bound_mm) return Outcome::done;
    if (inverse_ != "newton") {
      run.warn(
          fmt::format("the round trip ends {:.2e} mm from the imaged shape (bound {:.0e} mm): {} is not the inverse; "
                      "use --inverse newton",
                      solution.round_trip_max_mm, round_trip_bound_mm, inverse_));
      return Outcome::target_not_met;
    }
    run.warn(
        fmt::format("the round trip ends {:.2e} mm from the imaged shape (bound {:.0e} mm): loading the undeformed "
                    "shape again finds another equilibrium, so the prediction is one of several",
                    solution.round_trip_max_mm, round_trip_bound_mm));
    return Outcome::target_not_met;
  }

  Inputs read(Run& run) const {
    run.input(case_folder_ / "case.toml");
    Inputs in{read_case(case_folder_), {}, {}, {}, {}};
    in.model = read_model(run.input(model_file_.empty() ? case_folder_ / "model.toml" : model_file_));
    in.mesh = meshing::read_imaged_mesh(run.input(mesh_file_), in.measured.side);
    in.anatomy = meshing::compute_anatomy(in.mesh, in.measured.side, in.measured.imaged_pose);
    if (!in.measured.is_object())
      check_weight(in.model, in.anatomy, model_file_.empty() ? case_folder_ / "model.toml" : model_file_);
    for (const std::string& wanted : pose_names_) in.measured.pose(wanted);
    for (const Pose& pose : in.measured.poses)
      if (pose.name == in.measured.imaged_pose || pose_names_.empty() ||
          std::find(pose_names_.begin(), pose_names_.end(), pose.name) != pose_names_.end())
        in.loads.push_back({pose.name, pose.gravity});
    return in;
  }

  fs::path folder() const { return output.empty() ? mesh_file_.parent_path() : output; }

  std::vector<Passenger> passengers(Run& run, const Inputs& in) const {
    std::vector<Passenger> found;
    for (int tissue = 0; tissue < segmentation::tissue_count; ++tissue) {
      const std::string name(segmentation::tissue_names[tissue]);
      const fs::path file = mesh_file_.parent_path() / (name + ".vtp");
      // A surface of a tissue the mesh does not have is left over from other labels.
      if (in.mesh.fraction.col(tissue).sum() == 0 || !fs::exists(file)) continue;
      auto surface = reconstruction::read_surface(run.input(file));
      simulation::Embedding embedding(in.mesh, surface.points);
      found.push_back({name, std::move(surface), std::move(embedding)});
    }
    return found;
  }

  void check_landmarks(Run& run, const Inputs& in, const Landmarks& landmarks,
                       const simulation::Embedding& places) const {
    if (landmarks.names.empty()) return;
    Eigen::Index worst = 0;
    const double distance = places.outside_mm().maxCoeff(&worst);
    if (distance <= landmark_warning_mm) return;
    const std::string what = fmt::format("{}: landmark '{}' lies {:.1f} mm outside the imaged body",
                                         in.measured.prone_landmarks->string(), landmarks.names[worst], distance);
    if (distance <= landmark_bound_mm) return run.warn(what + "; it moves along with the closest tissue");
    Points flipped = landmarks.points;
    flipped.leftCols<2>() *= -1;
    const double other = simulation::Embedding(in.mesh, flipped).outside_mm().maxCoeff();
    throw InputError(fmt::format(
        "{} (bound {} mm). {}", what, landmark_bound_mm,
        other <= landmark_bound_mm ? "With x and y negated all lie inside: the file is RAS and case.frame says LPS, or "
                                     "the other way round"
                                   : "Check its unit (mm), its frame, and that it was marked in the prone image"));
  }

  void write(Run& run, const Inputs& in, const ChainSolution& solution) const {
    const auto organs = passengers(run, in);
    std::optional<Landmarks> landmarks;
    std::optional<simulation::Embedding> landmark_places;
    if (in.measured.prone_landmarks) {
      landmarks = read_landmarks(run.input(*in.measured.prone_landmarks), in.measured.frame);
      landmark_places.emplace(in.mesh, landmarks->points);
      check_landmarks(run, in, *landmarks, *landmark_places);
    }
    const auto write_shape = [&](const std::string& name, const Points& x, const meshing::NamedTables& extra) {
      const fs::path file = folder() / (name + ".vtu");
      const Eigen::VectorXd det_f = simulation::cell_det_f(in.mesh.cells, x, solution.X);
      meshing::write_pose(in.mesh, x, extra, {{"det_f", det_f}}, run.output(file), in.measured.side);
      for (const Passenger& organ : organs) {
        reconstruction::Surface moved = organ.surface;
        moved.points = organ.embedding.at(x);
        reconstruction::write_surface(moved, run.output(folder() / (name + "_" + organ.name + ".vtp")));
      }
      if (landmarks)
        write_landmarks({landmarks->names, landmark_places->at(x)}, run.output(folder() / (name + "_landmarks.csv")));
      return file;
    };
    const Eigen::VectorXd error = (solution.round_trip.x - solution.prone).rowwise().norm();
    const bool free_of_load = in.measured.imaged_pose == simulation::free_of_load;
    const fs::path undeformed = write_shape("undeformed", solution.X, {});
    if (!free_of_load) {
      const fs::path imaged = write_shape(in.measured.imaged_pose, solution.prone, {{"round_trip_error_mm", error}});
      run.figures(imaged) = figures(in, solution, solution.round_trip.report, in.mesh.points);
    }
    run.figures(undeformed) = figures(in, solution, solution.inverse, solution.X);
    for (const PoseSolution& pose : solution.poses) {
      const fs::path file = write_shape(pose.name, pose.x, {});
      run.figures(file) = figures(in, solution, pose.report, pose.x);
      run.figures(file)["second_shape_mm"] = pose.second_shape_mm;
    }
  }

  /// Every pose for another solver, and beside it the displacements that ours found.
  void write_exports(Run& run, const Inputs& in, const ChainSolution& solution) const {
    const simulation::Solver solver = solvers.at(export_to_);
    for (std::size_t p = 0; p < in.loads.size(); ++p) {
      const Points& x = p == 0 ? solution.prone : solution.poses[p - 1].x;
      const auto pose = simulation::export_pose(in.mesh, in.anatomy, in.model, in.loads[p], solution.X, x);
      const fs::path file = folder() / (in.loads[p].name + "_" + export_to_ + simulation::export_extension(solver));
      simulation::write_export(solver, pose, run.output(file));
      const fs::path table = folder() / (in.loads[p].name + "_displacement.csv");
      simulation::write_displacements(pose, run.output(table));
      Json& f = run.figures(file);
      f["solver"] = export_to_;
      f["nodes"] = pose.nodes;
      f["skin_tetrahedra"] = pose.skin.rows();
      f["springs"] = pose.springs.size();
      f["materials"] = pose.materials.size();
      f["compare_with"] = table.filename().string();
      run.say(fmt::format("  {} for {}: {} springs, {} skin tetrahedra; compare with {}", file.string(), export_to_,
                          pose.springs.size(), pose.skin.rows(), table.filename().string()));
    }
  }

  Json figures(const Inputs& in, const ChainSolution& solution, const simulation::SolveReport& report,
               const Points& x) const {
    const Eigen::VectorXd from_prone = (x - in.mesh.points).rowwise().norm();
    const Eigen::VectorXd from_undeformed = (x - solution.X).rowwise().norm();
    Json f;
    f["inverse"] = in.measured.imaged_pose == simulation::free_of_load ? "none: imaged free of load" : inverse_;
    f["round_trip_max_mm"] = solution.round_trip_max_mm;
    f["round_trip_rms_mm"] = solution.round_trip_rms_mm;
    f["newton_iterations"] = report.newton_iterations;
    f["factorisations"] = report.factorisations;
    f["load_steps"] = report.load_steps;
    f["min_det_f"] = report.min_det_f;
    f["folded_cells"] = report.folded_cells;
    f["residual_share"] = report.residual_share;
    const double undeformed = simulation::volume_mm3(in.mesh.cells, solution.X);
    const double volume = simulation::volume_mm3(in.mesh.cells, x);
    f["volume_ml"] = 1e-3 * volume;
    f["volume_change"] = volume / undeformed - 1;
    f["displacement_from_prone_mm"] = {{"rms", rms(from_prone)}, {"max", from_prone.maxCoeff()}};
    f["displacement_from_undeformed_mm"] = {{"rms", rms(from_undeformed)}, {"max", from_undeformed.maxCoeff()}};
    const auto place = [&x](int point) -> Json {
      if (point < 0) return nullptr;
      return {x(point, 0), x(point, 1), x(point, 2)};
    };
    if (in.anatomy.breasts.empty() && !in.anatomy.is_object()) f["nipple_mm"] = place(in.anatomy.nipple_point);
    for (const meshing::Anatomy& one : in.anatomy.breasts) f["nipple_mm"][one.side] = place(one.nipple_point);
    f["load_number"] = simulation::load_number(in.anatomy, in.model);
    f["nodes"] = in.mesh.points.rows();
    f["tetrahedra"] = in.mesh.cells.rows();
    f["order"] = in.mesh.order();
    f["muscle_fit_rms_mm"] = in.anatomy.muscle->fit_rms_mm();
    f["blas"] = simulation::blas_description();
    return f;
  }

  void say(Run& run, const Inputs& in, const ChainSolution& solution) const {
    const std::string& imaged = in.measured.imaged_pose;
    const auto row = [&](const std::string& what, const simulation::SolveReport& report, const Points& x) {
      const Eigen::VectorXd moved = (x - in.mesh.points).rowwise().norm();
      run.say(fmt::format("  {:<24}{:>8.2f}{:>8.2f}{:>8}{:>8}{:>10.3f}", what, rms(moved), moved.maxCoeff(),
                          report.newton_iterations, report.load_steps, report.min_det_f));
    };
    run.say(fmt::format("{} nodes, {} tetrahedra of order {}; load number ρgH/E = {:.2f}", in.mesh.points.rows(),
                        in.mesh.cells.rows(), in.mesh.order(), simulation::load_number(in.anatomy, in.model)));
    run.say(fmt::format("  {:<24}{:>8}{:>8}{:>8}{:>8}{:>10}", "moved from " + imaged + ", mm", "rms", "max", "Newton",
                        "steps", "min det F"));
    row("undeformed", solution.inverse, solution.X);
    for (const PoseSolution& pose : solution.poses) row(pose.name, pose.report, pose.x);
    if (imaged == simulation::free_of_load)
      return run.say("  imaged free of load: its shape is the undeformed one, there is no inverse and no round trip");
    run.say(fmt::format("  round trip undeformed → {}: {:.2e} mm at most (bound {:.0e}), {} Newton steps", imaged,
                        solution.round_trip_max_mm, round_trip_bound_mm, solution.round_trip.report.newton_iterations));
  }

  fs::path case_folder_, mesh_file_, model_file_;
  std::vector<std::string> pose_names_;
  std::string inverse_ = "newton", export_to_;
  bool find_modulus_ = false;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::SimulateTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
