// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/plausibility.h"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "common/statistics.h"
#include "registration/coarse.h"
#include "registration/match.h"
#include "registration/readings.h"

namespace supine::registration {
namespace {

constexpr int judged_points = 160;
constexpr double least_misfit_mm = 2;   // below it no other reading is believed
constexpr double least_covered = 0.25;  // of the skin; a speck fits anywhere
constexpr double degree = 3.14159265358979323846 / 180;

/// y = scale · R (x − centre) + centre + shift: where a reading puts a point of the scan. det R is −1 when mirrored.
struct Similarity {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  double scale = 1;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
};

/// How far a reading may still move, 1 sigma: shift in mm, turn in rad, logarithm of the scale, softness.
struct Freedom {
  double shift_mm, turn, log_scale, softness;
};
constexpr double softness_sd = 0.4;
constexpr double least_softness = -0.8, most_softness = 1.5;  // at -1 the body has not moved at all
constexpr Freedom as_given{2, 1.5 * degree, 1e-4, softness_sd}, shifted{60, 1.5 * degree, 1e-4, softness_sd},
    turned{60, 5 * degree, 1e-4, softness_sd}, resized{60, 1.5 * degree, 0.4, softness_sd};

struct Laid {
  Similarity place;
  double softness = 0;
  double misfit_mm = std::numeric_limits<double>::infinity();
  double covered = 0;
};

/// Points of a scan that are laid on a skin.
class Bench {
 public:
  Bench(const calibration::Scan& scan, const PoseShape& shape) : scan_(scan) {
    const std::vector<int> rows = drawn_rows(scan.points().rows(), judged_points);
    points_ = scan.points()(rows, Eigen::all);
    normals_ = scan.distance().normals()(rows, Eigen::all);
    centre_ = points_.colwise().mean();
    problem_.target.skin = &shape.skin->distance();
    problem_.target.skin_displacement = shape.displacement;
    all_ = drawn_rows(static_cast<Eigen::Index>(rows.size()), judged_points);
    const std::vector<int> drawn = drawn_rows(static_cast<Eigen::Index>(shape.skin->nodes().size()), judged_points);
    skin_nodes_ = shape.skin->node_points()(drawn, Eigen::all);
    skin_centre_ = skin_nodes_.colwise().mean();
  }

  const Eigen::Vector3d& centre() const { return centre_; }

  /// The shift that lays centre on centre.
  Eigen::Vector3d to_centre() const { return skin_centre_ - centre_; }

  /// The shift by which a change about the origin of coordinates differs from one about the scan's centre.
  Eigen::Vector3d about_origin(const Similarity& change) const {
    return change.scale * change.rotation * centre_ - centre_;
  }

  Laid lay(const Similarity& start, const Freedom& freedom) {
    Laid laid{start};
    State total = State::Zero();  // motion since the start, about the moved centre; then log scale, softness
    double reach_mm = 80;
    constexpr double settled_mm = 0.02;
    for (int i = 0; i < iterations; ++i) {
      const bool early = i < iterations / 2;
      const Matches seen = matches_at(laid.place);
      const State before = total;
      if (!step(seen, freedom, reach_mm, early, total)) break;
      laid.place = moved(start, total);
      laid.softness = std::clamp(total[7], least_softness, most_softness);
      if (!early && (total - before).head<3>().norm() < settled_mm) break;
    }
    judge(laid);
    return laid;
  }

 private:
  using State = Eigen::Matrix<double, 8, 1>;
  static constexpr int iterations = 20;

  Similarity moved(const Similarity& start, const State& total) const {
    const Eigen::Vector3d turn = total.segment<3>(3);
    Similarity now = start;
    now.shift += total.head<3>();
    now.scale *= std::exp(total[6]);
    if (turn.norm() > 0)
      now.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * start.rotation;
    return now;
  }

  Matches matches_at(const Similarity& place) {
    const Eigen::Matrix3d map = place.scale * place.rotation;
    problem_.points =
        ((points_.rowwise() - centre_.transpose()) * map.transpose()).rowwise() + (centre_ + place.shift).transpose();
    problem_.normals = normals_ * place.rotation.transpose();
    return match(problem_, all_, {});
  }

  /// One step of Gauss and Newton toward the skin, point to plane; border matches pull the scan back in the beginning.
  bool step(const Matches& seen, const Freedom& freedom, double& reach_mm, bool early, State& total) {
    constexpr double independent_points = 5, sigma_mm = 2, narrowest_mm = 3, medians = 4;
    Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
    State right = State::Zero();
    std::vector<double> residuals;
    const Eigen::Vector3d pivot_now = problem_.points.colwise().mean();
    for (Eigen::Index q = 0; q < problem_.points.rows(); ++q) {
      if (seen.distance_mm[q] > reach_mm || (seen.border[q] ? !early : !seen.facing[q])) continue;
      const Eigen::Vector3d point = problem_.points.row(q), off = point - seen.point.row(q).transpose();
      const Eigen::Vector3d along =
          seen.border[q] && off.norm() > 0 ? Eigen::Vector3d(off.normalized()) : Eigen::Vector3d(seen.normal.row(q));
      State row;
      const Eigen::Vector3d arm = point - pivot_now;
      row << along, arm.cross(along), along.dot(arm), -along.dot(seen.displacement.row(q).transpose());
      // The residual at softness 0, since the skin is taken as predicted.
      const double residual = along.dot(off) - row.head<7>().dot(total.head<7>());
      normal += row * row.transpose();
      right -= residual * row;
      residuals.push_back(std::abs(along.dot(off) + row[7] * total[7]));
    }
    if (residuals.size() < 20) return false;
    const double weight = independent_points / (static_cast<double>(residuals.size()) * sigma_mm * sigma_mm);
    State precision;
    precision << Eigen::Vector3d::Constant(1 / (freedom.shift_mm * freedom.shift_mm)),
        Eigen::Vector3d::Constant(1 / (freedom.turn * freedom.turn)), 1 / (freedom.log_scale * freedom.log_scale),
        1 / (freedom.softness * freedom.softness);
    normal *= weight;
    normal.diagonal() += precision;
    total = normal.ldlt().solve(weight * right);
    reach_mm = std::clamp(medians * median(Eigen::Map<const Eigen::VectorXd>(
                                        residuals.data(), static_cast<Eigen::Index>(residuals.size()))),
                          narrowest_mm, 80.0);
    return true;
  }

  void judge(Laid& laid) {
    constexpr int least_points = 30;
    const Matches seen = matches_at(laid.place);
    double sum = 0;
    int over = 0;
    for (Eigen::Index q = 0; q < problem_.points.rows(); ++q) {
      if (seen.border[q]) continue;
      const Eigen::Vector3d off = (problem_.points.row(q) - seen.point.row(q)).transpose();
      const double d = seen.normal.row(q) * (off - laid.softness * seen.displacement.row(q).transpose());
      const double counted = seen.facing[q] ? std::min(lost_mm, std::abs(d)) : lost_mm;
      sum += counted * counted;
      ++over;
    }
    if (over < least_points) return;
    laid.misfit_mm = std::sqrt(sum / over);
    laid.covered = covered_share(laid.place);
  }

  /// Share of the skin whose closest point of the scan is not on the scan's border.
  double covered_share(const Similarity& place) const {
    const Points back =
        (((skin_nodes_.rowwise() - (centre_ + place.shift).transpose()) * place.rotation) / place.scale).rowwise() +
        centre_.transpose();
    calibration::ClosestPoints closest;
    scan_.distance().closest(back, closest);
    int covered = 0;
    for (Eigen::Index q = 0; q < back.rows(); ++q)
      covered += !closest.on_border[q] && place.scale * closest.distance_mm[q] < 2 * lost_mm;
    return static_cast<double>(covered) / static_cast<double>(back.rows());
  }

  const calibration::Scan& scan_;
  Problem problem_;
  Points points_, normals_, skin_nodes_;
  Eigen::Vector3d centre_, skin_centre_;
  std::vector<int> all_;
};

Reading reading_of(const Laid& laid, std::string words) { return {std::move(words), laid.misfit_mm, laid.covered}; }

void keep_better(Laid& best, const Laid& other) {
  if (other.misfit_mm < best.misfit_mm) best = other;
}

/// The change as it is, about the origin of coordinates and about the centre.
Laid best_of_starts(Bench& bench, Similarity change, const Freedom& freedom) {
  Laid best;
  for (const Eigen::Vector3d& shift :
       {Eigen::Vector3d(Eigen::Vector3d::Zero()), bench.about_origin(change), bench.to_centre()}) {
    change.shift = shift;
    keep_better(best, bench.lay(change, freedom));
  }
  return best;
}

std::string vector_words(const Eigen::Vector3d& v) {
  const auto whole = [](double mm) { return std::lround(mm); };
  return fmt::format("({}, {}, {})", whole(v.x()), whole(v.y()), whole(v.z()));
}

std::optional<Reading> shifted_reading(Bench& bench) {
  constexpr double least_shift_mm = 12, step_mm = 25;
  Laid best;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-step_mm, step_mm}) {
      Similarity start;
      start.shift = sign * Eigen::Vector3d::Unit(axis);
      keep_better(best, bench.lay(start, shifted));
    }
  keep_better(best, best_of_starts(bench, {}, shifted));
  if (best.place.shift.norm() < least_shift_mm) return std::nullopt;
  return reading_of(best, fmt::format("shifted by {} mm", vector_words(best.place.shift)));
}

std::string turn_words(const Eigen::Matrix3d& change) {
  const Eigen::AngleAxisd turn(change);
  const Eigen::Vector3d axis = turn.axis();
  for (int a = 0; a < 3; ++a)
    if (std::abs(axis[a]) > 0.99)
      return fmt::format("turned by {:.0f}° about {}{}", turn.angle() / degree * (axis[a] < 0 ? -1 : 1), "xyz"[a],
                         a == 2 && turn.angle() > 179 * degree ? " (x and y negated: RAS)" : "");
  return "with its " + axis_change_words(change);
}

/// What people do to axes: turns about one of them, one or all negated, two exchanged.
bool is_usual(const Eigen::Matrix3d& change) {
  const double kept = change.cwiseAbs().trace();
  if (kept == 3) return !change.isIdentity();
  if (kept != 1) return false;
  for (int axis = 0; axis < 3; ++axis)
    if (change(axis, axis) != 0) return change(axis, axis) > 0;
  return false;
}

/// Of the usual turns or mirrorings the one that fits best.
std::optional<Reading> turned_reading(Bench& bench, bool mirror) {
  Laid best;
  Eigen::Matrix3d of_best = Eigen::Matrix3d::Identity();
  for (const Eigen::Matrix3d& change : axis_changes(mirror)) {
    if (!is_usual(change)) continue;
    const Laid laid = best_of_starts(bench, {change}, turned);
    if (laid.misfit_mm < best.misfit_mm) best = laid, of_best = change;
  }
  if (!std::isfinite(best.misfit_mm)) return std::nullopt;
  return reading_of(best, mirror ? "mirrored, " + axis_change_words(of_best) : turn_words(of_best));
}

/// Left for right: x negated, which is the patient's left in LPS. Head for feet: z negated.
std::optional<Reading> mirrored_reading(Bench& bench, int axis, const char* words) {
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs[axis] = -1;
  const Laid best = best_of_starts(bench, {signs.asDiagonal().toDenseMatrix()}, turned);
  if (!std::isfinite(best.misfit_mm)) return std::nullopt;
  return reading_of(best, words);
}

/// @param eased_mm  misfit of the scan at its own size where it may move as far
std::optional<Reading> resized_reading(Bench& bench, double eased_mm) {
  constexpr double least_log = 0.1, smallest_size = 0.3;
  constexpr double clearly_smaller = 0.75;  // a scan that lies far off fits at another size too, by and large
  constexpr std::pair<const char*, double> units[] = {
      {"in metres", 1000}, {"in cm", 10}, {"in inches", 25.4}, {"in micrometres", 0.001}, {"in tenths of a mm", 0.1}};
  Laid best;
  std::string words;
  for (const auto& [unit, factor] : units) {
    const Laid laid = best_of_starts(bench, {Eigen::Matrix3d::Identity(), factor}, turned);
    if (laid.covered > least_covered && laid.misfit_mm < best.misfit_mm) best = laid, words = unit;
  }
  const Laid size = best_of_starts(bench, {}, resized);
  if (size.covered > least_covered && size.misfit_mm < best.misfit_mm && size.misfit_mm < clearly_smaller * eased_mm &&
      std::abs(std::log(size.place.scale)) > least_log)
    best = size, words = fmt::format("{:.2f} times as large", size.place.scale);
  if (words.empty()) return std::nullopt;
  Reading reading = reading_of(best, words);
  // A scan that becomes smaller covers less: it is judged by what it would cover at the size it has as given.
  const double size_factor = std::min(1.0, best.place.scale * best.place.scale);
  if (size_factor > smallest_size) reading.covered = std::min(1.0, reading.covered / size_factor);
  return reading;
}

bool far_better(const Reading& given, const Reading& other) {
  constexpr double share_left = 0.5, share_covered = 0.8;
  return given.misfit_mm > least_misfit_mm && other.misfit_mm < share_left * given.misfit_mm &&
         other.covered >= std::max(least_covered, share_covered * given.covered);
}

}  // namespace

bool Readings::fits_as_well(const std::optional<Reading>& other) const {
  constexpr double as_well = 1.15, tolerance_mm = 0.1;
  return other && other->misfit_mm < as_well * given.misfit_mm + tolerance_mm;
}

Readings examine_readings(const calibration::Scan& scan, const std::vector<PoseShape>& shapes) {
  constexpr double clearly = 0.6;  // a stranger reading must fit that much better than one before it
  constexpr double at_ease = 0.6;  // and than the scan itself does with the same freedom
  Bench bench(scan, shapes.front());
  Readings found{reading_of(bench.lay({}, as_given), "as given"),
                 mirrored_reading(bench, 0, "mirrored (x negated: left for right)"),
                 mirrored_reading(bench, 2, "mirrored (z negated: head for feet)"),
                 {}};
  const auto consider = [&](const std::optional<Reading>& other) {
    if (!other || !far_better(found.given, *other)) return;
    if (!found.better || other->misfit_mm < clearly * found.better->misfit_mm) found.better = other;
  };
  if (found.given.misfit_mm < least_misfit_mm) return found;
  for (std::size_t s = 1; s < shapes.size(); ++s) {
    Bench other(scan, shapes[s]);
    consider(reading_of(other.lay({}, as_given), fmt::format("as a scan of the {} pose", shapes[s].pose)));
  }
  consider(shifted_reading(bench));
  const double eased_mm = best_of_starts(bench, {}, turned).misfit_mm;
  for (const auto& other : {found.mirrored, found.upended, turned_reading(bench, false), turned_reading(bench, true)})
    if (other && other->misfit_mm < at_ease * eased_mm) consider(other);
  consider(resized_reading(bench, eased_mm));
  return found;
}

std::string check_readings(const Readings& readings, const std::string& pose, bool landmarks, const std::string& name) {
  if (readings.better) {
    const std::string given = std::isfinite(readings.given.misfit_mm)
                                  ? fmt::format(
                                        "does not fit the {} shape as given ({:.1f} mm off, RMS, after moving "
                                        "it a little)",
                                        pose, readings.given.misfit_mm)
                                  : fmt::format("does not meet the {} shape as given", pose);
    throw InputError(
        fmt::format("{}: {}, but {} it fits ({:.1f} mm). Check the file's axes, side and unit, `surface` and `gravity` "
                    "of [pose.{}], and [case] side; a "
                    "scan that only lies elsewhere is laid on the body by supine-register",
                    name, given, readings.better->words, readings.better->misfit_mm, pose));
  }
  constexpr double fits_nothing_mm = 8;
  if (!std::isfinite(readings.given.misfit_mm))
    throw InputError(fmt::format(
        "{}: too few of its points come to lie over the skin of the {} shape to say whether it fits, as given "
        "or read in any other way. Is it a scan of this body, whole, with axes and unit as measured?",
        name, pose));
  if (!(readings.given.misfit_mm <= fits_nothing_mm))
    throw InputError(
        fmt::format("{}: does not fit the {} shape ({:.1f} mm off, RMS, bound {:g}, no point counting for more than "
                    "{:g}), as given or read in any "
                    "other way. Is it a scan of this body, with axes, unit and triangles as they were measured?",
                    name, pose, readings.given.misfit_mm, fits_nothing_mm, lost_mm));
  if (landmarks) return {};
  std::string doubt;
  const auto add = [&](const char* what, const char* how, const Reading& other) {
    doubt += fmt::format(
        "{}{} of the {} scan is not verified: mirrored, {}, it would fit as well ({:.1f} mm off, as given {:.1f} mm)",
        doubt.empty() ? "" : "; ", what, pose, how, other.misfit_mm, readings.given.misfit_mm);
  };
  if (readings.side_unverified()) add("the side", "left for right", *readings.mirrored);
  if (readings.head_unverified()) add("the upper end", "head for feet", *readings.upended);
  return doubt.empty() ? doubt : doubt + ". Landmarks would tell";
}

}  // namespace supine::registration
