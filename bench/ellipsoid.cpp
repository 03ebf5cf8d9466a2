// SPDX-License-Identifier: AGPL-3.0-or-later
#include "bench/ellipsoid.h"

#include <vtkCell.h>
#include <vtkDataSet.h>
#include <vtkGenericDataObjectReader.h>
#include <vtkNew.h>

#include <array>
#include <cmath>
#include <vector>

#include "common/error.h"
#include "tests/simulation/scene.h"
#include "tests/support/shapes.h"

namespace supine::bench {

using reconstruction::Region;

meshing::TetMesh read_ellipsoid(const std::string& file, int order) {
  vtkNew<vtkGenericDataObjectReader> reader;
  reader->SetFileName(file.c_str());
  reader->Update();
  vtkDataSet* data = vtkDataSet::SafeDownCast(reader->GetOutput());
  if (!data) throw InputError(file + " is not a VTK mesh");
  std::vector<std::array<int, 4>> cells;
  for (vtkIdType c = 0; c < data->GetNumberOfCells(); ++c)
    if (vtkCell* cell = data->GetCell(c); cell->GetCellType() == VTK_TETRA) {
      auto& nodes = cells.emplace_back();
      for (int a = 0; a < 4; ++a) nodes[a] = static_cast<int>(cell->GetPointId(a));
    }
  if (cells.empty()) throw InputError(file + " has no tetrahedra");
  meshing::TetMesh mesh;
  mesh.points.resize(data->GetNumberOfPoints(), 3);
  for (vtkIdType p = 0; p < data->GetNumberOfPoints(); ++p) data->GetPoint(p, mesh.points.row(p).data());
  mesh.points *= 1000;  // metres → mm
  mesh.cells.resize(static_cast<Eigen::Index>(cells.size()), 4);
  for (std::size_t c = 0; c < cells.size(); ++c)
    mesh.cells.row(static_cast<Eigen::Index>(c)) << cells[c][0], cells[c][1], cells[c][2], cells[c][3];
  testing::add_boundary(mesh);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    double highest = 0;
    for (const int node : mesh.faces.row(f)) highest = std::max(highest, std::abs(mesh.points(node, 2)));
    if (highest < 1e-6) mesh.region[f] = static_cast<int>(Region::inner);
  }
  return order == 2 ? testing::quadratic(mesh) : mesh;
}

meshing::Anatomy ellipsoid_anatomy(const meshing::TetMesh& mesh) {
  meshing::Anatomy anatomy;
  anatomy.outward = Eigen::Vector3d::UnitZ();
  anatomy.q.setZero(mesh.points.rows(), 2);
  return anatomy;
}

simulation::Model ellipsoid_model(simulation::BulkLaw law, double young_kpa, double skin_kpa,
                                  simulation::Compression compression) {
  simulation::Model model;
  model.breast.law = law;
  model.breast.young_modulus_kpa.value = young_kpa;
  model.breast.density_refers_to = simulation::DensityReference::undeformed;
  model.skin.young_modulus_kpa.value = skin_kpa;
  model.skin.law = simulation::SkinLaw::corotational;
  model.skin.compression = compression;
  model.interface.kind = simulation::InterfaceKind::fixed;
  return model;
}

}  // namespace supine::bench
