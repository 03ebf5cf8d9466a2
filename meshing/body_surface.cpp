// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/body_surface.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "meshing/surface/sound_surface.h"
#include "meshing/surface/triangle_tree.h"

namespace supine::meshing {
namespace {

constexpr double facing_cosine = 0.866;  // 30 degrees

using Eigen::Vector3d;
using reconstruction::Region;
using reconstruction::Surface;

struct Corners {
  Vector3d a, b, c;
  Vector3d centre() const { return (a + b + c) / 3; }
  Vector3d normal() const { return (b - a).cross(c - a).normalized(); }
};

Corners corners_of(const Surface& surface, Eigen::Index t) {
  return {surface.points.row(surface.triangles(t, 0)), surface.points.row(surface.triangles(t, 1)),
          surface.points.row(surface.triangles(t, 2))};
}

double distance_mm(const Vector3d& p, const Surface& surface) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const Corners at = corners_of(surface, t);
    const Vector3d w = closest_weights(p, {at.a, at.b, at.c});
    least = std::min(least, (w[0] * at.a + w[1] * at.b + w[2] * at.c - p).norm());
  }
  return least;
}

/// How far off a support a face is, mm; 0 on the outer side of one that takes all beyond it.
double off_mm(const BodyPlace& support, const Vector3d& centre) {
  if (support.surface) return distance_mm(centre, *support.surface);
  const double height = (centre - support.point).dot(support.normal);
  return support.beyond ? std::max(0.0, -height) : std::abs(height);
}

bool lies_on(const BodyPlace& support, const Vector3d& centre, const Vector3d& normal) {
  const bool faces = support.surface || support.beyond || normal.dot(support.normal) > facing_cosine;
  return faces && off_mm(support, centre) <= support.within_mm;
}

[[noreturn]] void refuse_empty(const Surface& body, const BodyPlace& support, const std::string& what) {
  double least = std::numeric_limits<double>::infinity();
  Vector3d nearest = Vector3d::Zero();
  for (Eigen::Index t = 0; t < body.triangles.rows(); ++t) {
    const Vector3d centre = corners_of(body, t).centre();
    const double off = off_mm(support, centre);
    if (off < least) least = off, nearest = centre;
  }
  throw InputError(fmt::format(
      "{}: no face lies on support '{}' (within {:g} mm{}); the nearest, at ({:.1f}, {:.1f}, {:.1f}) mm, is {:.2f} mm "
      "off. Move the support, turn its normal out of the body, or raise within_mm",
      what, support.name, support.within_mm, support.surface || support.beyond ? "" : ", facing it to 30 degrees",
      nearest.x(), nearest.y(), nearest.z(), least));
}

}  // namespace

int support_of_face(const std::vector<BodyPlace>& supports, const Vector3d& centre, const Vector3d& normal) {
  int found = -1;
  for (std::size_t s = 0; s < supports.size(); ++s) {
    if (!lies_on(supports[s], centre, normal)) continue;
    if (found >= 0)
      throw InputError(fmt::format(
          "supports '{}' and '{}' overlap: the face at ({:.1f}, {:.1f}, {:.1f}) mm lies on both",
          supports[static_cast<std::size_t>(found)].name, supports[s].name, centre.x(), centre.y(), centre.z()));
    found = static_cast<int>(s);
  }
  return found;
}

reconstruction::Surface with_support_regions(reconstruction::Surface body, const std::vector<BodyPlace>& supports,
                                             const std::string& what) {
  if (supports.empty())
    throw InputError(fmt::format("{}: nothing holds the body; name a support ([image.supports.NAME])", what));
  std::vector<int> faces(supports.size(), 0);
  body.region = Eigen::VectorXi::Constant(body.triangles.rows(), static_cast<int>(Region::skin));
  for (Eigen::Index t = 0; t < body.triangles.rows(); ++t) {
    const Corners at = corners_of(body, t);
    const int support = support_of_face(supports, at.centre(), at.normal());
    if (support < 0) continue;
    body.region[t] = static_cast<int>(Region::inner);
    ++faces[static_cast<std::size_t>(support)];
  }
  for (std::size_t s = 0; s < supports.size(); ++s)
    if (faces[s] == 0) refuse_empty(body, supports[s], what);
  if ((body.region.array() == static_cast<int>(Region::inner)).all())
    throw InputError(fmt::format("{}: every face lies on a support; nothing of the body is free to move", what));
  return body;
}

bool lies_in_part(const BodyPlace& part, const Vector3d& at) {
  if (!part.surface) return (at - part.point).dot(part.normal) > 0;
  return winding_number(part.surface->points, part.surface->triangles, at) > 0.5;
}

}  // namespace supine::meshing
