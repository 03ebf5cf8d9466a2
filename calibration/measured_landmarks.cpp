// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/measured_landmarks.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace supine::calibration {
namespace {

constexpr double usual_sigma_mm = 1.5;
constexpr double furthest_mm = 60;
constexpr double spread_factor = 3;
constexpr double doubtful_factor = 7.0 / 6, explained_share = 0.5, noticed_sigmas = 2;
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

double pair_sigma_mm(const Landmarks& imaged, Eigen::Index imaged_row, const Landmarks& measured,
                     Eigen::Index measured_row) {
  const double both_mm = std::hypot(stated_mm(imaged, imaged_row), stated_mm(measured, measured_row));
  return both_mm > 0 ? both_mm : usual_sigma_mm;
}

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
    pairs.sigma_mm[l] = pair_sigma_mm(imaged, *row, measured, l);
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

std::string doubt_of_scale(const MeasuredLandmarks& landmarks, const Points& predicted) {
  if (predicted.rows() < 3) return {};
  const auto about_mean = [](const Points& points) -> Points { return points.rowwise() - points.colwise().mean(); };
  const Points here = about_mean(landmarks.measured), there = about_mean(predicted);
  const double factor = here.cwiseProduct(there).sum() / there.squaredNorm();
  if (!(factor > 0) || std::max(factor, 1 / factor) < doubtful_factor) return {};
  const auto rms = [&here](const Points& places) {
    return (here - places).norm() / std::sqrt(static_cast<double>(here.rows()));
  };
  const double off = rms(there), rest = rms(factor * there);
  if (off < noticed_sigmas * landmarks.sigma_mm.mean() || rest > explained_share * off) return {};
  return fmt::format(
      "its {} landmarks are spread {:.2f} times as far as the model has them ({:.1f} mm off about their mean, RMS; "
      "{:.1f} mm without that factor): check their unit and scale; if they are right, the model is far from this body",
      landmarks.names.size(), factor, off, rest);
}

}  // namespace supine::calibration
