// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/work/simulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>

#include "common/error.h"
#include "common/rms.h"
#include "common/suggestion.h"
#include "meshing/mesh_io.h"
#include "simulation/solve/linear_solver.h"
#include "simulation/terms/bulk.h"

namespace supine::pipeline {
namespace {

using Json = nlohmann::ordered_json;
using simulation::InverseMethod;
using simulation::PoseSolution;

// A round trip beyond this is not a certificate; the true inverse ends orders below.
constexpr double round_trip_bound_mm = 1e-6;

// Two balanced shapes closer than this are one for whoever reads the prediction.
constexpr double second_shape_bound_mm = 0.01;

InverseMethod inverse_method(const std::string& name) {
  const auto found = inverse_methods().find(name);
  if (found != inverse_methods().end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, method] : inverse_methods()) names.push_back(known);
  throw InputError(fmt::format("inverse = {}: must be one of {}", name, listed(names)));
}

Json figures_of(const CaseInputs& in, const Simulated& simulated, const simulation::SolveReport& report,
                const Points& x) {
  const simulation::ChainSolution& solution = simulated.solution;
  const Eigen::VectorXd from_prone = (x - in.mesh.points).rowwise().norm();
  const Eigen::VectorXd from_undeformed = (x - solution.X).rowwise().norm();
  Json f;
  f["inverse"] =
      in.description.imaged_pose == simulation::free_of_load ? "none: imaged free of load" : simulated.inverse;
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

/// What touches in a pose.
Json contact_figures(const simulation::ContactFigures& contact) {
  Json f;
  f["area_cm2"] = contact.area_cm2;
  f["pressure_max_kpa"] = contact.pressure_kpa;
  f["overlap_max_mm"] = contact.overlap_mm;
  if (contact.overlap_mm > 0) f["overlap_at_mm"] = {contact.place_mm.x(), contact.place_mm.y(), contact.place_mm.z()};
  return f;
}

const PoseSolution* pose_named(const simulation::ChainSolution& solution, const std::string& name) {
  for (const PoseSolution& pose : solution.poses)
    if (pose.name == name) return &pose;
  return nullptr;
}

/// Contact pressure on the boundary triangles, kPa: zero where nothing touches, not a number on all but skin.
Table contact_pressure(const CaseInputs& in, const simulation::ContactFigures& contact) {
  const Eigen::Index cells = in.mesh.cells.rows();
  Table pressure = Table::Constant(cells + in.mesh.faces.rows(), 1, std::numeric_limits<double>::quiet_NaN());
  Eigen::Index skin = 0;
  for (Eigen::Index f = 0; f < in.mesh.faces.rows(); ++f)
    if (in.mesh.region[f] == static_cast<int>(reconstruction::Region::skin))
      pressure(cells + f, 0) = contact.face_kpa[skin++];
  return pressure;
}

}  // namespace

const std::map<std::string, InverseMethod>& inverse_methods() {
  static const std::map<std::string, InverseMethod> methods = {{"newton", InverseMethod::newton},
                                                               {"fixed-point", InverseMethod::fixed_point},
                                                               {"reversed-gravity", InverseMethod::reversed_gravity}};
  return methods;
}

std::vector<simulation::PoseLoad> loads_of(const Case& description, const std::vector<std::string>& wanted) {
  for (const std::string& name : wanted) description.pose(name);
  std::vector<simulation::PoseLoad> loads;
  for (const Pose& pose : description.poses)
    if (pose.name == description.imaged_pose || wanted.empty() ||
        std::find(wanted.begin(), wanted.end(), pose.name) != wanted.end())
      loads.push_back({pose.name, pose.gravity});
  return loads;
}

void warn_of_locking(Run& run, const CaseInputs& in) {
  const auto poisson = Eigen::VectorXd::Constant(in.mesh.cells.rows(), in.model.breast.poisson_ratio.value);
  const std::string warning = simulation::locking_warning(in.mesh.order(), poisson, in.model.breast.volumetric);
  if (!warning.empty()) run.warn(warning);
}

simulation::SolveOptions solve_options(Run& run) {
  simulation::SolveOptions options;
  const auto one_at_a_time = std::make_shared<std::mutex>();  // poses are solved side by side
  options.progress = [&run, one_at_a_time](const std::string& what, double load, int iteration, double share) {
    const std::lock_guard lock(*one_at_a_time);
    run.progress(fmt::format("{}: load {:.0f} %, iteration {}, {:.1e} of the weight unbalanced", what, 100 * load,
                             iteration, share));
  };
  return options;
}

Simulated simulate(Run& run, const CaseInputs& in, const SimulateOptions& asked) {
  Simulated simulated{loads_of(in.description, asked.poses), asked.inverse, {}};
  simulated.solution = simulation::solve_chain(in.mesh, in.anatomy, in.model, simulated.loads,
                                               inverse_method(asked.inverse), solve_options(run));
  for (const std::string& warning : simulated.solution.warnings) run.warn(warning);
  return simulated;
}

Outcome judge(Run& run, const Simulated& simulated) {
  const simulation::ChainSolution& solution = simulated.solution;
  for (const PoseSolution& pose : solution.poses)
    if (pose.second_shape_mm > second_shape_bound_mm) return Outcome::target_not_met;
  if (solution.round_trip_max_mm <= round_trip_bound_mm) return Outcome::done;
  if (simulated.inverse != "newton") {
    run.warn(
        fmt::format("the round trip ends {:.2e} mm from the imaged shape (bound {:.0e} mm): {} is not the inverse; "
                    "use --inverse newton",
                    solution.round_trip_max_mm, round_trip_bound_mm, simulated.inverse));
    return Outcome::target_not_met;
  }
  run.warn(
      fmt::format("the round trip ends {:.2e} mm from the imaged shape (bound {:.0e} mm): loading the undeformed "
                  "shape again finds another equilibrium, so the prediction is one of several",
                  solution.round_trip_max_mm, round_trip_bound_mm));
  return Outcome::target_not_met;
}

const Points& shape_of(const simulation::ChainSolution& solution, const std::string& imaged_pose,
                       const std::string& name) {
  if (name == simulation::free_of_load) return solution.X;
  if (name == imaged_pose) return solution.prone;
  std::vector<std::string> names = {imaged_pose, simulation::free_of_load};
  for (const PoseSolution& pose : solution.poses) {
    if (pose.name == name) return pose.x;
    names.push_back(pose.name);
  }
  throw InputError(fmt::format("there is no shape \"{}\"; there are {}", name, listed(names)));
}

const Points& shape_of(const Simulated& simulated, const std::string& name) {
  return shape_of(simulated.solution, simulated.loads.front().name, name);
}

Json shape_figures(const CaseInputs& in, const Simulated& simulated, const std::string& name) {
  const simulation::ChainSolution& solution = simulated.solution;
  const Points& x = shape_of(simulated, name);
  if (name == simulation::free_of_load) return figures_of(in, simulated, solution.inverse, x);
  const bool imaged = name == simulated.loads.front().name;
  const PoseSolution* pose = imaged ? nullptr : pose_named(solution, name);
  Json f = imaged ? figures_of(in, simulated, solution.round_trip.report, in.mesh.points)
                  : figures_of(in, simulated, pose->report, x);
  const Eigen::Vector3d& gravity = in.description.pose(name).gravity;
  f["gravity"] = {gravity.x(), gravity.y(), gravity.z()};
  if (imaged) return f;
  f["second_shape_mm"] = pose->second_shape_mm;
  if (pose->contact) f["contact"] = contact_figures(*pose->contact);
  if (pose->chest_contact) f["chest_contact"] = contact_figures(*pose->chest_contact);
  return f;
}

void write_shape(const CaseInputs& in, const Simulated& simulated, const std::string& name,
                 const std::filesystem::path& file) {
  const simulation::ChainSolution& solution = simulated.solution;
  const Points& x = shape_of(simulated, name);
  meshing::NamedTables at_points;
  if (name == simulated.loads.front().name && name != simulation::free_of_load)
    at_points = {{"round_trip_error_mm", (solution.round_trip.x - solution.prone).rowwise().norm()}};
  meshing::NamedTables at_cells = {{"det_f", simulation::cell_det_f(in.mesh.cells, x, solution.X)}};
  const PoseSolution* pose = pose_named(solution, name);
  if (pose != nullptr && pose->contact) at_cells.emplace_back("contact_kpa", contact_pressure(in, *pose->contact));
  if (pose != nullptr && pose->chest_contact)
    at_cells.emplace_back("chest_contact_kpa", contact_pressure(in, *pose->chest_contact));
  meshing::write_pose(in.mesh, x, at_points, at_cells, file, in.description.side, name);
}

void say_simulated(const Run& run, const CaseInputs& in, const Simulated& simulated) {
  const simulation::ChainSolution& solution = simulated.solution;
  const std::string& imaged = in.description.imaged_pose;
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
  const auto touches = [&run](const std::string& pose, const char* what, const simulation::ContactFigures& contact) {
    run.say(fmt::format("  {}: skin presses on {} over {:.1f} cm2, {:.2f} kPa at most, {:.2f} mm deep at most", pose,
                        what, contact.area_cm2, contact.pressure_kpa, contact.overlap_mm));
  };
  for (const PoseSolution& pose : solution.poses) {
    if (pose.contact) touches(pose.name, "skin", *pose.contact);
    if (pose.chest_contact) touches(pose.name, "the chest beside the breast", *pose.chest_contact);
  }
  if (imaged == simulation::free_of_load)
    return run.say("  imaged free of load: its shape is the undeformed one, there is no inverse and no round trip");
  run.say(fmt::format("  round trip undeformed → {}: {:.2e} mm at most (bound {:.0e}), {} Newton steps", imaged,
                      solution.round_trip_max_mm, round_trip_bound_mm, solution.round_trip.report.newton_iterations));
}

}  // namespace supine::pipeline
