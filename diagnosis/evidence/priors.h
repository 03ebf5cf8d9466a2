// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/evidence/patchiness.h"
#include "simulation/effect.h"

namespace supine::diagnosis {

/// How well one measurement is known, where that was said of it.
struct KnownOfPose {
  simulation::MeasurementTolerances known;
  double scan_shared_mm;
  std::optional<double> independent_points = {};  ///< how many the scan is worth; none: all it has
};

/// What is believed before anything is measured: all that a verdict rests on (docs/diagnosis.md).
struct Priors {
  /// Of sets of none, one, two and three effects; shared evenly by the sets of a size.
  std::array<double, 4> of_sets = {0.5, 0.3, 0.15, 0.05};
  /// Effects that are as likely there as not, each by itself; `of_sets` is of the others.
  std::vector<std::string> expected = {};
  double unlisted = 0.1;  ///< that a local cause is there that no effect lists (unlisted.h); 0 = none is weighed
  simulation::MeasurementTolerances known = {};  ///< nuisances, 1 sigma
  std::map<std::string, KnownOfPose> of_pose;    ///< by name, in place of `known` and `scan_shared_mm`
  Patchiness patchiness = {};
  double scan_shared_mm = 0.2, scan_shared_length_mm = 25;  ///< what neighbouring points of a scan err together
  /// What no effect explains is half-Cauchy with the scale max(least_unexplained_mm, share_of_way × rms way from the
  /// imaged pose), up to most_unexplained_mm.
  double least_unexplained_mm = 0.3, share_of_way = 0.01, most_unexplained_mm = 10;
  double named_at = 0.95;             ///< inclusion probability from which an effect is named
  double unexplained_bound_mm = 0.5;  ///< above it what is left is told as a verdict

  bool is_expected(const std::string& effect) const;
  /// ln of the prior of one set. @param effects  all that are weighed  @param set  rows of them
  double ln_of_set(const std::vector<std::string>& effects, const std::vector<int>& set) const;
  /// Σ of the priors of what holds the effect.
  double of_effect(const std::vector<std::string>& effects, const std::string& effect) const;
  const simulation::MeasurementTolerances& known_in(const std::string& pose) const;
  double scan_shared_in(const std::string& pose) const;
  std::optional<double> independent_points_in(const std::string& pose) const;
};

/// What a diagnosis can be made without, to see what it rests on: forces that nobody knows of; places of scans,
/// gravity, breath and all else that is never known; that every body is uneven.
enum class Allowance { discrepancy, nuisances, patchiness };
/// The same as if there were no such thing. Without patchiness no local cause is weighed.
Priors without(Allowance what, Priors priors);

/// The prior of one number of an effect: normal, or log-normal where only values above null make sense.
struct StrengthPrior {
  double median, spread;  ///< spread: of ln(value) where it is log-normal
  bool log_normal;
  /// Of the value itself.
  double mean() const;
  double sd() const;
};

StrengthPrior strength_prior(const simulation::Parameter& row);

}  // namespace supine::diagnosis
