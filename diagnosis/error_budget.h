// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "diagnosis/weighted_fit.h"

namespace supine::diagnosis {

/// What the RMS of the residual is made of, mm; the squares add up to its square.
///
/// The modes of each source count with what the fit of the free parameters leaves of them, tr(M Σ_source Mᵀ)/n; noise,
/// the mesh's mean and its spread in full. Segmentation and chest wall are under registration. Where the known
/// sources alone would make more than is there, registration, numerical error and parameters (which are tolerances, not
/// measurements) are shortened alike until the sum fits, then noise; else the rest is the model's.
struct ErrorBudget {
  double total = 0, noise = 0, registration = 0, numerical = 0, parameters = 0, model_form = 0;
};

ErrorBudget error_budget(const WeightedFit& fit, const ErrorSources& sources, const Metric& metric);

}  // namespace supine::diagnosis
