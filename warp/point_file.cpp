// SPDX-License-Identifier: AGPL-3.0-or-later
#include "warp/point_file.h"

#include <fmt/format.h>

#include "common/error.h"
#include "common/landmarks.h"
#include "warp/point_formats.h"

namespace supine::warp {
namespace {

namespace fs = std::filesystem;

/// name,x,y,z[,sigma_mm]
class TableFile : public PointFile::Content {
 public:
  TableFile(const fs::path& file, const std::string& table_frame) : landmarks_(read_landmarks(file, table_frame)) {
    frame = table_frame;
    extension = ".csv";
    for (std::size_t i = 0; i < landmarks_.names.size(); ++i)
      add(landmarks_.names[i], landmarks_.points.row(static_cast<Eigen::Index>(i)).transpose());
    groups.push_back({file.stem().string(), "points", 0, landmarks_.points.rows()});
  }

  void write(const Points& places, const fs::path& file) const override {
    Landmarks moved = landmarks_;
    moved.points = places;
    if (frame == "RAS") moved.points.leftCols<2>() *= -1;
    write_landmarks(moved, file);
  }

 private:
  Landmarks landmarks_;
};

std::unique_ptr<PointFile::Content> read(const fs::path& file, const std::string& table_frame) {
  const std::string name = file.filename().string();
  if (!fs::is_regular_file(file)) throw InputError(fmt::format("{}: there is no such file", file.string()));
  if (name.ends_with(".fcsv")) return read_fcsv(file);
  if (name.ends_with(".mrk.json")) return read_markups(file);
  if (name.ends_with(".csv")) return std::make_unique<TableFile>(file, table_frame);
  throw InputError(fmt::format("{}: points are read from .csv (name,x,y,z), .fcsv or .mrk.json", file.string()));
}

}  // namespace

void PointFile::Content::add(const std::string& name, const Eigen::Vector3d& place) {
  names.push_back(name);
  points.conservativeResize(points.rows() + 1, Eigen::NoChange);
  points.row(points.rows() - 1) = place.transpose();
}

double sign_of_frame(const fs::path& file, const std::string& frame) {
  if (frame == "LPS" || frame == "1") return 1;
  if (frame == "RAS" || frame == "0") return -1;
  throw InputError(fmt::format("{}: coordinate system \"{}\" is neither LPS nor RAS; save it again with one of them",
                               file.string(), frame));
}

PointFile::PointFile(const fs::path& file, const std::string& table_frame) : content_(read(file, table_frame)) {
  if (content_->points.rows() == 0) throw InputError(fmt::format("{}: holds no points", file.string()));
}
PointFile::~PointFile() = default;
PointFile::PointFile(PointFile&&) noexcept = default;

const Points& PointFile::points() const { return content_->points; }
const std::vector<std::string>& PointFile::names() const { return content_->names; }
const std::vector<PointGroup>& PointFile::groups() const { return content_->groups; }
const std::string& PointFile::frame() const { return content_->frame; }
const std::string& PointFile::extension() const { return content_->extension; }

void PointFile::write(const Points& points, const fs::path& file) const { content_->write(points, file); }

}  // namespace supine::warp
