// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "simulation/base_parameters.h"
#include "simulation/effect.h"

namespace supine::simulation {

/// The catalogue, in the order in which effects act and tables list them: what multiplies a stiffness of the base model
/// (adhesion) comes before what adds to it (ligament).
const std::vector<const Effect*>& catalogue();

/// Adds an effect of one's own at the end, for a source file that is linked to a tool:
///   const MyEffect mine;  const bool known = supine::simulation::add_to_catalogue(mine);
/// Before main() or at its beginning; @p effect must live as long as the program. @return true
/// @throws InputError  the name is taken
bool add_to_catalogue(const Effect& effect);

/// @return nullptr for an unknown name
const Effect* find_effect(const std::string& name);

/// Its traits; those of a tissue effect for an unknown name.
EffectTraits traits_of(const std::string& effect);

/// Whether it is a measurement or a numerical cause, and so none of the body.
bool is_measurement_effect(const std::string& effect);

/// Whether an effect stands for anything at some place (local_stiffness, local_muscle): the diagnosis weighs it as what
/// no effect lists, never by its name.
bool is_stand_in(const Effect& effect);

/// The effect that says where a scan lies: the catalogue's first that moves it.
const Effect& place_of_scan();

}  // namespace supine::simulation
