// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/folds.h"

#include <gtest/gtest.h>

#include "bench/robustness_cases.h"
#include "simulation/mechanics.h"
#include "tests/simulation/scene.h"

namespace supine::simulation {
namespace {

/// One quadratic tetrahedron of unit edges, the node between corners 0 and 1 at @p middle of that edge.
Points one_cell(double middle) {
  Points p(10, 3);
  p << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, middle, 0, 0, 0.5, 0.5, 0, 0, 0.5, 0, 0, 0, 0.5, 0.5, 0, 0.5, 0, 0.5, 0.5;
  return p;
}

Indices one_row() {
  Indices cells(1, 10);
  cells << 0, 1, 2, 3, 4, 5, 6, 7, 8, 9;
  return cells;
}

// Along the edge ∂x/∂ξ at its corner is 4 middle - 1: inside out below a quarter.
TEST(Folds, AMiddleNodeBelowAQuarterOfItsEdgeFoldsTheCorner) {
  EXPECT_EQ(find_folds(one_row(), one_cell(0.26)).cells, 0);
  const Folds folds = find_folds(one_row(), one_cell(0.2));
  ASSERT_EQ(folds.cells, 1);
  EXPECT_EQ(folds.worst_cell, 0);
  EXPECT_LT(folds.worst, -0.1);
  EXPECT_LT(folds.place_mm.norm(), 1e-12);
  EXPECT_GT(find_folds(one_row(), one_cell(0.8)).place_mm.x(), 0.99);
}

TEST(Folds, EnergySeesOnlyTheQuadraturePoints) {
  const Points folded = one_cell(0.2), straight = one_cell(0.5);
  EXPECT_LT(cell_det_f(one_row(), folded, straight)[0], 0);
  EXPECT_GT(cell_det_f_at_points(one_row(), folded, straight)[0], 0);
}

TEST(Folds, AreNamedWithCountAndPlace) {
  EXPECT_TRUE(folds_warning("supine", {}).empty());
  const std::string words = folds_warning("supine", find_folds(one_row(), one_cell(0.8)));
  EXPECT_NE(words.find("supine: 1 quadratic cell"), std::string::npos) << words;
  EXPECT_NE(words.find("(1.0, 0.0, 0.0) mm"), std::string::npos) << words;
}

// The law of the study has no energy that would choose between two balanced shapes.
TEST(SecondShape, OfALawWithoutEnergyIsFoundAndNamed) {
  const bench::RobustnessShape shape = bench::robustness_shape(17);
  for (const auto& [set, second] : {std::pair(13, true), std::pair(6, false)}) {
    const Model model = bench::robustness_model(set);
    ASSERT_EQ(model.breast.law, BulkLaw::corotational_qr);
    const ChainSolution solution = solve_chain(shape.mesh, shape.anatomy, model, shape.poses);
    EXPECT_EQ(solution.poses[0].second_shape_mm > 0.1, second) << set;
    EXPECT_EQ(solution.warnings.size(), second ? 1u : 0u);
    if (second) {
      EXPECT_NE(solution.warnings[0].find("two balanced shapes"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace supine::simulation
