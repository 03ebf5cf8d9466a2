// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/free_parameters.h"

namespace supine::calibration {

/// Laws to draw parameters from.
enum class DrawKind {
  prior,  ///< as FreeParameters::priors(): log-normal where the parameter is positive; cut at its range
  normal  ///< the study's: normal with mean `value` and standard deviation prior_sd, whatever the sign
};

struct Draws {
  std::vector<Eigen::VectorXd> values;  ///< accepted draws
  int refused = 0;  ///< draws outside the range of a parameter (negative moduli, with normal), drawn again
};

/// @p count draws of the free parameters, each from its own generator, so that the first hundred of a thousand are the
/// hundred one gets when asking for a hundred.
/// @throws InputError  count < 1; a parameter without prior_sd; a law that lies outside its range almost everywhere
Draws draw_parameters(const FreeParameters& parameters, DrawKind kind, int count, unsigned seed);

/// First-order share of each parameter in the variance of @p result (Sobol), from the sample itself: variance of the
/// means over classes of equal size (about √n of them) of one parameter, less what chance alone gives them.
/// What is left to 1 is interaction. One parameter alone has all of it; a result that does not vary gives 0.
/// @param values  #n by #parameters, drawn independently of each other
Eigen::VectorXd first_order_shares(const Eigen::MatrixXd& values, const Eigen::VectorXd& result);

}  // namespace supine::calibration
