// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "diagnosis/refit.h"
#include "diagnosis/score_test.h"

namespace supine::diagnosis {

enum class Verdict { nothing_missing, missing, ambiguous, unexplained };
/// nothing_missing, missing, ambiguous, unexplained.
std::string verdict_name(Verdict verdict);

/// Bounds of the verdict (docs/diagnosis.md).
struct VerdictRules {
  double p_value = 0.05;         ///< of the best candidate, over the whole catalogue
  double held_out_share = 0.05;  ///< the held-out RMS must fall by this share
  double held_out_mm = 0.05;     ///< and by this much
  double excess_share = 0.3;     ///< or by this share of what it has above the noise, in squares
  double bic = 6;  ///< least evidence of what is named; candidates within this of the best cannot be told from it,
                   ///< times the misfit left
  double sure_p = 0.01;             ///< of an effect that counts by itself, whatever the held-out blocks show
  double pose_bic = 2;              ///< least b in the fitted pose where another one says the rest
  double pose_excess_share = 0.05;  ///< a fitted pose left out must lose this share of its excess, in squares
  double weak_excess_share = 0.2;   ///< this where b is under `bic`
  double strong_bic = 20;           ///< evidence that something real is behind, whatever it is
  double lack_of_fit_p = 0.01;      ///< what is left after the best is more than errors; skin left out and poses that
                                    ///< were not fitted must then lose excess_share each
  double slight_misfit = 1.1;       ///< unless it is this small on the mean
  double lack_of_fit_misfit = 1.6;  ///< and this many times what errors would leave on the mean
};

/// What is left of a model after its fit.
struct LackOfFit {
  double misfit = 1;   ///< data part of F per degree of freedom; 1 when all is explained
  double p_value = 1;  ///< of smooth shapes over the skin (28 polynomials in q, per pose), χ²
};

LackOfFit lack_of_fit(const WeightedFit& fit, const Metric& metric);

/// The base model as refits are compared with it.
struct BaseFigures {
  double rms_mm = 0, held_out_rms_mm = 0, noise_mm = 0;
  std::vector<double> pose_rms_mm;  ///< poses that were not fitted, then fitted ones left out
  LackOfFit left;
  std::size_t unfitted_poses = 0;       ///< how many of these poses were not fitted
  std::vector<double> pose_noise_mm{};  ///< of their scans; empty = noise_mm for each
};

struct Diagnosis {
  Verdict verdict = Verdict::nothing_missing;
  std::vector<std::string> missing;  ///< the one; the whole set when ambiguous; the best when unexplained
  std::string why;                   ///< one sentence
  LackOfFit left;                    ///< after the best
};

/// nothing_missing  no score that chance would not give (p), or nothing that lowers the held-out error. Where errors
///                  would not leave what is left (lack_of_fit_p), p is not asked of the best if b, the held-out error
///                  and poses that were not fitted show it each: a score has to get past the effect's own tolerance
/// missing          one refit counts and no other comes near. Its evidence is b plus what poses that were not fitted
///                  gain with it (Refit::pose_gain; at most twice b for it, nothing where they end further off, in
///                  full against it). It counts where b and evidence are `bic` or more and the held-out error falls,
///                  or those poses alone gain `bic`, or its own p is below sure_p, because blocks of skin predicted
///                  without themselves cannot show what lies under one of them alone. With such a p b of pose_bic will
///                  do where the evidence is `bic`, or such a pose, or one left out, loses weak_excess_share; with a p
///                  under p_value where the evidence is `bic`, the held-out error falls and such a pose loses
///                  weak_excess_share. Where one speaks against it (gain below −pose_bic) or has no equilibrium the
///                  evidence must be `strong_bic`; with a place or width at the border of its range it does not count
///                  (a steep hill of the chest wall is what makes up for a scar); fitted poses left out, where several
///                  are fitted, have to fall too
/// ambiguous        others have evidence within `bic` of the best, measurement effects first
/// unexplained      nothing counts, though the residual is real or the best b is at least `strong_bic`; or the best
///                  leaves much of a real residual, or some of it and most of what skin left out, or a pose that was
///                  not fitted, has above the noise
/// @param refits  best first; of them only finished ones count
/// @param left    lack of fit of each refit
Diagnosis decide(const ScoreTable& table, const std::vector<Refit>& refits, const std::vector<LackOfFit>& left,
                 const BaseFigures& base, const VerdictRules& rules = {});

}  // namespace supine::diagnosis
