// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkStringArray.h>
#include <vtkUnsignedCharArray.h>
#include <vtkXMLImageDataWriter.h>

#include <algorithm>

#include "common/error.h"
#include "common/vtk_errors.h"
#include "common/vtk_files.h"
#include "segmentation/formats/image_formats.h"
#include "segmentation/formats/image_io.h"
#include "segmentation/formats/labels_io.h"
#include "segmentation/tissue.h"

namespace supine::segmentation {
namespace {

constexpr const char* label_array = "tissue";
constexpr const char* share_array = "fraction_gland";
constexpr const char* support_array = "support";
constexpr const char* support_names = "support_names";

void add_strings(vtkImageData& image, const char* name, const std::vector<std::string>& values) {
  vtkNew<vtkStringArray> array;
  array->SetName(name);
  for (const std::string& value : values) array->InsertNextValue(value);
  image.GetFieldData()->AddArray(array);
}

/// The scalar array: `tissue`, else the active scalars, else the only array; of points, else of cells.
vtkDataArray* find_scalars(vtkImageData& image, bool& on_cells) {
  for (const bool cells : {false, true}) {
    vtkDataSetAttributes* data = cells ? static_cast<vtkDataSetAttributes*>(image.GetCellData()) : image.GetPointData();
    vtkDataArray* array = data->GetArray(label_array);
    if (!array) array = data->GetScalars();
    if (!array && data->GetNumberOfArrays() == 1) array = data->GetArray(0);
    on_cells = cells;
    if (array) return array;
  }
  return nullptr;
}

}  // namespace

namespace formats {

RawImage read_vti(const std::filesystem::path& file) {
  const auto read = supine::read_vti(file);
  vtkImageData& data = *read;
  bool on_cells = false;
  vtkDataArray* scalars = find_scalars(data, on_cells);
  if (!scalars)
    throw InputError(fmt::format("{}: no scalar array (`{}`) on points or cells", file.string(), label_array));
  if (scalars->GetNumberOfComponents() != 1)
    throw InputError(fmt::format("{}: array \"{}\" has {} components; a scalar volume is needed, not colour",
                                 file.string(), scalars->GetName() ? scalars->GetName() : "",
                                 scalars->GetNumberOfComponents()));
  if (const auto unit = field_text(data, "unit"); unit && *unit != "mm")
    throw InputError(fmt::format("{}: field data unit is \"{}\"; mm expected", file.string(), *unit));
  RawImage image;
  image.frame = field_text(data, "frame");
  Eigen::Vector3d first;  // continuous index of the first voxel's centre
  for (int a = 0; a < 3; ++a) {
    const int *extent = data.GetExtent(), points = extent[2 * a + 1] - extent[2 * a] + 1;
    image.grid.size[a] = on_cells ? points - 1 : points;
    first[a] = extent[2 * a] + (on_cells ? 0.5 : 0.0);
    image.grid.origin_mm[a] = data.GetOrigin()[a];
    for (int r = 0; r < 3; ++r) image.axes(r, a) = data.GetDirectionMatrix()->GetElement(r, a) * data.GetSpacing()[a];
    if (!(data.GetSpacing()[a] > 0))
      throw InputError(
          fmt::format("{}: Spacing of axis {} is {} mm; it must be > 0", file.string(), a, data.GetSpacing()[a]));
  }
  check_size(file, image.grid.size);
  image.grid.origin_mm += image.axes * first;
  if (static_cast<std::size_t>(scalars->GetNumberOfTuples()) != image.grid.count())
    throw InputError(
        fmt::format("{}: {} values for {} voxels", file.string(), scalars->GetNumberOfTuples(), image.grid.count()));
  image.voxels.resize(image.grid.count());
  if (auto* bytes = vtkUnsignedCharArray::SafeDownCast(scalars)) {
    std::copy_n(bytes->GetPointer(0), image.voxels.size(), image.voxels.begin());
  } else {
    for (std::size_t n = 0; n < image.voxels.size(); ++n)
      image.voxels[n] = static_cast<float>(scalars->GetComponent(static_cast<vtkIdType>(n), 0));
  }
  return image;
}

}  // namespace formats

void write_labels(const LabelImage& labels, const std::filesystem::path& file, const LabelNotes& notes,
                  const std::vector<float>& gland_share, const SupportVoxels& supports) {
  const Grid& grid = labels.grid;
  vtkNew<vtkImageData> data;
  data->SetDimensions(grid.size.x(), grid.size.y(), grid.size.z());
  data->SetOrigin(grid.origin_mm.data());
  data->SetSpacing(grid.spacing_mm.data());
  vtkNew<vtkMatrix3x3> direction;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) direction->SetElement(r, c, grid.direction(r, c));
  data->SetDirectionMatrix(direction);
  vtkNew<vtkUnsignedCharArray> tissue;
  tissue->SetName(label_array);
  // VTK only reads from the borrowed array.
  tissue->SetArray(const_cast<std::uint8_t*>(labels.voxels.data()), static_cast<vtkIdType>(labels.voxels.size()), 1);
  data->GetPointData()->SetScalars(tissue);
  vtkNew<vtkFloatArray> share;
  if (!gland_share.empty()) {
    share->SetName(share_array);
    share->SetArray(const_cast<float*>(gland_share.data()), static_cast<vtkIdType>(gland_share.size()), 1);
    data->GetPointData()->AddArray(share);
  }
  vtkNew<vtkUnsignedCharArray> support;
  if (!supports.names.empty()) {
    support->SetName(support_array);
    support->SetArray(const_cast<std::uint8_t*>(supports.number.data()), static_cast<vtkIdType>(supports.number.size()),
                      1);
    data->GetPointData()->AddArray(support);
    add_strings(*data, support_names, supports.names);
  }
  add_strings(*data, "frame", {"LPS"});
  add_strings(*data, "unit", {"mm"});
  add_strings(*data, "tissue_names", {tissue_names.begin(), tissue_names.end()});
  for (const auto& [key, value] : notes) add_strings(*data, key.c_str(), {value});
  vtkNew<vtkXMLImageDataWriter> writer;
  const VtkErrors errors(*writer);
  writer->SetFileName(file.c_str());
  writer->SetInputData(data);
  writer->SetCompressionLevel(1);
  writer->EncodeAppendedDataOff();
  if (writer->Write() != 1 || errors.any())
    throw InputError(fmt::format("{}: cannot be written (disk full, or no permission?)", file.string()));
}

LabelImage read_labels(const std::filesystem::path& file) {
  const ImageFile image = read_image(file, "");
  LabelImage labels{image.image.grid, std::vector<std::uint8_t>(image.image.voxels.size())};
  for (std::size_t n = 0; n < labels.voxels.size(); ++n) {
    const float value = image.image.voxels[n];
    labels.voxels[n] = static_cast<std::uint8_t>(value);
    if (value < 0 || value >= tissue_count || labels.voxels[n] != value)
      throw InputError(
          fmt::format("{}: value {} of array `{}` is not a tissue (0 to {}); write the file with supine-segment",
                      file.string(), value, label_array, tissue_count - 1));
  }
  return labels;
}

std::vector<float> read_gland_share(const std::filesystem::path& file) {
  const auto read = supine::read_vti(file);
  auto* array = vtkFloatArray::SafeDownCast(read->GetPointData()->GetArray(share_array));
  if (!array) return {};
  if (array->GetNumberOfComponents() != 1)
    throw InputError(fmt::format("{}: array `{}` has {} components; one number a voxel is expected", file.string(),
                                 share_array, array->GetNumberOfComponents()));
  std::vector<float> share(array->GetPointer(0), array->GetPointer(0) + array->GetNumberOfTuples());
  for (const float value : share)
    if (!(value >= 0 && value <= 1))
      throw InputError(fmt::format("{}: value {} of array `{}` is no share, 0 to 1; write the file with supine-segment",
                                   file.string(), value, share_array));
  return share;
}

SupportVoxels read_label_supports(const std::filesystem::path& file) {
  const auto read = supine::read_vti(file);
  vtkImageData& data = *read;
  SupportVoxels supports;
  supports.names = field_texts(data, support_names);
  if (supports.names.empty()) return supports;
  auto* array = vtkUnsignedCharArray::SafeDownCast(data.GetPointData()->GetArray(support_array));
  if (!array || array->GetNumberOfComponents() != 1 || !data.GetPointData()->GetArray(label_array))
    throw InputError(
        fmt::format("{}: field data `{}` names {} supports, but there is no point array `{}` of one byte "
                    "a voxel; write the file with supine-segment",
                    file.string(), support_names, supports.names.size(), support_array));
  supports.number.assign(array->GetPointer(0), array->GetPointer(0) + array->GetNumberOfTuples());
  if (std::all_of(supports.number.begin(), supports.number.end(), [](std::uint8_t number) { return number == 0; }))
    throw InputError(
        fmt::format("{}: no voxel of array `{}` belongs to one of the {} supports; write the file with "
                    "supine-segment",
                    file.string(), support_array, supports.names.size()));
  for (const std::uint8_t number : supports.number)
    if (number > supports.names.size())
      throw InputError(
          fmt::format("{}: value {} of array `{}` is no support (0 to {}); write the file with "
                      "supine-segment",
                      file.string(), number, support_array, supports.names.size()));
  return supports;
}

LabelNotes read_label_notes(const std::filesystem::path& file) {
  const auto read = supine::read_vti(file);
  LabelNotes notes;
  for (const char* key : {"cut", "rim_mm", "side"})
    if (const auto value = field_text(*read, key)) notes[key] = *value;
  return notes;
}

}  // namespace supine::segmentation
