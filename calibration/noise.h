// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/arrays.h"

namespace supine::calibration {

/// What points of a scan are taken to err at least, 1 sigma: a smoothed scan shows no noise, and then facets and
/// creases of the mesh would count for what they are not.
inline constexpr double least_noise_mm = 0.25;

/// Scanner noise along the normal, 1 sigma, from what the signed distances do between neighbouring points: each of up
/// to 3000 points against the plane through the distances of its 16 neighbours, median absolute deviation. What
/// varies over more than a few points (the model's error) cancels; so does noise that neighbouring points share,
/// which makes this a lower bound for scanners that smooth.
/// @param place        #R by 3, mm. Best the closest points on the model (Residuals::on_skin): by the places of the
///   scan's points themselves the nearest are those that err alike, and noise comes out low, by 4 % at 0.7 mm where
///   points lie 2.4 mm apart
/// @param distance_mm  #R, signed
/// @throws InputError  fewer than 40 points
double estimate_noise_mm(const Points& place, const Eigen::VectorXd& distance_mm);

/// Rows that no noise explains: further from the plane through their neighbours' distances than @p sigmas times the
/// noise. Of a normal law one in 16,000 is, at four sigmas. Patches of points that are off together stay.
/// @throws InputError  fewer than 40 points
std::vector<int> points_that_stand_out(const Points& place, const Eigen::VectorXd& distance_mm, double noise_mm,
                                       double sigmas = 4);

}  // namespace supine::calibration
