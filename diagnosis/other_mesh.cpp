// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/other_mesh.h"

#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStaticPointLocator.h>

#include <algorithm>
#include <vector>

#include "meshing/decimate/decimate.h"
#include "meshing/tetrahedra/curve.h"
#include "meshing/tetrahedra/face_pieces.h"
#include "meshing/tetrahedra/grade.h"
#include "meshing/tetrahedra/tetrahedralise.h"
#include "meshing/topology.h"

namespace supine::diagnosis {
namespace {

using meshing::TetMesh;
using reconstruction::Region;

/// The boundary's corner triangles on points of their own. The ligament's ring, which nothing but pictures knows, is
/// not marked.
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

/// The cell of a mesh whose centre lies nearest to a place.
class NearestCell {
 public:
  explicit NearestCell(const TetMesh& mesh) {
    vtkNew<vtkPoints> centres;
    centres->SetDataTypeToDouble();
    centres->SetNumberOfPoints(mesh.cells.rows());
    for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
      const Eigen::RowVector3d centre = mesh.points(mesh.cells.row(c).head<4>(), Eigen::all).colwise().mean();
      centres->SetPoint(c, centre.data());
    }
    points_->SetPoints(centres);
    locator_->SetDataSet(points_);
    locator_->BuildLocator();
  }

  Eigen::Index at(const Eigen::RowVector3d& place) const { return locator_->FindClosestPoint(place.data()); }

 private:
  vtkNew<vtkPolyData> points_;
  vtkNew<vtkStaticPointLocator> locator_;
};

/// Fractions of the tissues and parts of @p mesh in the cells of @p other: means over four places in each, those of the
/// quadrature rule of degree 2.
void take_tissues(const TetMesh& mesh, TetMesh& other) {
  constexpr double own = 0.5854101966249685, rest = (1 - own) / 3;
  const NearestCell nearest(mesh);
  other.tissue.resize(other.cells.rows());
  other.fraction = Table::Zero(other.cells.rows(), mesh.fraction.cols());
  other.part_fraction = Table::Zero(other.cells.rows(), mesh.part_fraction.cols());
  for (Eigen::Index c = 0; c < other.cells.rows(); ++c) {
    const Points corners = other.points(other.cells.row(c).head<4>(), Eigen::all);
    for (int a = 0; a < 4; ++a) {
      const Eigen::Index from = nearest.at(rest * corners.colwise().sum() + (own - rest) * corners.row(a));
      other.fraction.row(c) += mesh.fraction.row(from) / 4;
      if (mesh.part_fraction.cols() > 0) other.part_fraction.row(c) += mesh.part_fraction.row(from) / 4;
    }
    Eigen::Index most = 0;
    other.fraction.row(c).maxCoeff(&most);
    other.tissue[c] = static_cast<int>(most);
  }
}

/// Tetrahedra inside @p surface with the tissues of @p mesh.
TetMesh filled(const reconstruction::Surface& surface, double edge_mm, const TetMesh& mesh) {
  meshing::TetrahedraliseOptions options;
  options.edge_mm = edge_mm;
  TetMesh other = meshing::tetrahedralise(surface, options, "the boundary of the mesh");
  other.muscle = mesh.muscle;
  other.support_names = mesh.support_names;
  other.muscle_support = mesh.muscle_support;
  other.part_names = mesh.part_names;
  take_tissues(mesh, other);
  if (mesh.order() == 2) {
    other = meshing::to_quadratic(other);
    meshing::CurveOptions onto_its_faces;
    onto_its_faces.smooth_share = 0;  // no voxels' noise in them
    meshing::curve_boundary(other, meshing::face_pieces(mesh), nullptr, onto_its_faces);
  }
  return other;
}

}  // namespace

TetMesh other_mesh(const TetMesh& mesh, double skin_edge_share) {
  const reconstruction::Surface surface = boundary_of(mesh);
  const double edge_mm = meshing::mean_edge_mm(surface);
  const double now_mm = meshing::skin_edge_mm(surface);  // shorter than the others where they were made so before
  const double wanted_mm = skin_edge_share * (now_mm > 0 ? std::min(edge_mm, now_mm) : edge_mm);
  return filled(meshing::refine_skin_edge(surface, wanted_mm), edge_mm, mesh);
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
  return filled(coarse, meshing::mean_edge_mm(coarse), mesh);
}

}  // namespace supine::diagnosis
