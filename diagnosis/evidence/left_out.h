// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "diagnosis/evidence/hypotheses.h"

namespace supine::diagnosis {

/// What is predicted from the rest: rows of the clusters.
struct LeftOut {
  std::string name;  ///< a pose, or "a block of skin"
  std::vector<int> clusters;
};

/// Every pose where several are measured, else six blocks of skin (calibration/held_out.h).
std::vector<LeftOut> left_out_parts(const calibration::MeasuredScene& scene, const BaseFit& base);

/// Root mean square distance of the points of a fit, every block of skin predicted without itself: moduli, effects and
/// nuisances are those of the rest, under all errors and the likeliest discrepancy, which itself predicts nothing.
/// @param residuals  of the fit that @p h was weighed at
double held_out_rms(const BaseFit& base, const Hypothesis& h, const calibration::Residuals& residuals);

/// ln p(part | rest) of a hypothesis less that of another: > 0 where the first predicts what was left out better, under
/// all errors, nuisances and the discrepancy.
double left_out_gain(const Hypothesis& first, const Hypothesis& second, const LeftOut& part);

/// The same of the likeliest hypothesis with an effect, beside the likeliest of its set without it; where that was not
/// weighed under the same errors, beside the smallest set that was.
/// @param hypotheses  most probable first; one of them holds the effect
double left_out_gain_of(const std::vector<Hypothesis>& hypotheses, int effect, const std::vector<LeftOut>& parts);

}  // namespace supine::diagnosis
