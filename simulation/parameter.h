// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cmath>
#include <string>

namespace supine::simulation {

/// One row of the parameter table: reader, range checks, help, calibration and diagnosis all follow from it.
struct Parameter {
  std::string name;  ///< ends in its unit where it has one
  std::string unit;  ///< "kPa", "mm", "1"
  double null = 0;   ///< the value at which an effect leaves the model unchanged
  double lower = 0;  ///< admissible range, inclusive unless the reader says otherwise
  double upper = 0;
  /// Typical size: the value where a model names none, and the prior's median. Null where no sign is likelier.
  double median = 0;
  /// Prior spread: of one-sided rows the standard deviation of ln(value), of two-sided rows that of the value itself,
  /// in its own unit. Its law follows from the range: log-normal where that is positive, else normal.
  double spread = 0;
  bool one_sided = false;  ///< only values above null make sense
  std::string meaning;     ///< one line for help and messages
  bool shape = false;      ///< where an effect acts or how wide, not how much: moves nothing while that is null
};

/// Standard deviation of the prior in the parameter's own unit, as Setting::prior_sd has it.
inline double prior_sd(const Parameter& row) {
  return row.one_sided ? row.median * std::expm1(row.spread) : row.spread;
}

}  // namespace supine::simulation
