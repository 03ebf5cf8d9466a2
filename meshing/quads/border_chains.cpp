// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/border_chains.h"

#include "reconstruction/mesh_edges.h"

namespace supine::meshing {
namespace {
constexpr double corner_cosine = 0.4;
}

BorderChains::BorderChains(const reconstruction::Surface& surface) : surface_(surface), along_(surface.points.rows()) {
  for (const reconstruction::MeshEdge& edge : reconstruction::mesh_edges(surface.triangles)) {
    if (edge.count == 2 &&
        (surface.region.size() == 0 || surface.region(edge.triangles[0]) == surface.region(edge.triangles[1])))
      continue;
    along_[edge.points[0]].push_back(edge.points[1]);
    along_[edge.points[1]].push_back(edge.points[0]);
  }
}

Eigen::RowVector3d BorderChains::walk(int p, int next, double length_mm) const {
  const int start = p;
  while (true) {
    const Eigen::RowVector3d from = surface_.points.row(p), to = surface_.points.row(next);
    const double step = (to - from).norm();
    if (step >= length_mm) return from + length_mm / step * (to - from);
    length_mm -= step;
    if (along_[next].size() != 2 || next == start) return to;
    const int beyond = along_[next][0] == p ? along_[next][1] : along_[next][0];
    p = next;
    next = beyond;
  }
}

Eigen::RowVector3d BorderChains::tangent(int p, double length_mm) const {
  Eigen::RowVector3d t = walk(p, along_[p][0], length_mm) - surface_.points.row(p);
  if (along_[p].size() == 2)
    t = (walk(p, along_[p][1], length_mm) - surface_.points.row(p)).normalized() - t.normalized();
  const double length = t.norm();
  return length > 0 ? Eigen::RowVector3d(t / length) : t;
}

double BorderChains::turn_cosine(int p, double length_mm) const {
  const Eigen::RowVector3d at = surface_.points.row(p);
  const Eigen::RowVector3d back = (at - walk(p, along_[p][0], length_mm)).normalized();
  return back.dot((walk(p, along_[p][1], length_mm) - at).normalized());
}

// Whether no point of the chain nearby turns more; of equals the lowest number counts.
bool BorderChains::sharpest(int p, double length_mm, const std::vector<double>& cosine) const {
  for (int next : along_[p]) {
    int from = p;
    double left = length_mm;
    while (next != p) {
      left -= (surface_.points.row(next) - surface_.points.row(from)).norm();
      if (left < 0 || along_[next].size() != 2) break;
      if (cosine[next] < cosine[p] - 1e-9 || (cosine[next] < cosine[p] + 1e-9 && next < p)) return false;
      const int beyond = along_[next][0] == from ? along_[next][1] : along_[next][0];
      from = next;
      next = beyond;
    }
  }
  return true;
}

std::vector<char> BorderChains::corners(const Eigen::VectorXd& size_mm) const {
  std::vector<double> cosine(along_.size(), 1);
  std::vector<char> corner(along_.size(), 0);
  for (int p = 0; p < static_cast<int>(along_.size()); ++p) {
    if (along_[p].size() == 2)
      cosine[p] = turn_cosine(p, size_mm(p));
    else
      corner[p] = along_[p].empty() ? 0 : 1;
  }
  for (int p = 0; p < static_cast<int>(along_.size()); ++p)
    if (along_[p].size() == 2 && cosine[p] < corner_cosine && sharpest(p, size_mm(p), cosine)) corner[p] = 1;
  return corner;
}

}  // namespace supine::meshing
