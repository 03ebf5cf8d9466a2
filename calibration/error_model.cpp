// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/error_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

namespace supine::calibration {
namespace {

constexpr Eigen::Index most_clusters = 450;  // of the likelihood: a dense Cholesky for each point of the grid
constexpr double cluster_radius_mm = 4;
constexpr Eigen::Index most_in_sums = 6000;  // of double sums
constexpr double lengths_mm[] = {5, 8, 12, 18, 27, 40, 60};
constexpr double spreads[] = {0.1, 0.17, 0.3, 0.45, 0.7, 1, 1.5, 2.5, 4};  // over the nugget

std::vector<int> every(const std::vector<int>& rows, Eigen::Index most) {
  const auto count = static_cast<Eigen::Index>(rows.size());
  const Eigen::Index kept = std::min(count, most);
  std::vector<int> some(static_cast<std::size_t>(kept));
  for (Eigen::Index i = 0; i < kept; ++i)
    some[static_cast<std::size_t>(i)] = rows[static_cast<std::size_t>(i * count / kept)];
  return some;
}

double distance_mm(const Residuals& r, int i, int j) { return (r.place.row(i) - r.place.row(j)).norm(); }

struct Candidate {
  double length_mm, ratio;  // spread over nugget
  double log_likelihood = -std::numeric_limits<double>::infinity();
  double nugget_mm = 0;
};

/// Restricted log-likelihood of cluster means with the overall scale at its best value.
void rate(const Clusters& clusters, const Eigen::MatrixXd& x, const Eigen::VectorXd& y, Candidate& candidate) {
  const Eigen::Index n = y.size();
  Eigen::MatrixXd sigma = Eigen::MatrixXd::Zero(n, n);
  sigma.diagonal() = clusters.members.cwiseInverse();
  const double variance = candidate.ratio * candidate.ratio;
  for (Eigen::Index i = 0; variance > 0 && i < n; ++i)
    for (Eigen::Index j = 0; j <= i; ++j)
      if (clusters.pose[i] == clusters.pose[j])
        sigma(i, j) +=
            variance * std::exp(-(clusters.place.row(i) - clusters.place.row(j)).norm() / candidate.length_mm);
  const Eigen::LLT<Eigen::MatrixXd> root(sigma);  // reads the lower half
  if (root.info() != Eigen::Success) return;
  const Eigen::VectorXd white = root.matrixL().solve(y);
  const Eigen::MatrixXd design = root.matrixL().solve(x);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(design);
  const Eigen::VectorXd left = white - design * qr.solve(white);
  const auto freedom = static_cast<double>(n - qr.rank());
  double log_det = 2 * root.matrixLLT().diagonal().array().log().sum();
  for (Eigen::Index k = 0; k < qr.rank(); ++k) log_det += 2 * std::log(std::abs(qr.matrixR()(k, k)));
  candidate.nugget_mm = std::sqrt(left.squaredNorm() / freedom);
  candidate.log_likelihood = -0.5 * log_det - freedom * std::log(candidate.nugget_mm);
}

/// The likelihood on the grid, each point of it rated once.
class Ratings {
 public:
  Ratings(const Clusters& clusters, const Eigen::MatrixXd& x, const Eigen::VectorXd& y)
      : clusters_(clusters), x_(x), y_(y) {}

  /// Takes over the most likely of @p trials if it is better than the best so far.
  void improve(std::vector<Candidate> trials, Candidate& best) {
    std::erase_if(trials, [this](const Candidate& c) { return !known_.emplace(c.length_mm, c.ratio).second; });
#pragma omp parallel for schedule(dynamic)
    for (std::size_t c = 0; c < trials.size(); ++c) rate(clusters_, x_, y_, trials[c]);
    for (const Candidate& trial : trials)
      if (trial.log_likelihood > best.log_likelihood + 1e-9) best = trial;
  }

 private:
  const Clusters& clusters_;
  const Eigen::MatrixXd& x_;
  const Eigen::VectorXd& y_;
  std::set<std::pair<double, double>> known_;
};

/// Each point joins the first centre within the radius, or becomes one; in the order of place. Rows of landmarks become
/// one each, after the points.
Clusters clusters_of(const Residuals& residuals, const std::vector<int>& order, double radius_mm) {
  Clusters clusters;
  clusters.of_point.resize(residuals.size());
  std::vector<int> centres;
  for (const int row : order) {
    std::size_t c = 0;
    while (c < centres.size() &&
           (residuals.pose[centres[c]] != residuals.pose[row] || distance_mm(residuals, centres[c], row) > radius_mm))
      ++c;
    if (c == centres.size()) centres.push_back(row);
    clusters.of_point[row] = static_cast<int>(c);
  }
  for (Eigen::Index row = residuals.skin_rows(); row < residuals.size(); ++row) {
    clusters.of_point[row] = static_cast<int>(centres.size());
    centres.push_back(static_cast<int>(row));
  }
  const auto count = static_cast<Eigen::Index>(centres.size());
  clusters.members = Eigen::VectorXd::Zero(count);
  for (const int c : clusters.of_point) ++clusters.members[c];
  clusters.pose = residuals.pose(centres);
  clusters.kind.resize(count);
  for (Eigen::Index c = 0; c < count; ++c) clusters.kind[c] = residuals.kind(centres[static_cast<std::size_t>(c)]);
  clusters.place = clusters.means(residuals.on_skin);
  return clusters;
}

}  // namespace

std::vector<int> order_by_place(const Residuals& residuals) {
  std::vector<int> rows(static_cast<std::size_t>(residuals.size()));
  std::iota(rows.begin(), rows.end(), 0);
  std::sort(rows.begin(), rows.end(), [&residuals](int a, int b) {
    if (residuals.pose[a] != residuals.pose[b]) return residuals.pose[a] < residuals.pose[b];
    for (int k = 0; k < 3; ++k)
      if (residuals.place(a, k) != residuals.place(b, k)) return residuals.place(a, k) < residuals.place(b, k);
    return a < b;
  });
  return rows;
}

double ErrorModel::effective_count(const Residuals& residuals) const {
  const std::vector<int> rows = every(order_by_place(residuals), most_in_sums);
  const auto n = static_cast<Eigen::Index>(rows.size());
  const double shared = spread_mm * spread_mm, total = shared + nugget_mm * nugget_mm;
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(n);
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const int a = rows[static_cast<std::size_t>(i)], b = rows[static_cast<std::size_t>(j)];
      if (i == j || residuals.pose[a] != residuals.pose[b]) continue;
      sums[i] += std::pow(shared * std::exp(-distance_mm(residuals, a, b) / length_mm), 2);
    }
  const double all = static_cast<double>(residuals.size()), thinning = all / static_cast<double>(n);
  return std::pow(all * total, 2) / (all * total * total + sums.sum() * thinning * thinning);
}

Eigen::MatrixXd Clusters::means(const Eigen::MatrixXd& columns) const {
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(members.size(), columns.cols());
  for (Eigen::Index i = 0; i < columns.rows(); ++i) sums.row(of_point[i]) += columns.row(i);
  return members.cwiseInverse().asDiagonal() * sums;
}

Clusters cluster_points(const Residuals& residuals, Eigen::Index most) {
  std::vector<int> order = order_by_place(residuals);
  std::erase_if(order, [&residuals](int row) { return residuals.is_landmark(row); });
  double radius_mm = cluster_radius_mm;
  Clusters clusters = clusters_of(residuals, order, radius_mm);
  while (clusters.members.size() - residuals.landmark_rows > most)
    clusters = clusters_of(residuals, order, radius_mm *= 1.2);
  return clusters;
}

ErrorModel fit_error_model(const Residuals& residuals, const Eigen::MatrixXd& slope) {
  const Clusters clusters = cluster_points(residuals, most_clusters);
  const Eigen::MatrixXd x = clusters.means(slope);
  const Eigen::VectorXd y = clusters.means(residuals.distance_mm);
  // Along spreads, along lengths, and again until the best stays: the likelihood has one hill.
  Candidate best{lengths_mm[0], 0};
  rate(clusters, x, y, best);
  best.length_mm = 18;
  Ratings ratings(clusters, x, y);
  for (double before = -std::numeric_limits<double>::infinity(); best.log_likelihood > before;) {
    before = best.log_likelihood;
    std::vector<Candidate> row, column;
    for (const double spread : spreads) row.push_back({best.length_mm, spread});
    ratings.improve(row, best);
    for (const double length : lengths_mm) column.push_back({length, best.ratio});
    if (best.ratio > 0) ratings.improve(column, best);
  }
  return {best.nugget_mm, best.ratio * best.nugget_mm, best.length_mm};
}

Eigen::MatrixXd weighted_product(const ErrorModel& model, const Residuals& residuals, const Eigen::MatrixXd& a,
                                 const Eigen::MatrixXd& b) {
  const Eigen::MatrixXd single = model.nugget_mm * model.nugget_mm * (a.transpose() * b);
  if (model.spread_mm == 0) return single;
  const std::vector<int> rows = every(order_by_place(residuals), most_in_sums);
  const auto n = static_cast<Eigen::Index>(rows.size());
  const double thinning = static_cast<double>(residuals.size()) / static_cast<double>(n);
  Eigen::MatrixXd smoothed = Eigen::MatrixXd::Zero(n, b.cols());
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const int p = rows[static_cast<std::size_t>(i)], q = rows[static_cast<std::size_t>(j)];
      if (residuals.pose[p] != residuals.pose[q]) continue;
      smoothed.row(i) += std::exp(-distance_mm(residuals, p, q) / model.length_mm) * b.row(q);
    }
  const double scale = model.spread_mm * model.spread_mm * thinning * thinning;
  return single + scale * (a(rows, Eigen::all).transpose() * smoothed);
}

}  // namespace supine::calibration
