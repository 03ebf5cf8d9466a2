// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/vtu_reader.h"

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>

#include <cmath>
#include <limits>

#include "common/error.h"
#include "common/vtk_files.h"
#include "meshing/mesh_check.h"
#include "meshing/topology.h"
#include "segmentation/tissue.h"

namespace supine::meshing {
namespace {

Table to_table(vtkDataArray& array) {
  Table table(array.GetNumberOfTuples(), array.GetNumberOfComponents());
  for (Eigen::Index r = 0; r < table.rows(); ++r) {
    for (int k = 0; k < table.cols(); ++k) table(r, k) = array.GetComponent(r, k);
  }
  return table;
}

/// Numbers that count or name something. @param what  for the message
Eigen::MatrixXi whole_numbers(const std::filesystem::path& file, const Table& table, const std::string& what) {
  for (const double value : table.reshaped())
    if (value != std::floor(value) || std::abs(value) > std::numeric_limits<int>::max())
      throw InputError(fmt::format("{}: {} holds {}; whole numbers are expected", file.string(), what, value));
  return table.cast<int>();
}

}  // namespace

struct VtuReader::Grid {
  vtkSmartPointer<vtkUnstructuredGrid> vtk;
};

VtuReader::VtuReader(const std::filesystem::path& file) : file_(file), grid_(std::make_unique<Grid>()) {
  grid_->vtk = read_vtu(file);
  if (text("frame").value_or("LPS") != "LPS") {
    throw InputError(fmt::format("{}: frame is \"{}\"; meshes are LPS", file.string(), *text("frame")));
  }
  if (text("unit").value_or("mm") != "mm") {
    throw InputError(fmt::format("{}: unit is \"{}\"; meshes are in mm", file.string(), *text("unit")));
  }
}

VtuReader::~VtuReader() = default;

std::optional<std::string> VtuReader::text(const std::string& field) const { return field_text(*grid_->vtk, field); }

std::vector<std::string> VtuReader::texts(const std::string& field) const { return field_texts(*grid_->vtk, field); }

Points VtuReader::positions() const {
  Points points(grid_->vtk->GetNumberOfPoints(), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) grid_->vtk->GetPoint(i, points.row(i).data());
  return points;
}

Table VtuReader::point_array(const std::string& name, int components) const {
  vtkDataArray* array = grid_->vtk->GetPointData()->GetArray(name.c_str());
  if (array == nullptr) throw InputError(fmt::format("{}: has no point array \"{}\"", file_.string(), name));
  if (array->GetNumberOfComponents() != components) {
    throw InputError(fmt::format("{}: point array \"{}\" has {} components, {} are expected", file_.string(), name,
                                 array->GetNumberOfComponents(), components));
  }
  return to_table(*array);
}

NamedTables VtuReader::point_arrays() const {
  NamedTables tables;
  vtkPointData* data = grid_->vtk->GetPointData();
  for (int i = 0; i < data->GetNumberOfArrays(); ++i) {
    if (vtkDataArray* array = data->GetArray(i)) tables.emplace_back(array->GetName(), to_table(*array));
  }
  return tables;
}

Table VtuReader::cell_column(const std::string& name) const {
  vtkDataArray* array = grid_->vtk->GetCellData()->GetArray(name.c_str());
  if (array == nullptr) throw InputError(fmt::format("{}: has no cell array \"{}\"", file_.string(), name));
  if (array->GetNumberOfComponents() != 1)
    throw InputError(fmt::format("{}: cell array \"{}\" has {} numbers a cell, 1 is expected", file_.string(), name,
                                 array->GetNumberOfComponents()));
  return to_table(*array);
}

Indices VtuReader::nodes_of(long long cell, int wanted) const {
  vtkNew<vtkIdList> nodes;
  grid_->vtk->GetCellPoints(cell, nodes);
  if (nodes->GetNumberOfIds() != wanted)
    throw InputError(fmt::format("{}: cell {} has {} nodes; its kind has {}", file_.string(), cell,
                                 nodes->GetNumberOfIds(), wanted));
  Indices of_cell(1, wanted);
  for (int k = 0; k < wanted; ++k) of_cell(0, k) = static_cast<int>(nodes->GetId(k));
  return of_cell;
}

void VtuReader::read_topology(TetMesh& mesh) const {
  vtkUnstructuredGrid& grid = *grid_->vtk;
  const vtkIdType count = grid.GetNumberOfCells();
  vtkIdType cells = 0;
  while (cells < count && (grid.GetCellType(cells) == VTK_TETRA || grid.GetCellType(cells) == VTK_QUADRATIC_TETRA))
    ++cells;
  if (cells == 0)
    throw InputError(fmt::format("{}: has no tetrahedra (they must come before the triangles)", file_.string()));
  const bool quadratic = grid.GetCellType(0) == VTK_QUADRATIC_TETRA;
  mesh.cells.resize(cells, quadratic ? 10 : 4);
  mesh.faces.resize(count - cells, quadratic ? 6 : 3);
  for (vtkIdType c = 0; c < count; ++c) {
    const bool is_tet = c < cells;
    const int wanted =
        is_tet ? (quadratic ? VTK_QUADRATIC_TETRA : VTK_TETRA) : (quadratic ? VTK_QUADRATIC_TRIANGLE : VTK_TRIANGLE);
    if (grid.GetCellType(c) != wanted) {
      throw InputError(
          fmt::format("{}: cell {} is of VTK type {}; {} was expected (tetrahedra, then triangles, of one order)",
                      file_.string(), c, grid.GetCellType(c), wanted));
    }
    if (is_tet)
      mesh.cells.row(c) = nodes_of(c, static_cast<int>(mesh.cells.cols()));
    else
      mesh.faces.row(c - cells) = nodes_of(c, static_cast<int>(mesh.faces.cols()));
  }
  set_face_cells(mesh);
}

void VtuReader::read_tissue(TetMesh& mesh) const {
  const Eigen::Index cells = mesh.cells.rows();
  mesh.tissue = whole_numbers(file_, cell_column("tissue"), "cell array \"tissue\"").col(0).head(cells);
  mesh.region = whole_numbers(file_, cell_column("region"), "cell array \"region\"").col(0).tail(mesh.faces.rows());
  mesh.fraction = Table::Zero(cells, segmentation::tissue_count);
  for (int t = 0; t < segmentation::tissue_count; ++t) {
    if (!segmentation::is_meshed(static_cast<segmentation::Tissue>(t))) continue;
    mesh.fraction.col(t) = cell_column(fmt::format("fraction_{}", segmentation::tissue_names[t])).col(0).head(cells);
  }
}

void VtuReader::read_muscle(TetMesh& mesh) const {
  vtkDataArray* points = grid_->vtk->GetFieldData()->GetArray("muscle_points_mm");
  vtkDataArray* triangles = grid_->vtk->GetFieldData()->GetArray("muscle_triangles");
  if (points == nullptr || triangles == nullptr || points->GetNumberOfComponents() != 3 ||
      triangles->GetNumberOfComponents() != 3) {
    throw InputError(
        fmt::format("{}: has no muscle sheet (field data muscle_points_mm and muscle_triangles, three components each)",
                    file_.string()));
  }
  mesh.muscle.points = to_table(*points);
  mesh.muscle.triangles = whole_numbers(file_, to_table(*triangles), "muscle_triangles");
  if (!mesh.muscle.points.allFinite())
    throw InputError(fmt::format("{}: muscle_points_mm holds a coordinate that is not finite", file_.string()));
  const auto& rows = mesh.muscle.triangles;
  if (rows.size() > 0 && (rows.minCoeff() < 0 || rows.maxCoeff() >= mesh.muscle.points.rows())) {
    throw InputError(
        fmt::format("{}: muscle_triangles names a point that muscle_points_mm does not have", file_.string()));
  }
}

void VtuReader::read_parts(TetMesh& mesh) const {
  mesh.part_names = texts("part_names");
  mesh.part_fraction.resize(mesh.cells.rows(), static_cast<Eigen::Index>(mesh.part_names.size()));
  for (std::size_t p = 0; p < mesh.part_names.size(); ++p)
    mesh.part_fraction.col(static_cast<Eigen::Index>(p)) =
        cell_column("part_" + mesh.part_names[p]).col(0).head(mesh.cells.rows());
}

void VtuReader::read_supports(TetMesh& mesh) const {
  mesh.support_names = texts("support_names");
  if (mesh.support_names.empty()) return;
  vtkDataArray* of_triangle = grid_->vtk->GetFieldData()->GetArray("muscle_support");
  if (of_triangle == nullptr || of_triangle->GetNumberOfTuples() != mesh.muscle.triangles.rows())
    throw InputError(
        fmt::format("{}: field data muscle_support needs one number per triangle of muscle_triangles", file_.string()));
  mesh.muscle_support = whole_numbers(file_, to_table(*of_triangle), "muscle_support").col(0);
  if (mesh.muscle_support.minCoeff() < 0 ||
      mesh.muscle_support.maxCoeff() >= static_cast<int>(mesh.support_names.size()))
    throw InputError(
        fmt::format("{}: muscle_support names a support that support_names does not have", file_.string()));
}

TetMesh VtuReader::mesh(const Table& displacement) const {
  TetMesh mesh;
  mesh.points = positions();
  if (displacement.size() > 0) mesh.points -= displacement;
  read_topology(mesh);
  read_tissue(mesh);
  read_muscle(mesh);
  read_parts(mesh);
  read_supports(mesh);
  try {
    check_mesh(mesh);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", file_.string(), error.what()));
  }
  return mesh;
}

}  // namespace supine::meshing
