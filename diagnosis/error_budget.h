// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace supine::diagnosis {

struct Findings;

/// What keeps the distances of the base model from zero, rms over the fitted points, mm: what the scan's noise makes,
/// what is left to doubt after the fit in the scans' places and the other measurement errors, in mesh, moduli and
/// springs, in uneven tissue, skin and muscle, and what no effect explains. They do not add up to the total: the fit
/// takes most of each away.
struct ErrorBudget {
  double total = 0, noise = 0, registration = 0, numerical = 0, parameters = 0, patchiness = 0, model_form = 0;
};

ErrorBudget error_budget(const Findings& found);

/// Whether a finer mesh is what would show most: the mesh errs by more than each of the others.
bool mesh_errs_most(const ErrorBudget& budget);

}  // namespace supine::diagnosis
