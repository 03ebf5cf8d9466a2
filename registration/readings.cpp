// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/readings.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <vector>

#include "common/error.h"
#include "registration/coarse.h"
#include "registration/match.h"

namespace supine::registration {
namespace {

struct Unit {
  const char* name;
  double millimetres;
};
constexpr Unit units[] = {{"metres", 1000}, {"centimetres", 10}, {"inches", 25.4}, {"micrometres", 0.001}};

double diagonal(const Points& points) { return (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm(); }

double spread(const Points& points) { return (points.rowwise() - points.colwise().mean()).norm(); }

struct LandmarkTables {
  Points scan, image;
  Eigen::VectorXd weight;
};

LandmarkTables tables_of(const Problem& problem) {
  const auto count = static_cast<Eigen::Index>(problem.landmarks.size());
  LandmarkTables tables{Points(count, 3), Points(count, 3), Eigen::VectorXd::Ones(count)};
  for (Eigen::Index l = 0; l < count; ++l) {
    tables.scan.row(l) = problem.landmarks[static_cast<std::size_t>(l)].scan;
    tables.image.row(l) = problem.landmarks[static_cast<std::size_t>(l)].image;
  }
  return tables;
}

double rms_mm(const LandmarkTables& tables, bool mirror) {
  const RigidTransform best = best_rigid(tables.scan, tables.image, tables.weight, mirror);
  return (best.apply(tables.scan) - tables.image).norm() / std::sqrt(static_cast<double>(tables.scan.rows()));
}

[[noreturn]] void refuse_unit(const std::string& name, const Unit& unit, const std::string& evidence) {
  throw InputError(fmt::format("{}: its coordinates are in {}, not mm: {}. Multiply them by {:g}", name, unit.name,
                               evidence, unit.millimetres));
}

Problem scaled(Problem problem, double factor) {
  problem.points *= factor;
  problem.landmarks.clear();
  return problem;
}

double best_score_mm(const Problem& problem) {
  const double near = search_near(problem, {}).front().score_mm;
  return near < 3 ? near : std::min(near, search_far(problem).front().score_mm);
}

void check_by_landmarks(const Problem& problem, const std::string& name) {
  constexpr double same = 1.4, unit_tolerance = 1.4;
  const LandmarkTables tables = tables_of(problem);
  const double factor = spread(tables.image) / spread(tables.scan);
  if (factor < same && factor > 1 / same) return;
  const Unit* nearest = nullptr;
  for (const Unit& unit : units)
    if (!nearest || std::abs(std::log(factor / unit.millimetres)) < std::abs(std::log(factor / nearest->millimetres)))
      nearest = &unit;
  if (std::abs(std::log(factor / nearest->millimetres)) < std::log(unit_tolerance))
    refuse_unit(name, *nearest, fmt::format("its landmarks lie {:.4g} times closer together than on the body", factor));
  throw InputError(
      fmt::format("{}: its landmarks lie {:.3g} times closer together than on the body (bound 1/{} to {}), which is no "
                  "unit either. Landmarks of another body, or names that are mixed up?",
                  name, factor, same, same));
}

void check_by_extent(const Problem& problem, const std::string& name) {
  constexpr double least = 0.15, most = 6;
  const calibration::SurfaceDistance& body = problem.target.skin ? *problem.target.skin : *problem.target.rigid;
  const double ratio = diagonal(problem.points) / diagonal(body.points());
  if (ratio >= least && ratio <= most) return;
  const Unit* best = nullptr;
  double best_mm = std::numeric_limits<double>::infinity();
  for (const Unit& unit : units) {
    if (ratio * unit.millimetres < least || ratio * unit.millimetres > most) continue;
    const double score = best_score_mm(scaled(problem, unit.millimetres));
    if (score < best_mm) best_mm = score, best = &unit;
  }
  if (best)
    refuse_unit(
        name, *best,
        fmt::format(
            "its diagonal is {:.4g}, that of the body {:.4g} mm; read in {} it lies {:.1f} mm (RMS) from the body",
            diagonal(problem.points), diagonal(body.points()), best->name, best_mm));
  throw InputError(
      fmt::format("{}: its diagonal is {:.4g} mm, that of the body {:.4g} mm (bound {} to {} times it), and no "
                  "unit explains it. A scan of another object?",
                  name, diagonal(problem.points), diagonal(body.points()), least, most));
}

std::string nearest_change(const Eigen::Matrix3d& rotation, bool mirror, double within_deg) {
  const double least_trace = 1 + 2 * std::cos(within_deg * std::acos(-1.0) / 180);
  for (const Eigen::Matrix3d& change : axis_changes(mirror))
    if ((rotation.transpose() * change).trace() >= least_trace && !change.isIdentity())
      return axis_change_words(change);
  return {};
}

/// One axis negated, or two swapped, about the origin and about the scan's centre.
std::vector<RigidTransform> mirrored_starts(const Problem& problem) {
  const Eigen::Vector3d centre = problem.points.colwise().mean();
  std::vector<RigidTransform> starts;
  for (const Eigen::Matrix3d& change : axis_changes(true)) {
    if (std::abs(change.trace() - 1) > 1e-9) continue;
    starts.push_back({change, Eigen::Vector3d::Zero()});
    starts.push_back({change, centre - change * centre});
  }
  return starts;
}

Problem mirrored_by(Problem problem, const RigidTransform& change) {
  problem.points = change.apply(problem.points);
  problem.normals = change.apply_to_directions(problem.normals);
  problem.landmarks.clear();
  return problem;
}

}  // namespace

std::string axis_change_words(const Eigen::Matrix3d& change) {
  constexpr const char* axes[] = {"x", "y", "z"};
  std::string negated, order;
  for (int row = 0; row < 3; ++row) {
    Eigen::Index column = 0;
    const double sign = change.row(row).cwiseAbs().maxCoeff(&column) * change(row, column);
    order += fmt::format("{}{}{}", row > 0 ? ", " : "", change(row, column) < 0 ? "-" : "", axes[column]);
    if (sign < 0) negated += std::string(negated.empty() ? "" : " and ") + axes[row];
  }
  if (change.cwiseAbs().isIdentity()) return negated + (negated == "x and y" ? " negated (RAS)" : " negated");
  return fmt::format("axes swapped (read its x, y, z as {})", order);
}

void check_unit(const Problem& problem, const std::string& name) {
  if (problem.points.rows() == 0) throw InputError(fmt::format("{}: has no points", name));
  if (!problem.points.allFinite()) throw InputError(fmt::format("{}: a coordinate is not a finite number", name));
  if (problem.landmarks.size() >= 3 && spread(tables_of(problem).scan) > 0)
    check_by_landmarks(problem, name);
  else if (problem.target.skin || problem.target.rigid)
    check_by_extent(problem, name);
}

void check_mirror(const Problem& problem, const RigidTransform& placement, double score_mm, const std::string& name) {
  constexpr double bad_mm = 3, gain = 0.5;
  RigidTransform mirrored = placement;
  double given_mm = score_mm, mirrored_mm = std::numeric_limits<double>::infinity();
  if (problem.landmarks.size() >= 4) {
    const LandmarkTables tables = tables_of(problem);
    given_mm = rms_mm(tables, false);
    mirrored_mm = rms_mm(tables, true);
    mirrored = best_rigid(tables.scan, tables.image, tables.weight, true);
  } else if (given_mm > bad_mm && (problem.target.skin || problem.target.rigid)) {
    const std::vector<int> rows = drawn_rows(problem.points.rows(), 240);
    for (const RigidTransform& start : mirrored_starts(problem)) {
      const Problem turned = mirrored_by(problem, start);
      const RigidTransform found = icp(turned, rows, {}, 30);
      const double score = match_score_mm(match(turned, rows, found));
      if (score >= mirrored_mm) continue;
      mirrored_mm = score;
      mirrored.rotation = found.rotation * start.rotation;
    }
  }
  if (given_mm <= bad_mm || mirrored_mm > gain * given_mm) return;
  const std::string which = nearest_change(mirrored.rotation, true, 30);
  throw InputError(
      fmt::format("{}: is a mirror image: as given it fits to {:.1f} mm (RMS), mirrored to {:.1f} mm{}. Write the scan "
                  "with the axes "
                  "as they are{}",
                  name, given_mm, mirrored_mm, which.empty() ? "" : ", with " + which,
                  problem.landmarks.size() >= 4 ? ", or check which landmark has which name" : ""));
}

std::string named_axis_change(const Eigen::Matrix3d& rotation) { return nearest_change(rotation, false, 15); }

}  // namespace supine::registration
