// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/left_out.h"

#include <Eigen/Dense>
#include <algorithm>

#include "calibration/held_out.h"
#include "common/rms.h"

namespace supine::diagnosis {
namespace {

double ln_evidence_of(const ErrorCovariance& errors, const Hypothesis& h, const Eigen::VectorXd& y,
                      const std::vector<int>& clusters) {
  Directions all = h.evidence->directions();
  all.columns = Eigen::MatrixXd(all.columns(clusters, Eigen::all));
  return LinearEvidence(errors, y(clusters), std::move(all)).weigh(h.rows).ln_evidence;
}

/// Block of skin of each cluster.
Eigen::VectorXi blocks_of(const BaseFit& base) {
  const Eigen::VectorXi of_residual = calibration::spatial_blocks(base.fit.residuals);
  Eigen::VectorXi blocks = Eigen::VectorXi::Zero(base.clusters.members.size());
  for (Eigen::Index r = of_residual.size(); r-- > 0;) blocks[base.clusters.of_point[r]] = of_residual[r];
  return blocks;
}

/// What the numbers of a hypothesis are by some clusters alone, as offsets.
Eigen::VectorXd numbers_by(const Hypothesis& h, const Eigen::MatrixXd& sigma, const std::vector<int>& clusters) {
  const Directions& all = h.evidence->directions();
  const Eigen::MatrixXd columns = all.columns(clusters, h.rows);
  const Eigen::VectorXd y = h.evidence->distances()(clusters), sd = all.sd(h.rows), mean = all.mean(h.rows);
  const Eigen::LLT<Eigen::MatrixXd> root(sigma(clusters, clusters));
  const Eigen::MatrixXd weighed = root.solve(columns);
  const Eigen::VectorXd information = sd.cwiseAbs2().cwiseInverse();
  Eigen::MatrixXd a = columns.transpose() * weighed;
  a.diagonal() += information;
  return a.llt().solve(information.cwiseProduct(mean) - weighed.transpose() * y);
}

}  // namespace

double held_out_rms(const BaseFit& base, const Hypothesis& h, const calibration::Residuals& residuals) {
  const Eigen::VectorXi blocks = blocks_of(base);
  const double size = base.size_of(h.weighed);
  const Eigen::MatrixXd sigma = base.errors + size * size * base.kernel;
  Eigen::VectorXd change = Eigen::VectorXd::Zero(blocks.size());  // of the distances of each cluster
  for (int block = 0; block <= blocks.maxCoeff(); ++block) {
    std::vector<int> own, rest;
    for (int c = 0; c < static_cast<int>(blocks.size()); ++c) (blocks[c] == block ? own : rest).push_back(c);
    if (own.empty() || rest.empty()) continue;
    const Eigen::VectorXd numbers = numbers_by(h, sigma, rest);
    change(own) = h.evidence->directions().columns(own, h.rows) * numbers;
  }
  Eigen::VectorXd distance = residuals.distance_mm + base.mean_mm;
  for (Eigen::Index r = 0; r < distance.size(); ++r) distance[r] += change[base.clusters.of_point[r]];
  return rms(distance.head(residuals.skin_rows()));
}

std::vector<LeftOut> left_out_parts(const calibration::MeasuredScene& scene, const BaseFit& base) {
  std::vector<LeftOut> parts;
  Eigen::VectorXi part_of = base.clusters.pose;
  if (scene.measurements.size() > 1) {
    for (const auto* measurement : scene.measurements) parts.push_back({measurement->pose.name, {}});
  } else {
    part_of = blocks_of(base);
    parts.assign(static_cast<std::size_t>(part_of.maxCoeff() + 1), {"a block of skin", {}});
  }
  for (Eigen::Index c = 0; c < part_of.size(); ++c)
    parts[static_cast<std::size_t>(part_of[c])].clusters.push_back(static_cast<int>(c));
  return parts;
}

double left_out_gain(const Hypothesis& first, const Hypothesis& second, const LeftOut& part) {
  std::vector<bool> out(static_cast<std::size_t>(first.ground->errors.rows()), false);
  for (const int c : part.clusters) out[static_cast<std::size_t>(c)] = true;
  std::vector<int> rest;
  for (int c = 0; c < static_cast<int>(out.size()); ++c)
    if (!out[static_cast<std::size_t>(c)]) rest.push_back(c);
  if (rest.empty()) return 0;
  const auto given_rest = [&rest](const Hypothesis& h) {
    const BaseFit& ground = *h.ground;
    const ErrorCovariance errors(ground.errors(rest, rest), ground.kernel(rest, rest), ground.scale_mm, ground.most_mm);
    return h.ln_evidence - ln_evidence_of(errors, h, h.evidence->distances(), rest);
  };
  return given_rest(first) - given_rest(second);
}

double left_out_gain_of(const std::vector<Hypothesis>& hypotheses, int effect, const std::vector<LeftOut>& parts) {
  const auto with = std::find_if(hypotheses.begin(), hypotheses.end(),
                                 [effect](const Hypothesis& h) { return is_part_of({effect}, h.effects); });
  std::vector<int> others = with->effects;
  std::erase(others, effect);
  const Hypothesis* without = nullptr;
  for (const Hypothesis& h : hypotheses) {
    if (h.ground != with->ground || is_part_of({effect}, h.effects)) continue;
    if (h.effects == others) {
      without = &h;
      break;
    }
    if (without == nullptr || h.effects.size() < without->effects.size()) without = &h;
  }
  double gain = 0;
  for (const LeftOut& part : parts)
    if (without != nullptr) gain += left_out_gain(*with, *without, part);
  return gain;
}

}  // namespace supine::diagnosis
