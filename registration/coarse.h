// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "registration/problem.h"

namespace supine::registration {

/// A placement and how well it fits.
struct Placement {
  RigidTransform transform;  ///< scan → image
  double score_mm;           ///< match_score_mm(); of landmarks alone their weighted RMS
};

/// Trimmed point-to-plane ICP (Chen and Medioni 1992; Chetverikov et al. 2005): matches further than four times their
/// median count for nothing. Landmarks count all the way.
/// @param rows  of the problem's points
RigidTransform icp(const Problem& problem, const std::vector<int>& rows, const RigidTransform& start, int iterations);

/// Where the landmarks say that the scan lies (best_rigid(), weights 1/σ²; those of fewer than three are shifted).
/// Without landmarks as given.
RigidTransform start_of(const Problem& problem);

/// Placements near @p start: turned by up to 15° about each axis of the scan, as they are and with the nearest
/// shift that brings centre to centre, each refined by icp(); best first.
std::vector<Placement> search_near(const Problem& problem, const RigidTransform& start);

/// The same from every turn that swaps and negates axes, and from those that lay principal directions of the scan
/// on those of the body.
std::vector<Placement> search_far(const Problem& problem);

/// The 24 rotations that bring axes to axes; with @p mirror the 24 of determinant −1.
std::vector<Eigen::Matrix3d> axis_changes(bool mirror);

}  // namespace supine::registration
