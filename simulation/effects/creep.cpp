// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/creep.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& Creep::parameters() const {
  static const std::vector<Parameter> rows = {
      {.name = "log_softening",
       .unit = "1",
       .lower = 0,
       .upper = 0.36,
       .median = 0.1,
       .spread = 0.7,
       .one_sided = true,
       .meaning = "ln of the modulus in the other poses over the one in prone"}};
  return rows;
}

void Creep::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                  Fields<Dual>& fields) const {
  if (!scene.is_imaged()) return;
  const Dual& log_softening = values[0];
  for (Dual& e : fields.ln_young) e -= log_softening;
}

}  // namespace supine::simulation
