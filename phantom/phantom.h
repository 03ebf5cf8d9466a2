// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "phantom/case_folder.h"
#include "phantom/discrepancy.h"
#include "phantom/motion.h"
#include "phantom/nuisances.h"
#include "phantom/placement.h"
#include "phantom/truth.h"

namespace supine::phantom {

struct PhantomOptions {
  std::uint64_t seed = 1;
  std::vector<std::string> effects;  ///< of the catalogue; at most two causes in all, three where realistic
  std::vector<std::string> outside;  ///< of outside_causes()
  std::optional<double> size;        ///< of every cause, 0 to 1 in its range, in place of drawn ones (draw_cause)
  Population population = Population::benchmark;
  bool realistic = false;  ///< Nuisances::Kind::realistic
  bool prior = false;      ///< causes, nuisances and discrepancy from their priors
  bool tilt = false;       ///< a scan of the body tilted by 45° as well
  double noise_mm = 0.7;   ///< in [0, 5]
  double voxel_mm = 1.5;   ///< in [0.5, 4]
  int rings = 11;          ///< of the mesh, in [4, 30]
  int order = 2;           ///< 1 or 2
  void check() const;      ///< @throws InputError naming option, value and bound, or what excludes what
};

/// What the case folder tells, and what it does not.
struct Phantom {
  CaseContents contents;
  Body body;  ///< with the moduli that were used
  std::vector<Cause> causes;
  std::optional<Nuisances> nuisances;
  std::optional<Discrepancy> discrepancy;
  std::map<std::string, Placement> places;  ///< of the scans that do not lie where they should, by pose
  int nodes = 0, tetrahedra = 0;
  std::vector<std::string> gave_way;  ///< what was said of moduli that were not carried at once
  double volume_ml = 0;
  std::vector<TruthPose> poses;  ///< of the truth's nodes
  Points rest;                   ///< stress-free, mm
  Motion motion;                 ///< from prone to supine
};

/// Body, noise and holes depend on the seed alone, so that two phantoms of one seed differ by their causes only.
/// Where the drawn moduli carry no equilibrium they are raised by 15 % up to six times; those of volunteers are scaled
/// until the nipple moves as far as was drawn (solve_volunteer.h).
/// @throws InputError        options; an unknown cause, a cause given twice, too many
/// @throws NumericalFailure  no equilibrium even then
Phantom make_phantom(const PhantomOptions& options);

}  // namespace supine::phantom
