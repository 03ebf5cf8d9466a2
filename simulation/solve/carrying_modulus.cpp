// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/carrying_modulus.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace supine::simulation {
namespace {

constexpr double margin = 1.1;                       // beyond E / load, so that mostly one try is enough
constexpr double least_raise = 1.3, most_raise = 8;  // of the modulus after a failure
constexpr double lowering = 1.5;                     // of the modulus after the first success

/// A search asks whether there is an equilibrium, not where to a nanometre.
SolveOptions search_options() {
  SolveOptions options;
  options.step_tolerance_mm = 1e-4;
  options.residual_tolerance = 1e-6;
  return options;
}

/// One chain after the other, with the bracket they leave.
class Search {
 public:
  Search(Chain& chain, Model& model, const ModulusSearch& search) : chain_(chain), model_(model), search_(search) {}

  /// Narrows the bracket by the chain at @p kpa; load() says how far a failure came.
  bool carries(double kpa) {
    if (search_.progress) search_.progress(kpa);
    model_.breast.young_modulus_kpa.value = kpa;
    ++found.chains;
    try {
      found.solution = chain_.solve(model_, found.carries_kpa > 0 ? &found.solution : nullptr);
      found.carries_kpa = kpa;
      return true;
    } catch (const NoEquilibrium& failure) {
      load_ = failure.load();
    } catch (const NumericalFailure&) {
      load_ = 0;  // balanced, but a cell was turned inside out
    }
    found.fails_kpa = kpa;
    return false;
  }
  double load() const { return load_; }

  CarryingModulus found;

 private:
  Chain& chain_;
  Model& model_;
  const ModulusSearch& search_;
  double load_ = 0;
};

}  // namespace

CarryingModulus find_carrying_modulus(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, Model model,
                                      const std::vector<PoseLoad>& poses, const ModulusSearch& search) {
  Chain chain(mesh, anatomy, model, poses, search_options());
  double kpa = std::clamp(model.breast.young_modulus_kpa.value, search.softest_kpa, search.stiffest_kpa);
  Search tried(chain, model, search);
  while (!tried.carries(kpa)) {
    if (kpa >= search.stiffest_kpa)
      throw NumericalFailure(
          fmt::format("not even breast.young_modulus_kpa = {:.4g} carries this body: not the tissue's stiffness is at "
                      "fault; look at the mesh with supine-tetrahedralise --check, and at the directions of gravity",
                      kpa));
    const double raise = tried.load() > 0 ? std::clamp(margin / tried.load(), least_raise, most_raise) : most_raise;
    kpa = std::min(kpa * raise, search.stiffest_kpa);
  }
  while (!tried.found.fails_kpa && tried.found.carries_kpa > search.softest_kpa)
    tried.carries(std::max(tried.found.carries_kpa / lowering, search.softest_kpa));
  while (tried.found.fails_kpa && tried.found.carries_kpa > search.ratio * *tried.found.fails_kpa)
    tried.carries(std::sqrt(tried.found.carries_kpa * *tried.found.fails_kpa));
  return std::move(tried.found);
}

}  // namespace supine::simulation
