// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/base_parameters.h"

#include <gtest/gtest.h>

#include <set>

#include "common/error.h"
#include "simulation/laws/bulk_laws.h"
#include "simulation/model_fields.h"
#include "simulation/parameters.h"
#include "tests/simulation/scene.h"

namespace supine::simulation {
namespace {

TEST(BaseParameters, EveryRowStandsForOneNumberOfTheModel) {
  Model model;
  std::set<std::string> names;
  std::set<const Setting*> numbers;
  for (const BaseParameter& row : base_parameters()) {
    const Setting* number = &row.in(model);
    EXPECT_EQ(&row.in_const(model), number) << row.name;
    EXPECT_EQ(&base_setting(model, row.name), number);
    EXPECT_EQ(find_setting(model, row.name), number);
    EXPECT_EQ(find_parameter(row.name), &row);
    EXPECT_TRUE(names.insert(row.name).second) << row.name << " is there twice";
    EXPECT_TRUE(numbers.insert(number).second) << row.name << " shares its number with another row";
  }
  EXPECT_THROW(base_setting(model, "breast.young_modulus"), InputError);
  EXPECT_EQ(find_setting(model, "breast.young_modulus"), nullptr);
}

TEST(BaseParameters, RowsAreConsistent) {
  for (const BaseParameter& row : base_parameters()) {
    EXPECT_EQ(row.median, row.in_const(Model()).value) << row.name;
    EXPECT_LT(row.lower, row.upper) << row.name;
    EXPECT_GE(row.median, row.lower) << row.name;
    EXPECT_LE(row.median, row.upper) << row.name;
    EXPECT_GT(row.spread, 0) << row.name;
    EXPECT_FALSE(row.unit.empty()) << row.name;
    EXPECT_FALSE(row.meaning.empty()) << row.name;
    EXPECT_EQ(row.why_not.empty(), !row.bulk_law && !row.skin_law) << row.name;
  }
}

TEST(BaseParameters, NumbersOfALawReachItsMaterialAndNoOther) {
  const testing::TestScene& scene = testing::dome_scene();
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  const Scene place{scene.mesh, scene.anatomy, layout, "supine"};
  for (const BaseParameter& row : base_parameters()) {
    if (!row.bulk_law) continue;
    for (const auto& [name, law] : bulk_law_names()) {
      Model model = testing::soft_model(law);
      row.in(model).value = 0.37;
      const auto fields = make_fields(model, place, {0, 1, 0}, row.name);
      const Dual found = (row.law_shape == 1 ? fields.law_shape_1 : fields.law_shape_2)[0];
      EXPECT_EQ(why_not_of(model, row.name).empty(), law == *row.bulk_law) << row.name << " " << name;
      EXPECT_EQ(found.a == 0.37 && found.v[0] == 1, law == *row.bulk_law) << row.name << " " << name;
    }
  }
}

TEST(BaseParameters, TheIncompressibleSkinHasNoPoissonRatio) {
  Model model;
  model.skin.law = SkinLaw::neo_hookean;
  EXPECT_NE(why_not_of(model, "skin.poisson_ratio"), "");
  model.skin.law = SkinLaw::corotational;
  EXPECT_EQ(why_not_of(model, "skin.poisson_ratio"), "");
}

}  // namespace
}  // namespace supine::simulation
