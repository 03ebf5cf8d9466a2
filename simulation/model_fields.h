// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/fields.h"
#include "simulation/model.h"

namespace supine::simulation {

/// The fields of @p model in one pose: base model first, then its effects in the order of the catalogue, whatever
/// their order in the model.
/// @param gravity  unit vector of the pose
/// @param varied   the parameter the derivatives are taken with respect to (parameters.h), of the base model or of any
///   effect of the catalogue: one that is not in the model acts at its null. Empty: no derivatives.
/// @throws InputError  an effect or parameter that does not exist
Fields<Dual> make_fields(const Model& model, const Scene& scene, const Eigen::Vector3d& gravity,
                         const std::string& varied = {});

/// Refuses effects that can change nothing here, so that nobody waits for them: no tissue of that kind, no interface
/// point in the ring, a law or a boundary that does not read the field.
/// @throws InputError  naming the effect and the reason
void check_effects_act(const Model& model, const Scene& scene);

}  // namespace supine::simulation
