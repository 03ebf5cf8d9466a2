// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/tetgen_call.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#define TETLIBRARY
#include <tetgen.h>

#include "common/error.h"
#include "common/shared_random.h"
#include "meshing/topology.h"

namespace supine::meshing {
namespace {

constexpr double circumradius_share = 0.7;  // of the edge; TetGen bounds circumradii, a regular tetrahedron has 0.61

void fill_input(tetgenio& in, const reconstruction::Surface& surface) {
  in.firstnumber = 0;
  in.numberofpoints = static_cast<int>(surface.points.rows());
  in.pointlist = new REAL[surface.points.size()];  // tetgenio frees it
  std::copy(surface.points.data(), surface.points.data() + surface.points.size(), in.pointlist);
  in.numberoffacets = static_cast<int>(surface.triangles.rows());
  in.facetlist = new tetgenio::facet[in.numberoffacets];
  for (int t = 0; t < in.numberoffacets; ++t) {
    tetgenio::facet& facet = in.facetlist[t];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    tetgenio::init(facet.polygonlist);
    facet.polygonlist->numberofvertices = 3;
    facet.polygonlist->vertexlist = new int[3];
    for (int k = 0; k < 3; ++k) facet.polygonlist->vertexlist[k] = surface.triangles(t, k);
  }
}

// The grid as a background mesh: six tetrahedra round the diagonal of each box, the size as metric of each node.
void fill_background(tetgenio& background, const SizeField& sizes) {
  background.firstnumber = 0;
  background.numberofpoints = static_cast<int>(sizes.size_mm.size());
  background.pointlist = new REAL[3 * sizes.size_mm.size()];  // tetgenio frees all of these
  background.numberofpointmtrs = 1;
  background.pointmtrlist = new REAL[sizes.size_mm.size()];
  for (int z = 0; z < sizes.count.z(); ++z)
    for (int y = 0; y < sizes.count.y(); ++y)
      for (int x = 0; x < sizes.count.x(); ++x) {
        const Eigen::Index n = sizes.node(x, y, z);
        Eigen::Map<Eigen::Vector3d>(background.pointlist + 3 * n) = sizes.place(x, y, z);
        background.pointmtrlist[n] = circumradius_share * sizes.size_mm[n];
      }
  const Eigen::Vector3i boxes = sizes.count.array() - 1;
  background.numberofcorners = 4;
  background.numberoftetrahedra = 6 * boxes.prod();
  background.tetrahedronlist = new int[4 * background.numberoftetrahedra];
  int* corner = background.tetrahedronlist;
  for (int z = 0; z < boxes.z(); ++z)
    for (int y = 0; y < boxes.y(); ++y)
      for (int x = 0; x < boxes.x(); ++x)
        for (const auto& [first, second] : {std::pair{0, 1}, {1, 0}, {1, 2}, {2, 1}, {2, 0}, {0, 2}}) {
          Eigen::Vector3i at(x, y, z);
          std::array<int, 4> tet;
          tet[0] = static_cast<int>(sizes.node(at.x(), at.y(), at.z()));
          at[first] += 1;
          tet[1] = static_cast<int>(sizes.node(at.x(), at.y(), at.z()));
          at[second] += 1;
          tet[2] = static_cast<int>(sizes.node(at.x(), at.y(), at.z()));
          tet[3] = static_cast<int>(sizes.node(x + 1, y + 1, z + 1));
          if ((second - first + 3) % 3 == 2) std::swap(tet[1], tet[2]);  // one handedness for all
          corner = std::copy(tet.begin(), tet.end(), corner);
        }
}

const char* meaning(int error) {
  switch (error) {
    case 1:
      return "out of memory";
    case 3:
      return "the surface intersects itself";
    case 4:
      return "a very small feature of the surface (raise the smoothing or decimate further)";
    case 5:
      return "two triangles lie nearly on each other (raise the smoothing or decimate further)";
    default:
      return "an internal error of TetGen";
  }
}

}  // namespace

TetgenResult call_tetgen(const reconstruction::Surface& surface, const TetgenBounds& bounds, const SizeField* sizes) {
  tetgenio in, out, background;
  fill_input(in, surface);
  if (sizes) fill_background(background, *sizes);
  // p: fill a surface, Y: keep its triangles, A: number what it separates, q and a: bounds, O: optimise, Q: quiet,
  // m: edge lengths of the background.
  std::string switches =
      fmt::format("pYAQq{:.6g}/{:.6g}a{:.9f}O7/7", bounds.radius_edge, bounds.min_dihedral_deg, bounds.max_volume_mm3);
  if (sizes) switches += "m";
  try {
    const std::lock_guard alone(shared_random);
    tetrahedralize(switches.data(), &in, &out, nullptr, sizes ? &background : nullptr);
  } catch (int error) {
    throw NumericalFailure(
        fmt::format("TetGen (switches {}) stopped with error {}: {}", switches, error, meaning(error)));
  }
  if (out.numberoftetrahedra == 0)
    throw NumericalFailure(fmt::format("TetGen (switches {}) made no tetrahedra", switches));
  TetgenResult result{Eigen::Map<const Points>(out.pointlist, out.numberofpoints, 3),
                      Indices(out.numberoftetrahedra, 4), Eigen::VectorXi::Zero(out.numberoftetrahedra)};
  for (int c = 0; c < out.numberoftetrahedra; ++c) {
    for (int k = 0; k < 4; ++k) result.cells(c, k) = out.tetrahedronlist[out.numberofcorners * c + k];
    if (cell_volume_mm3(result.points, result.cells, c) < 0) std::swap(result.cells(c, 2), result.cells(c, 3));
    if (out.numberoftetrahedronattributes > 0) {
      result.chamber[c] =
          static_cast<int>(std::lround(out.tetrahedronattributelist[out.numberoftetrahedronattributes * c]));
    }
  }
  return result;
}

}  // namespace supine::meshing
