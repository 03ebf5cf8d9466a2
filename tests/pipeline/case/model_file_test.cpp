// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/model_file.h"

#include <vector>

#include "common/error.h"
#include "simulation/catalogue.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using simulation::Model;

const std::string good = R"([breast]
law = "neo_hookean"
young_modulus_kpa = { value = 0.5, prior_sd = 0.4, lower = 0.05, upper = 5 }
poisson_ratio = 0.45
density_kg_m3 = 1010
density_refers_to = "undeformed"
[skin]
law = "corotational"
young_modulus_kpa = 20
thickness_mm = 1.5
compression = "full"
compression_share = 0.1
[interface]
kind = "fixed"
normal_kpa_per_mm = 3.5
tangential_kpa_per_mm = 0.02
[cut]
kind = "held"
stiffness_kpa_per_mm = 1.25
[[effect]]
name = "ligament"
stiffness_kpa_per_mm = { value = 0.4, lower = 0, upper = 4 }
width_mm = 13
arc = "full"
)";

class ModelFile : public testing::Test {
 protected:
  Model read(const std::string& text) {
    write_text(folder_ / "model.toml", text);
    return read_model(folder_ / "model.toml");
  }
  TemporaryFolder folder_;
};

TEST_F(ModelFile, EveryBaseKeyArrives) {
  const Model m = read(good);
  EXPECT_EQ(m.breast.law, simulation::BulkLaw::neo_hookean);
  EXPECT_EQ(m.breast.density_refers_to, simulation::DensityReference::undeformed);
  EXPECT_EQ(m.breast.density_kg_m3.value, 1010);
  EXPECT_EQ(m.skin.law, simulation::SkinLaw::corotational);
  EXPECT_EQ(m.skin.young_modulus_kpa.value, 20);
  EXPECT_EQ(m.skin.thickness_mm.value, 1.5);
  EXPECT_EQ(m.skin.compression, simulation::Compression::full);
  EXPECT_EQ(m.skin.compression_share.value, 0.1);
  EXPECT_EQ(m.interface.kind, simulation::InterfaceKind::fixed);
  EXPECT_EQ(m.interface.normal_kpa_per_mm.value, 3.5);
  EXPECT_EQ(m.interface.tangential_kpa_per_mm.value, 0.02);
  EXPECT_EQ(m.cut.kind, simulation::CutKind::held);
  EXPECT_EQ(m.cut.stiffness_kpa_per_mm.value, 1.25);
}

TEST_F(ModelFile, SaysHowUnevenTheBodyIs) {
  const fs::path file = folder_ / "model.toml";
  read(good);
  EXPECT_EQ(read_patchiness(file).tissue, diagnosis::Patchiness{}.tissue) << "as usual where it is not said";
  read(good + "[patchiness]\ntissue = 0.4\nskin_length_mm = 30\nmuscle_mm = 0\n");
  const diagnosis::Patchiness said = read_patchiness(file);
  EXPECT_EQ(said.tissue, 0.4);
  EXPECT_EQ(said.skin_length_mm, 30);
  EXPECT_EQ(said.muscle_mm, 0);
  EXPECT_EQ(said.skin, diagnosis::Patchiness{}.skin);
  EXPECT_THROW(read(good + "[patchiness]\ntissues = 0.4\n"), InputError);
  EXPECT_THROW(read(good + "[patchiness]\nskin = -0.1\n"), InputError);
  EXPECT_THROW(read(good + "[patchiness]\ntissue_length_mm = 0.02\n"), InputError) << "metres";
}

TEST_F(ModelFile, ATableIsFreeAndANumberIsFixed) {
  const Model m = read(good);
  const auto& e = m.breast.young_modulus_kpa;
  EXPECT_TRUE(e.free);
  EXPECT_EQ(e.value, 0.5);
  EXPECT_EQ(e.prior_sd, 0.4);
  EXPECT_EQ(e.lower, 0.05);
  EXPECT_EQ(e.upper, 5);
  EXPECT_FALSE(m.breast.poisson_ratio.free);
}

TEST_F(ModelFile, AnEffectHasAllItsParametersAndOptions) {
  const Model m = read(good);
  ASSERT_EQ(m.effects.size(), 1u);
  const auto& ligament = m.effects[0];
  const simulation::Effect* entry = simulation::find_effect("ligament");
  ASSERT_TRUE(entry);
  EXPECT_EQ(ligament.parameters.size(), entry->parameters().size());
  EXPECT_EQ(ligament.options.size(), entry->options().size());
  EXPECT_EQ(ligament.parameters.at("width_mm").value, 13);
  EXPECT_TRUE(ligament.parameters.at("stiffness_kpa_per_mm").free);
  EXPECT_EQ(ligament.options.at("arc"), "full");
}

TEST_F(ModelFile, AbsentEffectParametersTakeTheMedianOfTheCatalogue) {
  for (const simulation::Effect* effect : simulation::catalogue()) {
    const Model m = read("[[effect]]\nname = \"" + effect->name() + "\"\n");
    for (const auto& row : effect->parameters())
      EXPECT_EQ(m.effects.at(0).parameters.at(row.name).value, row.median) << effect->name() << " " << row.name;
  }
}

TEST_F(ModelFile, AnEmptyFileGivesTheDefaults) {
  const Model m = read("");
  EXPECT_EQ(m.breast.young_modulus_kpa.value, Model().breast.young_modulus_kpa.value);
  EXPECT_EQ(m.interface.kind, simulation::InterfaceKind::sliding);
  EXPECT_TRUE(m.effects.empty());
}

TEST_F(ModelFile, TheDefaultsLieInTheirRanges) {
  const Model m = read("");
  for (const auto* setting : {&m.breast.young_modulus_kpa, &m.breast.poisson_ratio, &m.skin.young_modulus_kpa,
                              &m.skin.thickness_mm, &m.interface.tangential_kpa_per_mm, &m.cut.stiffness_kpa_per_mm}) {
    EXPECT_GE(setting->value, setting->lower);
    EXPECT_LE(setting->value, setting->upper);
  }
}

TEST_F(ModelFile, OnlyTheCorotationalSkinHasAPoissonRatio) {
  EXPECT_EQ(read("[skin]\nlaw = \"corotational\"\n").skin.poisson_ratio.value, 0.45);
  EXPECT_EQ(read("[skin]\nlaw = \"corotational\"\npoisson_ratio = 0.3\n").skin.poisson_ratio.value, 0.3);
}

TEST_F(ModelFile, SkinFadesOverALengthIfThatIsAskedFor) {
  EXPECT_EQ(read("[skin]\nlaw = \"neo_hookean\"\n").skin.fade_mm, 0);
  EXPECT_EQ(read("[skin]\nfade_mm = 12.5\n").skin.fade_mm, 12.5);
  EXPECT_THROW(read("[skin]\nfade_mm = -1\n"), InputError);
  EXPECT_THROW(read("[skin]\nfade_mm = 51\n"), InputError);
  EXPECT_THROW(read("[cut]\nfade_mm = 5\n"), InputError);
}

TEST_F(ModelFile, SkinResistsBendingIfThatIsAskedFor) {
  EXPECT_EQ(read("[skin]\nlaw = \"neo_hookean\"\n").skin.bending_share, 0);
  EXPECT_EQ(read("[skin]\nbending_share = 1.5\n").skin.bending_share, 1.5);
  EXPECT_THROW(read("[skin]\nbending_share = -1\n"), InputError);
  EXPECT_THROW(read("[skin]\nbending_share = 1001\n"), InputError);
}

TEST_F(ModelFile, ContactIsOffUnlessItIsAskedFor) {
  EXPECT_EQ(read(good).contact.kind, simulation::ContactKind::off);
  const auto said = read(good + "[contact]\nkind = \"skin\"\nstiffness_kpa_per_mm = 3.5\nband_mm = 0.7\n").contact;
  EXPECT_EQ(said.kind, simulation::ContactKind::skin);
  EXPECT_EQ(said.stiffness_kpa_per_mm, 3.5);
  EXPECT_EQ(said.band_mm, 0.7);
  EXPECT_EQ(read(good + "[contact]\nkind = \"chest\"\n").contact.kind, simulation::ContactKind::chest);
  EXPECT_TRUE(read(good + "[contact]\nkind = \"all\"\n").contact.with_chest());
  EXPECT_TRUE(read(good + "[contact]\nkind = \"all\"\n").contact.with_skin());
  EXPECT_THROW(read(good + "[contact]\nkind = \"ribs\"\n"), InputError);
  EXPECT_THROW(read(good + "[contact]\nkind = \"skin\"\nband_mm = 0\n"), InputError);
  EXPECT_THROW(read(good + "[contact]\nkind = \"skin\"\nstiffness_kpa_per_mm = -1\n"), InputError);
  EXPECT_THROW(read(good + "[contact]\nkinds = \"skin\"\n"), InputError);
  EXPECT_THROW(read(good + "[contact]\nstiffness_kpa_per_mm = 3.5\n"), InputError);
  EXPECT_NO_THROW(read(good + "[contact]\nkind = \"off\"\nstiffness_kpa_per_mm = 3.5\n"));
}

TEST_F(ModelFile, TheSamplesAreRead) {
  for (const char* name : {"ligament", "phantom"})
    EXPECT_NO_THROW(read_model(std::filesystem::path(SUPINE_SOURCE_DIR) / "samples" / name / "model.toml")) << name;
}

struct BadModel {
  const char *name, *from, *to;
  std::vector<std::string> words;
};

void PrintTo(const BadModel& bad, std::ostream* out) { *out << bad.from << " -> " << bad.to; }

class BadModelFile : public ModelFile, public testing::WithParamInterface<BadModel> {};

TEST_P(BadModelFile, IsRefusedWithPlaceValueAndBound) {
  const std::string message = input_error([&] { read(replaced(good, GetParam().from, GetParam().to)); });
  expect_words(message, {"model.toml"});
  expect_words(message, GetParam().words);
}

INSTANTIATE_TEST_SUITE_P(
    Table, BadModelFile,
    testing::Values(
        BadModel{"NotToml", "law = \"neo_hookean\"", "law = neo_hookean", {":2:", "not valid TOML"}},
        BadModel{"UnknownKey",
                 "poisson_ratio =",
                 "poison_ratio =",
                 {":4", "[breast] poison_ratio", "did you mean poisson_ratio?"}},
        BadModel{"NoUnit", "thickness_mm =", "thickness =", {"[skin] thickness", "did you mean thickness_mm?"}},
        BadModel{"UnknownTable", "[interface]", "[interfaces]", {"interfaces", "did you mean interface?"}},
        BadModel{
            "UnknownLaw", "\"neo_hookean\"", "\"neohookean\"", {"law = \"neohookean\"", "did you mean neo_hookean?"}},
        BadModel{"UnknownKind", "kind = \"held\"", "kind = \"glued\"", {"[cut] kind = \"glued\"", "elastic or held"}},
        BadModel{"NegativeModulus",
                 "young_modulus_kpa = 20",
                 "young_modulus_kpa = -20",
                 {":9", "[skin] young_modulus_kpa = -20", "kPa"}},
        BadModel{
            "NegativeFreeModulus", "value = 0.5", "value = -0.5", {"breast.young_modulus_kpa", "value = -0.5", "kPa"}},
        BadModel{"NegativeLowerBound", "lower = 0.05", "lower = -1", {"breast.young_modulus_kpa", "lower = -1"}},
        BadModel{"PoissonAHalf", "poisson_ratio = 0.45", "poisson_ratio = 0.5", {"poisson_ratio = 0.5", "< 0.5"}},
        BadModel{"PoissonFreeToAHalf",
                 "poisson_ratio = 0.45",
                 "poisson_ratio = { value = 0.4, upper = 0.5 }",
                 {"breast.poisson_ratio", "upper = 0.5", "< 0.5"}},
        BadModel{"DensityZero", "1010", "0", {"density_kg_m3 = 0", "kg"}},
        BadModel{"NotANumber", "young_modulus_kpa = 20", "young_modulus_kpa = \"20\"", {"young_modulus_kpa", "number"}},
        BadModel{"NaN", "young_modulus_kpa = 20", "young_modulus_kpa = nan", {"young_modulus_kpa", "finite"}},
        BadModel{"NoValue", "value = 0.5, ", "", {"value", "missing"}},
        BadModel{"LowerAboveUpper", "lower = 0.05", "lower = 6", {"lower = 6", "upper = 5"}},
        BadModel{"ValueBelowLower", "lower = 0.05", "lower = 0.6", {"value = 0.5", "lower = 0.6"}},
        BadModel{"PriorNotPositive", "prior_sd = 0.4", "prior_sd = 0", {"prior_sd = 0", "> 0"}},
        BadModel{"UnknownSettingKey", "prior_sd = 0.4", "sd = 0.4", {"sd", "unknown key"}},
        BadModel{"PoissonOfIncompressibleSkin",
                 "law = \"corotational\"",
                 "law = \"neo_hookean\"\npoisson_ratio = 0.45",
                 {"[skin] poisson_ratio", "incompressible"}},
        BadModel{"MisspeltEffect",
                 "\"ligament\"",
                 "\"ligamnet\"",
                 {":21", "[[effect]] name = \"ligamnet\"", "did you mean ligament?"}},
        BadModel{"EffectWithoutName", "name = \"ligament\"\n", "", {"[[effect]]", "name", "missing"}},
        BadModel{"EffectTwice",
                 "arc = \"full\"",
                 "arc = \"full\"\n[[effect]]\nname = \"ligament\"",
                 {"[[effect]]", "already"}},
        BadModel{"SingleBracketEffect", "[[effect]]", "[effect]", {"effect", "[[effect]]"}},
        BadModel{
            "UnknownEffectKey", "width_mm = 13", "witdh_mm = 13", {"[[effect]] witdh_mm", "did you mean width_mm?"}},
        BadModel{"EffectOutOfRange", "width_mm = 13", "width_mm = -3", {"width_mm = -3", "mm"}},
        BadModel{"UnknownOption", "arc = \"full\"", "arc = \"fulll\"", {"arc = \"fulll\"", "did you mean full?"}}),
    [](const auto& place) { return place.param.name; });

TEST_F(ModelFile, AFileThatIsNotThereIsNamed) {
  expect_words(input_error([] { read_model("/no/such/model.toml"); }), {"/no/such/model.toml"});
}

}  // namespace
}  // namespace supine::pipeline
