// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/targets/moves.h"

#include <cmath>

#include "diagnosis/evidence/patchiness.h"
#include "diagnosis/numerical_error.h"
#include "diagnosis/weighted_fit.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

/// 3 rows per point.
Eigen::VectorXd flat(const Points& points) { return Eigen::Map<const Eigen::VectorXd>(points.data(), points.size()); }

Eigen::MatrixXd patches_of(const PoseAt& at, const simulation::Embedding& points, const Patchiness& patchiness) {
  const auto directions = patchy_directions(at.chain, patchiness);
  Eigen::MatrixXd all(3 * points.outside_mm().size(), static_cast<Eigen::Index>(directions.size()));
  const std::vector<simulation::ChainDerivative> moved = at.sensitivities.along(directions);
  for (std::size_t k = 0; k < directions.size(); ++k)
    all.col(static_cast<Eigen::Index>(k)) = flat(points.at(moved[k].poses[0]));
  return all;
}

/// The solution with one pose, that of @p name or else the first, by that name.
simulation::ChainSolution beginning_of(simulation::ChainSolution near, const std::string& name) {
  std::size_t row = 0;
  for (std::size_t p = 0; p < near.poses.size(); ++p)
    if (near.poses[p].name == name) row = p;
  near.poses = {near.poses[row]};
  near.poses[0].name = name;
  return near;
}

simulation::ChainSolution solved(simulation::Chain& chain, const simulation::Model& model,
                                 const simulation::ChainSolution* near) {
  if (near == nullptr) return chain.solve(model);
  const simulation::ChainSolution start = beginning_of(*near, chain.poses()[1].name);
  return chain.solve(model, &start);
}

}  // namespace

PoseAt::PoseAt(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const simulation::PoseLoad& imaged,
               const simulation::PoseLoad& pose, const simulation::Model& model_, const simulation::ChainSolution* near)
    : model(model_),
      chain(mesh, anatomy, model, {imaged, pose}, accurate_enough()),
      solution(solved(chain, model, near)),
      sensitivities(chain, model, solution) {}

double PoseAt::way_mm() const { return diagnosis::way_mm(solution); }

PointMoves moves_of(const PoseAt& at, const simulation::Embedding& points, const calibration::FreeParameters& free,
                    const Eigen::VectorXd& u, const std::vector<Nuisance>& nuisances, const Patchiness& patchiness,
                    const std::vector<Eigen::VectorXd>& forces) {
  const auto moved = [&](const std::string& name) { return flat(points.at(at.sensitivities.of(name).poses[0])); };
  const Eigen::Index rows = 3 * points.outside_mm().size();
  const std::string& pose = at.chain.poses()[1].name;
  PointMoves moves{Eigen::MatrixXd(rows, u.size()),
                   Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(nuisances.size())),
                   patches_of(at, points, patchiness), Eigen::MatrixXd(rows, static_cast<Eigen::Index>(forces.size()))};
  const Eigen::VectorXd unit = free.slope(u);
  for (Eigen::Index i = 0; i < u.size(); ++i)
    moves.parameters.col(i) = unit[i] * moved(free.names()[static_cast<std::size_t>(i)]);
  for (std::size_t k = 0; k < nuisances.size(); ++k) {
    const Nuisance& nuisance = nuisances[k];
    if (!nuisance.pose.empty() && nuisance.pose != pose) continue;
    const bool base = nuisance.effect.empty();
    const std::string name = nuisance.setting();
    const double scale = nuisance.sigma * (base ? simulation::base_setting(at.model, name).value : 1);
    moves.nuisances.col(static_cast<Eigen::Index>(k)) = scale * moved(name);
  }
  const std::vector<Points> by_force = at.sensitivities.moved_by(0, forces);
  for (std::size_t f = 0; f < forces.size(); ++f)
    moves.forces.col(static_cast<Eigen::Index>(f)) = flat(points.at(by_force[f]));
  return moves;
}

}  // namespace supine::diagnosis
