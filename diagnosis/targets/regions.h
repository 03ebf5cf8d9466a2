// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/targets/conditioned.h"

namespace supine::diagnosis {

/// Distance of a target to the skin along a line.
struct Depth {
  Eigen::Vector3d skin_mm;  ///< place on the skin, in the pose
  double mm = 0, sd_mm = 0;
};

/// What would make a region smaller, if it were known.
struct Shrink {
  std::string what;      ///< a parameter or nuisance by name, "marker on the nearest skin", or "scan " + a further pose
  std::string in_words;  ///< "knowing where the supine scan lies, along x", "a marker on the nearest skin"
  double share;          ///< of the sum of the three variances that goes away
};

/// Where a point of the imaged body lies in a pose, and how sure that is.
struct TargetRegion {
  std::string name;
  Eigen::Vector3d model_mm;                ///< where the model has it
  Eigen::Vector3d place_mm;                ///< the best guess with all that is known: centre of the ellipsoid
  Eigen::Vector3d finer_mm;                ///< what finer elements would move it by
  Eigen::Matrix3d covariance;              ///< mm²
  Eigen::Vector3d half_axes_mm;            ///< of the 95 % ellipsoid, longest first
  Eigen::Matrix3d axes;                    ///< its directions, columns
  double outside_mm = 0;                   ///< of the point from the imaged body
  std::optional<Depth> nearest, straight;  ///< to the closest skin; against gravity
  std::vector<Shrink> shrinks;             ///< most first, up to six

  double sd_mm() const;  ///< along an axis, rms
};

/// Landmarks that were measured in the pose, against where everything else that is known expects them.
struct ExpectedLandmarks {
  std::vector<std::string> names;
  Points expected;             ///< #L by 3, mm, in the frame of the scan as given
  Eigen::MatrixXd covariance;  ///< of measured less expected, 3 per landmark, their own errors included, mm²
  double square = 0;           ///< of all of them by that covariance
  double p_value = 1;          ///< of χ² with 3 degrees per landmark
};

/// What of the places goes through parameters and nuisances, to first order.
struct ParameterPart {
  Eigen::VectorXd u;                ///< coordinates of the free parameters where the model stands
  std::vector<Nuisance> nuisances;  ///< where the model has them
  Eigen::VectorXd mean;             ///< of the offsets of both, #z
  Eigen::MatrixXd covariance;       ///< #z by #z
  Eigen::MatrixXd moves;            ///< 3 #P by #z, mm
};

/// What all points of a call share.
struct TargetRegions {
  std::vector<TargetRegion> points;
  Eigen::MatrixXd covariance;  ///< of all places together, 3 per point
  bool measured = false;       ///< whether a scan was taken into account
  double unexplained_mm = 0;   ///< size of what no parameter explains: the likeliest, or without a scan the prior's
  double mesh_mm = 0;          ///< 1 sigma of the mesh's error, each axis
  bool mesh_measured = false;  ///< on other meshes; else it is a usual share of the way
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
/// exact derivatives of the chain at @p base.
/// @param evaluator  that base was fitted with
/// @throws NumericalFailure  no equilibrium in the pose
TargetRegions find_regions(const TargetQuestion& question, calibration::Evaluator& evaluator, const BaseFit& base,
                           const Priors& priors);

/// By priors alone, where nothing was measured.
/// @throws NumericalFailure  no equilibrium
TargetRegions find_regions(const TargetQuestion& question, const simulation::Model& model, const Priors& priors);

}  // namespace supine::diagnosis
