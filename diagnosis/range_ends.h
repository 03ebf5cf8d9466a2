// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "diagnosis/examine.h"

namespace supine::diagnosis {

/// A number of an effect of measurement that the fit drove to an end of its range: nothing is measured so wrong, so the
/// input itself is.
struct MeasurementAtEnd {
  std::string name, unit;  ///< EFFECT.PARAMETER
  double value, bound;     ///< as fitted; the end of the range
};

/// Those of the model itself, and where something is missing those of the likeliest set that was followed through the
/// chain; these only where something local that no effect lists is less likely than not, for what has another
/// explanation is no wrong input. Empty: none.
std::vector<MeasurementAtEnd> measurements_at_end(const Findings& found);

}  // namespace supine::diagnosis
