// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "meshing/anatomy/muscle_distance.h"
#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// The anatomical frame of one breast, computed once per case from the imaged mesh and the muscle.
///
/// With side "none" the body is an object (docs/bodies.md): the supports stand for the muscle; lateral and head are the
/// two longest directions of its skin, the first away from the supports, q counts along them from the skin's centre in
/// units of foot_radius_mm, half of its length; there is no mound and no nipple, thickness_mm is the distance to the
/// nearest support and the areas are thirds of its largest.
///
/// With side "both", `breasts` holds the frame of each, `breast` says whose a point is, and q is that of the point's
/// own breast: lateral is positive to the outer side of both. outward is then the mean of the two, lateral the left
/// one's, heights and radii the larger; what belongs to one breast is asked of breast_frame().
struct Anatomy {
  std::string side;                   ///< left, right or both; none of an object
  std::string imaged_pose = "prone";  ///< the pose the mesh was imaged in; undeformed: free of load
  Eigen::Vector3d outward;            ///< unit; mean outward normal of the muscle under the mound
  Eigen::Vector3d lateral;  ///< unit, orthogonal to outward; toward the patient's own outer side (+x LPS for left)
  Eigen::Vector3d head;     ///< unit, orthogonal to both; toward the head
  Eigen::Vector3d foot_centre_mm;  ///< on the muscle, centre of the mound's footprint
  double foot_radius_mm =
      0;  ///< mean radius of the foot: where the tissue over the muscle has come down to its rim thickness
  double rim_thickness_mm = 0;  ///< of the tissue over the muscle outside the foot
  double mound_height_mm = 0;   ///< largest thickness over the muscle
  Eigen::VectorXd foot_fourier;  ///< foot radius at azimuth θ (from lateral toward head): c0 + Σ_m c_m cos mθ + s_m sin
                                 ///< mθ, stored c0 c1 s1 c2 s2 …, mm
  Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>
      q;                         ///< #points; (lateral, head) from the foot's centre over foot_radius_mm
  Points muscle_normal;          ///< #points by 3, unit outward muscle normal (∇φ) at each imaged point
  Eigen::VectorXd thickness_mm;  ///< #points; φ at each imaged point: height over the muscle
  int nipple_point = -1;  ///< skin point furthest from the muscle within the mound, or where the nipple tissue is
  std::shared_ptr<const MuscleDistance> muscle;
  /// To each support, in the order of TetMesh::support_names; empty where the muscle is the one support.
  std::vector<std::shared_ptr<const MuscleDistance>> supports;
  double sternum_x_mm = 0;       ///< side both: the plane x = sternum_x_mm (LPS) parts the two
  std::vector<Anatomy> breasts;  ///< side both: left, right; else empty
  Eigen::VectorXi breast;        ///< #points; row of `breasts` a point belongs to; empty for one breast

  /// The frame of one breast: @p which is a row of `breasts`, or anything where there is one breast only.
  const Anatomy& breast_frame(int which) const { return breasts.empty() ? *this : breasts[which]; }
  const std::shared_ptr<const MuscleDistance>& support(std::size_t row) const {
    return supports.empty() ? muscle : supports[row];
  }
  bool is_object() const { return side == "none"; }
  /// Row of `breasts` of a point (of the mesh), 0 where there is one breast only.
  int breast_of(Eigen::Index point) const { return breasts.empty() ? 0 : breast[point]; }
  /// q of a point of the mesh; with two breasts on one chart of both: measured from the sternum, positive to the left,
  /// so that no place of the one has the coordinates of a place of the other.
  Eigen::Vector2d chart(Eigen::Index point) const;
  /// area_name() of a point of the mesh; with two breasts "left …" or "right …".
  std::string area_name_of(Eigen::Index point) const;
  /// All names area_name_of() can return, in the order tables list them.
  std::vector<std::string> all_area_names() const;

  /// Radius of the foot at azimuth @p theta (rad, from lateral toward head), mm.
  double foot_radius_at(double theta) const;
  /// Signed distance of a material point (given by its q) from the foot curve, mm; > 0 outside the mound.
  double from_foot_mm(const Eigen::Vector2d& q_point) const;
  /// Name of the area a skin point belongs to: "nipple area", "upper outer", "lower outer", "upper inner",
  /// "lower inner" inside the foot; "fold", "sternal edge", "lateral edge", "upper edge" outside.
  std::string area_name(const Eigen::Vector2d& q_point) const;
};

/// All names area_name() can return, in the order tables list them.
const std::vector<std::string>& area_names();

/// The same of an object.
const std::vector<std::string>& object_area_names();

/// @param mesh  imaged mesh with its muscle sheet
/// @param side         left, right, both, or none for an object
/// @param imaged_pose  the pose the mesh was imaged in
/// @throws InputError  no inner or no skin faces, no mound over the muscle; both: no cleft between two mounds
Anatomy compute_anatomy(const TetMesh& mesh, const std::string& side, const std::string& imaged_pose = "prone");

}  // namespace supine::meshing
