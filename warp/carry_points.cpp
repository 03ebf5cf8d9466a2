// SPDX-License-Identifier: AGPL-3.0-or-later
#include "warp/carry_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/error.h"
#include "simulation/embedding.h"

namespace supine::warp {
namespace {

/// Neighbouring control points of all connected groups, with their group.
struct Segments {
  std::vector<std::pair<Eigen::Index, Eigen::Index>> ends;
  std::vector<std::size_t> group;
};

Segments segments_of(const std::vector<PointGroup>& groups) {
  Segments all;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (!groups[g].connected()) continue;
    const Eigen::Index first = groups[g].first, count = groups[g].count;
    const Eigen::Index pairs = groups[g].kind == "ClosedCurve" && count > 2 ? count : count - 1;
    for (Eigen::Index i = 0; i < pairs; ++i) {
      all.ends.emplace_back(first + i, first + (i + 1) % count);
      all.group.push_back(g);
    }
  }
  return all;
}

void refuse_outside(const meshing::TetMesh& body, const Points& points, const std::string& name, double nearest_mm) {
  Points turned = points;
  turned.leftCols<2>() *= -1;
  const double other = simulation::Embedding(body, turned).outside_mm().minCoeff();
  throw InputError(
      fmt::format("{}: every point lies outside the body, the nearest by {:.1f} mm (bound {:g} mm). {}", name,
                  nearest_mm, on_surface_mm,
                  other <= on_surface_mm
                      ? "With x and y negated some lie inside: the frame is RAS and taken as LPS, or the other "
                        "way round"
                      : "Check frame and unit (mm), and that they were marked in the pose they come from (--from)"));
}

}  // namespace

std::size_t CarriedPoints::left_behind() const {
  return static_cast<std::size_t>(std::count(was_carried.begin(), was_carried.end(), false));
}

CarriedPoints carry_points(const TwoShapes& shapes, const Points& points, const std::vector<PointGroup>& groups,
                           const std::string& name) {
  meshing::TetMesh body = shapes.mesh;
  body.points = shapes.source;
  const Segments segments = segments_of(groups);
  Points all(points.rows() + static_cast<Eigen::Index>(segments.ends.size()), 3);
  all.topRows(points.rows()) = points;
  for (std::size_t s = 0; s < segments.ends.size(); ++s)
    all.row(points.rows() + static_cast<Eigen::Index>(s)) =
        0.5 * (points.row(segments.ends[s].first) + points.row(segments.ends[s].second));
  const simulation::Embedding embedding(body, all);
  const Points moved = embedding.at(shapes.target);
  CarriedPoints carried{points, embedding.outside_mm().head(points.rows()), {}, {}};
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    carried.was_carried.push_back(carried.outside_mm[p] <= on_surface_mm);
    if (carried.was_carried.back()) carried.places.row(p) = moved.row(p);
  }
  if (carried.left_behind() == carried.was_carried.size())
    refuse_outside(body, points, name, carried.outside_mm.minCoeff());
  carried.between_mm.assign(groups.size(), 0);
  for (std::size_t s = 0; s < segments.ends.size(); ++s) {
    const auto [a, b] = segments.ends[s];
    if (!carried.was_carried[static_cast<std::size_t>(a)] || !carried.was_carried[static_cast<std::size_t>(b)])
      continue;
    const auto middle = points.rows() + static_cast<Eigen::Index>(s);
    if (embedding.outside_mm()[middle] > on_surface_mm) continue;
    double& most = carried.between_mm[segments.group[s]];
    most = std::max(most, (moved.row(middle) - 0.5 * (moved.row(a) + moved.row(b))).norm());
  }
  return carried;
}

}  // namespace supine::warp
