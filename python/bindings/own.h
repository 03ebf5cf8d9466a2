// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "calibration/own_residual.h"

namespace supine::python {

/// A supine.Residual: `value(shapes)` gives rows, `derivative(shapes, moves)` how they change.
class PythonResidual : public calibration::OwnResidual {
 public:
  /// @throws InputError  an object without the two
  explicit PythonResidual(pybind11::object object);

  std::string name() const override { return name_; }
  Eigen::VectorXd value(const simulation::ChainSolution& shapes) const override;
  Eigen::VectorXd change(const simulation::ChainSolution& shapes,
                         const simulation::ChainDerivative& move) const override;

  /// Whether the derivative is that of the value, at @p shapes and along a random move of the nodes.
  /// @throws InputError  with the order at which the remainder falls
  void check_derivative(const simulation::ChainSolution& shapes) const;

 private:
  pybind11::object object_;
  std::string name_;
};

/// supine.add_effect() and the scene that effects look at.
void bind_own(pybind11::module_& module);

}  // namespace supine::python
