// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calibration/error_model.h"
#include "diagnosis/candidates.h"
#include "diagnosis/numerical_error.h"
#include "simulation/effect.h"

namespace supine::diagnosis {

/// How well things are known that no tissue effect should be blamed for.
struct Tolerances : simulation::MeasurementTolerances {
  double effect_form = 0.07;  ///< of the size of a tissue effect: where it ends and how it mixes are the catalogue's
  double correction = 1;      ///< share of the finer mesh's change that is added to the distances, give or take
                              ///< NumericalError::finer_doubt of it
};

/// How well a parameter of an effect is known to be at its null, 1 sigma; 0 for effects that are no source of error.
double tolerance_for(const std::string& effect, const std::string& unit, const Tolerances& tolerances);

/// Whether errors that are tolerated can look like the effect.
bool errors_imitate(const std::string& effect);

/// A shape the distances may take although nothing is missing, as large as one standard deviation.
struct ErrorMode {
  std::string source;  ///< registration, segmentation, chest_wall, numerical (incompressibility), mesh
  Eigen::VectorXd shape_mm;
};

/// Everything but a missing effect that keeps distances from zero. With d the distances at a model that lacks nothing,
///   d + mean_mm ~ N(0, Σ),   Σ = diag(noise²) + Σ_m shape_m shape_mᵀ + s_i s_j exp(−|y_i − y_j| / length),
/// s_i = spread × share_i
struct ErrorSources {
  Eigen::VectorXd noise_mm;                       ///< #R
  Eigen::VectorXd mean_mm;                        ///< #R
  std::vector<Eigen::VectorXd> unfitted_mean_mm;  ///< mean_mm for all points of each unfitted measurement; empty = 0
  double mean_doubt = 0;                          ///< how uncertain mean_mm is, as a share of it
  std::vector<ErrorMode> modes;
  double spread_mm = 0, length_mm = 1;  ///< what the mesh does beyond its modes, rms; 0 = nothing
  Eigen::VectorXd share;                ///< #R, of the spread at each point; mean square 1; empty = 1 everywhere
};

/// The same as it counts for a value that @p poses fitted scans have in common: what each scan errs by itself (its
/// place, the breath it was taken at) averages out.
double shared_tolerance_for(const std::string& effect, const std::string& unit, const Tolerances& tolerances,
                            std::size_t poses);

/// Puts what the mesh does into the sources: mean, modes (one per other mesh), spread.
void set_numerical(const NumericalError& numerical, const Tolerances& tolerances, ErrorSources& sources);

/// The sources for a fit with @p effect free: without the tolerance for that very thing, under which the fit would stop
/// short of its size.
ErrorSources without_tolerance_for(const std::string& effect, const ErrorSources& sources);

/// @param numerical  nullptr: no mesh was tried; then spread and length are those of @p fallback, fitted to the
///   residual itself, and smooth effects count for little
ErrorSources error_sources(const calibration::Residuals& residuals, const std::vector<Candidate>& candidates,
                           const NumericalError* numerical, const calibration::ErrorModel& fallback,
                           const Tolerances& tolerances = {});

}  // namespace supine::diagnosis
