// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace supine::diagnosis {

/// Chance that a χ² of @p freedom degrees is above @p value; 1 with fewer than one degree.
double chi_squared_above(int freedom, double value);

/// Chance that a χ² of @p freedom degrees and noncentrality @p lambda is above @p value; 0 with fewer than one degree.
double chi_squared_power(int freedom, double lambda, double value);

}  // namespace supine::diagnosis
