// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/ligament.h"

#include <cmath>
#include <numbers>

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "simulation/fields.h"

namespace supine::simulation {
namespace {

constexpr double edge_mm = 2;  // half of the width over which the ring's stiffness fades at its borders

// 1 inside the ring, 0 outside, cosine in between.
Dual ring_weight(const Dual& distance_mm, const Dual& half_width_mm) {
  const Dual beyond = (distance_mm.a < 0 ? -distance_mm : distance_mm) - half_width_mm;
  if (beyond.a <= -edge_mm) return Dual(1.0);
  if (beyond.a >= edge_mm) return Dual(0.0);
  return 0.5 - 0.5 * ceres::sin(beyond * (std::numbers::pi / (2 * edge_mm)));
}

// Half ring: the inframammary part alone, or all but the part toward the sternum.
bool in_arc(const std::string& arc, const Eigen::Vector2d& q) {
  if (arc == "lower") return q.y() < 0;
  if (arc == "open_medial") return q.x() > -0.5 * q.norm();
  return true;
}

// The study ties each node of the ring with compliance 1e-8 m/N, that is 1e8 mN/mm: spread over the ring's area.
double rigid_stiffness(const Scene& scene, const Eigen::VectorXd& weight) {
  const double area = weight.dot(scene.layout.interface.area_mm2);
  Eigen::VectorXd node_weight = Eigen::VectorXd::Zero(scene.mesh.points.rows());
  const auto& group = scene.layout.interface;
  const Eigen::Index per_face = group.q.rows() / std::max<Eigen::Index>(group.faces.size(), 1);
  for (Eigen::Index f = 0; f < group.faces.size(); ++f)
    for (Eigen::Index p = 0; p < per_face; ++p)
      for (int a = 0; a < scene.mesh.faces.cols(); ++a) {
        double& w = node_weight[scene.mesh.faces(group.faces[f], a)];
        w = std::max(w, weight[f * per_face + p]);
      }
  return area > 0 ? 1e8 * node_weight.sum() / area : 0;
}

}  // namespace

const std::vector<Parameter>& Ligament::parameters() const {
  static const std::vector<Parameter> rows = {
      {.name = "stiffness_kpa_per_mm",
       .unit = "kPa/mm",
       .lower = 0,
       .upper = 4,
       .median = 0.4,
       .spread = 1.0,
       .one_sided = true,
       .meaning = "tangential and normal stiffness per area of the ring"},
      {.name = "offset_mm",
       .unit = "mm",
       .lower = -30,
       .upper = 30,
       .median = 0,
       .spread = 4,
       .meaning = "distance of the ring's middle from the foot, outward positive",
       .shape = true},
      {.name = "width_mm",
       .unit = "mm",
       .null = 12,
       .lower = 1,
       .upper = 60,
       .median = 12,
       .spread = 4,
       .meaning = "width of the ring",
       .shape = true}};
  return rows;
}

const std::vector<OptionRow>& Ligament::options() const {
  static const std::vector<OptionRow> rows = {
      {"arc",
       "full",
       {"full", "lower", "open_medial"},
       "full ring; lower = its inframammary half; open_medial = without the third toward the sternum"},
      {"tie",
       "elastic",
       {"elastic", "rigid"},
       "rigid = the study's compliance of 1e-8 m/N per node instead of stiffness_kpa_per_mm"}};
  return rows;
}

void Ligament::apply(const Scene& scene, std::span<const Dual> values,
                     const std::map<std::string, std::string>& options, Fields<Dual>& fields) const {
  const Dual &stiffness_kpa_per_mm = values[0], &offset_mm = values[1], &width_mm = values[2];
  const auto& group = scene.layout.interface;
  std::vector<Dual> weight(group.q.rows(), Dual(0.0));
  Eigen::VectorXd plain = Eigen::VectorXd::Zero(group.q.rows());
  for (Eigen::Index p = 0; p < group.q.rows(); ++p) {
    const Eigen::Vector2d q = group.q.row(p).transpose();
    if (!in_arc(options.at("arc"), q)) continue;
    weight[p] = ring_weight(scene.anatomy.breast_frame(group.breast[p]).from_foot_mm(q) - offset_mm, 0.5 * width_mm);
    plain[p] = weight[p].a;
  }
  const Dual stiffness = options.at("tie") == "rigid" ? Dual(rigid_stiffness(scene, plain)) : stiffness_kpa_per_mm;
  for (Eigen::Index p = 0; p < group.q.rows(); ++p) {
    fields.interface_normal[p] += stiffness * weight[p];
    fields.interface_tangential[p] += stiffness * weight[p];
  }
}

}  // namespace supine::simulation
