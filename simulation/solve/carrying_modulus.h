// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "simulation/solve/chain.h"

namespace supine::simulation {

/// How far the search goes, and how finely.
struct ModulusSearch {
  double ratio = 1.05;         ///< > 1; ends when a modulus that carries is within this factor of one that does not
  double softest_kpa = 0.02;   ///< softer than any breast tissue that was measured: not looked at
  double stiffest_kpa = 1000;  ///< a body that this does not carry fails for another reason
  /// Told before every chain; may be empty.
  std::function<void(double kpa)> progress{};
};

struct CarryingModulus {
  double carries_kpa = 0;           ///< the softest that was found to carry every pose
  std::optional<double> fails_kpa;  ///< the stiffest that was not; nothing where softest_kpa carries
  int chains = 0;                   ///< solved for it
  ChainSolution solution;           ///< at carries_kpa, without round trip
};

/// The softest breast.young_modulus_kpa with which the undeformed shape and every pose are found, all else as in
/// @p model: by bisection in the logarithm, each chain starting from the nearest solution.
/// @param poses  as of Chain::Chain()
/// @throws NumericalFailure  not even stiffest_kpa carries the body
/// @throws InputError  what Chain::Chain() refuses
CarryingModulus find_carrying_modulus(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, Model model,
                                      const std::vector<PoseLoad>& poses, const ModulusSearch& search = {});

}  // namespace supine::simulation
