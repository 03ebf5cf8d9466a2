// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/targets/draws.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>

#include "common/error.h"
#include "common/statistics.h"
#include "diagnosis/targets/moves.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

MatrixXd root_of(const MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(covariance);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

simulation::Model model_at(const TargetQuestion& question, const calibration::FreeParameters& free,
                           const ParameterPart& part, const VectorXd& offset) {
  std::vector<Nuisance> nuisances = part.nuisances;
  for (std::size_t k = 0; k < nuisances.size(); ++k)
    nuisances[k].value += offset[part.u.size() + static_cast<Index>(k)];
  simulation::Model model = with_nuisances(free.model(free.clamped(part.u + offset.head(part.u.size()))), nuisances,
                                           {question.prone.name, question.pose.name});
  const Index before = part.u.size() + static_cast<Index>(nuisances.size());
  for (std::size_t k = 0; k < part.effects.size(); ++k) {
    const double by = offset[before + static_cast<Index>(k)];
    if (by == 0) continue;
    const EffectNumber& number = part.effects[k];
    if (model.effects.empty() || model.effects.back().name != number.effect)
      model.effects.push_back(simulation::null_setting(*simulation::find_effect(number.effect)));
    const simulation::Parameter& row = *simulation::find_parameter(number.parameter);
    model.effects.back().parameters[row.name].value = std::clamp(number.null + by, row.lower, row.upper);
  }
  return model;
}

/// Draws offsets: a set of what is there, then its numbers.
class Drawer {
 public:
  explicit Drawer(const ParameterPart& part) : part_(part) {
    std::vector<double> weights;
    for (const DirectionsOfSet& set : part.parts) {
      weights.push_back(set.probability);
      roots_.push_back(root_of(set.covariance));
    }
    which_ = std::discrete_distribution<std::size_t>(weights.begin(), weights.end());
  }

  VectorXd draw(std::mt19937_64& generator) {
    std::normal_distribution<double> normal;
    const std::size_t k = which_(generator);
    VectorXd standard(roots_[k].cols());
    for (double& number : standard) number = normal(generator);
    VectorXd offset = VectorXd::Zero(part_.mean.size());
    offset(part_.parts[k].rows) = part_.parts[k].mean + roots_[k] * standard;
    const Index before = offset.size() - static_cast<Index>(part_.effects.size());
    for (std::size_t e = 0; e < part_.effects.size(); ++e) {
      double& number = offset[before + static_cast<Index>(e)];
      if (part_.effects[e].least && number != 0) number = std::max(number, *part_.effects[e].least);
    }
    return offset;
  }

 private:
  const ParameterPart& part_;
  std::vector<MatrixXd> roots_;
  std::discrete_distribution<std::size_t> which_;
};

/// Places of one point over the draws, against what the derivatives say.
void summarise(Index point, const std::vector<VectorXd>& drawn, const VectorXd& middle, const MatrixXd& covariance,
               DrawnPlaces& result) {
  const Matrix3d linear = covariance.block<3, 3>(3 * point, 3 * point);
  const auto factor = linear.ldlt();
  const double bound = chi_squared_quantile(3, 0.95);
  Vector3d mean = Vector3d::Zero();
  int inside = 0;
  for (const VectorXd& places : drawn) {
    const Vector3d off = places.segment<3>(3 * point) - middle.segment<3>(3 * point);
    mean += off;
    inside += off.dot(factor.solve(off)) <= bound;
  }
  const auto count = static_cast<double>(drawn.size());
  mean /= count;
  double square = 0;
  for (const VectorXd& places : drawn)
    square += (places.segment<3>(3 * point) - middle.segment<3>(3 * point) - mean).squaredNorm();
  result.linear_sd_mm[point] = std::sqrt(linear.trace() / 3);
  result.drawn_sd_mm[point] = std::sqrt(square / (3 * (count - 1)));
  result.mean_off_mm[point] = mean.norm();
  result.inside[point] = inside / count;
}

}  // namespace

DrawnPlaces draw_places(const TargetQuestion& question, const calibration::FreeParameters& free,
                        const TargetRegions& regions, const simulation::ChainSolution* near, int draws, unsigned seed,
                        const std::function<void(int)>& progress) {
  const ParameterPart& part = regions.parameters;
  PoseAt at(*question.mesh, *question.anatomy, question.prone, question.pose,
            model_at(question, free, part, VectorXd::Zero(part.mean.size())), near);
  const simulation::Embedding points(*question.mesh, question.imaged);
  const auto flat = [&points](const Points& x) {
    const Points places = points.at(x);
    return VectorXd(Eigen::Map<const VectorXd>(places.data(), places.size()));
  };
  Drawer drawer(part);
  std::mt19937_64 generator(seed);
  std::vector<VectorXd> drawn;
  DrawnPlaces result;
  for (result.draws = 0; result.draws < draws; ++result.draws) {
    if (progress) progress(result.draws);
    const VectorXd offset = drawer.draw(generator);
    try {
      drawn.push_back(flat(at.chain.solve(model_at(question, free, part, offset), &at.solution).poses[0].x));
    } catch (const NumericalFailure&) {
      ++result.failed;
    }
  }
  if (drawn.size() < 2) throw NumericalFailure("none of the draws has an equilibrium; is the model near its end?");
  const VectorXd middle = flat(at.x()) + part.moves * part.mean;
  const MatrixXd covariance = part.moves * part.covariance * part.moves.transpose();
  const Index count = question.imaged.rows();
  for (VectorXd* column : {&result.linear_sd_mm, &result.drawn_sd_mm, &result.mean_off_mm, &result.inside})
    column->resize(count);
  for (Index p = 0; p < count; ++p) summarise(p, drawn, middle, covariance, result);
  return result;
}

}  // namespace supine::diagnosis
