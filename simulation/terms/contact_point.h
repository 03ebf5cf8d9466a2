// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "simulation/terms/skin_pairs.h"

namespace supine::simulation {

/// Where one sample of the skin is relative to the skin opposite.
///
/// That is a smooth surface through its samples q (implicit moving least squares; Shen, O'Brien and Shewchuk 2004):
/// the gap of a sample at x is φ = Σ w_q n_q·(x - x_q) / Σ w_q, with weights w_q of the imaged area, that fall with the
/// distance and are for skin that faces the sample. φ is twice continuously differentiable in all nodes where
/// distances to the nearest facet have kinks, exact on flat skin, and blind to motions of the whole.
struct ContactPoint {
  double weight = 0;  ///< D = Σ w_q, about 1 inside the skin opposite
  double moment = 0;  ///< M = Σ w_q n_q·(x - x_q), mm
  double gap_mm() const { return moment / weight; }
};

ContactPoint contact_point(const SkinSamples& samples, const SkinShape& shape, const SkinPairs::Group& group);

/// A function of D and M with its derivatives.
struct ContactEnergy {
  double value = 0, by_weight = 0, by_moment = 0;
  double by_weight2 = 0, by_both = 0, by_moment2 = 0;
  double stiffness = 0;  ///< coverage × second derivative by the gap, kPa/mm
};

/// coverage(D) × contact_energy(M / D).
/// @pre  point.weight > 0
ContactEnergy energy_of(const ContactPoint& point, double stiffness_kpa_per_mm, double band_mm);

/// Derivatives of one sample's energy with respect to the nodes it involves.
struct ContactDerivatives {
  std::vector<int> nodes;    ///< of the sample's face, then of those opposite, each once
  Eigen::VectorXd gradient;  ///< 3 per node
  Eigen::MatrixXd hessian;   ///< 3 per node, square; where it is wanted
};

enum class Curvature { none, exact, convex };  ///< convex: without what the gap's own curvature adds

/// @param energy  energy_of() of the group's point; every derivative is that of its value
void differentiate(const SkinSamples& samples, const SkinShape& shape, const Points& x, const SkinPairs::Group& group,
                   const ContactPoint& point, const ContactEnergy& energy, Curvature curvature,
                   ContactDerivatives& result);

}  // namespace supine::simulation
