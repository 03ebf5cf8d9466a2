// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/error_sources.h"

#include <algorithm>
#include <cmath>

#include "calibration/noise.h"
#include "simulation/catalogue.h"

namespace supine::diagnosis {
namespace {

using calibration::Residuals;
using simulation::traits_of;

/// The scanner's noise as the case says, or as neighbouring points show it where that is more: noise across the normal
/// comes on top where the skin is steep.
Eigen::VectorXd noise_of(const Residuals& residuals) {
  constexpr int fewest = 200;
  Eigen::VectorXd noise = residuals.sigma_mm;
  for (int pose = 0; pose <= residuals.pose.maxCoeff(); ++pose) {
    std::vector<int> rows;
    for (Eigen::Index r = 0; r < residuals.size(); ++r)
      if (residuals.pose[r] == pose) rows.push_back(static_cast<int>(r));
    if (rows.size() < fewest) continue;
    const double seen = calibration::estimate_noise_mm(residuals.place(rows, Eigen::all), residuals.distance_mm(rows));
    for (const int r : rows) noise[r] = std::max(noise[r], seen);
  }
  return noise;
}

/// The shape in each pose by itself: scans lie elsewhere, and breath stands elsewhere, in their own ways.
void add_by_pose(const Residuals& residuals, const ErrorMode& mode, std::vector<ErrorMode>& modes) {
  for (int pose = 0; pose <= residuals.pose.maxCoeff(); ++pose)
    modes.push_back(
        {mode.source, (residuals.pose.array() == pose).select(mode.shape_mm, Eigen::VectorXd::Zero(residuals.size()))});
}

}  // namespace

double tolerance_for(const std::string& effect, const std::string& unit, const Tolerances& tolerances) {
  const simulation::Effect* found = simulation::find_effect(effect);
  return found == nullptr ? 0 : found->tolerance(unit, tolerances);
}

double shared_tolerance_for(const std::string& effect, const std::string& unit, const Tolerances& tolerances,
                            std::size_t poses) {
  const double each = tolerance_for(effect, unit, tolerances);
  return traits_of(effect).error_of_each_scan ? each / std::sqrt(static_cast<double>(poses)) : each;
}

bool errors_imitate(const std::string& effect) { return tolerance_for(effect, {}, Tolerances{}) > 0; }

void set_numerical(const NumericalError& numerical, const Tolerances& tolerances, ErrorSources& sources) {
  std::erase_if(sources.modes, [](const ErrorMode& mode) { return mode.source == "mesh"; });
  sources.mean_mm = tolerances.correction * numerical.finer_mm;
  sources.mean_doubt = numerical.finer_doubt;
  sources.modes.push_back({"mesh", numerical.finer_doubt * numerical.finer_mm});
  sources.modes.push_back({"mesh", numerical.coarser_mm});
  sources.spread_mm = numerical.spread_mm;
  sources.share = numerical.share;
  sources.length_mm = numerical.length_mm;
}

ErrorSources without_tolerance_for(const std::string& effect, const ErrorSources& sources) {
  ErrorSources rest = sources;
  std::erase_if(rest.modes,
                [own = traits_of(effect).error_source](const ErrorMode& mode) { return mode.source == own; });
  return rest;
}

ErrorSources error_sources(const Residuals& residuals, const std::vector<Candidate>& candidates,
                           const NumericalError* numerical, const calibration::ErrorModel& fallback,
                           const Tolerances& tolerances) {
  ErrorSources sources;
  sources.noise_mm = noise_of(residuals);
  sources.mean_mm = Eigen::VectorXd::Zero(residuals.size());
  sources.spread_mm = fallback.spread_mm;
  sources.length_mm = fallback.length_mm;
  for (const Candidate& candidate : candidates) {
    const simulation::EffectTraits traits = traits_of(candidate.effect);
    for (std::size_t k = 0; !traits.error_source.empty() && k < candidate.parameters.size(); ++k) {
      const ErrorMode mode{traits.error_source,
                           tolerance_for(candidate.effect, candidate.parameters[k].unit, tolerances) *
                               candidate.slope.col(static_cast<Eigen::Index>(k))};
      if (traits.error_of_each_scan)
        add_by_pose(residuals, mode, sources.modes);
      else
        sources.modes.push_back(mode);
    }
  }
  if (numerical != nullptr) set_numerical(*numerical, tolerances, sources);
  return sources;
}

}  // namespace supine::diagnosis
