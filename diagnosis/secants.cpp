// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/secants.h"

#include "common/error.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {

void find_secants(const RefitProblem& problem, std::vector<Candidate>& candidates) {
  const calibration::Fit& base = problem.base->solution;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const auto& rows = candidates[c].parameters;
    const simulation::Parameter* row = simulation::find_parameter(rows[0].name);
    if (rows.size() != 1 || row->median == row->null) continue;
    simulation::Model model = *problem.model;
    model.effects.push_back(free_setting(candidates[c].effect));
    try {
      calibration::Evaluator evaluator(problem.scene, model, accurate_enough());
      const calibration::Prediction moved = evaluator.predict(model, &base.prediction.solution);
      const auto there = calibration::residuals_of(problem.scene, moved, base.mask, problem.metric->noise_mm);
      candidates[c].secant = there.distance_mm - base.residuals.distance_mm;
    } catch (const NumericalFailure&) {
      // No equilibrium at the usual size: the slope at the null has to do.
    }
  }
}

}  // namespace supine::diagnosis
