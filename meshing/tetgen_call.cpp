// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetgen_call.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#define TETLIBRARY
#include <tetgen.h>

#include "common/error.h"
#include "meshing/topology.h"

namespace supine::meshing {
namespace {

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

TetgenResult call_tetgen(const reconstruction::Surface& surface, const TetgenBounds& bounds) {
  tetgenio in, out;
  fill_input(in, surface);
  // p: fill a surface, Y: keep its triangles, A: number what it separates, q and a: bounds, O: optimise, Q: quiet.
  std::string switches =
      fmt::format("pYAQq{:.6g}/{:.6g}a{:.9f}O7/7", bounds.radius_edge, bounds.min_dihedral_deg, bounds.max_volume_mm3);
  try {
    tetrahedralize(switches.data(), &in, &out);
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
