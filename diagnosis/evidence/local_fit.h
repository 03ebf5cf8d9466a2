// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>

#include "diagnosis/evidence/set_fit.h"

namespace supine::diagnosis {

/// Whether local causes of a kind can be followed: those of one breast whose model does not have one already, tissue
/// and skin as the effect local_stiffness, muscle as local_muscle.
bool can_follow(LocalKind kind, const calibration::MeasuredScene& scene, const simulation::Model& given);

/// A local cause of a kind as an effect, all of it free: its strength with 4 standard deviations of its field, its
/// place as places of that kind are spread over the body, its length about that of the field.
simulation::EffectSetting free_local_cause(const calibration::MeasuredScene& scene, const LocalCauses& causes,
                                           LocalKind kind, double length_mm);

/// Follows a local cause through the chain, beside nothing else, from where straight lines have its place and size.
/// @param given      the base model: where its priors stand
/// @param length_mm  where the prior of its length stands
/// @return  nothing where there is no equilibrium with it, or where it ends as what the catalogue lists
std::optional<FollowedCause> follow_local_cause(const calibration::MeasuredScene& scene, const simulation::Model& given,
                                                const BaseFit& base, const Hypothesis& nothing,
                                                const LikeliestCause& from, double length_mm);

/// The likeliest of each kind, followed beside nothing: where an effect or something local has 0.2 or more, and
/// straight lines have it no further than e⁻¹² below what is likeliest; from where it is likely beside the likeliest
/// effects too, since it may do without them.
/// @pre  weigh_unlisted() of @p hypotheses
std::vector<FollowedCause> follow_local_causes(const calibration::MeasuredScene& scene, const simulation::Model& given,
                                               const BaseFit& base, const Priors& priors,
                                               const std::vector<Hypothesis>& hypotheses);

}  // namespace supine::diagnosis
