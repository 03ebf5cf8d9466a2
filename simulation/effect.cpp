// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effect.h"

namespace supine::simulation {

const std::vector<OptionRow>& Effect::options() const {
  static const std::vector<OptionRow> none;
  return none;
}

}  // namespace supine::simulation
