// SPDX-License-Identifier: AGPL-3.0-or-later
#include "bench/robustness_cases.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "simulation/laws/bulk_laws.h"
#include "tests/support/shapes.h"

namespace supine::bench {
namespace {

/// Even numbers that do not depend on the standard library's distributions.
class Draw {
 public:
  explicit Draw(unsigned seed) : generator_(seed) {}
  double even(double lower, double upper) { return lower + (upper - lower) * (generator_() / 4294967296.0); }
  double log_even(double lower, double upper) { return std::exp(even(std::log(lower), std::log(upper))); }

 private:
  std::mt19937 generator_;
};

Eigen::Vector3d tilted(const Eigen::Vector3d& gravity, double degrees, double about) {
  const Eigen::Vector3d axis(std::cos(about), 0, std::sin(about));
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis) * gravity;
}

}  // namespace

RobustnessShape robustness_shape(int index) {
  Draw draw(1000 + static_cast<unsigned>(index));
  RobustnessShape shape;
  // Heights are spread over their range, the rest is drawn.
  shape.height_mm = 20 + 60 * (index + 0.5) / robustness_shapes;
  shape.foot_radius_mm = draw.even(45, 75);
  shape.muscle_radius_mm = draw.log_even(90, 300);
  shape.lean_deg = draw.even(0, 25);
  testing::DomeOptions options;
  options.foot_radius_mm = shape.foot_radius_mm;
  options.rim_thickness_mm = draw.even(8, 14);
  options.height_mm = shape.height_mm;
  options.muscle_radius_mm = shape.muscle_radius_mm;
  options.rings = 5;
  options.layers = 3;
  shape.mesh = testing::dome_mesh(options);
  // z is head, -y outward: the mound sinks towards the feet with the square of its height, so the base stays.
  const double slope = std::tan(shape.lean_deg * std::numbers::pi / 180);
  for (Eigen::Index p = 0; p < shape.mesh.points.rows(); ++p) {
    const double above = std::max(0.0, -shape.mesh.points(p, 1));
    shape.mesh.points(p, 2) -= slope * above * above / (shape.height_mm + options.rim_thickness_mm);
  }
  shape.anatomy = meshing::compute_anatomy(shape.mesh, "left");
  const Eigen::Vector3d outward = -Eigen::Vector3d::UnitY();
  for (const auto& [name, gravity] : {std::pair{"prone", outward}, std::pair{"supine", Eigen::Vector3d(-outward)}}) {
    const double degrees = draw.even(0, 15), about = draw.even(0, 2 * std::numbers::pi);
    shape.poses.push_back({name, tilted(gravity, degrees, about)});
  }
  return shape;
}

simulation::Model robustness_model(int set) {
  Draw draw(50000 + static_cast<unsigned>(set));
  const auto& laws = simulation::bulk_law_names();
  simulation::Model model;
  model.breast.law = laws[static_cast<std::size_t>(set) % laws.size()].second;
  model.breast.young_modulus_kpa.value = draw.log_even(0.2, 5);
  model.breast.poisson_ratio.value = draw.even(0.3, 0.499);
  model.skin.young_modulus_kpa.value = draw.log_even(1, 100);
  model.skin.law = draw.even(0, 1) < 0.5 ? simulation::SkinLaw::neo_hookean : simulation::SkinLaw::corotational;
  return model;
}

}  // namespace supine::bench
