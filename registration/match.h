// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "registration/problem.h"

namespace supine::registration {

/// Distances further than this count as this in match_score_mm(): a point that meets nothing.
constexpr double lost_mm = 10;

/// A point this close to the border of the surface has not left it: noise and the border's own place.
constexpr double at_border_mm = 2;

/// The body's closest points to points of the scan.
struct Matches {
  Points point, normal, displacement;  ///< #Q by 3; of the body; the displacement of rigid surfaces is 0
  Eigen::VectorXd distance_mm;         ///< #Q, ≥ 0
  std::vector<bool> border;            ///< the closest point lies on the border of the surface
  std::vector<bool> facing;            ///< normals within 60° in either sense, or none known
  std::vector<bool> rigid;
};

/// @param rows       of the problem's points
/// @param placement  scan → image
Matches match(const Problem& problem, const std::vector<int>& rows, const RigidTransform& placement);

/// Root of the mean of min(d, lost_mm)², turned points counting as lost, points beyond the border by their distance to
/// it; smaller fits better.
double match_score_mm(const Matches& matches);

/// Share of points that meet the body: facing it and closer than lost_mm, beyond its border no further than
/// at_border_mm.
double overlap(const Matches& matches);

/// @p count rows of @p of, drawn with a fixed seed, ascending; all when there are fewer.
std::vector<int> drawn_rows(Eigen::Index of, int count);

}  // namespace supine::registration
