// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Two stages on the half ellipsoid that SOFA and CalculiX were run on (docs/verification.md): gravity along -z on the
// meshed shape, then again with the shape of stage 1 taken as stress-free. Prints the tip's displacement and the time.
//
//   half_ellipsoid breast_3k.vtk breast_3k_skin.vtk [young_kpa] [neo_hookean|corotational|corotational_qr] [skin_kpa]

#include <fmt/format.h>
#include <vtkCell.h>
#include <vtkDataSet.h>
#include <vtkGenericDataObjectReader.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <map>
#include <set>

#include "common/error.h"
#include "simulation/equilibrium.h"

namespace {

using namespace supine;
using reconstruction::Region;

vtkSmartPointer<vtkDataSet> read(const char* file) {
  vtkNew<vtkGenericDataObjectReader> reader;
  reader->SetFileName(file);
  reader->Update();
  vtkSmartPointer<vtkDataSet> data = vtkDataSet::SafeDownCast(reader->GetOutput());
  if (!data) throw InputError(std::string(file) + " is not a VTK mesh");
  return data;
}

// Metres in the files, mm here.
meshing::TetMesh read_mesh(const char* tets, const char* skin) {
  const auto volume = read(tets);
  const auto surface = read(skin);
  meshing::TetMesh mesh;
  mesh.points.resize(volume->GetNumberOfPoints(), 3);
  for (vtkIdType p = 0; p < volume->GetNumberOfPoints(); ++p) {
    volume->GetPoint(p, mesh.points.row(p).data());
    mesh.points.row(p) *= 1000;
  }
  std::vector<std::array<int, 4>> cells;
  for (vtkIdType c = 0; c < volume->GetNumberOfCells(); ++c)
    if (vtkCell* cell = volume->GetCell(c); cell->GetCellType() == VTK_TETRA)
      cells.push_back(
          {int(cell->GetPointId(0)), int(cell->GetPointId(1)), int(cell->GetPointId(2)), int(cell->GetPointId(3))});
  mesh.cells.resize(cells.size(), 4);
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (int a = 0; a < 4; ++a) mesh.cells(c, a) = cells[c][a];
  std::set<std::array<int, 3>> on_skin;
  std::vector<std::array<int, 3>> faces;
  for (vtkIdType f = 0; f < surface->GetNumberOfCells(); ++f)
    if (vtkCell* face = surface->GetCell(f); face->GetCellType() == VTK_TRIANGLE)
      faces.push_back({int(face->GetPointId(0)), int(face->GetPointId(1)), int(face->GetPointId(2))});
  const std::size_t skin_faces = faces.size();
  for (const auto& cell : cells)
    for (int skip = 0; skip < 4; ++skip) {
      std::array<int, 3> face;
      for (int a = 0, i = 0; a < 4; ++a)
        if (a != skip) face[i++] = cell[a];
      if (std::all_of(face.begin(), face.end(), [&](int n) { return std::abs(mesh.points(n, 2)) < 1e-6; }))
        faces.push_back(face);
    }
  mesh.faces.resize(faces.size(), 3);
  mesh.region.resize(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int a = 0; a < 3; ++a) mesh.faces(f, a) = faces[f][a];
    mesh.region[f] = static_cast<int>(f < skin_faces ? Region::skin : Region::inner);
  }
  return mesh;
}

simulation::Model make_model(int argc, char** argv) {
  using simulation::BulkLaw;
  static const std::map<std::string, BulkLaw> laws = {{"neo_hookean", BulkLaw::neo_hookean},
                                                      {"corotational", BulkLaw::corotational},
                                                      {"corotational_qr", BulkLaw::corotational_qr}};
  simulation::Model model;
  model.breast.young_modulus_kpa.value = argc > 3 ? std::atof(argv[3]) : 1.0;
  model.breast.law = argc > 4 ? laws.at(argv[4]) : BulkLaw::neo_hookean;
  model.breast.density_refers_to = simulation::DensityReference::undeformed;
  model.skin.young_modulus_kpa.value = argc > 5 ? std::atof(argv[5]) : 22.7;
  model.skin.law = simulation::SkinLaw::corotational;
  model.skin.compression = argc > 6 ? simulation::Compression::tension_field : simulation::Compression::full;
  model.interface.kind = simulation::InterfaceKind::fixed;
  return model;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) throw InputError("usage: half_ellipsoid TETS SKIN [young_kpa] [law] [skin_kpa] [tension_field]");
  const auto start = std::chrono::steady_clock::now();
  meshing::TetMesh mesh = read_mesh(argv[1], argv[2]);
  const auto tip = mesh.points.row(0).eval();
  const auto elapsed = [&start] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  std::cout << fmt::format("read {:.3f} s, {} nodes, {} tetrahedra\n", elapsed(), mesh.points.rows(),
                           mesh.cells.rows());
  for (int stage = 1; stage <= 2; ++stage) {
    const simulation::Model model = make_model(argc, argv);
    meshing::Anatomy anatomy;
    anatomy.q.setZero(mesh.points.rows(), 2);
    simulation::Mechanics mechanics(mesh, anatomy, model);
    mechanics.set_fields(simulation::values_of(
        simulation::make_fields(model, {mesh, anatomy, mechanics.layout(), "prone"}, -Eigen::Vector3d::UnitZ())));
    simulation::EquilibriumSolver solver(mechanics);
    Points x;
    const auto report = solver.forward(mesh.points, x, fmt::format("stage {}", stage));
    mesh.points = x;
    std::cout << fmt::format("stage {}: tip u_z {:.3f} mm, {} Newton, {} load steps, min det F {:.3f}, at {:.3f} s\n",
                             stage, x(0, 2) - tip.z(), report.newton_iterations, report.load_steps, report.min_det_f,
                             elapsed());
  }
  return 0;
} catch (const supine::Error& error) {
  std::cerr << error.what() << "\n";
  return 3;
}
