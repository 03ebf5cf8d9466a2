// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/other_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <vector>

#include "meshing/decimate/decimate.h"
#include "meshing/tetrahedra/curve.h"
#include "meshing/tetrahedra/face_pieces.h"
#include "meshing/tetrahedra/grade.h"
#include "meshing/tetrahedra/ligament_ring.h"
#include "meshing/tetrahedra/tetrahedralise.h"
#include "meshing/topology.h"

namespace supine::diagnosis {
namespace {

using meshing::TetMesh;
using reconstruction::Region;

/// The boundary's corner triangles on points of their own. The ring is marked anew later.
reconstruction::Surface boundary_of(const TetMesh& mesh) {
  reconstruction::Surface surface;
  std::vector<int> of_node(static_cast<std::size_t>(mesh.points.rows()), -1), nodes;
  surface.triangles.resize(mesh.faces.rows(), 3);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      int& row = of_node[static_cast<std::size_t>(mesh.faces(f, k))];
      if (row < 0) {
        row = static_cast<int>(nodes.size());
        nodes.push_back(mesh.faces(f, k));
      }
      surface.triangles(f, k) = row;
    }
  surface.points = mesh.points(nodes, Eigen::all);
  surface.region = mesh.region;
  for (int& region : surface.region)
    if (region == static_cast<int>(Region::ligament)) region = static_cast<int>(Region::inner);
  return surface;
}

Points cell_centres(const TetMesh& mesh) {
  Points centres = Points::Zero(mesh.cells.rows(), 3);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    for (int k = 0; k < 4; ++k) centres.row(c) += 0.25 * mesh.points.row(mesh.cells(c, k));
  return centres;
}

/// Cell centres in cubes as wide as a search reaches.
class CentreGrid {
 public:
  CentreGrid(Points centres, double width_mm) : centres_(std::move(centres)), width_mm_(width_mm) {
    for (Eigen::Index c = 0; c < centres_.rows(); ++c) cubes_[cube_of(centres_.row(c))].push_back(static_cast<int>(c));
  }

  /// Nearest centre: rings of cubes until none further out can be nearer.
  int nearest(const Eigen::RowVector3d& place) const {
    const auto [i, j, k] = cube_of(place);
    int best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (int reach = 1; reach < 64; reach *= 2) {
      for (int a = i - reach; a <= i + reach; ++a)
        for (int b = j - reach; b <= j + reach; ++b)
          for (int c = k - reach; c <= k + reach; ++c) look({a, b, c}, place, best, least);
      if (least < std::numeric_limits<double>::infinity()) return best;
    }
    return best;
  }

 private:
  using Cube = std::tuple<int, int, int>;

  Cube cube_of(const Eigen::RowVector3d& p) const {
    const auto cell = [this](double x) { return static_cast<int>(std::floor(x / width_mm_)); };
    return {cell(p[0]), cell(p[1]), cell(p[2])};
  }

  void look(const Cube& cube, const Eigen::RowVector3d& place, int& best, double& least) const {
    const auto found = cubes_.find(cube);
    if (found == cubes_.end()) return;
    for (const int c : found->second) {
      const double distance = (centres_.row(c) - place).squaredNorm();
      if (distance < least) least = distance, best = c;
    }
  }

  Points centres_;
  double width_mm_;
  std::map<Cube, std::vector<int>> cubes_;
};

/// Tetrahedra inside @p surface with the tissues of @p mesh.
TetMesh filled(const reconstruction::Surface& surface, double edge_mm, const TetMesh& mesh,
               const meshing::Anatomy& anatomy) {
  meshing::TetrahedraliseOptions options;
  options.edge_mm = edge_mm;
  TetMesh other = meshing::tetrahedralise(surface, options, "the boundary of the mesh");
  other.muscle = mesh.muscle;
  other.support_names = mesh.support_names;
  other.muscle_support = mesh.muscle_support;
  other.part_names = mesh.part_names;
  const CentreGrid grid(cell_centres(mesh), edge_mm);
  const Points centres = cell_centres(other);
  other.tissue.resize(other.cells.rows());
  other.fraction.resize(other.cells.rows(), mesh.fraction.cols());
  other.part_fraction.resize(other.cells.rows(), mesh.part_fraction.cols());
  for (Eigen::Index c = 0; c < other.cells.rows(); ++c) {
    const int from = grid.nearest(centres.row(c));
    other.tissue[c] = mesh.tissue[from];
    other.fraction.row(c) = mesh.fraction.row(from);
    if (mesh.part_fraction.cols() > 0) other.part_fraction.row(c) = mesh.part_fraction.row(from);
  }
  if (mesh.order() == 2) {
    other = meshing::to_quadratic(other);
    meshing::CurveOptions onto_its_faces;
    onto_its_faces.smooth_share = 0;  // no voxels' noise in them
    meshing::curve_boundary(other, meshing::face_pieces(mesh), nullptr, onto_its_faces);
  }
  if (!anatomy.is_object()) meshing::mark_ligament_ring(other, anatomy);
  return other;
}

}  // namespace

TetMesh other_mesh(const TetMesh& mesh, const meshing::Anatomy& anatomy, double skin_edge_share) {
  const reconstruction::Surface surface = boundary_of(mesh);
  const double edge_mm = meshing::mean_edge_mm(surface);
  const double now_mm = meshing::skin_edge_mm(surface);  // shorter than the others where they were made so before
  const double wanted_mm = skin_edge_share * (now_mm > 0 ? std::min(edge_mm, now_mm) : edge_mm);
  return filled(meshing::refine_skin_edge(surface, wanted_mm), edge_mm, mesh, anatomy);
}

TetMesh coarser_mesh(const TetMesh& mesh, const meshing::Anatomy& anatomy, double triangle_share) {
  constexpr double farthest_mm = 1.5, edge_share = 0.2;  // a bound far under the edge would call for a finer mesh
  const reconstruction::Surface surface = boundary_of(mesh);
  meshing::DecimateOptions options;
  options.target_triangles = static_cast<int>(triangle_share * static_cast<double>(surface.triangles.rows()));
  options.max_distance_mm = std::max(farthest_mm, edge_share * meshing::mean_edge_mm(surface));
  options.method = meshing::DecimateMethod::triangles;
  if (anatomy.is_object()) options.sharp_deg = 40;  // a body from CAD keeps its edges
  const reconstruction::Surface coarse = meshing::decimate(surface, options).surface;
  return filled(coarse, meshing::mean_edge_mm(coarse), mesh, anatomy);
}

}  // namespace supine::diagnosis
