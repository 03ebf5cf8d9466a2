// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/truth.h"

#include "simulation/solve/equilibrium.h"

namespace supine::phantom {

std::vector<TruthPose> truth_poses(bool tilt) {
  std::vector<TruthPose> poses = {{"prone", {0, -1, 0}, {}}, {"supine", {0, 1, 0}, {}}};
  const double half = std::sqrt(0.5);
  if (tilt) poses.push_back({"tilt45", {0, half, -half}, {}});
  return poses;
}

simulation::Model truth_model(const Body& body) {
  simulation::Model model;
  model.breast.law = simulation::BulkLaw::neo_hookean;
  model.breast.young_modulus_kpa.value = body.breast_kpa;
  model.breast.poisson_ratio.value = 0.45;
  model.breast.density_refers_to = simulation::DensityReference::undeformed;
  model.skin.law = simulation::SkinLaw::neo_hookean;
  model.skin.young_modulus_kpa.value = body.skin_kpa;
  return model;
}

void solve_truth(const BodyMesh& body_mesh, const Body& body, const std::vector<Cause>& causes,
                 std::vector<TruthPose>& poses) {
  const simulation::Model model = truth_model(body);
  simulation::Mechanics mechanics(body_mesh.mesh, body_mesh.anatomy, model);
  simulation::SolveOptions options;
  options.step_tolerance_mm = 1e-6;
  options.residual_tolerance = 1e-9;
  simulation::EquilibriumSolver solver(mechanics, options);
  for (TruthPose& pose : poses) {
    const simulation::Scene scene{body_mesh.mesh, body_mesh.anatomy, mechanics.layout(), pose.name};
    auto fields = simulation::values_of(simulation::make_fields(model, scene, pose.gravity));
    for (const Cause& cause : causes) apply_cause(cause, {body, body_mesh.mesh, mechanics.layout(), pose.name}, fields);
    mechanics.set_fields(fields);
    solver.forget();
    solver.forward(body_mesh.mesh.points, pose.x, "undeformed → " + pose.name);
  }
}

}  // namespace supine::phantom
