// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/segmentation/formats/image_files.h"

#include <fmt/format.h>
#include <unistd.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkStringArray.h>
#include <vtkXMLImageDataWriter.h>
#include <zlib.h>

#include <Eigen/Geometry>
#include <cstring>
#include <fstream>
#include <numeric>

#include "common/error.h"

namespace supine::segmentation::testing {
namespace {

namespace fs = std::filesystem;

Eigen::Vector3d signs(const std::string& frame) {
  return frame == "RAS" ? Eigen::Vector3d(-1, -1, 1) : Eigen::Vector3d(1, 1, 1);
}

Eigen::Matrix3d steps(const GreyImage& image, const std::string& frame) {
  return signs(frame).asDiagonal() * image.grid.direction * image.grid.spacing_mm.asDiagonal();
}

std::string numbers(const auto& v, const char* separator) {
  std::string text;
  for (const double x : v) text += fmt::format("{}{:.17g}", text.empty() ? "" : separator, x);
  return text;
}

void append_voxels(std::ofstream& stream, const GreyImage& image) {
  stream.write(reinterpret_cast<const char*>(image.voxels.data()),
               static_cast<std::streamsize>(image.voxels.size() * sizeof(float)));
}

std::string nrrd_header(const GreyImage& image, const std::string& frame, const std::string& encoding) {
  const Eigen::Matrix3d axes = steps(image, frame);
  return fmt::format(
      "NRRD0004\ntype: float\ndimension: 3\nspace: {}\nsizes: {} {} {}\nspace directions: ({}) ({}) ({})\nkinds: "
      "domain domain domain\n"
      "endian: little\nencoding: {}\nspace origin: ({})\n\n",
      frame == "RAS" ? "right-anterior-superior" : "left-posterior-superior", image.grid.size.x(), image.grid.size.y(),
      image.grid.size.z(), numbers(axes.col(0), ","), numbers(axes.col(1), ","), numbers(axes.col(2), ","), encoding,
      numbers(Eigen::Vector3d(signs(frame).cwiseProduct(image.grid.origin_mm)), ","));
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "supine_segmentation_XXXXXX").string();
  path_ = mkdtemp(name.data());
}

TemporaryFolder::~TemporaryFolder() { fs::remove_all(path_); }

void write_text(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

GreyImage numbered_image(const Eigen::Matrix3d& direction) {
  GreyImage image;
  image.grid.size = {5, 4, 3};
  image.grid.spacing_mm = {0.7, 0.8, 4};
  image.grid.origin_mm = {-10, 20, 30};
  image.grid.direction = direction;
  image.voxels.resize(60);
  std::iota(image.voxels.begin(), image.voxels.end(), 0.0f);
  return image;
}

Eigen::Matrix3d oblique() { return Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix(); }

void write_nrrd(const fs::path& file, const GreyImage& image, const std::string& frame) {
  std::ofstream stream(file, std::ios::binary);
  stream << nrrd_header(image, frame, "raw");
  append_voxels(stream, image);
}

void write_gzip_nrrd(const fs::path& file, const GreyImage& image) {
  std::ofstream(file, std::ios::binary) << nrrd_header(image, "LPS", "gzip");
  const gzFile stream = gzopen(file.c_str(), "ab");
  gzwrite(stream, image.voxels.data(), static_cast<unsigned>(image.voxels.size() * sizeof(float)));
  gzclose(stream);
}

void write_meta_image(const fs::path& file, const GreyImage& image, const std::string& frame) {
  const Eigen::Matrix3d direction = signs(frame).asDiagonal() * image.grid.direction;
  std::ofstream stream(file, std::ios::binary);
  stream << fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
      "TransformMatrix = {} {} {}\nOffset = {}\nCenterOfRotation = 0 0 0\nElementSpacing = {}\nDimSize = {} {} {}\n"
      "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n",
      numbers(direction.col(0), " "), numbers(direction.col(1), " "), numbers(direction.col(2), " "),
      numbers(Eigen::Vector3d(signs(frame).cwiseProduct(image.grid.origin_mm)), " "),
      numbers(image.grid.spacing_mm, " "), image.grid.size.x(), image.grid.size.y(), image.grid.size.z());
  append_voxels(stream, image);
}

void write_nifti(const fs::path& file, const GreyImage& image, Form form) {
  char header[352] = {};
  const auto put = [&header](std::size_t at, auto value) { std::memcpy(header + at, &value, sizeof value); };
  put(0, std::int32_t{348});
  put(40, std::int16_t{3});
  const Eigen::Matrix3d axes = steps(image, "RAS");
  Eigen::Matrix3d rotation = signs("RAS").asDiagonal() * image.grid.direction;
  const float qfac = rotation.determinant() < 0 ? -1.0f : 1.0f;
  rotation.col(2) *= qfac;
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() *= -1;
  put(76, qfac);
  for (int a = 0; a < 3; ++a) {
    put(42 + 2 * a, static_cast<std::int16_t>(image.grid.size[a]));
    put(80 + 4 * a, static_cast<float>(image.grid.spacing_mm[a]));
    const auto origin = static_cast<float>(signs("RAS")[a] * image.grid.origin_mm[a]);
    put(268 + 4 * a, form == Form::qform ? origin : 99.0f);  // a qform that must not be read
    put(256 + 4 * a, static_cast<float>(q.coeffs()[a]));
    for (int c = 0; c < 3; ++c) put(280 + 16 * a + 4 * c, static_cast<float>(axes(a, c)));
    put(292 + 16 * a, origin);
  }
  put(70, std::int16_t{16});
  put(72, std::int16_t{32});
  put(108, 352.0f);
  put(112, 1.0f);
  put(123, std::uint8_t{2});
  put(252, std::int16_t{form == Form::none ? std::int16_t{0} : std::int16_t{1}});
  put(254, std::int16_t{form == Form::sform ? std::int16_t{1} : std::int16_t{0}});
  std::memcpy(header + 344, "n+1", 4);
  const gzFile stream = gzopen(file.c_str(), file.extension() == ".gz" ? "wb" : "wbT");
  gzwrite(stream, header, sizeof header);
  gzwrite(stream, image.voxels.data(), static_cast<unsigned>(image.voxels.size() * sizeof(float)));
  gzclose(stream);
}

void write_vti(const fs::path& file, const GreyImage& image, const std::string& frame) {
  vtkNew<vtkImageData> data;
  data->SetDimensions(image.grid.size.data());
  data->SetSpacing(image.grid.spacing_mm.data());
  data->SetOrigin(Eigen::Vector3d(signs(frame).cwiseProduct(image.grid.origin_mm)).data());
  const Eigen::Matrix3d direction = signs(frame).asDiagonal() * image.grid.direction;
  vtkNew<vtkMatrix3x3> matrix;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) matrix->SetElement(r, c, direction(r, c));
  data->SetDirectionMatrix(matrix);
  vtkNew<vtkFloatArray> values;
  values->SetName("grey");
  for (const float v : image.voxels) values->InsertNextValue(v);
  data->GetPointData()->SetScalars(values);
  vtkNew<vtkStringArray> name;
  name->SetName("frame");
  name->InsertNextValue(frame);
  data->GetFieldData()->AddArray(name);
  vtkNew<vtkXMLImageDataWriter> writer;
  writer->SetFileName(file.c_str());
  writer->SetInputData(data);
  writer->Write();
}

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace supine::segmentation::testing
