// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/surface_io.h"

#include <fmt/core.h>
#include <vtkAlgorithm.h>
#include <vtkCallbackCommand.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCleanPolyData.h>
#include <vtkDataArray.h>
#include <vtkExecutive.h>
#include <vtkFieldData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkOBJReader.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkTriangleFilter.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLReader.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "common/error.h"
#include "common/trial_process.h"
#include "reconstruction/ply_file.h"
#include "reconstruction/surface_text.h"

namespace supine::reconstruction {
namespace {

// Keeps what VTK's algorithms would print, so that it can become an error message.
class VtkErrors {
 public:
  explicit VtkErrors(vtkAlgorithm& algorithm) : algorithm_(algorithm) {
    command_->SetCallback([](vtkObject*, unsigned long, void* client, void* text) {
      auto& message = *static_cast<std::string*>(client);
      if (message.empty() && text != nullptr) message = static_cast<const char*>(text);
    });
    command_->SetClientData(&message_);
    algorithm.AddObserver(vtkCommand::ErrorEvent, command_);
    algorithm.GetExecutive()->AddObserver(vtkCommand::ErrorEvent, command_);
    if (auto* xml = vtkXMLReader::SafeDownCast(&algorithm)) {
      xml->SetReaderErrorObserver(command_);
      xml->SetParserErrorObserver(command_);
    }
  }
  VtkErrors(const VtkErrors&) = delete;
  VtkErrors& operator=(const VtkErrors&) = delete;
  ~VtkErrors() {
    algorithm_.RemoveAllObservers();
    algorithm_.GetExecutive()->RemoveAllObservers();
  }
  bool any() const { return !message_.empty() || algorithm_.GetErrorCode() != 0; }
  std::string text() const {
    std::string text = message_;
    std::replace(text.begin(), text.end(), '\n', ' ');
    const auto end_of_place = text.find("): ");  // "ERROR: In FILE, line N CLASS (ADDRESS): "
    return text.starts_with("ERROR: In ") && end_of_place != std::string::npos ? text.substr(end_of_place + 3) : text;
  }

 private:
  vtkAlgorithm& algorithm_;
  std::string message_;
  vtkNew<vtkCallbackCommand> command_;
};

template <class Reader>
vtkSmartPointer<vtkPolyData> run_reader(const std::filesystem::path& file) {
  check_survivable_by<Reader>(file);
  vtkNew<Reader> reader;
  reader->SetFileName(file.c_str());
  const VtkErrors errors(*reader);
  reader->Update();
  vtkSmartPointer<vtkPolyData> data = reader->GetOutput();
  if (errors.any()) throw InputError(fmt::format("{}: cannot be read: {}", file.string(), errors.text()));
  return data;
}

vtkSmartPointer<vtkPolyData> polygons_of(const PlySurface& ply) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const auto& point : ply.points.rowwise()) points->InsertNextPoint(point.x(), point.y(), point.z());
  vtkNew<vtkCellArray> faces;
  for (const std::vector<int>& face : ply.faces) {
    faces->InsertNextCell(static_cast<int>(face.size()));
    for (const int vertex : face) faces->InsertCellPoint(vertex);
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(faces);
  return data;
}

void declare_from_field_data(vtkPolyData* data, const std::filesystem::path& file, Declaration& declaration) {
  for (const char* key : {"frame", "unit"}) {
    auto* text = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray(key));
    if (text == nullptr) continue;
    for (vtkIdType i = 0; i < text->GetNumberOfValues(); ++i)
      read_declaration(fmt::format("{} {}", key, text->GetValue(i)), file, declaration);
  }
}

// Point indices are checked here because the filters that follow trust them.
void check_cells(vtkPolyData* data, const std::filesystem::path& file) {
  const vtkIdType points = data->GetNumberOfPoints();
  for (vtkCellArray* cells : {data->GetPolys(), data->GetStrips()}) {
    for (vtkIdType c = 0; c < cells->GetNumberOfCells(); ++c) {
      vtkIdType size = 0;
      const vtkIdType* ids = nullptr;
      cells->GetCellAtId(c, size, ids);
      for (vtkIdType i = 0; i < size; ++i)
        if (ids[i] < 0 || ids[i] >= points)
          throw InputError(fmt::format("{}: face {} names point {}, the file has {}", file.string(), c,
                                       static_cast<long long>(ids[i]), points));
    }
  }
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

void copy_points(vtkPolyData* data, const std::filesystem::path& file, Surface& surface) {
  surface.points.resize(data->GetNumberOfPoints(), 3);
  for (vtkIdType p = 0; p < data->GetNumberOfPoints(); ++p) {
    data->GetPoint(p, surface.points.row(p).data());
    if (!surface.points.row(p).allFinite())
      throw InputError(fmt::format("{}: point {} has a coordinate that is not a finite number", file.string(), p));
  }
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

/// A triangle that stands twice, either way round, is the same surface once: it would count twice in every mean.
void drop_doubled_triangles(Surface& surface) {
  std::set<std::array<int, 3>> known;
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    std::array<int, 3> corners = {surface.triangles(t, 0), surface.triangles(t, 1), surface.triangles(t, 2)};
    std::sort(corners.begin(), corners.end());
    if (known.insert(corners).second) surface.triangles.row(kept++) = surface.triangles.row(t).eval();
  }
  surface.triangles.conservativeResize(kept, 3);
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
  const std::string kind = file.extension().string();
  vtkSmartPointer<vtkPolyData> data;
  Declaration declaration;
  if (kind == ".ply") {
    PlySurface ply = read_ply(file);
    declaration = ply.declaration;
    data = polygons_of(ply);
  } else if (kind == ".stl") {
    declaration = inspect_stl(file);
    data = run_reader<vtkSTLReader>(file);
  } else if (kind == ".obj") {
    declaration = inspect_obj(file);
    data = run_reader<vtkOBJReader>(file);
  } else if (kind == ".vtp") {
    data = run_reader<vtkXMLPolyDataReader>(file);
    declare_from_field_data(data, file, declaration);
  } else {
    throw InputError(fmt::format("{}: surfaces are read from .ply, .stl, .obj and .vtp files, not from \"{}\"",
                                 file.string(), kind));
  }
  if (data->GetNumberOfPoints() == 0) throw InputError(fmt::format("{}: has no points", file.string()));
  check_cells(data, file);
  SurfaceFile result{{}, declaration.frame};
  if (data->GetNumberOfPolys() + data->GetNumberOfStrips() > 0)
    data = only_triangles(data, kind == ".stl" || kind == ".obj");
  copy_points(data, file, result.surface);
  copy_triangles(data, result.surface);
  copy_region(data, file, result.surface);
  if (kind != ".vtp") drop_doubled_triangles(result.surface);
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
