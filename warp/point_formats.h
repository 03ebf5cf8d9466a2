// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "warp/point_file.h"

namespace supine::warp {

/// What one format keeps of a file; for point_file.cpp alone.
struct PointFile::Content {
  Points points = Points(0, 3);  // LPS
  std::vector<std::string> names;
  std::vector<PointGroup> groups;
  std::string frame, extension;

  virtual ~Content() = default;
  virtual void write(const Points& points, const std::filesystem::path& file) const = 0;

 protected:
  void add(const std::string& name, const Eigen::Vector3d& place);
};

std::unique_ptr<PointFile::Content> read_fcsv(const std::filesystem::path& file);
std::unique_ptr<PointFile::Content> read_markups(const std::filesystem::path& file);

/// What x and y are multiplied by to become LPS: 1 or -1. @throws InputError  another frame
double sign_of_frame(const std::filesystem::path& file, const std::string& frame);

}  // namespace supine::warp
