// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/chain.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "simulation/model_fields.h"
#include "simulation/solve/folds.h"
#include "simulation/solve/overlap.h"
#include "simulation/solve/pushed_forward.h"
#include "simulation/solve/turning.h"

namespace supine::simulation {
namespace {

constexpr int max_corrections = 60;               // of the fixed point: linear convergence, slow where tissue is soft
constexpr double correction_tolerance_mm = 1e-3;  // of the fixed point: far under what a scanner measures
constexpr double second_shape_bound_mm = 1e-3;    // two balanced shapes this close are one
constexpr double kg_mm3_per_kg_m3 = 1e-9;

/// Of gravity from the chest's front or back, prone and supine: breasts face up to some 45 degrees to the side.
constexpr double widest_deg = 75;

double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

void check_imaged_pose(const PoseLoad& prone, const meshing::Anatomy& anatomy) {
  if (prone.name != anatomy.imaged_pose)
    throw InputError(fmt::format("the body was imaged in pose '{}', and the chain starts from '{}'",
                                 anatomy.imaged_pose, prone.name));
  if (prone.name != "prone" || anatomy.is_object()) return;
  const double angle = degrees_between(prone.gravity, anatomy.outward);
  if (angle < widest_deg) return;
  const Eigen::Vector3d& n = anatomy.outward;
  throw InputError(fmt::format(
      "pose.prone.gravity = [{:.3f}, {:.3f}, {:.3f}] {} the muscle, whose outward normal is ({:.3f}, {:.3f}, {:.3f}): "
      "the angle between them is {:.0f} degrees and must be under {:.0f}. A prone breast hangs away from the chest: "
      "check sign and order of the numbers, or case.frame against the frame of the image",
      prone.gravity.x(), prone.gravity.y(), prone.gravity.z(), angle > 90 ? "presses the breast into" : "runs along",
      n.x(), n.y(), n.z(), angle, widest_deg));
}

void check_supine_gravity(const PoseLoad& pose, const meshing::Anatomy& anatomy) {
  if (pose.name != "supine" || anatomy.is_object()) return;
  const double angle = degrees_between(pose.gravity, -anatomy.outward);
  if (angle < widest_deg) return;
  const Eigen::Vector3d& n = anatomy.outward;
  throw InputError(fmt::format(
      "pose.supine.gravity = [{:.3f}, {:.3f}, {:.3f}] {} the muscle, whose outward normal is ({:.3f}, {:.3f}, {:.3f}): "
      "the angle between them is {:.0f} degrees and must be over {:.0f}. On the back the breast lies on the chest: "
      "check sign and order of the numbers",
      pose.gravity.x(), pose.gravity.y(), pose.gravity.z(), angle > 90 ? "pulls the breast off" : "runs along", n.x(),
      n.y(), n.z(), 180 - angle, 180 - widest_deg));
}

/// Notes smallest det F at the quadrature points and the cells folded in @p x or @p X.
/// @throws NumericalFailure  naming the cell that is inverted at a quadrature point
void check_cells(const meshing::TetMesh& mesh, const Points& x, const Points& X, const std::string& what,
                 SolveReport& report) {
  Eigen::Index cell = 0;
  report.min_det_f = cell_det_f_at_points(mesh.cells, x, X).minCoeff(&cell);
  if (report.min_det_f > 0) return;
  Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
  for (int a = 0; a < 4; ++a) centre += 0.25 * x.row(mesh.cells(cell, a));
  throw NumericalFailure(fmt::format(
      "{}: cell {} at ({:.1f}, {:.1f}, {:.1f}) mm is turned inside out (det F = {:.3g}); make the mesh finer there or "
      "raise breast.young_modulus_kpa",
      what, cell, centre.x(), centre.y(), centre.z(), report.min_det_f));
}

/// Notes and names the cells of a shape that fold between quadrature points.
void note_folds(const meshing::TetMesh& mesh, const Points& shape, const std::string& name, SolveReport& report,
                std::vector<std::string>& warnings) {
  const Folds folds = find_folds(mesh.cells, shape);
  report.folded_cells = folds.cells;
  if (folds.cells > 0) warnings.push_back(folds_warning(name, folds));
}

/// Names the faces that contact with the chest leaves alone.
void note_left_on_chest(const LeftOut& left, const std::string& name, std::vector<std::string>& warnings) {
  if (left.pairs == 0) return;
  const Eigen::Vector3d& at = left.place_mm;
  warnings.push_back(fmt::format(
      "{}: {} faces of the skin lie {} the chest beside the breast already, {:.1f} mm at ({:.1f}, {:.1f}, {:.1f}) mm; "
      "contact leaves them out",
      name, left.pairs, left.deepest_mm < 0 ? "inside" : "on", std::abs(left.deepest_mm), at.x(), at.y(), at.z()));
}

/// Names the pairs of faces that contact leaves alone.
void note_left_out(const LeftOut& left, const std::string& name, std::vector<std::string>& warnings) {
  if (left.pairs == 0) return;
  const Eigen::Vector3d& at = left.place_mm;
  warnings.push_back(fmt::format(
      "{}: {} pairs of skin faces {} already, {:.1f} mm at ({:.1f}, {:.1f}, {:.1f}) mm; contact leaves them out", name,
      left.pairs, left.deepest_mm < 0 ? "overlap" : "touch", std::abs(left.deepest_mm), at.x(), at.y(), at.z()));
}

/// Where all stiffness grows alike, equilibrium depends on weight over stiffness alone: E / load would carry what E
/// carried a share of. The skin and the springs do not grow with the breast's modulus, so that is a first guess.
std::string modulus_advice(const Model& model, double load) {
  constexpr double telling_load = 0.02;  // under this share the guess is no better than none
  const double kpa = model.breast.young_modulus_kpa.value;
  const std::string guess =
      load < telling_load
          ? std::string()
          : fmt::format("About breast.young_modulus_kpa = {:.2g} would carry it ({:.3g} carried {:.0f} %). ",
                        kpa / load, kpa, 100 * load);
  return ". " + guess + "supine-simulate --find-modulus finds the least that does";
}

Scene scene_of(const Mechanics& mechanics, const std::string& pose) {
  return {.mesh = mechanics.mesh(), .anatomy = mechanics.anatomy(), .layout = mechanics.layout(), .pose = pose};
}

/// A body that cannot be turned over has the one way, and all the work for it.
SolveOptions work_of(SolveOptions options, const PoseLoad& imaged) {
  constexpr double both_ways = 1.8;
  if (imaged.name == free_of_load || !(imaged.gravity.norm() > 0))
    options.most_work = static_cast<int>(both_ways * options.most_work);
  return options;
}

}  // namespace

Chain::Chain(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
             std::vector<PoseLoad> poses, SolveOptions options)
    : poses_(std::move(poses)),
      mechanics_(mesh, anatomy, model),
      solver_(mechanics_, work_of(std::move(options), poses_.at(0))) {
  check_imaged_pose(poses_.at(0), anatomy);
  for (const PoseLoad& pose : poses_) check_supine_gravity(pose, anatomy);
}

Fields<Dual> Chain::fields(const Model& model, const PoseLoad& pose, const std::string& varied) const {
  return make_fields(model, scene_of(mechanics_, pose.name), pose.gravity, varied);
}

void Chain::load(const Model& model, const PoseLoad& pose) { mechanics_.set_fields(values_of(fields(model, pose))); }

ChainSolution Chain::solve(const Model& model, const ChainSolution* near, InverseMethod method) {
  try {
    return solve_all(model, near, method);
  } catch (const NoEquilibrium& failure) {
    throw NoEquilibrium(failure.what() + modulus_advice(model, failure.load()), failure.load());
  }
}

ChainSolution Chain::solve_all(const Model& model, const ChainSolution* near, InverseMethod method) {
  const meshing::TetMesh& mesh = mechanics_.mesh();
  solver_.forget();
  ChainSolution solution;
  const Eigen::VectorXd offset = values_of(fields(model, poses_[0])).imaged_offset;
  solution.prone = mesh.points + Eigen::Map<const Points>(offset.data(), mesh.points.rows(), 3);
  within_limit(solution, [&] { solve_undeformed(model, method, near, solution); });
  check_cells(mesh, solution.prone, solution.X, "undeformed", solution.inverse);
  note_folds(mesh, solution.X, "undeformed", solution.inverse, solution.warnings);
  for (std::size_t p = 1; p < poses_.size(); ++p) {
    load(model, poses_[p]);
    Points start;
    if (near != nullptr) start = pushed_forward(mesh.cells, near->poses[p - 1].x, near->X, solution.X);
    PoseSolution pose{.name = poses_[p].name, .x = {}, .report = {}};
    within_limit(solution, [&] {
      pose.report = solve_pose(model, poses_[p], near != nullptr ? &start : nullptr, solution, pose.x);
    });
    check_cells(mesh, pose.x, solution.X, pose.name, pose.report);
    note_folds(mesh, pose.x, pose.name, pose.report, solution.warnings);
    solution.poses.push_back(std::move(pose));
  }
  return solution;
}

/// One solve of a chain, no dearer than each may be.
void Chain::within_limit(ChainSolution& solution, const std::function<void()>& solve) {
  const int before = solver_.work();
  solver_.limit_work(most_of_each_);
  solve();
  solution.dearest_solve = std::max(solution.dearest_solve, solver_.work() - before);
}

/// By growing load; where that leads nowhere, as the patient turns.
SolveReport Chain::solve_pose(const Model& model, const PoseLoad& pose, const Points* start,
                              const ChainSolution& solution, Points& x) {
  try {
    return solver_.forward(solution.X, x, "undeformed → " + pose.name, start);
  } catch (const NoEquilibrium&) {
    if (most_of_each_ || imaged_free_of_load() || !(poses_[0].gravity.norm() > 0) || !(pose.gravity.norm() > 0)) throw;
    const auto turned_load = [&](const Eigen::Vector3d& gravity) { load(model, {pose.name, gravity}); };
    x = solution.prone;
    const Turn turn = turn_of(mechanics_.anatomy(), poses_[0].gravity, pose.gravity);
    const std::optional<SolveReport> report =
        turn_over(solver_, turn, turned_load, solution.X, x, poses_[0].name + ", turning, → " + pose.name);
    if (!report) throw;
    return *report;
  }
}

void Chain::certify(const Model& model, ChainSolution& solution) {
  solver_.forget();
  look_for_contact(model, solution);
  solution.round_trip.name = poses_[0].name;
  if (imaged_free_of_load()) {
    solution.round_trip.x = solution.prone;
    if (!mechanics_.has_energy()) look_for_second_shapes(model, solution);
    return;
  }
  load(model, poses_[0]);
  solution.round_trip.report = solver_.forward(solution.X, solution.round_trip.x, "undeformed → " + poses_[0].name);
  const Eigen::VectorXd error = (solution.round_trip.x - solution.prone).rowwise().norm();
  solution.round_trip_max_mm = error.maxCoeff();
  solution.round_trip_rms_mm = std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
  if (!mechanics_.has_energy()) look_for_second_shapes(model, solution);
}

void Chain::look_for_contact(const Model& model, ChainSolution& solution) {
  const meshing::TetMesh& mesh = mechanics_.mesh();
  const SkinContactTerm* contact = mechanics_.contact();
  if (contact != nullptr) {
    if (!imaged_free_of_load()) note_left_out(contact->left_out_imaged(), poses_[0].name, solution.warnings);
    note_left_out(contact->left_out(solution.X), free_of_load, solution.warnings);
  }
  const ChestContact* on_chest = mechanics_.chest_contact();
  if (on_chest != nullptr) {
    if (!imaged_free_of_load()) note_left_on_chest(on_chest->left_out_imaged(), poses_[0].name, solution.warnings);
    note_left_on_chest(on_chest->left_out(solution.X), free_of_load, solution.warnings);
  }
  const Indices skin = mesh.faces(mechanics_.layout().skin.faces, Eigen::all);
  for (PoseSolution& pose : solution.poses) {
    if (contact != nullptr) pose.contact = contact->figures({.x = pose.x, .X = solution.X});
    if (on_chest != nullptr) pose.chest_contact = on_chest->figures({.x = pose.x, .X = solution.X});
    const std::string warning =
        overlap_warning(pose.name, find_overlap(mesh, skin, pose.x), model.contact, pose.report.folded_cells);
    if (!warning.empty()) solution.warnings.push_back(warning);
  }
  look_into_chest(model, skin, solution);
}

/// Warns of skin that lies in the chest beside the breast.
void Chain::look_into_chest(const Model& model, const Indices& skin, ChainSolution& solution) const {
  const std::optional<meshing::ChestBeside> chest = meshing::chest_beside(mechanics_.mesh(), mechanics_.anatomy());
  if (!chest) return;
  for (const PoseSolution& pose : solution.poses) {
    const std::string warning = in_chest_warning(pose.name, find_in_chest(*chest, skin, pose.x), model.contact);
    if (!warning.empty()) solution.warnings.push_back(warning);
  }
}

void Chain::look_for_second_shapes(const Model& model, ChainSolution& solution) {
  for (std::size_t p = 1; p < poses_.size(); ++p) {
    PoseSolution& pose = solution.poses[p - 1];
    load(model, poses_[p]);
    Points other;
    try {
      solver_.forward(solution.X, other, poses_[0].name + " → " + pose.name, &solution.prone);
    } catch (const NumericalFailure&) {
      continue;  // that way leads nowhere: no second shape
    }
    Eigen::Index node = 0;
    const double distance = (other - pose.x).rowwise().norm().maxCoeff(&node);
    if (distance <= second_shape_bound_mm) continue;
    pose.second_shape_mm = distance;
    solution.warnings.push_back(fmt::format(
        "{}: two balanced shapes, {:.2f} mm apart at ({:.1f}, {:.1f}, {:.1f}) mm: one is reached from the undeformed "
        "shape, the other from the {} one, and forces without an energy (breast.law = corotational_qr, friction) "
        "cannot say which holds; use breast.law = \"corotational\", or raise breast.young_modulus_kpa",
        pose.name, distance, pose.x(node, 0), pose.x(node, 1), pose.x(node, 2), poses_[0].name));
  }
}

void Chain::solve_undeformed(const Model& model, InverseMethod method, const ChainSolution* near,
                             ChainSolution& solution) {
  const PoseLoad& prone = poses_[0];
  if (imaged_free_of_load()) {
    solution.X = solution.prone;
    return;
  }
  const std::string way = prone.name + " → undeformed";
  if (method == InverseMethod::newton) {
    load(model, prone);
    Points start;
    if (near != nullptr) start = solution.prone + (near->X - near->prone);
    solution.inverse = solver_.inverse(solution.prone, solution.X, way, near != nullptr ? &start : nullptr);
    return;
  }
  load(model, {.name = prone.name, .gravity = -prone.gravity});
  solution.inverse = solver_.forward(solution.prone, solution.X, way + " (reversed gravity)");
  if (method == InverseMethod::fixed_point) correct_by_fixed_point(model, solution);
}

void Chain::correct_by_fixed_point(const Model& model, ChainSolution& solution) {
  load(model, poses_[0]);
  SolveReport& report = solution.inverse;
  double error = 0;
  for (int correction = 0; correction < max_corrections; ++correction) {
    Points x;
    const SolveReport forward = solver_.forward(solution.X, x, poses_[0].name + " → undeformed (fixed point)");
    report.newton_iterations += forward.newton_iterations;
    report.factorisations += forward.factorisations;
    report.load_steps = forward.load_steps;
    report.residual_share = forward.residual_share;
    report.termination = forward.termination;
    error = (x - solution.prone).rowwise().norm().maxCoeff();
    if (error < correction_tolerance_mm) return;
    solution.X -= x - solution.prone;
  }
  throw NumericalFailure(
      fmt::format("{} → undeformed (fixed point): still {:.3g} mm off after {} corrections (bound {} mm); use "
                  "--inverse newton",
                  poses_[0].name, error, max_corrections, correction_tolerance_mm));
}

ChainSolution solve_chain(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
                          const std::vector<PoseLoad>& poses, InverseMethod method, const SolveOptions& options) {
  Chain chain(mesh, anatomy, model, poses, options);
  check_effects_act(model, scene_of(chain.mechanics(), poses.back().name));
  ChainSolution solution = chain.solve(model, nullptr, method);
  chain.certify(model, solution);
  return solution;
}

double load_number(const meshing::Anatomy& anatomy, const Model& model) {
  return model.breast.density_kg_m3.value * kg_mm3_per_kg_m3 * gravity_mm_s2 * anatomy.mound_height_mm /
         model.breast.young_modulus_kpa.value;
}

}  // namespace supine::simulation
