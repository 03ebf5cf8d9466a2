// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/error_sources.h"

#include <algorithm>
#include <cmath>

#include "calibration/noise.h"

namespace supine::diagnosis {
namespace {

using calibration::Residuals;

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

std::string source_of(const std::string& effect) {
  if (effect == "misregistration") return "registration";
  if (effect == "segmentation_offset") return "segmentation";
  if (effect == "chest_wall_motion") return "chest_wall";
  if (effect == "incompressibility") return "numerical";
  return {};
}

bool is_of_each_scan(const std::string& source) { return source == "registration" || source == "chest_wall"; }

/// The shape in each pose by itself: scans lie elsewhere, and breath stands elsewhere, in their own ways.
void add_by_pose(const Residuals& residuals, const ErrorMode& mode, std::vector<ErrorMode>& modes) {
  for (int pose = 0; pose <= residuals.pose.maxCoeff(); ++pose)
    modes.push_back(
        {mode.source, (residuals.pose.array() == pose).select(mode.shape_mm, Eigen::VectorXd::Zero(residuals.size()))});
}

}  // namespace

double tolerance_for(const std::string& effect, const std::string& unit, const Tolerances& t) {
  if (effect == "misregistration") return unit == "rad" ? t.registration_rad : t.registration_mm;
  if (effect == "segmentation_offset") return t.segmentation_mm;
  if (effect == "chest_wall_motion") return unit == "1" ? 0 : t.chest_wall_mm;
  return effect == "incompressibility" ? t.incompressibility : 0;
}

double shared_tolerance_for(const std::string& effect, const std::string& unit, const Tolerances& tolerances,
                            std::size_t poses) {
  const double each = tolerance_for(effect, unit, tolerances);
  return is_of_each_scan(source_of(effect)) ? each / std::sqrt(static_cast<double>(poses)) : each;
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
  std::erase_if(rest.modes, [own = source_of(effect)](const ErrorMode& mode) { return mode.source == own; });
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
    const std::string source = source_of(candidate.effect);
    for (std::size_t k = 0; !source.empty() && k < candidate.parameters.size(); ++k) {
      const ErrorMode mode{source, tolerance_for(candidate.effect, candidate.parameters[k].unit, tolerances) *
                                       candidate.slope.col(static_cast<Eigen::Index>(k))};
      if (is_of_each_scan(source))
        add_by_pose(residuals, mode, sources.modes);
      else
        sources.modes.push_back(mode);
    }
  }
  if (numerical != nullptr) set_numerical(*numerical, tolerances, sources);
  return sources;
}

}  // namespace supine::diagnosis
