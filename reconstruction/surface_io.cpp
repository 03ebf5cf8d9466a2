// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/surface_io.h"

#include <fmt/core.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCleanPolyData.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkTriangleFilter.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numeric>
#include <set>
#include <tuple>
#include <vector>

#include "common/error.h"
#include "common/trial_process.h"
#include "common/vtk_errors.h"
#include "common/vtk_files.h"
#include "reconstruction/obj_file.h"
#include "reconstruction/ply_file.h"
#include "reconstruction/surface_text.h"

namespace supine::reconstruction {
namespace {

vtkSmartPointer<vtkPolyData> read_stl_once(const std::filesystem::path& file) {
  vtkNew<vtkSTLReader> reader;
  reader->SetFileName(file.c_str());
  const VtkErrors errors(*reader);
  reader->Update();
  if (errors.any()) throw InputError(fmt::format("{}: cannot be read: {}", file.string(), errors.text()));
  return reader->GetOutput();
}

vtkSmartPointer<vtkPolyData> read_stl(const std::filesystem::path& file) {
  check_survivable(file, [&file] { read_stl_once(file); });
  return read_stl_once(file);
}

vtkSmartPointer<vtkPolyData> polygons_of(const Polygons& polygons) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const auto& point : polygons.points.rowwise()) points->InsertNextPoint(point.x(), point.y(), point.z());
  vtkNew<vtkCellArray> faces;
  for (const std::vector<int>& face : polygons.faces) {
    faces->InsertNextCell(static_cast<int>(face.size()));
    for (const int vertex : face) faces->InsertCellPoint(vertex);
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(faces);
  return data;
}

void declare_from_field_data(vtkPolyData& data, const std::filesystem::path& file, Declaration& declaration) {
  for (const char* key : {"frame", "unit"})
    for (const std::string& value : field_texts(data, key))
      read_declaration(fmt::format("{} {}", key, value), file, declaration);
}

vtkSmartPointer<vtkPolyData> only_triangles(vtkPolyData* data, bool merge_points) {
  vtkSmartPointer<vtkPolyData> result = data;
  if (merge_points) {
    vtkNew<vtkCleanPolyData> clean;
    clean->SetInputData(result);
    clean->SetToleranceIsAbsolute(true);
    clean->SetAbsoluteTolerance(0);
    clean->ConvertPolysToLinesOff();
    clean->Update();
    result = clean->GetOutput();
  }
  vtkNew<vtkTriangleFilter> triangulate;
  triangulate->SetInputData(result);
  triangulate->PassVertsOff();
  triangulate->PassLinesOff();
  triangulate->Update();
  return triangulate->GetOutput();
}

void copy_points(vtkPolyData* data, Surface& surface) {
  surface.points.resize(data->GetNumberOfPoints(), 3);
  for (vtkIdType p = 0; p < data->GetNumberOfPoints(); ++p) data->GetPoint(p, surface.points.row(p).data());
}

void copy_triangles(vtkPolyData* data, Surface& surface) {
  vtkCellArray* polys = data->GetPolys();
  surface.triangles.resize(polys->GetNumberOfCells(), 3);
  for (vtkIdType t = 0; t < polys->GetNumberOfCells(); ++t) {
    vtkIdType size = 0;
    const vtkIdType* ids = nullptr;
    polys->GetCellAtId(t, size, ids);
    for (int corner = 0; corner < 3; ++corner) surface.triangles(t, corner) = static_cast<int>(ids[corner]);
  }
}

/// For each point the first one at its place.
std::vector<int> first_at_place(const Points& points) {
  std::vector<int> order(points.rows()), first(points.rows());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&points](int p) { return std::tuple(points(p, 0), points(p, 1), points(p, 2), p); };
  std::sort(order.begin(), order.end(), [&key](int a, int b) { return key(a) < key(b); });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const int p = order[i];
    const bool again = i > 0 && points.row(p) == points.row(order[i - 1]);
    first[p] = again ? first[order[i - 1]] : p;
  }
  return first;
}

/// A triangle that stands twice, either way round, with points of its own or not, is the same surface once: it would
/// count twice in every mean.
void drop_doubled_triangles(Surface& surface) {
  const std::vector<int> first = first_at_place(surface.points);
  std::set<std::array<int, 3>> known;
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    std::array<int, 3> corners = {first[surface.triangles(t, 0)], first[surface.triangles(t, 1)],
                                  first[surface.triangles(t, 2)]};
    std::sort(corners.begin(), corners.end());
    if (known.insert(corners).second) surface.triangles.row(kept++) = surface.triangles.row(t).eval();
  }
  surface.triangles.conservativeResize(kept, 3);
}

/// A reading that stands twice says no more than once, and its neighbour at no distance would show no noise.
void drop_doubled_points(Surface& cloud) {
  const std::vector<int> first = first_at_place(cloud.points);
  Eigen::Index kept = 0;
  for (Eigen::Index p = 0; p < cloud.points.rows(); ++p)
    if (first[p] == p) cloud.points.row(kept++) = cloud.points.row(p).eval();
  cloud.points.conservativeResize(kept, 3);
}

void check_area(const std::filesystem::path& file, const Surface& surface) {
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const Eigen::RowVector3d a = surface.points.row(surface.triangles(t, 0)),
                             b = surface.points.row(surface.triangles(t, 1)),
                             c = surface.points.row(surface.triangles(t, 2));
    if ((b - a).cross(c - a).norm() > 0) return;
  }
  if (surface.triangles.rows() > 0)
    throw InputError(fmt::format("{}: none of its triangles has an area; write the file again", file.string()));
}

void copy_region(vtkPolyData* data, const std::filesystem::path& file, Surface& surface) {
  vtkDataArray* region = data->GetCellData()->GetArray("region");
  if (region == nullptr || region->GetNumberOfTuples() != surface.triangles.rows()) return;
  surface.region.resize(surface.triangles.rows());
  for (Eigen::Index t = 0; t < surface.region.size(); ++t) {
    const double value = region->GetComponent(t, 0);
    if (value < 0 || value >= static_cast<double>(region_names.size()) || value != std::floor(value))
      throw InputError(fmt::format("{}: triangle {} has region {}; regions are the whole numbers 0 to {}",
                                   file.string(), t, value, region_names.size() - 1));
    surface.region(t) = static_cast<int>(value);
  }
}

void drop_unused_points(Surface& surface) {
  if (surface.triangles.rows() == 0) return;
  std::vector<int> renumbered(surface.points.rows(), -1);
  for (Eigen::Index i = 0; i < surface.triangles.size(); ++i) renumbered[surface.triangles.data()[i]] = 0;
  int used = 0;
  for (Eigen::Index p = 0; p < surface.points.rows(); ++p) {
    if (renumbered[p] < 0) continue;
    surface.points.row(used) = surface.points.row(p).eval();
    renumbered[p] = used++;
  }
  surface.points.conservativeResize(used, 3);
  for (Eigen::Index i = 0; i < surface.triangles.size(); ++i)
    surface.triangles.data()[i] = renumbered[surface.triangles.data()[i]];
}

void set_text(vtkPolyData* data, const char* key, const char* value) {
  vtkNew<vtkStringArray> text;
  text->SetName(key);
  text->InsertNextValue(value);
  data->GetFieldData()->AddArray(text);
}

}  // namespace

SurfaceFile read_surface_file(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file))
    throw InputError(fmt::format("{}: there is no such file", file.string()));
  std::string kind = file.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](unsigned char c) { return std::tolower(c); });
  vtkSmartPointer<vtkPolyData> data;
  Declaration declaration;
  if (kind == ".ply" || kind == ".obj") {
    const Polygons polygons = kind == ".ply" ? read_ply(file) : read_obj(file);
    declaration = polygons.declaration;
    data = polygons_of(polygons);
  } else if (kind == ".stl") {
    declaration = inspect_stl(file);
    data = read_stl(file);
  } else if (kind == ".vtp") {
    data = read_vtp(file);
    declare_from_field_data(*data, file, declaration);
  } else {
    throw InputError(fmt::format("{}: surfaces are read from .ply, .stl, .obj and .vtp files, not from \"{}\"",
                                 file.string(), file.extension().string()));
  }
  if (data->GetNumberOfPoints() == 0) throw InputError(fmt::format("{}: has no points", file.string()));
  check_sound(file, *data);
  SurfaceFile result{{}, declaration.frame};
  if (data->GetNumberOfPolys() + data->GetNumberOfStrips() > 0)
    data = only_triangles(data, kind == ".stl" || kind == ".obj");
  copy_points(data, result.surface);
  copy_triangles(data, result.surface);
  copy_region(data, file, result.surface);
  if (result.surface.triangles.rows() == 0) drop_doubled_points(result.surface);
  if (result.surface.region.size() == 0) drop_doubled_triangles(result.surface);
  check_area(file, result.surface);
  drop_unused_points(result.surface);
  return result;
}

Surface read_surface(const std::filesystem::path& file, const std::string& case_frame) {
  if (case_frame != "LPS" && case_frame != "RAS")
    throw InputError(fmt::format("the frame of {} is said to be \"{}\"; only LPS and RAS are understood", file.string(),
                                 case_frame));
  SurfaceFile read = read_surface_file(file);
  if (read.frame.value_or(case_frame) == "RAS") read.surface.points.leftCols<2>() *= -1;
  return std::move(read.surface);
}

void write_surface(const Surface& surface, const std::filesystem::path& file,
                   const std::map<std::string, Eigen::VectorXi>& more) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(surface.points.rows());
  for (Eigen::Index p = 0; p < surface.points.rows(); ++p) points->SetPoint(p, surface.points.row(p).data());
  vtkNew<vtkCellArray> cells;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const vtkIdType ids[3] = {surface.triangles(t, 0), surface.triangles(t, 1), surface.triangles(t, 2)};
    cells->InsertNextCell(3, ids);
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  if (surface.triangles.rows() > 0) {
    data->SetPolys(cells);
  } else {
    for (vtkIdType p = 0; p < surface.points.rows(); ++p) cells->InsertNextCell(1, &p);
    data->SetVerts(cells);
  }
  const auto add_cells = [&data](const std::string& name, const Eigen::VectorXi& values) {
    vtkNew<vtkIntArray> array;
    array->SetName(name.c_str());
    for (const int value : values) array->InsertNextValue(value);
    data->GetCellData()->AddArray(array);
  };
  if (surface.region.size() > 0) add_cells("region", surface.region);
  for (const auto& [name, values] : more) add_cells(name, values);
  set_text(data, "frame", "LPS");
  set_text(data, "unit", "mm");
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetFileName(file.c_str());
  writer->SetInputData(data);
  writer->SetHeaderTypeToUInt64();
  const VtkErrors errors(*writer);
  if (writer->Write() == 0 || errors.any())
    throw InputError(fmt::format("{}: cannot be written (disk full, or no permission?)", file.string()));
}

}  // namespace supine::reconstruction
