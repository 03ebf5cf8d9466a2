// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>

#include "simulation/solve/sensitivities.h"

namespace supine::calibration {

/// A measurement of one's own that a fit takes beside the scans: rows that are zero where the shapes agree with it,
/// each over its own 1 sigma. The number of rows is the same for all shapes.
class OwnResidual {
 public:
  virtual ~OwnResidual() = default;
  virtual std::string name() const = 0;
  virtual Eigen::VectorXd value(const simulation::ChainSolution& shapes) const = 0;
  /// How the rows change, to first order, when the shapes move.
  /// @param move  in the order of the solution's poses, mm
  virtual Eigen::VectorXd change(const simulation::ChainSolution& shapes,
                                 const simulation::ChainDerivative& move) const = 0;
};

}  // namespace supine::calibration
