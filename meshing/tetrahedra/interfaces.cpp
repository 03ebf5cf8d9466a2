// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/interfaces.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "common/error.h"
#include "meshing/surface/sound_surface.h"
#include "meshing/topology.h"
#include "reconstruction/surface_check.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;
using Corners = std::array<int, 3>;

Corners sorted(Corners c) {
  std::sort(c.begin(), c.end());
  return c;
}

std::string place(const Eigen::RowVector3d& p) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p.x(), p.y(), p.z());
}

void append(Surface& all, const Surface& more) {
  const Eigen::Index points = all.points.rows(), triangles = all.triangles.rows();
  all.points.conservativeResize(points + more.points.rows(), 3);
  all.points.bottomRows(more.points.rows()) = more.points;
  all.triangles.conservativeResize(triangles + more.triangles.rows(), 3);
  all.triangles.bottomRows(more.triangles.rows()) = more.triangles.array() + static_cast<int>(points);
}

void require_disjoint(const Surface& all, const std::vector<Eigen::Index>& first,
                      const std::vector<std::string>& names) {
  const auto crossings = reconstruction::self_intersections(all);
  if (crossings.empty()) return;
  const auto owner = [&first](int t) {
    return static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), t) - first.begin()) - 1;
  };
  const auto [a, b] = crossings.front();
  throw InputError(fmt::format(
      "{} crosses {}: {} pairs of triangles, the first at {}; an interface must keep clear of the body's surface and "
      "of "
      "other interfaces: decimate it further away there, or leave it out (the tissue then counts by its share)",
      names[owner(b)], names[owner(a)], crossings.size(), place(all.points.row(all.triangles(a, 0)))));
}

// Cells on one side of all walls have one number.
std::vector<int> chambers(const TetMesh& mesh, const Triangles& walls) {
  std::map<Corners, int> faces;  // the first cell on it; −1 for a wall
  for (Eigen::Index t = 0; t < walls.rows(); ++t) faces[sorted({walls(t, 0), walls(t, 1), walls(t, 2)})] = -1;
  std::vector<std::vector<int>> next(mesh.cells.rows());
  for (int c = 0; c < mesh.cells.rows(); ++c)
    for (const auto& f : tet_faces) {
      const auto [entry, fresh] =
          faces.emplace(sorted({mesh.cells(c, f[0]), mesh.cells(c, f[1]), mesh.cells(c, f[2])}), c);
      if (fresh || entry->second < 0) continue;
      next[c].push_back(entry->second);
      next[entry->second].push_back(c);
    }
  std::vector<int> number(mesh.cells.rows(), -1), stack;
  int count = 0;
  for (int c = 0; c < mesh.cells.rows(); ++c) {
    if (number[c] >= 0) continue;
    stack.push_back(c);
    number[c] = count;
    while (!stack.empty()) {
      const int at = stack.back();
      stack.pop_back();
      for (const int other : next[at])
        if (number[other] < 0) {
          number[other] = count;
          stack.push_back(other);
        }
    }
    ++count;
  }
  return number;
}

}  // namespace

Surface with_interfaces(const Surface& body, const std::vector<Interface>& interfaces, const std::string& what) {
  Surface all = body;
  all.region.resize(0);
  std::vector<Eigen::Index> first{0};
  std::vector<std::string> names{what};
  for (const Interface& interface : interfaces) {
    if (!segmentation::is_meshed(interface.tissue))
      throw InputError(
          fmt::format("{}: {} is not meshed; an interface encloses adipose, gland, tumour or another tissue "
                      "of the mesh",
                      interface.what, segmentation::tissue_names[static_cast<int>(interface.tissue)]));
    require_sound(interface.surface, Borders::closed, interface.what);
    for (Eigen::Index t = 0; t < interface.surface.triangles.rows(); ++t) {
      const Eigen::RowVector3d p = interface.surface.points.row(interface.surface.triangles(t, 0));
      if (winding_number(body.points, body.triangles, p.transpose()) < 0.5)
        throw InputError(fmt::format("{}: lies outside {} at {}; an interface must lie inside the body", interface.what,
                                     what, place(p)));
    }
    first.push_back(all.triangles.rows());
    names.push_back(interface.what);
    append(all, interface.surface);
  }
  require_disjoint(all, first, names);
  return all;
}

Eigen::VectorXi enclosing_interfaces(const TetMesh& mesh, const Triangles& walls,
                                     const std::vector<Interface>& interfaces) {
  const std::vector<int> chamber = chambers(mesh, walls);
  std::map<int, int> enclosing;
  Eigen::VectorXi result(mesh.cells.rows());
  for (Eigen::Index c = 0; c < result.size(); ++c) {
    const auto [entry, fresh] = enclosing.emplace(chamber[c], -1);
    if (fresh) {
      Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
      for (int k = 0; k < 4; ++k) centre += mesh.points.row(mesh.cells(c, k)) / 4;
      for (std::size_t i = 0; i < interfaces.size(); ++i)
        if (winding_number(interfaces[i].surface.points, interfaces[i].surface.triangles, centre.transpose()) > 0.5)
          entry->second = static_cast<int>(i);
    }
    result[c] = entry->second;
  }
  return result;
}

void impose_interfaces(TetMesh& mesh, const Eigen::VectorXi& enclosing, const std::vector<Interface>& interfaces) {
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    if (enclosing[c] >= 0) {
      mesh.fraction.row(c).setZero();
      mesh.fraction(c, static_cast<int>(interfaces[enclosing[c]].tissue)) = 1;
    } else {
      for (const Interface& interface : interfaces) mesh.fraction(c, static_cast<int>(interface.tissue)) = 0;
      const double left = mesh.fraction.row(c).sum();
      if (left > 0)
        mesh.fraction.row(c) /= left;
      else
        mesh.fraction(c, static_cast<int>(segmentation::Tissue::adipose)) = 1;
    }
    Eigen::Index largest = 0;
    mesh.fraction.row(c).maxCoeff(&largest);
    mesh.tissue[c] = static_cast<int>(largest);
  }
}

}  // namespace supine::meshing
