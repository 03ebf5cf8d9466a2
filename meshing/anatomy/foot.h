// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace supine::meshing {

/// A piece of skin seen from the front.
struct SkinSample {
  Eigen::Vector2d place_mm;  ///< (lateral, head) in the plane orthogonal to the mound's outward axis
  double thickness_mm;       ///< φ, the height over the muscle
  double area_mm2;
};

/// The mound's foot in that plane.
struct Foot {
  Eigen::Vector2d centre_mm;
  Eigen::VectorXd fourier;  ///< radius at azimuth θ: c0 c1 s1 c2 s2 …, mm; c1 and s1 are close to 0
  double rim_thickness_mm;  ///< mean thickness outside the foot, up to the edge of the inner surface
};

/// Radius at azimuth @p theta of a Fourier series stored c0 c1 s1 c2 s2 …
double fourier_radius(const Eigen::VectorXd& fourier, double theta);

/// Where the tissue over the muscle comes down to its rim thickness.
///
/// Going in from the edge of the inner surface along each azimuth, the foot is where the smoothed thickness exceeds the
/// smallest one of the outer band (that azimuth's rim thickness) by a small share of the mound's height; where there
/// is no rim, that is just inside the edge. The centre is moved until the first harmonic of the radius is gone.
/// @param skin          pieces of skin, a few mm large
/// @param inner_mm      points of the inner surface in the same plane; their outline bounds the search
/// @param start_mm      a point inside the foot
Foot find_foot(const std::vector<SkinSample>& skin, const std::vector<Eigen::Vector2d>& inner_mm,
               const Eigen::Vector2d& start_mm);

}  // namespace supine::meshing
