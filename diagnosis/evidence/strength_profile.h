// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "diagnosis/candidates.h"
#include "diagnosis/evidence/curved_density.h"
#include "diagnosis/evidence/set_refit.h"
#include "diagnosis/weighted_fit.h"

namespace supine::diagnosis {

/// Whether the distances follow the effect's usual size in another way than its slope at the null says.
/// @return  false where that size was not solved
bool is_far_from_linear(const Candidate& candidate);

/// What a refit stood on.
struct RefitGround {
  const calibration::MeasuredScene& scene;
  const BaseFit& base;
  const Metric& metric;
  const std::vector<Nuisance>& nuisances;
};

/// Places beyond the last that was followed, as if the measurement said no more there: ln of the density goes on as the
/// prior's, in strides of half its standard deviation or more, to four of these beyond its mean.
/// @param last, ln_density  the last place, a coordinate, and ln of the density there
/// @param step              sign: the side; size: the stride so far, in coordinates
/// @param bound             end of the range on that side, left out
/// @return                  coordinates and ln of the density, the nearest first
std::vector<std::pair<double, double>> prior_alone(double last, double ln_density, double step, double bound,
                                                   const calibration::Prior& prior);

/// Posterior density of one strength, in its coordinate, evidence included: the strength is held at places 1.5 standard
/// deviations apart until the density has fallen to a fiftieth, five to each side at the most; everything else is
/// fitted there through the chain and integrated by Laplace's formula (Tierney and Kadane 1986, marginal densities).
/// Beyond five places the measurement says no more (the prior goes on); beyond one without equilibrium nothing lies.
/// Its mass stands in place of the evidence that Laplace's formula gives at the optimum alone.
/// @param parameters  the refit's, nuisances at their values in their base
/// @param k           one of their coordinates, which has a prior
/// @return            nothing where fewer than four places have an equilibrium
std::optional<CurvedDensity> strength_profile(const RefitGround& ground, const Refit& refit,
                                              const calibration::FreeParameters& parameters, Eigen::Index k);

}  // namespace supine::diagnosis
