// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <set>

#include "common/curve.h"
#include "meshing/anatomy/muscle_distance.h"

namespace supine::meshing {

struct Anatomy;
struct TetMesh;

/// The skin of the chest beyond the rim of the mesh, as far as a large breast comes to lie on it: the muscle's smooth
/// continuation (MuscleDistance), covered as thickly as the tissue is at the rim nearest to it. The body that goes on
/// behind the cut is not in the mesh; this is its surface.
///
/// The rim is where the imaged skin ends. Seen along the mean outward normal of the muscle it is a curve around its
/// centre; its radius and the height of the skin over the muscle there are Fourier series of the azimuth. The radius is
/// that of the fitted series plus the furthest that a point of the rim lies outside of it and margin_mm: the rim itself
/// moves by some millimetres.
class ChestBeside {
 public:
  /// At a place x; every function is twice continuously differentiable.
  struct Sample {
    double share = 0;  ///< how far the chest is there: 0 within the rim, 1 from fade_mm outside of it
    Eigen::Vector3d share_gradient = Eigen::Vector3d::Zero();
    Eigen::Matrix3d share_hessian = Eigen::Matrix3d::Zero();
    double gap_mm = 0;  ///< height over the chest's skin, negative inside; this and what follows where share > 0
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();  ///< 1/mm
  };

  static constexpr double margin_mm = 5, fade_mm = 10;

  /// @param rim  nodes of @p mesh where its skin ends, at least one   @param anatomy  of the mesh
  ChestBeside(const TetMesh& mesh, const Anatomy& anatomy, const std::set<int>& rim);

  Sample at(const Eigen::Vector3d& point_mm) const;

 private:
  std::shared_ptr<const MuscleDistance> muscle_;
  Eigen::Matrix<double, 2, 3> across_;  // rows: lateral, head
  Eigen::Vector2d centre_;
  Eigen::VectorXd radius_, height_;  // Fourier: c0 c1 s1 c2 s2 …, mm
};

/// The chest beside the breast, where there is one: none of an object, nor where the skin is closed.
std::optional<ChestBeside> chest_beside(const TetMesh& mesh, const Anatomy& anatomy);

}  // namespace supine::meshing
