// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "diagnosis/evidence/set_fit.h"

namespace supine::diagnosis {

/// An end of the range of a parameter.
enum class RangeEnd { none, lower, upper };

/// The end that coordinate @p i of a fit lies at, within a hundredth of the range. The lower end of a
/// strength of one sign is where it is not there: none.
RangeEnd range_end(const calibration::FreeParameters& parameters, const Eigen::VectorXd& u, Eigen::Index i);

/// A parameter of a refit, with its 95 % interval, cut at its range.
struct FittedParameter {
  std::string name, unit;
  double value, low, high;
  RangeEnd end = RangeEnd::none;  ///< where the fit ended, or the middle of what is likely lies
};

/// A set of effects added to the model, and everything free fitted again through the whole chain.
struct Refit {
  std::vector<std::string> effects;
  bool solved = false;                      ///< whether the chain found an equilibrium; nothing below holds otherwise
  bool has_densities = false;               ///< find_strength_densities()
  bool at_border = false;                   ///< whether a place or width ended at the border of its range
  double rms_mm = 0, held_out_rms_mm = 0;   ///< fitted points; every block of skin without itself
  std::vector<FittedParameter> parameters;  ///< of the effects
  Hypothesis hypothesis;                    ///< weighed there, without its probability
  simulation::Model model;                  ///< with the effects and the fitted numbers, without nuisances
  JointFit joint;                           ///< where it ended
};

/// Follows a screened hypothesis through the chain: Levenberg-Marquardt in moduli, strengths (in their logarithm where
/// that is their prior), places and widths from where the screening has them, nuisances and discrepancy as errors, at
/// the size of the discrepancy that the screening has likeliest. Where a nuisance ends further than a standard
/// deviation from where it stood, its shape holds no more: then they are fitted as well (joint_fit.h). Laplace's
/// evidence there for every size.
///
/// A second fit begins with effects at their usual size and nothing moved (but where scans would then lie centimetres
/// off), and the likelier of both is kept, where the first ends far from what lines promise, where @p screened was
/// drawn from a refit, and where @p from had to move what is never known by more than two standard deviations, less
/// than centimetres: a strength that begins near zero may stay there. One whose lines are those of its usual size
/// begins there at once.
/// @param given     the base model: where its priors stand
/// @param from      the fit at which @p screened was drawn: the base fit, or a refit of a part of the set
Refit refit(const calibration::MeasuredScene& scene, const simulation::Model& given, const BaseFit& base,
            const JointFit& from, const std::vector<Candidate>& candidates, const Hypothesis& screened);

/// Follows a set once more from where it was followed before, under the errors of @p ground.
Refit refit_again(const calibration::MeasuredScene& scene, const BaseFit& ground, const Refit& before);

/// Follows a part of a set from where the whole ended: what the whole has found may do without the effects that the
/// part lacks.
/// @param ground  whose errors count
/// @param part    its hypothesis, of which the effects count
Refit refit_within(const calibration::MeasuredScene& scene, const simulation::Model& given, const BaseFit& ground,
                   const Refit& whole, const std::vector<Candidate>& candidates, const Hypothesis& part);

/// ln of the evidence that a refit without one of its effects is promised along straight lines from there, the numbers
/// of the effect put back to their nulls and all else free: the refit's own errors and slopes. Of an effect that is far
/// from linear, and of one that replaces what is never known, it is no more than a hint.
double promised_without(const Refit& refit, const Candidate& effect);

/// Whether every strength of an effect may as well be what it is where the effect is not there, by its 95 % interval.
bool does_nothing(const Refit& refit, const Candidate& candidate);

/// Where an effect of the refit is far from linear in its strength: the density of it, which its interval and the
/// evidence are taken from then (strength_profile.h). Many chain solves: for what is likely; once.
/// @return  what the logarithm of the evidence gains
double find_strength_densities(const calibration::MeasuredScene& scene, const std::vector<Candidate>& candidates,
                               Refit& refit);

}  // namespace supine::diagnosis
