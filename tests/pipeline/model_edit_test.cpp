// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/model_edit.h"

#include "pipeline/model_file.h"
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
  const std::string text = with_effect(file(base), "ligament");
  EXPECT_EQ(text.substr(0, base.size()), base);
}

TEST_F(ModelEdit, EveryEffectOfTheCatalogueCanBeAddedReadAndRemoved) {
  for (const simulation::Effect* effect : simulation::catalogue()) {
    const auto path = file(with_effect(file(base), effect->name()));
    const simulation::Model model = read_model(path);
    ASSERT_EQ(model.effects.size(), 1u) << effect->name();
    bool any_free = false;
    for (const auto& [key, setting] : model.effects[0].parameters) any_free |= setting.free;
    EXPECT_TRUE(any_free) << effect->name();
    EXPECT_EQ(without_effect(path, effect->name()), base) << effect->name();
  }
}

TEST_F(ModelEdit, RemovingKeepsTheCommentOfTheNextTable) {
  const auto path =
      file("[[effect]]\nname = \"ligament\"\nwidth_mm = 10\n\n# about the skin\n[skin]\nthickness_mm = 2\n");
  EXPECT_EQ(without_effect(path, "ligament"), "\n# about the skin\n[skin]\nthickness_mm = 2\n");
}

TEST_F(ModelEdit, AddingTwiceIsRefusedWithTheLine) {
  const auto path = file(with_effect(file(base), "ligament"));
  expect_words(input_error([&] { with_effect(path, "ligament"); }), {"model.toml:4", "already"});
}

TEST_F(ModelEdit, AMisspeltEffectIsRefusedWithTheNearestName) {
  expect_words(input_error([&] { with_effect(file(base), "ligamnet"); }), {"ligamnet", "did you mean ligament?"});
}

TEST_F(ModelEdit, RemovingWhatIsNotThereIsRefused) {
  expect_words(input_error([&] { without_effect(file(base), "ligament"); }), {"model.toml", "ligament"});
}

}  // namespace
}  // namespace supine::pipeline
