// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "phantom/mri/anatomy.h"
#include "segmentation/image.h"

namespace supine::phantom {

/// What a point of a drawn torso is made of.
enum class Stuff : std::uint8_t { air, fat, gland, skin, muscle, organ, vessel, support };
inline constexpr int stuff_count = 8;

/// One breast that hangs from the chest.
struct DrawnBreast {
  bool there = true;
  Eigen::Vector3d foot_mm;   ///< middle of its foot on the chest
  Eigen::Vector2d half_mm;   ///< of the foot, across and along the body
  double hang_mm = 100;      ///< from the chest to the tip
  double blunt = 2.3;        ///< power of the outline: 2 an ellipsoid, more is blunter
  Eigen::Vector2d lean_mm;   ///< of the tip against the foot, in x and z
  double gland_share = 0.2;  ///< about, of its volume
};

/// A torso lying prone with both breasts hanging free, in LPS mm (breasts to −y): chest with pectoral muscles and
/// sternum, fat, skin, nipples, gland that fans out from them, vessels under the skin, nodes in the axillae, and a
/// support that the belly lies on. All by formulas from the seed.
class Torso {
 public:
  explicit Torso(std::uint64_t seed);

  Stuff at(const Eigen::Vector3d& point_mm) const;
  /// Whether a point of muscle or fat is collagen: the thin fascia on the muscle's front, or a ligament of an anatomy.
  bool is_collagen(const Eigen::Vector3d& point_mm) const;
  /// Depth y of the front of chest and pectoral muscle at (x, z).
  double chest_y_mm(double x, double z) const;
  const std::array<DrawnBreast, 2>& breasts() const { return breasts_; }  ///< right, left
  Eigen::Vector3d nipple_mm(int side) const;
  /// Levels z between which the breasts hang, and the depth y at which a reader ends them.
  double low_z_mm() const;
  double high_z_mm() const;
  double back_y_mm() const { return back_y_mm_; }

  /// Lets both breasts carry the inside of a labelled one, mirrored to their side, in place of the drawn gland.
  void carry(std::shared_ptr<const Anatomy> anatomy) { anatomy_ = std::move(anatomy); }

  /// Takes a breast away (a mastectomy).
  void remove(int side) { breasts_[side].there = false; }

 private:
  double bare_skin_y_mm(double x, double z) const;
  bool in_breast(int side, const Eigen::Vector3d& p, double inward_mm) const;
  bool in_body(const Eigen::Vector3d& p, double inward_mm) const;
  bool may_hold_gland(int side, const Eigen::Vector3d& p) const;
  Anatomy::Part part_at(const Eigen::Vector3d& p) const;
  bool is_gland(const Eigen::Vector3d& p) const;
  double texture(const Eigen::Vector3d& p) const;

  double half_width_ = 150, depth_ = 85, power_ = 2.3, front_y_ = 25, tilt_ = 0, fat_front_ = 12, fat_side_ = 25,
         pectoral_mm_ = 10, pectoral_x_ = 95, fascia_mm_ = 0.5, skin_mm_ = 2, back_y_mm_ = 60, support_z_ = -70,
         support_mm_ = 20;
  std::array<DrawnBreast, 2> breasts_;
  struct Ball {
    Eigen::Vector3d middle;
    double radius;
  };
  std::vector<Ball> nodes_;
  std::array<std::vector<Eigen::Vector3d>, 2> ducts_;  // ends of the fan's strands
  segmentation::GreyImage texture_;                    // a smooth random field, mean 0, sd 1
  std::shared_ptr<const Anatomy> anatomy_;
};

}  // namespace supine::phantom
