// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "segmentation/image.h"

namespace supine::phantom {

/// What lies inside one labelled breast, for drawn ones to carry.
class Anatomy {
 public:
  enum class Part : std::uint8_t { fat, gland, vessel, ligament };

  /// @param labels  of the breastPhantom family (github.com/DIDSR/breastPhantom): fat 1, skin 2, gland 29, nipple 33,
  /// muscle 40, Cooper's ligament 88, TDLU 95, duct 125, artery 150, vein 225; x from the chest wall to the nipple, y
  /// across, z to the head
  /// @throws InputError  other labels, no gland among them, or nothing in front of the muscle (x the other way round)
  explicit Anatomy(const segmentation::GreyImage& labels);

  /// @param place  across and toward the head as shares of the foot's half widths (-1 to 1), ahead as the share of the
  /// way from the chest to the tip (0 to 1)
  Part at(const Eigen::Vector3d& place) const;

 private:
  void measure();

  segmentation::LabelImage labels_;
  Eigen::Vector3d foot_mm_, half_mm_;  // middle of the foot on the chest; half widths, and the way to the tip first
};

}  // namespace supine::phantom
