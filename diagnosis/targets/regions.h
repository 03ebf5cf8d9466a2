// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/expected_landmarks.h"
#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/targets/conditioned.h"
#include "diagnosis/targets/missing_effects.h"

namespace supine::diagnosis {

/// Distance of a target to the skin along a line.
struct Depth {
  Eigen::Vector3d skin_mm;  ///< place on the skin, in the pose
  double mm = 0, sd_mm = 0;
};

/// What would make a region smaller, if it were known.
struct Shrink {
  /// A parameter or nuisance by name, an effect that may be missing, "marker on the nearest skin", or "scan " + a
  /// further pose.
  std::string what;
  std::string in_words;  ///< "knowing where the supine scan lies, along x", "a marker on the nearest skin"
  double share;          ///< of the sum of the three variances that goes away
};

/// A place and the ellipsoid that holds it in 95 of 100 cases.
struct Ellipsoid {
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();      ///< its centre
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();    ///< mm²
  Eigen::Vector3d half_axes_mm = Eigen::Vector3d::Zero();  ///< longest first
};

/// Where a point of the imaged body lies in a pose, and how sure that is.
struct TargetRegion {
  std::string name;
  Eigen::Vector3d model_mm;      ///< where the model has it
  Eigen::Vector3d place_mm;      ///< the best guess with all that is known: centre of the ellipsoid
  Eigen::Vector3d finer_mm;      ///< what finer elements would move it by
  Eigen::Matrix3d covariance;    ///< mm²
  Eigen::Vector3d half_axes_mm;  ///< of the ellipsoid that holds 95 % of all possibilities, longest first
  Eigen::Matrix3d axes;          ///< its directions, columns
  Ellipsoid if_nothing_missing;  ///< the same if it were known that nothing is missing; zero if that cannot be
  double outside_mm = 0;         ///< of the point from the imaged body
  std::optional<Depth> nearest, straight;  ///< to the closest skin; against gravity
  std::vector<Shrink> shrinks;             ///< most first, up to six

  double sd_mm() const;  ///< along an axis, rms
};

/// Landmarks that were measured in the pose, against where everything else that is known expects them.
struct ExpectedLandmarks {
  calibration::ExpectedPlaces expected;  ///< in the frame of the scan as given
  calibration::LandmarkAgreement agreement;
};

/// What of the places goes through numbers: parameters, nuisances, and those of effects that may be missing, to first
/// order or along secants.
struct ParameterPart {
  Eigen::VectorXd u;                   ///< coordinates of the free parameters where the model stands
  std::vector<Nuisance> nuisances;     ///< where the model has them
  std::vector<EffectNumber> effects;   ///< their numbers, as offsets from the null
  Eigen::VectorXd mean;                ///< of the offsets of all, #z
  Eigen::MatrixXd covariance;          ///< #z by #z
  std::vector<DirectionsOfSet> parts;  ///< of which these are the moments
  Eigen::MatrixXd moves;               ///< 3 #P by #z, mm
};

/// What all points of a call share.
struct TargetRegions {
  std::vector<TargetRegion> points;
  Eigen::MatrixXd covariance;   ///< of all places together, 3 per point
  bool measured = false;        ///< whether a scan was taken into account
  double unexplained_mm = 0;    ///< size of what no parameter explains: the likeliest, or without a scan the prior's
  double mesh_mm = 0;           ///< 1 sigma of the mesh's error, each axis
  bool mesh_measured = false;   ///< on other meshes; else it is a usual share of the way
  double unsettled_by = 0;      ///< largest step that a free parameter's coordinate would still make
  std::vector<LikelySet> sets;  ///< the likeliest sets of missing effects; empty: it was taken that nothing is missing
  std::optional<ExpectedLandmarks> landmarks;
  ParameterPart parameters;
};

struct TargetQuestion {
  const meshing::TetMesh* mesh;
  const meshing::Anatomy* anatomy;
  simulation::PoseLoad prone, pose;
  std::vector<std::string> names;
  Points imaged;               ///< #P by 3, mm, in the imaged pose
  bool further_scans = false;  ///< weigh scans of further poses among the shrinks: one more chain for each
};

/// By what a scan leaves open: parameters, nuisances, uneven tissue, what no effect explains and the mesh, through the
/// exact derivatives of the chain at @p base, over all sets of effects that may be missing.
/// @param evaluator  that base was fitted with
/// @throws NumericalFailure  no equilibrium in the pose
TargetRegions find_regions(const TargetQuestion& question, calibration::Evaluator& evaluator, const BaseFit& base,
                           const MissingEffects& missing, const Priors& priors);

/// By priors alone, where nothing was measured.
/// @param may_lack  whether the model may lack effects; else it is taken that it lacks none
/// @throws NumericalFailure  no equilibrium
TargetRegions find_regions(const TargetQuestion& question, const simulation::Model& model, bool may_lack,
                           const Priors& priors);

}  // namespace supine::diagnosis
