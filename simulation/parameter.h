// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

namespace supine::simulation {

/// One row of the parameter table: reader, range checks, help, calibration and diagnosis all follow from it.
struct Parameter {
  std::string name;  ///< ends in its unit where it has one
  std::string unit;  ///< "kPa", "mm", "1"
  double null = 0;   ///< the value at which an effect leaves the model unchanged
  double lower = 0;  ///< admissible range, inclusive unless the reader says otherwise
  double upper = 0;
  double median = 0;       ///< typical size, prior median
  double log_sd = 0;       ///< prior spread: of ln(value) for positive quantities
  bool one_sided = false;  ///< only values above null make sense
  std::string meaning;     ///< one line for help and messages
};

}  // namespace supine::simulation
