// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "segmentation/image.h"

// Writers for the tests: small, and independent of the readers under test.
namespace supine::segmentation::testing {

/// An empty folder that goes away with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void write_text(const std::filesystem::path& file, const std::string& text);

/// 5 x 4 x 3 voxels with the values 0 ... 59, 0.7 x 0.8 x 4 mm, in LPS.
GreyImage numbered_image(const Eigen::Matrix3d& direction = Eigen::Matrix3d::Identity());

/// A rotation about a skew axis: no axis of the image lies along one of the patient.
Eigen::Matrix3d oblique();

// Each writes float voxels. The image is in LPS; the file holds coordinates in `frame` (LPS or RAS).
void write_nrrd(const std::filesystem::path& file, const GreyImage& image, const std::string& frame = "LPS");
void write_gzip_nrrd(const std::filesystem::path& file, const GreyImage& image);  // LPS
void write_meta_image(const std::filesystem::path& file, const GreyImage& image, const std::string& frame = "LPS");
enum class Form { sform, qform, none };
void write_nifti(const std::filesystem::path& file, const GreyImage& image, Form form = Form::sform);  // always RAS
void write_vti(const std::filesystem::path& file, const GreyImage& image, const std::string& frame = "LPS");

/// The message of the Error that @p action throws; empty when it throws none.
std::string message_of(const std::function<void()>& action);

}  // namespace supine::segmentation::testing
