// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/chain.h"

#include <fmt/format.h>

#include "common/error.h"

namespace supine::simulation {
namespace {

constexpr int max_corrections = 60;  // fixed point
constexpr double correction_tolerance_mm = 1e-3;

void check_prone_gravity(const PoseLoad& prone, const meshing::Anatomy& anatomy) {
  const double along = prone.gravity.dot(anatomy.outward);
  if (along > 0) return;
  const Eigen::Vector3d& n = anatomy.outward;
  throw InputError(fmt::format(
      "pose.prone.gravity = [{:.3f}, {:.3f}, {:.3f}] presses the breast into the muscle, whose outward normal is "
      "({:.3f}, {:.3f}, {:.3f}): the angle must be under 90 degrees. A prone breast hangs away from the chest: check "
      "the sign, or case.frame against the frame of the image",
      prone.gravity.x(), prone.gravity.y(), prone.gravity.z(), n.x(), n.y(), n.z()));
}

/// Smallest det F of the final state, corners included. @throws NumericalFailure  naming the inverted cell
double checked_min_det_f(const meshing::TetMesh& mesh, const Points& x, const Points& X, const std::string& what) {
  Eigen::Index cell = 0;
  const double least = cell_det_f(mesh.cells, x, X).minCoeff(&cell);
  if (least > 0) return least;
  Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
  for (int a = 0; a < 4; ++a) centre += 0.25 * x.row(mesh.cells(cell, a));
  throw NumericalFailure(
      fmt::format("{}: cell {} at ({:.1f}, {:.1f}, {:.1f}) mm is turned inside out at a corner (det F = {:.3g}); make "
                  "the mesh finer "
                  "there or raise breast.young_modulus_kpa",
                  what, cell, centre.x(), centre.y(), centre.z(), least));
}

/// Loads and solves on one mesh and one model; owns what is reused between poses.
class Chain {
 public:
  Chain(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model, const SolveOptions& options)
      : model_(model), mechanics_(mesh, anatomy, model), solver_(mechanics_, options) {}

  void check_effects(const std::string& pose) const {
    check_effects_act(model_, Scene{mechanics_.mesh(), mechanics_.anatomy(), mechanics_.layout(), pose});
  }

  void load(const std::string& pose, const Eigen::Vector3d& gravity) {
    const Scene scene{mechanics_.mesh(), mechanics_.anatomy(), mechanics_.layout(), pose};
    mechanics_.set_fields(values_of(make_fields(model_, scene, gravity)));
  }

  SolveReport undeformed(const PoseLoad& prone, InverseMethod method, Points& X) {
    const Points& imaged = mechanics_.mesh().points;
    if (method == InverseMethod::newton) {
      load(prone.name, prone.gravity);
      return solver_.inverse(imaged, X, "prone → undeformed");
    }
    load(prone.name, -prone.gravity);
    SolveReport report = solver_.forward(imaged, X, "prone → undeformed (reversed gravity)");
    return method == InverseMethod::reversed_gravity ? report : corrected(prone, report, X);
  }

  PoseSolution pose(const PoseLoad& pose, const Points& X) {
    load(pose.name, pose.gravity);
    PoseSolution solution{pose.name, {}, {}};
    solution.report = solver_.forward(X, solution.x, "undeformed → " + pose.name);
    return solution;
  }

 private:
  SolveReport corrected(const PoseLoad& prone, SolveReport report, Points& X) {
    const Points& imaged = mechanics_.mesh().points;
    load(prone.name, prone.gravity);
    double error = 0;
    for (int correction = 0; correction < max_corrections; ++correction) {
      Points x;
      const SolveReport forward = solver_.forward(X, x, "prone → undeformed (fixed point)");
      report.newton_iterations += forward.newton_iterations;
      report.factorisations += forward.factorisations;
      report.load_steps = forward.load_steps;
      report.residual_share = forward.residual_share;
      error = (x - imaged).rowwise().norm().maxCoeff();
      if (error < correction_tolerance_mm) return report;
      X -= x - imaged;
    }
    throw NumericalFailure(
        fmt::format("prone → undeformed (fixed point): still {:.3g} mm off after {} corrections (bound {} mm); use "
                    "--inverse newton",
                    error, max_corrections, correction_tolerance_mm));
  }

  const Model& model_;
  Mechanics mechanics_;
  EquilibriumSolver solver_;
};

}  // namespace

ChainSolution solve_chain(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
                          const std::vector<PoseLoad>& poses, InverseMethod method, const SolveOptions& options) {
  const PoseLoad& prone = poses.at(0);
  check_prone_gravity(prone, anatomy);
  Chain chain(mesh, anatomy, model, options);
  chain.check_effects(poses.size() > 1 ? poses.back().name : prone.name);
  ChainSolution solution;
  solution.inverse = chain.undeformed(prone, method, solution.X);
  solution.inverse.min_det_f = checked_min_det_f(mesh, mesh.points, solution.X, "undeformed");
  solution.round_trip = chain.pose(prone, solution.X);
  const Eigen::VectorXd error = (solution.round_trip.x - mesh.points).rowwise().norm();
  solution.round_trip_max_mm = error.maxCoeff();
  solution.round_trip_rms_mm = std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
  for (std::size_t p = 1; p < poses.size(); ++p) {
    solution.poses.push_back(chain.pose(poses[p], solution.X));
    PoseSolution& pose = solution.poses.back();
    pose.report.min_det_f = checked_min_det_f(mesh, pose.x, solution.X, pose.name);
  }
  return solution;
}

double load_number(const meshing::Anatomy& anatomy, const Model& model) {
  return model.breast.density_kg_m3.value * 1e-9 * gravity_mm_s2 * anatomy.mound_height_mm /
         model.breast.young_modulus_kpa.value;
}

}  // namespace supine::simulation
