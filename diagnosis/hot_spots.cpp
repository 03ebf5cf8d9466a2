// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/hot_spots.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace supine::diagnosis {
namespace {

constexpr double neighbour_share = 0.25;  // six of them count for more than the node itself
constexpr int smoothing_rounds = 1;

/// Sums of weights and weighted distances by node, and of squares for the standard error.
struct Sums {
  Eigen::VectorXd weight, value, variance;
};

/// Every node takes a share of what its neighbours have: about an edge wider per round.
Sums spread(const Sums& sums, const Triangles& triangles) {
  Sums wider = sums;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = triangles(t, k), b = triangles(t, (k + 1) % 3);
      // Each inner edge is seen from both sides, so once per direction.
      wider.weight[a] += neighbour_share * sums.weight[b];
      wider.value[a] += neighbour_share * sums.value[b];
      wider.variance[a] += neighbour_share * neighbour_share * sums.variance[b];
    }
  return wider;
}

/// Triangles whose corners are all hot to the same side, in connected pieces.
class Pieces {
 public:
  Pieces(const Triangles& triangles, const std::vector<int>& side) : parent_(side.size()) {
    std::iota(parent_.begin(), parent_.end(), 0);
    for (Eigen::Index t = 0; t < triangles.rows(); ++t)
      for (int k = 0; k < 3; ++k) {
        const int a = triangles(t, k), b = triangles(t, (k + 1) % 3);
        const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
        if (side[i] != 0 && side[i] == side[j]) join(a, b);
      }
  }
  int root(int a) const {
    while (parent_[static_cast<std::size_t>(a)] != a) a = parent_[static_cast<std::size_t>(a)];
    return a;
  }

 private:
  void join(int a, int b) {
    const int i = root(a), j = root(b);
    parent_[static_cast<std::size_t>(std::max(i, j))] = std::min(i, j);
  }
  std::vector<int> parent_;
};

struct Gathered {
  double area = 0, sum = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  std::map<int, double> by_area;
};

std::string largest_area(const Gathered& piece, const calibration::SkinAreas& areas) {
  if (areas.names.empty()) return {};
  const auto most = std::max_element(piece.by_area.begin(), piece.by_area.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  return most->first < 0 ? std::string() : areas.names[static_cast<std::size_t>(most->first)];
}

}  // namespace

SkinError skin_error(const calibration::ModelSkin& skin, const calibration::Residuals& residuals,
                     const calibration::Prediction& prediction, std::size_t pose) {
  const Eigen::Index nodes = skin.distance().points().rows();
  Sums sums{Eigen::VectorXd::Zero(nodes), Eigen::VectorXd::Zero(nodes), Eigen::VectorXd::Zero(nodes)};
  const auto& closest = prediction.poses[pose].distances.closest;
  for (Eigen::Index r = 0; r < residuals.skin_rows(); ++r) {
    if (residuals.pose[r] != static_cast<int>(pose)) continue;
    const int point = residuals.point[r];
    for (Eigen::Index k = 0; k < closest.node.cols(); ++k) {
      const double w = std::max(0.0, closest.weight(point, k));  // a mean is meant: no point counts against it
      const int node = closest.node(point, k);
      sums.weight[node] += w;
      sums.value[node] += w * residuals.distance_mm[r];
      sums.variance[node] += w * w * residuals.sigma_mm[r] * residuals.sigma_mm[r];
    }
  }
  for (int round = 0; round < smoothing_rounds; ++round) sums = spread(sums, skin.triangles());
  SkinError error;
  const double none = std::numeric_limits<double>::quiet_NaN();
  error.mean_mm = (sums.weight.array() > 0).select(sums.value.array() / sums.weight.array().max(1e-300), none);
  error.error_mm =
      (sums.weight.array() > 0).select(sums.variance.array().sqrt() / sums.weight.array().max(1e-300), none);
  return error;
}

std::vector<HotSpot> find_hot_spots(const calibration::ModelSkin& skin, const SkinError& error,
                                    const calibration::SkinAreas& areas, const std::string& pose,
                                    const HotSpotRules& rules) {
  std::vector<int> side(static_cast<std::size_t>(error.mean_mm.size()), 0);
  for (Eigen::Index i = 0; i < error.mean_mm.size(); ++i)
    if (std::abs(error.mean_mm[i]) > std::max(rules.least_mm, rules.noise_factor * error.error_mm[i]))
      side[static_cast<std::size_t>(i)] = error.mean_mm[i] > 0 ? 1 : -1;
  const Triangles& triangles = skin.triangles();
  const Points& x = skin.distance().points();
  const Pieces pieces(triangles, side);
  std::map<int, Gathered> gathered;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const Eigen::Vector3d a = x.row(triangles(t, 0)), b = x.row(triangles(t, 1)), c = x.row(triangles(t, 2));
    const double third = (b - a).cross(c - a).norm() / 6;
    for (int k = 0; k < 3; ++k) {
      const int node = triangles(t, k);
      if (side[static_cast<std::size_t>(node)] == 0) continue;
      Gathered& piece = gathered[pieces.root(node)];
      piece.area += third;
      piece.sum += third * error.mean_mm[node];
      piece.centre += third * x.row(node).transpose();
      piece.by_area[areas.names.empty() ? 0 : areas.of_point[node]] += third;
    }
  }
  std::vector<HotSpot> spots;
  for (const auto& [root, piece] : gathered)
    if (piece.area >= 100 * rules.least_cm2)
      spots.push_back(
          {largest_area(piece, areas), pose, piece.area / 100, piece.sum / piece.area, piece.centre / piece.area});
  std::stable_sort(spots.begin(), spots.end(), [](const HotSpot& a, const HotSpot& b) {
    return a.area_cm2 * std::abs(a.mean_signed_mm) > b.area_cm2 * std::abs(b.mean_signed_mm);
  });
  return spots;
}

}  // namespace supine::diagnosis
