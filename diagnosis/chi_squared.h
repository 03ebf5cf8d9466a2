// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace supine::diagnosis {

/// Chance that a χ² of @p freedom degrees is above @p value (Wilson and Hilferty 1931); within 0.005, and within a
/// factor of 2 down to 1e-6.
double chi_squared_above(int freedom, double value);

/// Chance that a χ² of @p freedom degrees and noncentrality @p lambda exceeds its central 95 % quantile
/// (Sankaran 1963; quantile by Wilson and Hilferty 1931); within 0.01.
double chi_squared_power(int freedom, double lambda);

}  // namespace supine::diagnosis
