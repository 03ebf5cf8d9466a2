// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/error_model.h"
#include "calibration/least_squares.h"
#include "diagnosis/evidence/joint_fit.h"
#include "diagnosis/evidence/linear_evidence.h"
#include "diagnosis/evidence/nuisances.h"
#include "diagnosis/evidence/priors.h"
#include "diagnosis/evidence/unlisted.h"
#include "diagnosis/numerical_error.h"

namespace supine::diagnosis {

/// A model that lacks nothing, fitted together with all that is never known, and what is needed to weigh others
/// against it. Clusters of points, errors and discrepancy are fixed here, once, for every hypothesis.
struct BaseFit : JointFit {
  std::vector<double> noise_mm;  ///< per measurement, as given
  calibration::Clusters clusters;
  Eigen::VectorXd noise_of_point_mm;  ///< #R, of the scanner
  Eigen::VectorXd repeats;            ///< #R, how many points of the scan say what one does
  double patchiness_mm = 0;           ///< rms that uneven tissue, skin and muscle make
  Eigen::VectorXd mean_mm;            ///< #R, added to the distances: what the mesh takes away
  Eigen::MatrixXd errors;             ///< R over the clusters, without nuisances
  Eigen::MatrixXd patches;            ///< what of them uneven tissue, skin and muscle make: P with P Pᵀ in R
  LocalCauses local;                  ///< that no effect lists
  Eigen::MatrixXd kernel;             ///< K over the clusters
  std::unique_ptr<ErrorCovariance> covariance;  ///< of both
  double scale_mm = 0, most_mm = 0;             ///< of the prior of the discrepancy's size
  Eigen::Index creased_points = 0;              ///< of the scans, over creases of the model's skin (creases.h)
  std::optional<NumericalError> numerical;      ///< none: the mesh is taken to be exact
  double ln_weight = 0;                         ///< of all that is weighed under these errors (follow.h)

  /// Distances over the clusters, the mesh's error taken away.
  Eigen::VectorXd distances(const calibration::Residuals& residuals) const;
  /// The likeliest size of the discrepancy in a hypothesis.
  double size_of(const Weighed& weighed) const;
};

/// The numbers of a base fit and of its nuisances, with what is left open of them; with the mesh's error measured also
/// what that leaves unsaid (mesh_doubt.h).
struct JointPosterior {
  std::vector<std::string> names;  ///< free parameters, then nuisances
  Eigen::VectorXd value, sd;       ///< in their units; of a number of the base model that is never known its logarithm
  Eigen::MatrixXd of_parameters;   ///< covariance of the coordinates of the free parameters, over all else
};
JointPosterior posterior_of(const BaseFit& base);

/// What distances depend on at a fit, as offsets from where they stand: its free parameters with their priors, then
/// nuisances; over the clusters.
Directions directions_at(const calibration::Fit& fit, const calibration::FreeParameters& parameters,
                         const std::vector<Nuisance>& nuisances, const calibration::Clusters& clusters);

/// Evidence of the numbers of a fit under the errors of @p ground.
LinearEvidence evidence_of(const BaseFit& ground, const JointFit& at);

struct BaseFitOptions {
  Priors priors;
  bool other_meshes = true;                          ///< measure the mesh's error
  std::function<void(const std::string&)> progress;  ///< may be empty
  bool keeps_history = false;                        ///< JointFit::history
};

/// Gauss–Newton in the moduli and the nuisances, from the model's values: distances are exact at every step, uneven
/// tissue, skin and muscle (patchiness.h) and the discrepancy are linear and taken at the first.
/// @param start  values of the free parameters to begin with, by name; the prior's where there is none
/// @throws NumericalFailure  no equilibrium at the start
BaseFit fit_base_model(calibration::Evaluator& evaluator, const simulation::Model& given,
                       const simulation::Model& start, const std::vector<double>& noise_mm,
                       const simulation::ChainSolution* near, const BaseFitOptions& options);

/// What stands in every hypothesis that holds some effects: errors of mesh and body as they are beside these, over the
/// clusters of the base fit. They were measured where nothing is added to the model; a ligament that ties a breast
/// changes what another mesh or uneven tissue do to it.
/// @param at  a fit of the model with these effects
/// @throws NumericalFailure  no sensitivities there
std::unique_ptr<BaseFit> ground_beside(const calibration::MeasuredScene& scene, const BaseFit& base, const JointFit& at,
                                       const Priors& priors);

}  // namespace supine::diagnosis
