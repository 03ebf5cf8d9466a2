// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/compare.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"

namespace supine::calibration {
namespace {

double mae_of_covered(const ModelToScan& to_scan) {
  double sum = 0;
  for (Eigen::Index i = 0; i < to_scan.covered.size(); ++i) {
    if (to_scan.covered[i]) sum += std::abs(to_scan.to_scan.distance_mm[i]);
  }
  return sum / static_cast<double>(to_scan.covered.count());
}

// The area of the corner that weighs most.
int area_at(const ClosestPoints& closest, Eigen::Index i, const SkinAreas& areas) {
  int corner = 0;
  closest.weight.row(i).maxCoeff(&corner);
  return areas.of_point[closest.node(i, corner)];
}

// A third of each triangle to each corner, by mesh point.
Eigen::VectorXd point_areas_mm2(const ModelSkin& model) {
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(model.nodes().back() + 1);
  for (Eigen::Index t = 0; t < model.triangles().rows(); ++t) {
    for (const int node : model.triangles().row(t)) areas[node] += model.distance().areas_mm2()[t] / 3;
  }
  return areas;
}

// By area, not by points: meshes may be finer at the skin's end, which no scan covers.
double covered_share(const ModelSkin& model, const ModelToScan& to_scan) {
  const Eigen::VectorXd areas = point_areas_mm2(model);
  double covered = 0;
  for (Eigen::Index i = 0; i < to_scan.covered.size(); ++i) {
    if (to_scan.covered[i]) covered += areas[model.nodes()[i]];
  }
  return covered / areas.sum();
}

Eigen::VectorXd area_sizes_mm2(const ModelSkin& model, const SkinAreas& areas) {
  const Eigen::VectorXd points = point_areas_mm2(model);
  Eigen::VectorXd sizes = Eigen::VectorXd::Zero(areas.names.size());
  for (const int node : model.nodes()) sizes[areas.of_point[node]] += points[node];
  return sizes;
}

std::vector<AreaError> area_table(const ModelSkin& model, const SkinAreas& areas, const Comparison& comparison) {
  std::vector<std::vector<double>> distances(areas.names.size());
  for (Eigen::Index i = 0; i < comparison.used.size(); ++i) {
    if (!comparison.used[i]) continue;
    distances[area_at(comparison.scan_to_model.closest, i, areas)].push_back(comparison.scan_to_model.distance_mm[i]);
  }
  const Eigen::VectorXd sizes = area_sizes_mm2(model, areas);
  std::vector<AreaError> table;
  for (std::size_t a = 0; a < areas.names.size(); ++a) {
    if (sizes[a] == 0) continue;
    const DistanceFigures figures = figures_of(distances[a]);
    table.push_back({areas.names[a], sizes[a] / 100, static_cast<int>(distances[a].size()), figures.mae_mm,
                     figures.mean_signed_mm});
  }
  return table;
}

double rms_of_kept(const Comparison& comparison) {
  double sum = 0;
  for (Eigen::Index i = 0; i < comparison.used.size(); ++i)
    if (comparison.used[i]) sum += std::pow(comparison.scan_to_model.distance_mm[i], 2);
  for (const int i : comparison.outliers.points) sum -= std::pow(comparison.scan_to_model.distance_mm[i], 2);
  const auto kept = comparison.scan_points_used - static_cast<int>(comparison.outliers.points.size());
  return std::sqrt(std::max(sum, 0.0) / kept);
}

void check_areas(const ModelSkin& model, const SkinAreas& areas) {
  const int names = static_cast<int>(areas.names.size());
  for (const int node : model.nodes()) {
    if (node >= areas.of_point.size() || areas.of_point[node] < 0 || areas.of_point[node] >= names) {
      throw InputError(fmt::format("skin point {} belongs to no area", node));
    }
  }
}

}  // namespace

Comparison compare(const ModelSkin& model, const Scan& scan, const SkinAreas& areas, const CoverageBounds& bounds,
                   double given_noise_mm) {
  Comparison result;
  model_to_scan(scan, model.node_points(), model.node_normals(), bounds, result.model_to_scan);
  result.mae_study_mm = mae_of_covered(result.model_to_scan);
  result.covered_fraction =
      scan.is_contour() ? std::numeric_limits<double>::quiet_NaN() : covered_share(model, result.model_to_scan);

  scan_to_model(model, scan.points(), result.scan_to_model);
  result.used = !result.scan_to_model.closest.on_border;
  std::vector<double> distances;
  for (Eigen::Index i = 0; i < result.used.size(); ++i) {
    if (result.used[i]) distances.push_back(result.scan_to_model.distance_mm[i]);
  }
  if (distances.empty()) {
    throw InputError(fmt::format(
        "none of the {} scan points lies over the model's skin: each is closest to the skin's border. Compare with a "
        "scan of the imaged body",
        scan.points().rows()));
  }
  result.scan_points_used = static_cast<int>(distances.size());
  result.scan = figures_of(distances);
  result.outliers = find_outliers(scan.points(), result.scan_to_model, given_noise_mm);
  result.rms_kept_mm = rms_of_kept(result);
  if (!areas.names.empty()) {
    check_areas(model, areas);
    result.areas = area_table(model, areas, result);
  }
  return result;
}

std::vector<LandmarkError> compare_landmarks(const Landmarks& predicted, const Landmarks& measured) {
  std::vector<LandmarkError> errors;
  std::vector<std::string> unknown;
  for (std::size_t i = 0; i < measured.names.size(); ++i) {
    if (const auto row = predicted.row_of(measured.names[i]))
      errors.push_back({measured.names[i], (predicted.points.row(*row) - measured.points.row(i)).norm()});
    else
      unknown.push_back(measured.names[i]);
  }
  if (!unknown.empty()) {
    throw InputError(
        fmt::format("measured landmark{} {} {} not among the predicted ones ({}): a landmark has the same name in "
                    "every pose",
                    unknown.size() > 1 ? "s" : "", fmt::join(unknown, ", "), unknown.size() > 1 ? "are" : "is",
                    fmt::join(predicted.names, ", ")));
  }
  return errors;
}

}  // namespace supine::calibration
