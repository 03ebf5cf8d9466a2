// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/fields.h"
#include "simulation/model.h"

namespace supine::simulation {

/// What holds a fixed support of an object, kPa/mm, along and across: a slab of 30 mm × 30 mm turns by less than 1e-6 °
/// under the moment of 0.2 kg at 0.1 m.
inline constexpr double fixed_support_kpa_per_mm = 1e6;

/// How the tissue is held on a support: as the model says of its name, or of the interface.
InterfaceKind kind_of_support(const Model& model, const meshing::TetMesh& mesh, int support);

/// Whether a support of that kind holds by springs that do not let it slide: elastic, and fixed ones with a name.
bool is_tied(InterfaceKind kind, const meshing::TetMesh& mesh);

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
