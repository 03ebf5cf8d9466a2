// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/mri/anatomy.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/error.h"

namespace supine::phantom {
namespace {

using Eigen::Vector3d;

enum Label : std::uint8_t {
  air = 0,
  fat = 1,
  skin = 2,
  gland = 29,
  nipple = 33,
  muscle = 40,
  ligament = 88,
  tdlu = 95,
  duct = 125,
  artery = 150,
  vein = 225
};
constexpr std::array known{air, fat, skin, gland, nipple, muscle, ligament, tdlu, duct, artery, vein};
constexpr double foot_mm = 4;  // depth of the slice in front of the muscle in which the foot is measured

struct Box {
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  void add(const Vector3d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
};

segmentation::LabelImage checked(const segmentation::GreyImage& image) {
  segmentation::LabelImage labels{image.grid, {}};
  labels.voxels.reserve(image.voxels.size());
  bool any_gland = false;
  for (const float value : image.voxels) {
    const auto label = static_cast<std::uint8_t>(std::clamp(value, 0.0f, 255.0f));
    if (static_cast<float>(label) != value || std::find(known.begin(), known.end(), label) == known.end())
      throw InputError(fmt::format(
          "value {} is no label of a breastPhantom volume (0, 1, 2, 29, 33, 40, 88, 95, 125, 150, 225)", value));
    any_gland = any_gland || label == gland;
    labels.voxels.push_back(label);
  }
  if (!any_gland) throw InputError("no voxel is gland (label 29)");
  return labels;
}

}  // namespace

Anatomy::Anatomy(const segmentation::GreyImage& labels) : labels_(checked(labels)) { measure(); }

void Anatomy::measure() {
  const segmentation::Grid& grid = labels_.grid;
  const auto each = [&](const auto& see) {
    for (int k = 0; k < grid.size.z(); ++k)
      for (int j = 0; j < grid.size.y(); ++j)
        for (int i = 0; i < grid.size.x(); ++i)
          if (labels_.at(i, j, k) != air) see(labels_.at(i, j, k), grid.point(Vector3d(i, j, k)));
  };
  Box breast, slab, foot;
  each([&](std::uint8_t label, const Vector3d& p) { (label == muscle ? slab : breast).add(p); });
  const double chest = std::max(breast.low.x(), slab.high.x());
  each([&](std::uint8_t, const Vector3d& p) {
    if (p.x() >= chest && p.x() <= chest + foot_mm) foot.add(p);
  });
  if (!foot.low.allFinite() || !(breast.high.x() > chest + foot_mm))
    throw InputError(
        fmt::format("no breast lies in front of the muscle (which ends at x = {:.1f} mm, all else at {:.1f} mm): x "
                    "must lead from the "
                    "chest wall to the nipple",
                    chest, breast.high.x()));
  foot_mm_ = (foot.low + foot.high) / 2;
  foot_mm_.x() = chest;
  half_mm_ = (foot.high - foot.low) / 2;
  half_mm_.x() = breast.high.x() - chest;
}

Anatomy::Part Anatomy::at(const Eigen::Vector3d& place) const {
  const Vector3d p = foot_mm_ + half_mm_.cwiseProduct(Vector3d(place.z(), place.x(), place.y()));
  const Eigen::Vector3i n = labels_.grid.continuous_index(p).array().round().cast<int>();
  if (!labels_.grid.contains(n.x(), n.y(), n.z())) return Part::fat;
  switch (labels_.at(n.x(), n.y(), n.z())) {
    case gland:
    case tdlu:
    case duct:
      return Part::gland;
    case artery:
    case vein:
      return Part::vessel;
    case ligament:
      return Part::ligament;
    default:
      return Part::fat;
  }
}

}  // namespace supine::phantom
