// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/register_scan.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calibration/noise.h"
#include "common/error.h"
#include "common/statistics.h"
#include "registration/coarse.h"
#include "registration/match.h"
#include "registration/readings.h"

namespace supine::registration {
namespace {

constexpr int judged_points = 2000;
constexpr Belief given_belief{}, landmark_belief{300, 1.0};

bool has_surface(const Problem& problem) { return problem.target.skin || problem.target.rigid; }

double landmark_rms_mm(const Problem& problem, const RigidTransform& placement) {
  double sum = 0;
  for (const Landmark& l : problem.landmarks) sum += (placement.at(l.scan) - l.image).squaredNorm();
  return problem.landmarks.empty() ? 0 : std::sqrt(sum / static_cast<double>(problem.landmarks.size()));
}

/// From the distances where the scan lies by now.
double noise_mm(const Problem& problem, const RigidTransform& placement) {
  constexpr int least_points = 40;
  constexpr double least_mm = 0.05, otherwise_mm = 0.7;
  const std::vector<int> rows = drawn_rows(problem.points.rows(), judged_points);
  const Matches matches = match(problem, rows, placement);
  const Points moved = placement.apply(problem.points(rows, Eigen::all));
  std::vector<int> kept;
  for (std::size_t q = 0; q < rows.size(); ++q)
    if (!matches.border[q] && matches.facing[q] && matches.distance_mm[q] < lost_mm)
      kept.push_back(static_cast<int>(q));
  if (kept.size() < least_points) return otherwise_mm;
  Eigen::VectorXd signed_mm(kept.size());
  for (std::size_t k = 0; k < kept.size(); ++k)
    signed_mm[k] = (moved.row(kept[k]) - matches.point.row(kept[k])).dot(matches.normal.row(kept[k]));
  return std::max(least_mm, calibration::estimate_noise_mm(moved(kept, Eigen::all), signed_mm));
}

std::vector<Placement> placements(const Problem& problem, const RigidTransform& start, bool& searched_far) {
  constexpr double good_mm = 4;
  // Landmarks say which of several places is meant.
  if (!has_surface(problem) || problem.landmarks.size() >= 3) return {{start, landmark_rms_mm(problem, start)}};
  std::vector<Placement> found = search_near(problem, start);
  if (found.front().score_mm < good_mm) return found;
  const std::vector<Placement> far = search_far(problem);
  // What lies near where it was said to lie is believed unless another place fits far better.
  if (far.front().score_mm > found.front().score_mm / 2) return found;
  searched_far = true;
  return far;
}

/// Other placements count by how much worse they fit, as if effective_points independent points had said so.
void include_others(const Problem& problem, const std::vector<Placement>& places, const Belief& belief,
                    Registration& into) {
  constexpr double least_weight = 0.01;
  const double best = into.after_mm * into.after_mm;
  const std::vector<int> rows = drawn_rows(problem.points.rows(), judged_points);
  for (std::size_t p = 1; p < places.size(); ++p) {
    const Fit other = fit(problem, places[p].transform, belief);
    const double score = match_score_mm(match(problem, rows, other.transform));
    const double weight = std::exp(-into.fit.effective_points / 2 * (score * score / best - 1));
    if (weight < least_weight || mahalanobis_squared(into.fit, other.transform) < 1) continue;
    const Motion off = motion_about(into.fit.pivot, into.fit.transform.inverse().then(other.transform));
    into.fit.covariance += std::min(1.0, weight) / (1 + std::min(1.0, weight)) * off * off.transpose();
    ++into.other_places;
  }
}

void check_fits(const Registration& found, const Problem& problem, const std::string& name) {
  constexpr double least_overlap = 0.3, most_mm = 8, most_landmark_mm = 25;
  if (found.landmarks_after_mm > most_landmark_mm)
    throw InputError(
        fmt::format("{}: its landmarks lie {:.1f} mm (RMS) from where the body has them at best (bound {} mm). "
                    "Landmarks of another body, or names that are mixed up?",
                    name, found.landmarks_after_mm, most_landmark_mm));
  if (!has_surface(problem) || (found.overlap >= least_overlap && found.after_mm <= most_mm)) return;
  throw InputError(
      fmt::format("{}: does not fit this body anywhere: at best {:.0f} % of it meets the body (bound {:.0f} %), {:.1f} "
                  "mm off (RMS; bound {} mm). "
                  "A scan of another object{}?",
                  name, 100 * found.overlap, 100 * least_overlap, found.after_mm, most_mm,
                  problem.landmarks.size() < 3 ? ", or one that lies too far off: name three landmarks or more"
                                               : ", or landmarks in another frame, unit or place than the scan"));
}

void check_problem(const Problem& problem, const std::string& name) {
  if (!has_surface(problem) && problem.landmarks.size() < 3)
    throw InputError(
        fmt::format("{}: {} landmarks and no surface to lay it on; three landmarks at least, or a surface "
                    "([register] on)",
                    name, problem.landmarks.size()));
}

/// A start from which points that are rigid meet what is rigid. Landmarks on a skin that deforms are 10 mm off, and
/// from there skin meets the sheet, sheet the skin, and the scan may slide away with all the weight of what is rigid.
RigidTransform near_what_is_rigid(const Problem& problem, const RigidTransform& start, const Belief& belief) {
  if (!problem.target.skin || !problem.target.rigid) return start;
  Problem soft = problem;
  soft.target.rigid = nullptr;
  return fit(soft, start, belief).transform;
}

}  // namespace

Registration register_scan(Problem problem, const RigidTransform& given, bool noise_known, const std::string& name) {
  check_problem(problem, name);
  check_unit(problem, name);
  const bool landmarks = problem.landmarks.size() >= 3;
  const RigidTransform start = problem.landmarks.empty() ? given : start_of(problem);
  if (landmarks) check_mirror(problem, start, landmark_rms_mm(problem, start), name);
  Registration found;
  std::vector<Placement> places = placements(problem, start, found.searched_far);
  if (!landmarks) check_mirror(problem, places.front().transform, places.front().score_mm, name);
  if (!noise_known && has_surface(problem)) problem.noise_mm = noise_mm(problem, places.front().transform);
  found.noise_mm = problem.noise_mm;
  const Belief& belief = landmarks ? landmark_belief : given_belief;
  found.fit = fit(problem, near_what_is_rigid(problem, places.front().transform, belief), belief);
  if (has_surface(problem)) {
    const std::vector<int> rows = drawn_rows(problem.points.rows(), judged_points);
    const Matches matches = match(problem, rows, found.fit.transform);
    found.before_mm = match_score_mm(match(problem, rows, given));
    found.after_mm = match_score_mm(matches);
    found.overlap = overlap(matches);
    if (!landmarks) include_others(problem, places, belief, found);
  }
  found.landmarks_before_mm = landmark_rms_mm(problem, given);
  found.landmarks_after_mm = landmark_rms_mm(problem, found.fit.transform);
  found.axes = named_axis_change(found.fit.transform.rotation);
  found.given_inside = mahalanobis_squared(found.fit, given) <= chi_squared_quantile(6, 0.95);
  check_fits(found, problem, name);
  return found;
}

std::vector<WeakDirection> weak_directions(const Fit& fit) {
  constexpr double weak_mm = 5, weak_rad = 0.0873;
  std::vector<WeakDirection> weak;
  for (const bool turn : {true, false}) {
    const Eigen::Matrix3d block =
        turn ? fit.covariance.bottomRightCorner<3, 3>() : fit.covariance.topLeftCorner<3, 3>();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(block);
    for (int axis = 2; axis >= 0; --axis)
      if (const double sd = std::sqrt(solver.eigenvalues()[axis]); sd > (turn ? weak_rad : weak_mm))
        weak.push_back({solver.eigenvectors().col(axis), sd, turn});
  }
  return weak;
}

}  // namespace supine::registration
