// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/model_edit.h"

#include <cmath>

#include "common/error.h"
#include "pipeline/case/model_file.h"
#include "pipeline/case/starting_model.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

const std::string base = "# my notes\n[breast]\nyoung_modulus_kpa = 0.5  # from the clinic\n";

class ModelEdit : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& text) {
    write_text(folder_ / "model.toml", text);
    return folder_ / "model.toml";
  }
  TemporaryFolder folder_;
};

TEST_F(ModelEdit, AddingKeepsEveryByteBefore) {
  const std::string text = with_effect(read_model_text(file(base)), "ligament");
  EXPECT_EQ(text.substr(0, base.size()), base);
}

TEST_F(ModelEdit, EveryEffectOfTheCatalogueCanBeAddedReadAndRemoved) {
  for (const simulation::Effect* effect : simulation::catalogue()) {
    const auto path = file(with_effect(read_model_text(file(base)), effect->name()));
    const simulation::Model model = read_model(path);
    ASSERT_EQ(model.effects.size(), 1u) << effect->name();
    bool any_free = false;
    for (const auto& [key, setting] : model.effects[0].parameters) any_free |= setting.free;
    EXPECT_TRUE(any_free) << effect->name();
    EXPECT_EQ(without_effect(read_model_text(path), effect->name()), base) << effect->name();
  }
}

TEST_F(ModelEdit, AStartingModelCarriesItsBodyAndMayBeEdited) {
  const simulation::Model model = read_model(file(starting_model(163)));
  const simulation::Setting& modulus = model.breast.young_modulus_kpa;
  EXPECT_NEAR(1000 * 9.81e-6 * 163 / modulus.value, 0.4, 0.02);  // ρ g H / E
  EXPECT_TRUE(modulus.free && modulus.prior_sd);
  EXPECT_LT(modulus.lower, 0.2 * modulus.value);
  EXPECT_NO_THROW(read_model(file(with_effect(read_model_text(file(starting_model(60))), "ligament"))));
}

TEST_F(ModelEdit, NoModulusSuitsABodyAThousandTimesTooSmall) {
  try {
    starting_model(0.016);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("are its coordinates in mm?"), std::string::npos) << error.what();
  }
}

TEST_F(ModelEdit, StrengthAndPlaceOfAnAddedEffectAreFreeAboutTheirUsualValues) {
  const simulation::Model model = read_model(file(with_effect(read_model_text(file(base)), "ligament")));
  for (const simulation::Parameter& row : simulation::find_effect("ligament")->parameters()) {
    const simulation::Setting& setting = model.effects[0].parameters.at(row.name);
    EXPECT_TRUE(setting.free) << row.name;
    EXPECT_EQ(setting.value, row.median) << row.name;
    EXPECT_GT(setting.prior_sd.value(), 0) << row.name;
    EXPECT_EQ(setting.lower, row.lower) << row.name;
    EXPECT_EQ(setting.upper, row.upper) << row.name;
  }
}

TEST_F(ModelEdit, AnAddedEffectBeginsWithWhatWasChosen) {
  const simulation::Model model =
      read_model(file(with_effect(read_model_text(file(base)), "ligament", {{"width_mm", "20.5"}, {"arc", "lower"}})));
  const simulation::EffectSetting& ligament = model.effects[0];
  EXPECT_EQ(ligament.parameters.at("width_mm").value, 20.5);
  EXPECT_TRUE(ligament.parameters.at("width_mm").free);
  EXPECT_EQ(ligament.options.at("arc"), "lower");
  EXPECT_EQ(ligament.options.at("tie"), "elastic");
  EXPECT_EQ(ligament.parameters.at("offset_mm").value, 0);
}

TEST_F(ModelEdit, WhatIsChosenIsANameAndAValue) {
  EXPECT_EQ(chosen_values({"width_mm=20", "arc=lower"}),
            (std::map<std::string, std::string>{{"arc", "lower"}, {"width_mm", "20"}}));
  for (const char* word : {"width_mm", "=20", "width_mm="})
    expect_words(input_error([word] { chosen_values({word}); }), {word, "NAME=VALUE"});
}

TEST_F(ModelEdit, WhatIsChosenHasToBeANumberOrAnOptionOfTheEffect) {
  const auto refused = [this](const char* name, const char* value) {
    return input_error([&] { with_effect(read_model_text(file(base)), "ligament", {{name, value}}); });
  };
  expect_words(refused("widht_mm", "20"), {"ligament has no \"widht_mm\"", "width_mm", "arc"});
  expect_words(refused("width_mm", "200"), {"ligament.width_mm = 200", "from 1 to 60 mm"});
  expect_words(refused("width_mm", "20 mm"), {"ligament.width_mm = 20 mm", "a number"});
  expect_words(refused("width_mm", "nan"), {"ligament.width_mm = nan"});
  expect_words(refused("arc", "upper"), {"ligament.arc = upper", "lower"});
}

TEST_F(ModelEdit, RemovingKeepsTheCommentOfTheNextTable) {
  const auto path =
      file("[[effect]]\nname = \"ligament\"\nwidth_mm = 10\n\n# about the skin\n[skin]\nthickness_mm = 2\n");
  EXPECT_EQ(without_effect(read_model_text(path), "ligament"), "\n# about the skin\n[skin]\nthickness_mm = 2\n");
}

TEST_F(ModelEdit, AddingTwiceIsRefusedWithTheLine) {
  const auto path = file(with_effect(read_model_text(file(base)), "ligament"));
  expect_words(input_error([&] { with_effect(read_model_text(path), "ligament"); }), {"model.toml:4", "already"});
}

TEST_F(ModelEdit, AMisspeltEffectIsRefusedWithTheNearestName) {
  expect_words(input_error([&] { with_effect(read_model_text(file(base)), "ligamnet"); }),
               {"ligamnet", "did you mean ligament?"});
}

TEST_F(ModelEdit, RemovingWhatIsNotThereIsRefused) {
  expect_words(input_error([&] { without_effect(read_model_text(file(base)), "ligament"); }),
               {"model.toml", "ligament"});
}

TEST_F(ModelEdit, NewValuesKeepEverythingElse) {
  const std::string text =
      "# größer\n[breast]\nyoung_modulus_kpa = { value = 0.5, prior_sd = 0.4 }  # µ\n[skin]\nthickness_mm = 2\n"
      "[skin.young_modulus_kpa]\nvalue = 20  # soft\n[[effect]]\nname = \"ligament\"\n"
      "stiffness_kpa_per_mm = { lower = 0, value = 0.4 }\n";
  const auto path = file(text);
  const std::string edited = with_values(read_model_text(path), {{"breast.young_modulus_kpa", 1.0 / 3},
                                                                 {"skin.young_modulus_kpa", 33.25},
                                                                 {"ligament.stiffness_kpa_per_mm", 0.125}});
  std::string expected = text;
  expected.replace(expected.find("value = 0.5"), 11, "value = 0.3333333333333333");
  expected.replace(expected.find("value = 20"), 10, "value = 33.25");
  expected.replace(expected.find("value = 0.4"), 11, "value = 0.125");
  EXPECT_EQ(edited, expected);
  const simulation::Model model = read_model(file(edited));
  EXPECT_EQ(model.breast.young_modulus_kpa.value, 1.0 / 3);
  EXPECT_EQ(model.skin.young_modulus_kpa.value, 33.25);
}

TEST_F(ModelEdit, AValueThatRoundingPutBesideItsBoundIsTheBound) {
  const auto path = file("[breast]\nyoung_modulus_kpa = { value = 500, prior_sd = 400, lower = 50, upper = 5000 }\n");
  const double fitted = std::nextafter(50.0, 0.0);
  EXPECT_EQ(read_model(file(with_values(read_model_text(path), {{"breast.young_modulus_kpa", fitted}})))
                .breast.young_modulus_kpa.value,
            50);
}

TEST_F(ModelEdit, AFixedNumberIsReplacedToo) {
  EXPECT_EQ(with_values(read_model_text(file(base)), {{"breast.young_modulus_kpa", 0.25}}),
            "# my notes\n[breast]\nyoung_modulus_kpa = 0.25  # from the clinic\n");
}

TEST_F(ModelEdit, ABoundIsReplacedWhereItStandsInTheFile) {
  const auto path = file("[breast]\nyoung_modulus_kpa = { value = 2, lower = 0.1, upper = 20 }\n");
  EXPECT_EQ(with_values(read_model_text(path),
                        {{"breast.young_modulus_kpa", 0.05}, {"breast.young_modulus_kpa.lower", 0.025}}),
            "[breast]\nyoung_modulus_kpa = { value = 0.05, lower = 0.025, upper = 20 }\n");
  EXPECT_THROW(with_values(read_model_text(file(base)), {{"breast.young_modulus_kpa.lower", 1}}), InputError);
}

TEST_F(ModelEdit, EffectsInOneListAreReadAndNotEdited) {
  const auto path = file("effect = [ { name = \"ligament\" }, { name = \"friction\" } ]\n" + base);
  EXPECT_EQ(read_model(path).effects.size(), 2u);
  for (const char* effect : {"ligament", "creep"}) {
    expect_words(input_error([&] { without_effect(read_model_text(path), effect); }), {"model.toml:1", "[[effect]]"});
    expect_words(input_error([&] { with_effect(read_model_text(path), effect); }), {"model.toml:1", "[[effect]]"});
  }
}

TEST_F(ModelEdit, NewValuesAreForNumbersThatStandInTheFile) {
  EXPECT_THROW(with_values(read_model_text(file(base)), {{"skin.young_modulus_kpa", 1}}), InputError);
  EXPECT_THROW(with_values(read_model_text(file(base)), {{"ligament.stiffness_kpa_per_mm", 1}}), InputError);
}

}  // namespace
}  // namespace supine::pipeline
