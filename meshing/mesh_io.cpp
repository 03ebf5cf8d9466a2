// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/mesh_io.h"

#include <fmt/format.h>
#include <vtkCallbackCommand.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkExecutive.h>
#include <vtkFieldData.h>
#include <vtkIdTypeArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <fstream>
#include <limits>

#include "common/error.h"
#include "meshing/supports.h"
#include "meshing/vtu_reader.h"
#include "segmentation/tissue.h"

namespace supine::meshing {
namespace {

using segmentation::Tissue;

vtkSmartPointer<vtkDoubleArray> to_array(const std::string& name, const Eigen::Ref<const Table>& table) {
  auto array = vtkSmartPointer<vtkDoubleArray>::New();
  array->SetName(name.c_str());
  array->SetNumberOfComponents(static_cast<int>(table.cols()));
  array->SetNumberOfTuples(table.rows());
  for (Eigen::Index r = 0; r < table.rows(); ++r) {
    for (int k = 0; k < table.cols(); ++k) array->SetComponent(r, k, table(r, k));
  }
  return array;
}

vtkSmartPointer<vtkIntArray> to_int_array(const std::string& name, const Eigen::Ref<const Indices>& table) {
  auto array = vtkSmartPointer<vtkIntArray>::New();
  array->SetName(name.c_str());
  array->SetNumberOfComponents(static_cast<int>(table.cols()));
  array->SetNumberOfTuples(table.rows());
  for (Eigen::Index r = 0; r < table.rows(); ++r) {
    for (int k = 0; k < table.cols(); ++k) array->SetValue(r * table.cols() + k, table(r, k));
  }
  return array;
}

template <class Names>
vtkSmartPointer<vtkStringArray> to_strings(const std::string& name, const Names& values) {
  auto array = vtkSmartPointer<vtkStringArray>::New();
  array->SetName(name.c_str());
  for (const auto& value : values) array->InsertNextValue(std::string(value));
  return array;
}

void add_cells(vtkUnstructuredGrid& grid, const Indices& rows, int type) {
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    vtkIdType nodes[10];
    for (Eigen::Index k = 0; k < rows.cols(); ++k) nodes[k] = rows(r, k);
    grid.InsertNextCell(type, rows.cols(), nodes);
  }
}

void add_cell_arrays(vtkUnstructuredGrid& grid, const TetMesh& mesh) {
  const Eigen::Index cells = mesh.cells.rows(), faces = mesh.faces.rows();
  Indices tissue = Indices::Constant(cells + faces, 1, -1), region = Indices::Zero(cells + faces, 1);
  tissue.topRows(cells) = mesh.tissue;
  region.bottomRows(faces) = mesh.region;
  grid.GetCellData()->AddArray(to_int_array("tissue", tissue));
  grid.GetCellData()->AddArray(to_int_array("region", region));
  for (int t = 0; t < segmentation::tissue_count; ++t) {
    if (!segmentation::is_meshed(static_cast<Tissue>(t))) continue;
    Table fraction = Table::Zero(cells + faces, 1);
    fraction.topRows(cells) = mesh.fraction.col(t);
    grid.GetCellData()->AddArray(to_array(fmt::format("fraction_{}", segmentation::tissue_names[t]), fraction));
  }
  for (std::size_t p = 0; p < mesh.part_names.size(); ++p) {
    Table share = Table::Zero(cells + faces, 1);
    share.topRows(cells) = mesh.part_fraction.col(static_cast<Eigen::Index>(p));
    grid.GetCellData()->AddArray(to_array("part_" + mesh.part_names[p], share));
  }
  if (mesh.support_names.empty()) return;
  Indices support = Indices::Constant(cells + faces, 1, -1);
  support.bottomRows(faces) = support_of_faces(mesh);
  grid.GetCellData()->AddArray(to_int_array("support", support));
}

void add_field_data(vtkUnstructuredGrid& grid, const TetMesh& mesh, const std::string& side) {
  vtkFieldData& fields = *grid.GetFieldData();
  fields.AddArray(to_strings("frame", std::vector<std::string>{"LPS"}));
  fields.AddArray(to_strings("unit", std::vector<std::string>{"mm"}));
  if (!side.empty()) fields.AddArray(to_strings("side", std::vector<std::string>{side}));
  fields.AddArray(to_strings("tissue_names", segmentation::tissue_names));
  fields.AddArray(to_strings("region_names", reconstruction::region_names));
  fields.AddArray(to_array("muscle_points_mm", mesh.muscle.points));
  fields.AddArray(to_int_array("muscle_triangles", mesh.muscle.triangles));
  if (!mesh.part_names.empty()) fields.AddArray(to_strings("part_names", mesh.part_names));
  if (mesh.support_names.empty()) return;
  fields.AddArray(to_strings("support_names", mesh.support_names));
  fields.AddArray(to_int_array("muscle_support", mesh.muscle_support));
}

vtkSmartPointer<vtkUnstructuredGrid> to_grid(const TetMesh& mesh, const Points& positions, const std::string& side) {
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(positions.rows());
  for (Eigen::Index i = 0; i < positions.rows(); ++i)
    points->SetPoint(i, positions(i, 0), positions(i, 1), positions(i, 2));
  grid->SetPoints(points);
  grid->Allocate(mesh.cells.rows() + mesh.faces.rows());
  const bool quadratic = mesh.order() == 2;
  add_cells(*grid, mesh.cells, quadratic ? VTK_QUADRATIC_TETRA : VTK_TETRA);
  add_cells(*grid, mesh.faces, quadratic ? VTK_QUADRATIC_TRIANGLE : VTK_TRIANGLE);
  add_cell_arrays(*grid, mesh);
  add_field_data(*grid, mesh, side);
  return grid;
}

void write_grid(vtkUnstructuredGrid& grid, const std::filesystem::path& file) {
  const std::string refusal = fmt::format("{}: cannot be written (disk full, or no permission?)", file.string());
  if (!std::ofstream(file)) throw InputError(refusal);  // before VTK prints pages about it
  vtkNew<vtkXMLUnstructuredGridWriter> writer;
  writer->SetInputData(&grid);
  writer->SetFileName(file.c_str());
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  writer->SetCompressorTypeToZLib();
  vtkNew<vtkCallbackCommand> unheard;  // VTK's pages, should the disk become full
  writer->AddObserver(vtkCommand::ErrorEvent, unheard);
  writer->GetExecutive()->AddObserver(vtkCommand::ErrorEvent, unheard);
  const bool written = writer->Write() == 1 && writer->GetErrorCode() == 0;
  writer->GetExecutive()->RemoveAllObservers();
  if (!written) throw InputError(refusal);
}

void check_rows(const std::string& name, Eigen::Index rows, Eigen::Index wanted, const char* of) {
  if (rows != wanted)
    throw InputError(fmt::format("array \"{}\" has {} rows, the mesh has {} {}", name, rows, wanted, of));
}

}  // namespace

void write_mesh(const TetMesh& mesh, const std::filesystem::path& file, const std::string& side) {
  write_grid(*to_grid(mesh, mesh.points, side), file);
}

void write_pose(const TetMesh& mesh, const Points& positions, const NamedTables& point_arrays,
                const NamedTables& cell_arrays, const std::filesystem::path& file, const std::string& side,
                const std::string& pose) {
  check_rows("positions", positions.rows(), mesh.points.rows(), "points");
  const auto grid = to_grid(mesh, positions, side);
  if (!pose.empty()) grid->GetFieldData()->AddArray(to_strings("pose", std::vector<std::string>{pose}));
  grid->GetPointData()->AddArray(to_array("displacement_mm", positions - mesh.points));
  for (const auto& [name, table] : point_arrays) {
    check_rows(name, table.rows(), mesh.points.rows(), "points");
    grid->GetPointData()->AddArray(to_array(name, table));
  }
  const Eigen::Index cells = mesh.cells.rows(), all = cells + mesh.faces.rows();
  for (const auto& [name, table] : cell_arrays) {
    if (table.rows() != all) check_rows(name, table.rows(), cells, "tetrahedra");
    Table padded = Table::Constant(all, table.cols(), std::numeric_limits<double>::quiet_NaN());
    padded.topRows(table.rows()) = table;
    grid->GetCellData()->AddArray(to_array(name, padded));
  }
  write_grid(*grid, file);
}

TetMesh read_mesh(const std::filesystem::path& file) { return VtuReader(file).mesh(); }

std::string read_side(const std::filesystem::path& file) { return VtuReader(file).text("side").value_or(""); }

PoseMesh read_pose(const std::filesystem::path& file, const std::string& wanted) {
  const VtuReader reader(file);
  if (const auto shown = reader.text("pose"); shown && !wanted.empty() && *shown != wanted)
    throw InputError(fmt::format("{}: shows pose '{}', '{}' is expected; copied over or renamed? Simulate again",
                                 file.string(), *shown, wanted));
  const Table displacement = reader.point_array("displacement_mm", 3);
  PoseMesh pose;
  pose.mesh = reader.mesh(displacement);
  pose.positions = reader.positions();
  pose.point_arrays = reader.point_arrays();
  std::erase_if(pose.point_arrays, [](const auto& named) { return named.first == "displacement_mm"; });
  return pose;
}

}  // namespace supine::meshing
