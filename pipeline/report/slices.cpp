// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/report/slices.h"

#include <algorithm>
#include <cmath>

#include "common/statistics.h"
#include "meshing/mesh_io.h"
#include "pipeline/report/encode.h"
#include "segmentation/formats/image_io.h"
#include "warp/sampler.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using segmentation::GreyImage;
using segmentation::Grid;

/// Box around all corners of a grid.
std::pair<Vector3d, Vector3d> box_of(const Grid& grid) {
  Vector3d low = Vector3d::Constant(INFINITY), high = -low;
  const Vector3d last = (grid.size.array() - 1).matrix().cast<double>();
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d index(corner & 1 ? last.x() : 0, corner & 2 ? last.y() : 0, corner & 4 ? last.z() : 0);
    low = low.cwiseMin(grid.point(index)), high = high.cwiseMax(grid.point(index));
  }
  return {low, high};
}

/// Upright, as fine as the finest axis of the volume where @p most allows it.
Grid upright(const Grid& of, const Vector3d& low, const Vector3d& high, double most) {
  const auto [first, last] = box_of(of);
  const Vector3d from = low.cwiseMax(first), extent = (high.cwiseMin(last) - from).cwiseMax(0);
  Grid grid;
  double step = std::max(of.spacing_mm.minCoeff(), std::cbrt(extent.prod() / most));
  do {
    grid.size = (extent / step).array().floor().cast<int>() + 1;
    grid.spacing_mm.setConstant(step);
    step *= 1.02;
  } while (static_cast<double>(grid.count()) > most);
  grid.origin_mm = from;
  return grid;
}

std::vector<float> values_on(const Grid& grid, const GreyImage& volume) {
  const warp::Sampler sampler(volume, warp::Interpolation::linear);
  const float least = *std::min_element(volume.voxels.begin(), volume.voxels.end());
  std::vector<float> values(grid.count());
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i)
        values[grid.index(i, j, k)] =
            sampler.at(volume.grid.continuous_index(grid.point(Vector3d(i, j, k)))).value_or(least);
  return values;
}

/// Of DIR/POSE_*.nrrd the one of the case's image, else another grey one, else labels.
fs::path carried_volume(const Case& measured, const fs::path& folder) {
  const std::string pose = measured.predicted().name + "_";
  std::vector<fs::path> files;
  if (fs::is_directory(folder))
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with(pose) && name.ends_with(".nrrd") && !name.ends_with("_displacement.nrrd"))
        files.push_back(entry.path());
    }
  const std::string image = measured.image_file.filename().string();
  const auto rank = [&](const fs::path& file) {
    const std::string stem = file.stem().string().substr(pose.size());
    return stem == "labels" ? 2 : image.starts_with(stem + ".") ? 0 : 1;
  };
  std::sort(files.begin(), files.end(),
            [&rank](const fs::path& a, const fs::path& b) { return rank(a) != rank(b) ? rank(a) < rank(b) : a < b; });
  return files.empty() ? fs::path() : files.front();
}

}  // namespace

GreyBytes grey_bytes(const GreyImage& volume, const Vector3d& low, const Vector3d& high, double most) {
  GreyBytes bytes;
  bytes.grid = upright(volume.grid, low, high, most);
  const std::vector<float> values = values_on(bytes.grid, volume);
  std::vector<double> some;
  const std::size_t step = std::max<std::size_t>(1, values.size() / 200000);
  for (std::size_t i = 0; i < values.size(); i += step) some.push_back(values[i]);
  bytes.black = quantile(some, 0.005), bytes.white = quantile(some, 0.995);
  if (!(bytes.white > bytes.black)) bytes.white = bytes.black + 1;
  bytes.voxels.reserve(values.size());
  for (const float value : values)
    bytes.voxels.push_back(static_cast<std::uint8_t>(
        std::lround(255 * std::clamp((value - bytes.black) / (bytes.white - bytes.black), 0.0, 1.0))));
  return bytes;
}

nlohmann::ordered_json slices_json(Run& run, const Case& measured, const fs::path& out) {
  constexpr double margin_mm = 15;
  const std::string& pose = measured.predicted().name;
  const fs::path file = carried_volume(measured, out / "warp");
  const fs::path calibrated = out / "calibrated" / (pose + ".vtu");
  const fs::path shape = fs::exists(calibrated) ? calibrated : out / (pose + ".vtu");
  if (file.empty() || !fs::exists(shape)) return nullptr;
  const Points x = meshing::read_pose(run.input(shape), pose).positions;
  const GreyImage volume = segmentation::read_image(run.input(file), measured.frame).image;
  const Vector3d low = x.colwise().minCoeff().transpose().array() - margin_mm,
                 high = x.colwise().maxCoeff().transpose().array() + margin_mm;
  const GreyBytes bytes = grey_bytes(volume, low, high, most_slice_voxels);
  const Grid& grid = bytes.grid;
  return {{"pose", pose},
          {"file", file.filename().string()},
          {"size", {grid.size.x(), grid.size.y(), grid.size.z()}},
          {"spacing_mm", grid.spacing_mm.x()},
          {"origin_mm", {grid.origin_mm.x(), grid.origin_mm.y(), grid.origin_mm.z()}},
          {"black", bytes.black},
          {"white", bytes.white},
          {"voxels", base64(std::as_bytes(std::span(bytes.voxels)))}};
}

}  // namespace supine::pipeline
