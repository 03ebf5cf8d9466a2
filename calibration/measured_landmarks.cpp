// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/measured_landmarks.h"

#include <fmt/ranges.h>

#include <cmath>

#include "common/error.h"

namespace supine::calibration {
namespace {

constexpr double usual_sigma_mm = 1.5;
constexpr double furthest_mm = 60;
constexpr double spread_factor = 3;
constexpr double exchanged_from_mm = 10, exchanged_share = 1.0 / 3;

/// 0 where the file states none.
double stated_mm(const Landmarks& landmarks, Eigen::Index row) {
  return landmarks.sigma_mm.size() > 0 ? landmarks.sigma_mm[row] : 0;
}

double furthest(const Points& measured, const Points& predicted) {
  return (measured - predicted).rowwise().norm().maxCoeff();
}

/// What the file may be instead; empty: nothing that is known.
std::string reading(const Points& measured, const Points& predicted) {
  if (furthest(1000 * measured, predicted) < furthest_mm) return "In metres they lie right: write mm. ";
  if (furthest(10 * measured, predicted) < furthest_mm) return "In centimetres they lie right: write mm. ";
  Points turned = measured;
  turned.leftCols<2>() *= -1;
  if (furthest(turned, predicted) < furthest_mm)
    return "With x and y negated they lie right: the file is RAS and case.frame says LPS, or the other way round. ";
  return {};
}

double spread(const Points& points) { return (points.rowwise() - points.colwise().mean()).norm(); }

/// One landmark near the origin may be in metres and seem right; several lie too close together then.
void check_spread(const MeasuredLandmarks& landmarks, const Points& predicted) {
  const double here = spread(landmarks.measured), there = spread(predicted);
  if (landmarks.measured.rows() < 2 || (here < spread_factor * there && there < spread_factor * here)) return;
  throw InputError(fmt::format(
      "its {} landmarks spread over {:.3g} mm (root of the sum of squares about their mean), those of the model over "
      "{:.3g} mm (bound: a factor of {}). {}Check the unit",
      landmarks.names.size(), here, there, spread_factor, reading(landmarks.measured, predicted)));
}

void check_names(const MeasuredLandmarks& landmarks, const Points& predicted) {
  const auto error = [&](Eigen::Index l, Eigen::Index place) {
    return (landmarks.measured.row(l) - predicted.row(place)).norm();
  };
  for (Eigen::Index a = 0; a < predicted.rows(); ++a)
    for (Eigen::Index b = 0; b < a; ++b) {
      const double named = std::hypot(error(a, a), error(b, b)), exchanged = std::hypot(error(a, b), error(b, a));
      if (named > exchanged_from_mm && exchanged < exchanged_share * named)
        throw InputError(fmt::format(
            "landmarks '{}' and '{}' lie {:.0f} mm from where the model has them, and {:.0f} mm with their names "
            "exchanged: exchange them in one of the files",
            landmarks.names[static_cast<std::size_t>(b)], landmarks.names[static_cast<std::size_t>(a)], named,
            exchanged));
    }
}

}  // namespace

MeasuredLandmarks pair_landmarks(const Landmarks& imaged, const Landmarks& measured) {
  const Eigen::Index count = measured.points.rows();
  MeasuredLandmarks pairs{measured.names, Points(count, 3), measured.points, Eigen::VectorXd(count)};
  for (Eigen::Index l = 0; l < count; ++l) {
    const std::string& name = measured.names[static_cast<std::size_t>(l)];
    const auto row = imaged.row_of(name);
    if (!row)
      throw InputError(
          fmt::format("landmark '{}' is not among those of [landmarks] prone ({}): it has the same name in every pose",
                      name, fmt::join(imaged.names, ", ")));
    pairs.imaged.row(l) = imaged.points.row(*row);
    const double both_mm = std::hypot(stated_mm(imaged, *row), stated_mm(measured, l));
    pairs.sigma_mm[l] = both_mm > 0 ? both_mm : usual_sigma_mm;
  }
  return pairs;
}

void check_landmarks(const MeasuredLandmarks& landmarks, const Points& predicted) {
  const Points& measured = landmarks.measured;
  if (measured.rows() == 0) return;
  check_spread(landmarks, predicted);
  check_names(landmarks, predicted);
  Eigen::Index worst = 0;
  const double distance = (measured - predicted).rowwise().norm().maxCoeff(&worst);
  if (distance <= furthest_mm) return;
  throw InputError(fmt::format(
      "landmark '{}' at ({:.1f}, {:.1f}, {:.1f}) mm lies {:.0f} mm from where the model has it (bound {:.0f} mm). "
      "{}Check its unit, its frame and its name; where the model is that far off, calibrate it by the surface alone",
      landmarks.names[static_cast<std::size_t>(worst)], measured(worst, 0), measured(worst, 1), measured(worst, 2),
      distance, furthest_mm, reading(measured, predicted)));
}

}  // namespace supine::calibration
