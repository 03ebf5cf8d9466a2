// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/chi_squared.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/complement.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>

namespace supine::diagnosis {

using boost::math::chi_squared;
using boost::math::complement;

double chi_squared_above(int freedom, double value) {
  if (freedom < 1 || value <= 0) return 1;
  return boost::math::cdf(complement(chi_squared(freedom), value));
}

double chi_squared_power(int freedom, double lambda, double value) {
  if (freedom < 1) return 0;
  if (lambda <= 0) return chi_squared_above(freedom, value);
  constexpr double certain = 1e4;  // beyond it the series needs many terms and the chance is 1 to every digit
  if (lambda > certain + value) return 1;
  return boost::math::cdf(complement(boost::math::non_central_chi_squared(freedom, lambda), std::max(0.0, value)));
}

}  // namespace supine::diagnosis
