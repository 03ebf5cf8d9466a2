// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "diagnosis/candidates.h"
#include "diagnosis/whitening.h"

namespace supine::diagnosis {

/// What the measurement says of one candidate, from the fitted model alone (no refit).
struct Score {
  std::string effect;
  /// T: fall of the whitened sum of squares, recalibration allowed for, along the slope or along the secant, whichever
  /// is more.
  double statistic;
  double slope_statistic;   ///< along the slope alone
  int freedom;              ///< q: directions tested
  double bic;               ///< b = T − q ln n_eff
  double p_value;           ///< that the best candidate of all scores as high as this one without any effect
  Eigen::VectorXd step;     ///< one-step value of each parameter, in its unit
  Eigen::VectorXd step_sd;  ///< its standard deviation
  bool wrong_sign;          ///< one-sided, and the step goes to the other side: nothing along the slope
  bool beyond_range;        ///< a step leaves three times the range from null to bound: right shape, implausible amount
  double predicted_rms_mm;  ///< of all points after the joint linear step, steps cut at the bounds
  double predicted_held_out_rms_mm;  ///< the same, every block of skin predicted without itself
  double noncentrality;  ///< λ, T expected beyond noise at the typical size: along the secant where there is one; of a
                         ///< stand-in what it leaves
  double power;          ///< chance that T at the typical size is above what 5 % of scans without any effect reach
  double expected_ln_factor;  ///< ½(λ − q ln(1 + λ/q)), of the evidence for it where it is there at its typical size,
                              ///< under a normal prior as wide as that (Laplace, over noise)
  std::vector<std::string> not_told_apart_from;  ///< candidates with a canonical correlation above 0.9
};

struct ScoreTable {
  std::vector<Score> scores;  ///< best first
  double base_rms_mm;
  double base_held_out_rms_mm;
  double effective_points;
  double chance_bic;                 ///< b of the best candidate that 5 % of scans without any effect exceed
  std::vector<std::string> effects;  ///< in the order of the candidates
  /// Largest canonical correlation of each two effects (sign aside) under Σ, what recalibration can absorb taken out: 1
  /// = this measurement cannot tell them apart.
  Eigen::MatrixXd alike;
};

/// A Bayes factor that settles whether an effect is there.
inline constexpr double settling_factor = 3;

/// ½(λ − q ln(1 + λ/q)) of @p noncentrality λ and @p freedom q; all without unit.
double expected_ln_factor(double noncentrality, int freedom);

/// Whether that is ln of a factor that settles.
bool settles(double noncentrality, int freedom);

/// How many times its typical size an effect has to be for its evidence to reach a Bayes factor in a share of all
/// scans, nothing else missing: with T = χ²_q(a² λ), that a for which ½ T / (1 + q/λ) − ½ q ln(1 + λ/q) ≥ ln_factor so
/// often. Infinite where λ = 0.
/// @param share  of the scans, in (0, 1)
double size_that_reaches(double ln_factor, double share, double noncentrality, int freedom);

/// Effects that the scan could not settle if they were there at their typical size.
std::vector<std::string> unsettled(const ScoreTable& table);

/// Chance that an effect of @p freedom directions and @p noncentrality scores above chance, noise added.
double power_of(const ScoreTable& table, int freedom, double noncentrality);

/// Projected score test (Rao's; Lagrange multiplier) of every candidate. With d̃ = L⁻¹d, S̃ = L⁻¹S and Q an orthonormal
/// basis of what recalibration can absorb, M = I − QQᵀ:
///   T = ‖P(M S̃) M d̃‖²,   φ̂ = φ⁰ − (M S̃)⁺ M d̃;   T = 0 where a one-sided φ̂ is below its null.
/// A candidate with a secant is tested along both directions and counts with the better one.
/// p: max over all candidates and directions of b under d̃ ~ N(0, I), 1000 seeded draws (Westfall and Young). It is as
/// good as Σ: with white noise it calls every mesh error an effect.
/// Predicted and base root mean squares are of the distances as they are, as those of refits.
/// @param mean_mm  #R, added to the distances for the tests and the steps: what the mesh takes away
/// @param slope    ∂d/∂u of the fitted parameters, #R by #parameters
ScoreTable score_candidates(const calibration::Residuals& residuals, const Eigen::VectorXd& mean_mm,
                            const Eigen::MatrixXd& slope, const std::vector<Candidate>& candidates,
                            const Whitening& whitening, unsigned seed);

}  // namespace supine::diagnosis
