// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "diagnosis/examine.h"

namespace supine::diagnosis {

/// What a further measurement would do for the causes that cannot be told apart, or could not be seen.
struct Separation {
  std::string measurement;   ///< in words: the fitted pose once more, tilts, upright
  double separation = 0;     ///< expected fall of F between the closest pair of the set, all free parameters refitted
  std::string closest_pair;  ///< the two it separates least, "a / b"
  /// Chance to find an effect that cannot be seen now: mean over them, each weighed by how likely it was before.
  double single_power = 0;
  std::string shows;  ///< the effect it brings out most, weighed alike; may be empty
};

/// Expected separation (T-optimality; Atkinson and Fedorov 1975) under linearised poses: with S of what is measured
/// and S' of the further pose stacked,
///   Δ_ij = min_{δβ, δφ_j} ‖[S_i φ_i; S_i' φ_i] − [S_β δβ + S_j δφ_j; …]‖²  in the metric of Σ ⊕ Σ',
/// the smaller of Δ_ij and Δ_ji, for effects at their fitted (else usual) size. A further pose is one forward solve of
/// the base model and is assumed to be scanned as the fitted one was: every skin node a point, the same noise and
/// spread. Best first; of what shows as good as the same, where nothing is to be told apart, what asks for less.
/// @param set  effects to be told apart; with fewer than two the separation is 0 and single_power orders the list
std::vector<Separation> next_measurements(const Subject& subject, const Findings& found,
                                          const std::vector<std::string>& set);

/// Effects that this scan could not settle if they were there at their usual size: the Bayes factor to be expected is
/// under 3. Those that are named are not among them, unless they are named because they are expected.
std::vector<std::string> not_seen(const Findings& found);

}  // namespace supine::diagnosis
