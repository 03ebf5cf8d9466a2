// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>

namespace supine::phantom {

/// A stress-free breast as formulas: a leaning dome over a curved rigid chest muscle, with a gland and a tumour.
///
/// Local coordinates (u lateral, v head, w outward) in mm; the muscle's apex is the origin, the muscle the height field
/// w = muscle_height(u, v). The footprint is a disc (x, y), |x, y| <= 1, stretched to reach × foot_radius(azimuth).
/// Thickness over the muscle, along its normal, is rim_mm + (height_mm - rim_mm) (1 - t²)^sharpness inside the foot
/// (t = distance from the centre in foot radii), rim_mm outside.
/// skin.bending_share of bodies of real size, in truth and in the model they come with: their wrinkles are then several
/// elements long.
inline constexpr double real_size_bending_share = 3;

struct Body {
  std::string side;                               ///< left, right
  double foot_radius_mm;                          ///< mean
  double oval, oval_at_rad, three, three_at_rad;  ///< foot radius × (1 + oval cos 2(θ - at) + three cos 3(θ - at))
  double reach;                                   ///< rim of the body in foot radii
  double height_mm, rim_mm, sharpness;
  double drop, lean;  ///< mm toward the feet and to the outer side per mm above the rim thickness
  double radius_across_mm, radius_along_mm, skewness_per_mm2;       ///< of the muscle
  double yaw_rad, pitch_rad;                                        ///< outward axis from straight anterior
  Eigen::Vector3d centre_mm;                                        ///< LPS place of the local origin
  Eigen::Vector3d gland_centre, gland_half_axes_mm, tumour_centre;  ///< centres local, mm
  double tumour_radius_mm;
  double breast_kpa, skin_kpa;  ///< Young's moduli; the skin is 1.5 mm thick
  double nipple_moves_mm = 0;   ///< from prone to supine, to which both moduli are scaled; 0: they stay as drawn
  bool real_size = false;       ///< lies on the chest beside it where it falls so far, and its skin resists bending

  /// Columns lateral, head, outward in LPS; determinant -1 on the right side.
  Eigen::Matrix3d frame() const;
  Eigen::Vector3d world(const Eigen::Vector3d& local) const { return centre_mm + frame() * local; }
  Eigen::Vector3d local(const Eigen::Vector3d& world_mm) const { return frame().transpose() * (world_mm - centre_mm); }

  double foot_radius_at(double azimuth_rad) const;
  double muscle_height(double u, double v) const;
  Eigen::Vector3d muscle_normal(double u, double v) const;  ///< local, unit, outward
  double thickness_mm(double foot_radii) const;

  /// Local place of a point of the disc, share 0 = on the muscle, 1 = on the skin.
  Eigen::Vector3d place(const Eigen::Vector2d& disc, double share) const;
  /// Distance from the foot's centre over the foot's radius in that direction.
  double in_foot_radii(const Eigen::Vector2d& uv) const;

  bool in_gland(const Eigen::Vector3d& local) const;
  bool in_tumour(const Eigen::Vector3d& local) const;

  std::map<std::string, double> numbers() const;  ///< for the answer
};

/// Whose breasts are drawn.
enum class Population {
  benchmark,  ///< that of docs/hidden.md: the nipple moves a third as far as volunteers' does
  volunteers  ///< size and stiffness by draw_volunteer()
};

/// Draws one; the distribution stands in docs/supine-phantom.md.
Body draw_body(std::uint64_t seed, Population population = Population::benchmark);

}  // namespace supine::phantom
