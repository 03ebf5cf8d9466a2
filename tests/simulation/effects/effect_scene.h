// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <map>
#include <string>

#include "simulation/solve/chain.h"
#include "tests/simulation/scene.h"

namespace supine::testing {

/// The effect of this name at its null setting but for @p values.
simulation::EffectSetting effect(const std::string& name, const std::map<std::string, double>& values);

/// A box of some fat, some gland, some tumour on a plane muscle.
TestScene mixed_box(int n);

/// Takes the box for two breasts, parted in its middle.
void part(TestScene& scene);

}  // namespace supine::testing
