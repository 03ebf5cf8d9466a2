// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "diagnosis/refit.h"

namespace supine::diagnosis {

/// Size and 95 % interval of an effect that is to be named: replaces Refit::parameters, nothing else.
///
/// The mesh's error is measured again with the effect in the model, because a mesh that is too stiff makes too little
/// of the effect as well, and the refit goes on from where it is under that error. The interval of a strength without a
/// prior is a profile: the values at which F, everything else fitted again, is 3.84 · max(1, misfit) above its least;
/// cut at the range. It need not lie evenly, and may be open to the end where ever more of the effect changes nothing.
/// Tissue effects are widened by Tolerances::effect_form, sources of error by their tolerance, in quadrature. Other
/// parameters, and effects of several strengths, get linear_intervals().
/// @param sources    of the base model's examination
/// @param numerical  the mesh's error there; nullptr where it is not to be measured
void settle(const calibration::MeasuredScene& scene, const ErrorSources& sources, const NumericalError* numerical,
            const Tolerances& tolerances, const Metric& metric, Refit& refit);

}  // namespace supine::diagnosis
