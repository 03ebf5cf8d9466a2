// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/incompressibility.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& Incompressibility::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "log_factor",
                                               .unit = "1",
                                               .lower = -0.7,
                                               .upper = 4,
                                               .median = 0,
                                               .spread = 1.5,
                                               .meaning = "a of 0.5 - nu becoming (0.5 - nu) e^-a"}};
  return rows;
}

void Incompressibility::apply(const Scene&, std::span<const Dual> values, const std::map<std::string, std::string>&,
                              Fields<Dual>& fields) const {
  const Dual& log_factor = values[0];
  // As a step toward 0.5, so that a = 0 leaves ν bit for bit.
  const Dual share(-std::expm1(-log_factor.a), std::exp(-log_factor.a) * log_factor.v);
  for (Dual& nu : fields.poisson) nu += (0.5 - nu) * share;
}

}  // namespace supine::simulation
