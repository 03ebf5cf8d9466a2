// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "calibration/distance_figures.h"
#include "calibration/model_skin.h"
#include "calibration/outliers.h"
#include "calibration/scan.h"
#include "calibration/signed_distance.h"
#include "common/landmarks.h"

namespace supine::calibration {

/// How far the model is off in one area of the skin.
struct AreaError {
  std::string name;
  double area_cm2;        ///< of the model's skin in the pose; each triangle gives a third to the area of each corner
  int scan_points;        ///< used scan points whose closest skin point lies here
  double mae_mm;          ///< scan → model; NaN without scan points
  double mean_signed_mm;  ///< > 0 where the scan lies outside the model; NaN without scan points
};

struct LandmarkError {
  std::string name;
  double error_mm;  ///< predicted to measured
};

/// A model in one pose against a measured surface.
struct Comparison {
  double mae_study_mm;  ///< study's S13: mean |d| model skin points → scan, over the covered ones; NaN without any
  double covered_fraction;       ///< share of the skin's area whose points are covered; NaN: a contour covers none
  DistanceFigures scan;          ///< scan → model, over the used scan points
  std::vector<AreaError> areas;  ///< those that have skin, in the order of SkinAreas::names

  ModelToScan model_to_scan;                   ///< one row per ModelSkin::nodes()
  SignedDistances scan_to_model;               ///< one row per Scan::points()
  Eigen::Array<bool, Eigen::Dynamic, 1> used;  ///< scan points that are not beyond the model
  int scan_points_used;
  Outliers outliers;   ///< what a fit would leave out; every other figure counts them
  double rms_kept_mm;  ///< scan → model, over the used scan points but these
};

/// Both directions, signed (> 0 where the scan lies outside the model). All means count each point once.
///
/// Scan points whose closest point lies on the border of the model's skin are beyond the model (a scan covers more of
/// the body than the image) and take no part in any figure.
/// @param areas   may be empty: then there is no area table
/// @param given_noise_mm  of the scanner, 1 sigma; 0 = not known
/// @throws InputError  when no scan point lies over the model's skin
Comparison compare(const ModelSkin& model, const Scan& scan, const SkinAreas& areas, const CoverageBounds& bounds = {},
                   double given_noise_mm = 0);

/// Distances between landmarks of the same name, in the order of @p measured. Predicted ones that were not measured
/// are left out.
/// @throws InputError  a measured name that is not predicted, naming both lists
std::vector<LandmarkError> compare_landmarks(const Landmarks& predicted, const Landmarks& measured);

}  // namespace supine::calibration
