// SPDX-License-Identifier: AGPL-3.0-or-later
// An effect that Supine does not have: a scar, a patch of skin that is stiffer than the rest. This file is all it
// takes.
#include <cmath>

#include "meshing/anatomy.h"
#include "simulation/catalogue.h"
#include "simulation/fields.h"

namespace {

using supine::simulation::Dual;
using supine::simulation::Fields;
using supine::simulation::Parameter;
using supine::simulation::Scene;

class Scar : public supine::simulation::Effect {
 public:
  std::string name() const override { return "scar"; }
  std::string meaning() const override { return "a patch of stiffer skin, lower and outer"; }

  const std::vector<Parameter>& parameters() const override {
    static const std::vector<Parameter> rows = {{.name = "log_ratio",
                                                 .unit = "1",
                                                 .lower = 0,
                                                 .upper = 4,
                                                 .median = 1.5,
                                                 .spread = 0.7,
                                                 .one_sided = true,
                                                 .meaning = "ln of the scar's stiffness over the skin's"}};
    return rows;
  }

  /// Multiplies the stiffness of the skin by exp(log_ratio) in the middle of the patch, fading to 1 at its border.
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
             Fields<Dual>& fields) const override {
    const Dual& log_ratio = values[0];
    const Eigen::Vector2d centre(0.35, -0.35);  // outer, lower; in radii of the breast's foot
    constexpr double radius = 0.4;
    const auto& skin = scene.layout.skin;
    for (Eigen::Index f = 0; f < skin.faces.size(); ++f) {
      const double r = (skin.q.row(f).transpose() - centre).norm() / radius;
      if (r >= 1) continue;
      fields.skin_modulus[f] *= ceres::exp(log_ratio * std::pow(1 - r * r, 2));
    }
  }
};

const Scar scar;
const bool known = supine::simulation::add_to_catalogue(scar);

}  // namespace
