// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include "common/error.h"
#include "simulation/model_fields.h"
#include "simulation/parameters.h"
#include "tests/simulation/effects/effect_scene.h"

// Effects that could not act are refused.
namespace supine::simulation {
namespace {

using testing::effect, testing::mixed_box, testing::part;

struct Refusal {
  std::string effect, why, pose;
  void (*change)(Model&);
};

class RefusalTest : public ::testing::TestWithParam<Refusal> {};

TEST_P(RefusalTest, NamesTheEffectAndTheReason) {
  const testing::TestScene scene = mixed_box(4);
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = testing::soft_model();
  model.effects = {effect(GetParam().effect, {})};
  check_effects_act(model, {scene.mesh, scene.anatomy, layout, "supine"});
  GetParam().change(model);
  try {
    check_effects_act(model, {scene.mesh, scene.anatomy, layout, GetParam().pose});
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("'" + GetParam().effect + "'"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find(GetParam().why), std::string::npos) << error.what();
  }
}

const auto keep = [](Model&) {};
const auto fix = [](Model& m) { m.interface.kind = InterfaceKind::fixed; };
const auto rotate_skin = [](Model& m) { m.skin.law = SkinLaw::corotational; };
const auto skin_off = [](Model& m) { m.skin.young_modulus_kpa.value = 0; };

INSTANTIATE_TEST_SUITE_P(All, RefusalTest,
                         ::testing::Values(Refusal{"friction", "interface.kind", "supine", fix},
                                           Refusal{"chest_wall_motion", "interface.kind", "supine", fix},
                                           Refusal{"skin_stiffening", "skin.law", "supine", rotate_skin},
                                           Refusal{"skin_prestretch", "skin.young_modulus_kpa", "supine", skin_off},
                                           Refusal{"creep", "prone is the only pose", "prone", keep},
                                           Refusal{"arm_traction", "prone is the only pose", "prone", keep},
                                           Refusal{"gravity_tilt", "prone is the only pose", "prone", keep}),
                         [](const auto& place) { return place.param.effect; });

TEST(LeftRightStiffness, NeedsTwoBreasts) {
  testing::TestScene scene = mixed_box(2);
  Model model = testing::soft_model();
  model.effects = {null_setting(*find_effect("left_right_stiffness"))};
  const Layout one = make_layout(scene.mesh, scene.anatomy);
  EXPECT_THROW(check_effects_act(model, {scene.mesh, scene.anatomy, one, "supine"}), InputError);
  part(scene);
  const Layout two = make_layout(scene.mesh, scene.anatomy);
  EXPECT_NO_THROW(check_effects_act(model, {scene.mesh, scene.anatomy, two, "supine"}));
}

}  // namespace
}  // namespace supine::simulation
