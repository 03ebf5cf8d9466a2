// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "phantom/random_field.h"
#include "phantom/truth.h"

namespace supine::phantom {

/// What no effect explains: a deformation that unknown forces could make, in every pose but prone, added to the truth.
///
/// Forces sit on 60 centres of the skin and 60 of the inner surface, a Gaussian bump each in three directions; between
/// centres they are correlated over 25 mm; half of their variance is common to the poses, half each pose's own. They
/// move the body by the tangent of its equilibrium. A tenth of the variance is no force but a field along the skin's
/// normal, correlated over 25 mm. Over draws the mean square along the normal, over the skin of all these poses, is
/// size_mm()².
class Discrepancy {
 public:
  /// size_mm is half-Cauchy with the scale max(0.3 mm, 1 % of the RMS way of the supine nodes from prone), cut at 10
  /// mm.
  /// @param poses  solved, prone first
  /// @throws NumericalFailure  a tangent is singular
  Discrepancy(Truth& truth, const BodyMesh& body_mesh, const std::vector<TruthPose>& poses, std::uint64_t seed);

  double size_mm() const { return size_mm_; }
  /// What the forces move, #N by 3, mm.
  const Points& displacement(const std::string& pose) const { return displacement_.at(pose); }
  /// The rest, mm along the skin's normal by the place in the pose.
  RandomField beyond_forces(const std::string& pose) const;
  /// RMS of both along the normal over the pose's skin.
  double rms_mm(const std::string& pose) const { return rms_mm_.at(pose); }

 private:
  std::uint64_t seed_;
  double size_mm_;
  std::map<std::string, Points> displacement_;
  std::map<std::string, double> rms_mm_;
};

/// A draw of |x|, x Cauchy with this scale, not above @p most.
double half_cauchy(std::uint64_t seed, double scale, double most);

}  // namespace supine::phantom
