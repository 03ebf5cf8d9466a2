// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/termination_words.h"

#include <fmt/format.h>

namespace supine::simulation {

std::string termination_words(Termination end, int iterations, double residual_share) {
  switch (end) {
    case Termination::inverted:
      return "an element is inverted";
    case Termination::crushed:
      return "an element is crushed";
    case Termination::stalled:
    case Termination::iteration_limit:
      return fmt::format("no convergence in {} iterations, {:.1e} of the weight out of balance", iterations,
                         residual_share);
    case Termination::sliding:
      return fmt::format(
          "the body slides off: after {} iterations its energy falls as before, {:.1e} of the weight out of "
          "balance",
          iterations, residual_share);
    case Termination::work_limit:
      return fmt::format("given up: that costs too much; {:.1e} of the weight out of balance", residual_share);
    case Termination::singular_tangent:
      return "the tangent matrix is singular";
    case Termination::line_search_failed:
      return fmt::format("the line search stalled with {:.1e} of the weight out of balance", residual_share);
    case Termination::residual_small:
    case Termination::step_small:
      break;
  }
  return "converged";
}

}  // namespace supine::simulation
