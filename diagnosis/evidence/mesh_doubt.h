// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace supine::diagnosis {

/// What is known of a number: mean and standard deviation of a normal distribution.
struct Known {
  double mean, sd;
};

/// A number of which one of several things is known: mean and standard deviation of the mixture.
/// @param each  probability, up to a factor for all, and what is then known; at least one above zero
Known mixed(const std::vector<std::pair<double, Known>>& each);

/// What the mesh does to a number that is fitted, beyond what other meshes show and Σ holds: one standard deviation, of
/// a modulus of its logarithm, of a scan's place in mm and radians; 0 of all else. Measured on computed breasts of an
/// independent program with the default mesh (docs/verification.md#what-the-mesh-does-to-numbers).
/// @param parameter  as in parameters.h
double mesh_doubt(const std::string& parameter);

/// A posterior whose measurement says less, by an error of standard deviation @p doubt; what was believed before stays.
/// @param found  posterior of a number with the prior @p believed; sd > 0, no larger than the prior's
Known with_doubt(const Known& found, const Known& believed, double doubt);

}  // namespace supine::diagnosis
