// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/imaged_mesh.h"

#include <fmt/format.h>

#include <numeric>
#include <vector>

#include "common/error.h"
#include "meshing/topology.h"
#include "meshing/vtu_reader.h"

namespace supine::meshing {
namespace {

namespace fs = std::filesystem;

constexpr double mm3_per_ml = 1000;

void check_pose(const VtuReader& reader, const fs::path& file) {
  constexpr double moved_mm = 1e-3;
  for (const auto& [name, table] : reader.point_arrays()) {
    if (name != "displacement_mm") continue;
    const double furthest = table.rows() > 0 ? table.rowwise().norm().maxCoeff() : 0;
    if (furthest > moved_mm)
      throw InputError(
          fmt::format("{}: is the shape of a pose, moved by up to {:.1f} mm (displacement_mm) from the image; give the "
                      "imaged mesh, mesh.vtu as supine-tetrahedralise writes it",
                      file.string(), furthest));
  }
}

void check_side(const VtuReader& reader, const fs::path& file, const std::string& side) {
  const std::string own = reader.text("side").value_or("");
  if (own.empty() || own == side) return;
  throw InputError(
      fmt::format("{}: is a mesh of side \"{}\", the case says side = \"{}\"; correct [case] side, or make "
                  "the mesh again",
                  file.string(), own, side));
}

void check_volume(const TetMesh& mesh, const fs::path& file) {
  constexpr double least_ml = 10, most_ml = 10000;
  double ml = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) ml += cell_volume_mm3(mesh.points, mesh.cells, c) / mm3_per_ml;
  if (ml >= least_ml && ml <= most_ml) return;
  throw InputError(fmt::format(
      "{}: a body of {:.3g} ml (bound {:g} to {:g}); coordinates are in mm: were they, or the spacing of the "
      "image, written in cm or metres?",
      file.string(), ml, least_ml, most_ml));
}

/// Root of a point's piece, halving the ways to it.
int root_of(std::vector<int>& parent, int point) {
  while (parent[point] != point) point = parent[point] = parent[parent[point]];
  return point;
}

/// Every piece must be held somewhere, or nothing keeps it where it is.
void check_pieces(const TetMesh& mesh, const fs::path& file) {
  std::vector<int> parent(mesh.points.rows());
  std::iota(parent.begin(), parent.end(), 0);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    for (int a = 1; a < mesh.cells.cols(); ++a)
      parent[root_of(parent, mesh.cells(c, a))] = root_of(parent, mesh.cells(c, 0));
  std::vector<bool> held(parent.size(), false);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    if (mesh.region[f] != static_cast<int>(reconstruction::Region::skin))
      held[root_of(parent, mesh.faces(f, 0))] = true;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const int piece = root_of(parent, mesh.cells(c, 0));
    if (held[piece]) continue;
    double ml = 0;
    for (Eigen::Index other = c; other < mesh.cells.rows(); ++other)
      if (root_of(parent, mesh.cells(other, 0)) == piece)
        ml += cell_volume_mm3(mesh.points, mesh.cells, other) / mm3_per_ml;
    const auto at = mesh.points.row(mesh.cells(c, 0));
    throw InputError(fmt::format(
        "{}: a piece of {:.2g} ml at ({:.1f}, {:.1f}, {:.1f}) mm is attached to nothing: it touches neither "
        "the muscle nor a cut. Remove the speck from the labels, or join it to the breast",
        file.string(), ml, at.x(), at.y(), at.z()));
  }
}

}  // namespace

TetMesh read_imaged_mesh(const fs::path& file, const std::string& side) {
  const VtuReader reader(file);
  check_pose(reader, file);
  check_side(reader, file, side);
  TetMesh mesh = reader.mesh();
  if (side != "none") check_volume(mesh, file);
  check_pieces(mesh, file);
  return mesh;
}

}  // namespace supine::meshing
