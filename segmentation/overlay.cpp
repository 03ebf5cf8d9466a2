// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/overlay.h"

#include <fmt/format.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "segmentation/tissue.h"

namespace supine::segmentation {
namespace {

constexpr std::uint8_t air = 0;
// Right, down and away from the eye in patient LPS, per patient axis that is cut.
const Eigen::Vector3d right_of[3] = {{0, 1, 0}, {1, 0, 0}, {1, 0, 0}};
const Eigen::Vector3d down_of[3] = {{0, 0, -1}, {0, 0, -1}, {0, 1, 0}};

/// One cut axis of an image, and how its two others lie on the page.
struct Plane {
  int cut, across, down;        ///< image axes
  bool flip_across, flip_down;  ///< the image axis runs against the page
};

int nearest_axis(const Grid& grid, const Eigen::Vector3d& direction) {
  Eigen::Index axis = 0;
  (grid.direction.transpose() * direction).cwiseAbs().maxCoeff(&axis);
  return static_cast<int>(axis);
}

Plane page_plane(const Grid& grid, int axis) {
  Plane plane{};
  plane.cut = nearest_axis(grid, Eigen::Vector3d::Unit(axis));
  plane.across = nearest_axis(grid, right_of[axis]);
  plane.down = nearest_axis(grid, down_of[axis]);
  if (plane.across == plane.cut || plane.down == plane.cut || plane.across == plane.down) {  // near 45 degrees
    plane.across = (plane.cut + 1) % 3;
    plane.down = (plane.cut + 2) % 3;
  }
  plane.flip_across = grid.direction.col(plane.across).dot(right_of[axis]) < 0;
  plane.flip_down = grid.direction.col(plane.down).dot(down_of[axis]) < 0;
  return plane;
}

/// Slices that show tissue, spread evenly; the middle of the image when there is none.
std::vector<int> choose_slices(const LabelImage& labels, int cut, int wanted) {
  const Grid& grid = labels.grid;
  int first = grid.size[cut], last = -1;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const auto tissue = labels.at(i, j, k);
        if (!is_meshed(static_cast<Tissue>(tissue))) continue;
        const int n = cut == 0 ? i : cut == 1 ? j : k;
        first = std::min(first, n);
        last = std::max(last, n);
      }
  if (last < 0) return {grid.size[cut] / 2};
  std::vector<int> slices;
  const int count = std::min(wanted, last - first + 1);
  for (int s = 0; s < count; ++s) slices.push_back(first + static_cast<int>((s + 0.5) * (last - first + 1) / count));
  return slices;
}

/// Grey at which a slice is white: the 99th of 100 parts of what is not air.
float white_level(const GreyImage& grey, const LabelImage& labels) {
  std::vector<float> values;
  for (std::size_t n = 0; n < grey.voxels.size(); ++n)
    if (labels.voxels[n] != air) values.push_back(grey.voxels[n]);
  if (values.empty()) values = grey.voxels;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), at, values.end());
  return std::max(*at, 1e-6f);
}

class Tile {
 public:
  Tile(const LabelImage& labels, const GreyImage* grey, const Plane& plane, double pixel_mm, float white)
      : labels_(labels), grey_(grey), plane_(plane), pixel_mm_(pixel_mm), white_(white) {}
  int width() const { return pixels(plane_.across); }
  int height() const { return pixels(plane_.down); }

  void draw(int slice, Picture& page, int left, int top) const {
    for (int y = 0; y < height(); ++y)
      for (int x = 0; x < width(); ++x) {
        const auto colour = pixel(slice, x, y);
        std::copy(colour.begin(), colour.end(),
                  page.rgb.begin() + 3 * (static_cast<std::ptrdiff_t>(top + y) * page.width + left + x));
      }
  }

 private:
  int pixels(int axis) const {
    return std::max(1,
                    static_cast<int>(std::lround(labels_.grid.size[axis] * labels_.grid.spacing_mm[axis] / pixel_mm_)));
  }
  /// Image index along one axis of the page; the voxel's middle is a whole number.
  double position(int pixel, int axis, bool flip) const {
    const double at = (pixel + 0.5) * pixel_mm_ / labels_.grid.spacing_mm[axis] - 0.5;
    return flip ? labels_.grid.size[axis] - 1 - at : at;
  }
  std::size_t voxel(int slice, int x, int y) const {
    Eigen::Vector3i n;
    n[plane_.cut] = slice;
    for (const auto& [axis, pixel, flip] :
         {std::tuple(plane_.across, x, plane_.flip_across), {plane_.down, y, plane_.flip_down}})
      n[axis] = std::clamp(static_cast<int>(std::lround(position(pixel, axis, flip))), 0, labels_.grid.size[axis] - 1);
    return labels_.grid.index(n.x(), n.y(), n.z());
  }
  std::uint8_t tissue(int slice, int x, int y) const {
    return labels_.voxels[voxel(slice, std::clamp(x, 0, width() - 1), std::clamp(y, 0, height() - 1))];
  }
  std::array<std::uint8_t, 3> pixel(int slice, int x, int y) const {
    const std::uint8_t here = tissue(slice, x, y);
    const bool outline = here != air && (here != tissue(slice, x - 1, y) || here != tissue(slice, x + 1, y) ||
                                         here != tissue(slice, x, y - 1) || here != tissue(slice, x, y + 1));
    if (outline || (!grey_ && here != air)) return tissue_colour(here);
    if (!grey_) return {0, 0, 0};
    const float share = std::clamp(grey_->voxels[voxel(slice, x, y)] / white_, 0.0f, 1.0f);
    const auto level = static_cast<std::uint8_t>(255 * std::pow(share, 0.6f));  // dark muscle stays visible
    return {level, level, level};
  }
  const LabelImage& labels_;
  const GreyImage* grey_;
  Plane plane_;
  double pixel_mm_;
  float white_;
};

}  // namespace

std::array<std::uint8_t, 3> tissue_colour(int tissue) {
  static constexpr std::array<std::array<std::uint8_t, 3>, tissue_count> colours = {{{0, 0, 0},
                                                                                     {255, 210, 0},
                                                                                     {255, 60, 200},
                                                                                     {0, 220, 255},
                                                                                     {255, 50, 40},
                                                                                     {60, 255, 60},
                                                                                     {255, 140, 0},
                                                                                     {80, 80, 255},
                                                                                     {200, 255, 180},
                                                                                     {120, 130, 255}}};
  return colours[static_cast<std::size_t>(tissue)];
}

Picture overlay(const LabelImage& labels, const GreyImage* grey, int axis, const OverlayOptions& options,
                std::vector<double>& places_mm) {
  if (options.slices < 1 || options.slices > 64 || options.columns < 1)
    throw InputError(
        fmt::format("overlay: {} slices in {} columns; 1 to 64 slices are possible", options.slices, options.columns));
  const Plane plane = page_plane(labels.grid, axis);
  const double pixel_mm =
      options.pixel_mm > 0 ? options.pixel_mm : std::max(0.25, labels.grid.spacing_mm.minCoeff() / 2);
  const std::vector<int> slices = choose_slices(labels, plane.cut, options.slices);
  const Tile tile(labels, grey, plane, pixel_mm, grey ? white_level(*grey, labels) : 1);
  const int count = static_cast<int>(slices.size()), columns = std::min(options.columns, count);
  const int rows = (count + columns - 1) / columns;
  Picture page{columns * tile.width(), rows * tile.height(), {}};
  page.rgb.assign(3 * static_cast<std::size_t>(page.width) * page.height, 0);
  places_mm.clear();
#pragma omp parallel for schedule(static)
  for (int s = 0; s < count; ++s) tile.draw(slices[s], page, s % columns * tile.width(), s / columns * tile.height());
  for (const int slice : slices) {
    Eigen::Vector3d middle = (labels.grid.size - Eigen::Vector3i::Ones()).cast<double>() / 2;
    middle[plane.cut] = slice;
    places_mm.push_back(labels.grid.point(middle)[axis]);
  }
  return page;
}

void write_png(const Picture& picture, const std::filesystem::path& file) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(picture.width, picture.height, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  auto* to = static_cast<std::uint8_t*>(image->GetScalarPointer());
  const std::size_t row = 3 * static_cast<std::size_t>(picture.width);
  for (int y = 0; y < picture.height; ++y)  // VTK's first row is the lowest
    std::copy_n(picture.rgb.data() + row * y, row, to + row * (picture.height - 1 - y));
  vtkNew<vtkPNGWriter> writer;
  writer->SetFileName(file.c_str());
  writer->SetInputData(image);
  writer->Write();
  if (writer->GetErrorCode() != 0) throw InputError(fmt::format("{}: the picture cannot be written", file.string()));
}

}  // namespace supine::segmentation
