// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/chain.h"

#include <fmt/format.h>
#include <omp.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/side_by_side.h"
#include "simulation/model_fields.h"
#include "simulation/solve/folds.h"
#include "simulation/solve/overlap.h"
#include "simulation/solve/pushed_forward.h"

namespace supine::simulation {
namespace {

constexpr int max_corrections = 60;               // of the fixed point: linear convergence, slow where tissue is soft
constexpr double correction_tolerance_mm = 1e-3;  // of the fixed point: far under what a scanner measures
constexpr double second_shape_bound_mm = 1e-3;    // two balanced shapes this close are one
constexpr double kg_mm3_per_kg_m3 = 1e-9;

/// Dofs. Beyond this a factor takes a gigabyte and more, and the loops over elements and the products fill all threads.
constexpr Eigen::Index largest_side_by_side = 60'000;

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

/// What carries more at the same moduli and is not in the model yet.
std::string setting_advice(const Model& model) {
  std::string advice;
  if (model.skin.bending_share == 0) advice += ". skin.bending_share = 3 lets creasing skin resist bending";
  if (model.breast.law == BulkLaw::corotational || model.breast.law == BulkLaw::corotational_qr)
    advice += ". breast.law = \"neo_hookean\" stiffens in compression";
  return advice;
}

Scene scene_of(const Mechanics& mechanics, const std::string& pose) {
  return {.mesh = mechanics.mesh(), .anatomy = mechanics.anatomy(), .layout = mechanics.layout(), .pose = pose};
}

}  // namespace

Chain::Chain(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
             std::vector<PoseLoad> poses, SolveOptions options)
    : poses_(std::move(poses)), options_(std::move(options)) {
  const bool apart = omp_get_max_threads() > 1 && mesh.points.size() <= largest_side_by_side;
  workplaces_.resize(apart ? poses_.size() : 1);
  workplaces_[0] = std::make_unique<Workplace>(mesh, anatomy, model, nullptr, options_);
  check_imaged_pose(poses_.at(0), anatomy);
  for (const PoseLoad& pose : poses_) check_supine_gravity(pose, anatomy);
}

Chain::Workplace& Chain::workplace(std::size_t pose, const Model& model) {
  if (workplaces_.size() == 1) return *workplaces_[0];
  std::unique_ptr<Workplace>& place = workplaces_[pose];
  if (!place)
    place = std::make_unique<Workplace>(mechanics().mesh(), mechanics().anatomy(), model, &mechanics(), options_);
  return *place;
}

/// Calls @p work of every pose from @p first on: side by side where each has a workplace.
void Chain::each_pose(std::size_t first, const std::function<void(std::size_t pose)>& work) const {
  std::vector<std::function<void()>> works;
  for (std::size_t p = first; p < poses_.size(); ++p) works.emplace_back([&work, p] { work(p); });
  if (workplaces_.size() > 1) return side_by_side(works);
  for (const auto& one : works) one();
}

Fields<Dual> Chain::fields(const Model& model, const PoseLoad& pose, const std::string& varied) const {
  return make_fields(model, scene_of(mechanics(), pose.name), pose.gravity, varied);
}

void Chain::load(Workplace& place, const Model& model, const PoseLoad& pose) const {
  place.mechanics.set_fields(values_of(fields(model, pose)));
}

ChainSolution Chain::solve(const Model& model, const ChainSolution* near, InverseMethod method) {
  try {
    return solve_all(model, near, method);
  } catch (const NoEquilibrium& failure) {
    throw NoEquilibrium(failure.what() + setting_advice(model) + modulus_advice(model, failure.load()), failure.load());
  }
}

ChainSolution Chain::solve_all(const Model& model, const ChainSolution* near, InverseMethod method) {
  const meshing::TetMesh& mesh = mechanics().mesh();
  ChainSolution solution;
  const Eigen::VectorXd offset = values_of(fields(model, poses_[0])).imaged_offset;
  solution.prone = mesh.points + Eigen::Map<const Points>(offset.data(), mesh.points.rows(), 3);
  solution.dearest_solve =
      within_limit(workplaces_[0]->solver, [&] { solve_undeformed(model, method, near, solution); });
  check_cells(mesh, solution.prone, solution.X, "undeformed", solution.inverse);
  note_folds(mesh, solution.X, "undeformed", solution.inverse, solution.warnings);
  std::vector<PoseSolution> poses(poses_.size());
  std::vector<int> work(poses_.size());
  each_pose(1, [&](std::size_t p) { poses[p] = solve_pose(model, p, near, solution, work[p]); });
  for (std::size_t p = 1; p < poses_.size(); ++p) {
    note_folds(mesh, poses[p].x, poses[p].name, poses[p].report, solution.warnings);
    solution.dearest_solve = std::max(solution.dearest_solve, work[p]);
    solution.poses.push_back(std::move(poses[p]));
  }
  return solution;
}

/// @param work  out: what it cost
PoseSolution Chain::solve_pose(const Model& model, std::size_t pose, const ChainSolution* near,
                               const ChainSolution& solution, int& work) {
  const meshing::TetMesh& mesh = mechanics().mesh();
  PoseSolution found{.name = poses_[pose].name, .x = {}, .report = {}};
  Points start;
  if (near != nullptr) start = pushed_forward(mesh.cells, near->poses[pose - 1].x, near->X, solution.X);
  Workplace& place = workplace(pose, model);
  work = within_limit(place.solver, [&] {
    load(place, model, poses_[pose]);
    found.report = place.solver.forward(solution.X, found.x, "undeformed → " + poses_[pose].name,
                                        near != nullptr ? &start : nullptr);
  });
  check_cells(mesh, found.x, solution.X, found.name, found.report);
  return found;
}

/// One solve of a chain, no dearer than each may be, from nothing that an earlier one has left behind.
/// @return what it cost, as EquilibriumSolver::work()
int Chain::within_limit(EquilibriumSolver& solver, const std::function<void()>& solve) const {
  const int before = solver.work();
  solver.forget();
  solver.limit_work(most_of_each_);
  solve();
  return solver.work() - before;
}

void Chain::certify(const Model& model, ChainSolution& solution) {
  Workplace& place = *workplaces_[0];
  place.solver.forget();
  place.solver.limit_work(most_of_each_);
  look_for_contact(model, solution);
  solution.round_trip.name = poses_[0].name;
  if (imaged_free_of_load()) {
    solution.round_trip.x = solution.prone;
    if (!place.mechanics.has_energy()) look_for_second_shapes(model, solution);
    return;
  }
  load(place, model, poses_[0]);
  solution.round_trip.report =
      place.solver.forward(solution.X, solution.round_trip.x, "undeformed → " + poses_[0].name);
  const Eigen::VectorXd error = (solution.round_trip.x - solution.prone).rowwise().norm();
  solution.round_trip_max_mm = error.maxCoeff();
  solution.round_trip_rms_mm = std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
  if (!place.mechanics.has_energy()) look_for_second_shapes(model, solution);
}

void Chain::look_for_contact(const Model& model, ChainSolution& solution) {
  const meshing::TetMesh& mesh = mechanics().mesh();
  const SkinContactTerm* contact = mechanics().contact();
  if (contact != nullptr) {
    if (!imaged_free_of_load()) note_left_out(contact->left_out_imaged(), poses_[0].name, solution.warnings);
    note_left_out(contact->left_out(solution.X), free_of_load, solution.warnings);
  }
  const ChestContact* on_chest = mechanics().chest_contact();
  if (on_chest != nullptr) {
    if (!imaged_free_of_load()) note_left_on_chest(on_chest->left_out_imaged(), poses_[0].name, solution.warnings);
    note_left_on_chest(on_chest->left_out(solution.X), free_of_load, solution.warnings);
  }
  const Indices skin = mesh.faces(mechanics().layout().skin.faces, Eigen::all);
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
  const std::optional<meshing::ChestBeside> chest = meshing::chest_beside(mechanics().mesh(), mechanics().anatomy());
  if (!chest) return;
  for (const PoseSolution& pose : solution.poses) {
    const std::string warning = in_chest_warning(pose.name, find_in_chest(*chest, skin, pose.x), model.contact);
    if (!warning.empty()) solution.warnings.push_back(warning);
  }
}

void Chain::look_for_second_shapes(const Model& model, ChainSolution& solution) {
  Workplace& place = *workplaces_[0];
  for (std::size_t p = 1; p < poses_.size(); ++p) {
    PoseSolution& pose = solution.poses[p - 1];
    load(place, model, poses_[p]);
    Points other;
    try {
      place.solver.forward(solution.X, other, poses_[0].name + " → " + pose.name, &solution.prone);
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
  Workplace& place = *workplaces_[0];
  if (imaged_free_of_load()) {
    solution.X = solution.prone;
    return;
  }
  const std::string way = prone.name + " → undeformed";
  if (method == InverseMethod::newton) {
    load(place, model, prone);
    Points start;
    if (near != nullptr) start = solution.prone + (near->X - near->prone);
    solution.inverse = place.solver.inverse(solution.prone, solution.X, way, near != nullptr ? &start : nullptr);
    return;
  }
  load(place, model, {.name = prone.name, .gravity = -prone.gravity});
  solution.inverse = place.solver.forward(solution.prone, solution.X, way + " (reversed gravity)");
  if (method == InverseMethod::fixed_point) correct_by_fixed_point(model, solution);
}

void Chain::correct_by_fixed_point(const Model& model, ChainSolution& solution) {
  Workplace& place = *workplaces_[0];
  load(place, model, poses_[0]);
  SolveReport& report = solution.inverse;
  double error = 0;
  for (int correction = 0; correction < max_corrections; ++correction) {
    Points x;
    const SolveReport forward = place.solver.forward(solution.X, x, poses_[0].name + " → undeformed (fixed point)");
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
