// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/truth.h"

#include <fmt/format.h>

#include "common/error.h"
#include "simulation/catalogue.h"
#include "simulation/model_fields.h"
#include "simulation/parameters.h"
#include "simulation/solve/equilibrium.h"

namespace supine::phantom {
namespace {

simulation::Model full_model(const Body& body, const std::vector<Cause>& causes, const Nuisances* nuisances) {
  simulation::Model model = truth_model(body);
  if (nuisances != nullptr) nuisances->change(model);
  for (const Cause& cause : causes) {
    if (!cause.by_catalogue) continue;
    simulation::EffectSetting setting = simulation::null_setting(*simulation::find_effect(cause.name));
    for (const auto& [name, value] : cause.values) setting.parameters[name].value = value;
    model.effects.push_back(setting);
  }
  return model;
}

}  // namespace

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
  if (body.real_size) {
    model.contact.kind = simulation::ContactKind::chest;
    model.skin.bending_share = real_size_bending_share;
  }
  return model;
}

Truth::Truth(const BodyMesh& body_mesh, const Body& body, const std::vector<Cause>& causes, const Nuisances* nuisances)
    : body_mesh_(body_mesh),
      body_(body),
      causes_(causes),
      nuisances_(nuisances),
      model_(full_model(body, causes, nuisances)),
      mechanics_(body_mesh.mesh, body_mesh.anatomy, model_) {}

simulation::Fields<double> Truth::fields(const TruthPose& pose) const {
  const simulation::Scene scene{body_mesh_.mesh, body_mesh_.anatomy, mechanics_.layout(), pose.name};
  auto fields = simulation::values_of(simulation::make_fields(model_, scene, pose.gravity));
  const Stage stage{body_, body_mesh_.mesh, mechanics_.layout(), pose.name};
  if (nuisances_ != nullptr) nuisances_->apply(stage, fields);
  for (const Cause& cause : causes_)
    if (!cause.by_catalogue) apply_cause(cause, stage, fields);
  return fields;
}

const simulation::Mechanics& Truth::in(const TruthPose& pose) {
  mechanics_.set_fields(fields(pose));
  return mechanics_;
}

/// From a shape of the pose that other moduli have.
void Truth::follow(simulation::EquilibriumSolver& solver, TruthPose& pose) const {
  if (!solver.forward_from(body_mesh_.mesh.points, pose.x, pose.name))
    throw NumericalFailure(
        fmt::format("{}: no equilibrium beside that of stiffer tissue, at {:.3g} kPa and a skin of {:.3g} kPa",
                    pose.name, body_.breast_kpa, body_.skin_kpa));
}

void Truth::solve(std::vector<TruthPose>& poses, Start start) {
  // Breasts of real size are looked for among moduli that carry none, so a failure may not cost many times a success.
  simulation::SolveOptions options;
  options.step_tolerance_mm = 1e-6;
  options.residual_tolerance = 1e-9;
  if (body_.real_size) options.most_work /= 2;
  simulation::EquilibriumSolver solver(mechanics_, options);
  for (TruthPose& pose : poses) {
    in(pose);
    solver.forget();
    if (start == Start::shapes)
      follow(solver, pose);
    else
      solver.forward(body_mesh_.mesh.points, pose.x, "undeformed → " + pose.name);
  }
}

}  // namespace supine::phantom
