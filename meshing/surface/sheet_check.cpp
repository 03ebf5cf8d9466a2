// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/surface/sheet_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "meshing/surface/triangle_tree.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;

constexpr double most_elsewhere = 0.1;  // of the inner region's area
constexpr double least_reach_mm = 3;

struct Facet {
  Eigen::Vector3d middle, area;  ///< the second: outward, its length the area
};

Facet facet(const Surface& surface, Eigen::Index t) {
  const Eigen::Vector3d a = surface.points.row(surface.triangles(t, 0)),
                        b = surface.points.row(surface.triangles(t, 1)),
                        c = surface.points.row(surface.triangles(t, 2));
  return {(a + b + c) / 3, (b - a).cross(c - a) / 2};
}

/// Areas of the inner region, mm².
struct Found {
  double all = 0, far = 0, turned = 0, farthest_mm = 0;
  Eigen::Vector3d where = Eigen::Vector3d::Zero();  ///< of the farthest
};

}  // namespace

void check_sheet(const Surface& body, const Surface& sheet, const std::string& name) {
  if (body.region.size() == 0 || sheet.triangles.rows() == 0) return;
  const TriangleTree tree(sheet.points, sheet.triangles);
  double edges_mm = 0;
  Found found;
  std::vector<std::pair<TriangleTree::Hit, Facet>> seen;
  for (Eigen::Index t = 0; t < body.triangles.rows(); ++t) {
    if (body.region(t) != static_cast<int>(reconstruction::Region::inner)) continue;
    const Facet own = facet(body, t);
    seen.emplace_back(tree.closest(own.middle), own);
    edges_mm += 2 * std::sqrt(own.area.norm() / std::sqrt(3.0));  // of an equilateral one
  }
  if (seen.empty()) return;
  const double reach_mm = std::max(least_reach_mm, 0.5 * edges_mm / static_cast<double>(seen.size()));
  for (const auto& [hit, own] : seen) {
    const double area = own.area.norm(), off_mm = std::sqrt(hit.squared_mm2);
    found.all += area;
    if (off_mm > found.farthest_mm) found.farthest_mm = off_mm, found.where = own.middle;
    if (off_mm > reach_mm)
      found.far += area;
    else if (facet(sheet, hit.triangle).area.dot(own.area) > 0)
      found.turned += area;
  }
  if (found.far > most_elsewhere * found.all)
    throw InputError(fmt::format(
        "{}: {:.0f} % of the body's inner face lie more than {:.1f} mm from this sheet (bound {:.0f} %), up to {:.1f} "
        "mm at ({:.1f}, {:.1f}, {:.1f}) mm. Is it the muscle of this body, in mm, whole and in the same frame? "
        "supine-reconstruct writes both",
        name, 100 * found.far / found.all, reach_mm, 100 * most_elsewhere, found.farthest_mm, found.where.x(),
        found.where.y(), found.where.z()));
  if (found.turned > most_elsewhere * found.all)
    throw InputError(
        fmt::format("{}: under {:.0f} % of the body's inner face its triangles face away from the body (bound {:.0f} "
                    "%): turn them round, or take the sheet that supine-reconstruct writes",
                    name, 100 * found.turned / found.all, 100 * most_elsewhere));
}

}  // namespace supine::meshing
