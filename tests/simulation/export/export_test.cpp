// SPDX-License-Identifier: AGPL-3.0-or-later
// What is written for other solvers: CalculiX runs it, the others' files are read back and summed.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdlib>
#include <map>

#include "simulation/catalogue.h"
#include "simulation/export/exported_pose.h"
#include "simulation/laws/skin_laws.h"
#include "tests/pipeline/temporary_folder.h"
#include "tests/simulation/scene.h"

namespace supine::simulation {
namespace {

using pipeline::expect_words;
using pipeline::input_error;
using pipeline::TemporaryFolder;

const std::vector<PoseLoad> poses = {{"prone", {0.1, -0.99498743710662, 0}}, {"supine", {0, 1, 0}}};

Model exportable(BulkLaw law, bool with_skin, SkinLaw skin = SkinLaw::neo_hookean) {
  Model model = testing::soft_model(law, skin);
  model.skin.compression = Compression::full;
  if (!with_skin) model.skin.young_modulus_kpa.value = 0;
  return model;
}

EffectSetting effect(const std::string& name, const std::string& parameter, double value) {
  return {name, {{parameter, Setting{value}}}, {}};
}

/// The poses of a model as solved by us, ready to be written.
std::vector<ExportedPose> solved(const Model& model) {
  const auto& scene = testing::dome_scene();
  check_exportable(model.breast.law == BulkLaw::neo_hookean_calculix ? Solver::calculix : Solver::sofa, scene.mesh,
                   scene.anatomy, model, poses);
  const ChainSolution solution = solve_chain(scene.mesh, scene.anatomy, model, poses);
  return {export_pose(scene.mesh, scene.anatomy, model, poses[0], solution.X, solution.prone),
          export_pose(scene.mesh, scene.anatomy, model, poses[1], solution.X, solution.poses[0].x)};
}

bool has_program(const std::string& name) {
  return std::system(("command -v " + name + " > /dev/null 2>&1").c_str()) == 0;
}

/// Displacements of the last block of a .dat file, by node.
std::map<int, Eigen::Vector3d> displacements(const std::filesystem::path& file) {
  std::map<int, Eigen::Vector3d> found;
  std::istringstream lines(pipeline::read_text(file));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    int node = 0;
    Eigen::Vector3d u;
    if (words >> node >> u[0] >> u[1] >> u[2]) found[node] = u;
  }
  return found;
}

/// Largest distance between CalculiX's answer and ours, mm.
double calculix_difference_mm(const ExportedPose& pose) {
  TemporaryFolder folder;
  write_export(Solver::calculix, pose, folder / "deck.inp");
  const std::string run = "cd " + folder.path().string() + " && OMP_NUM_THREADS=1 timeout 120 ccx deck > deck.log 2>&1";
  EXPECT_EQ(std::system(run.c_str()), 0) << pipeline::read_text(folder / "deck.log");
  const auto found = displacements(folder / "deck.dat");
  EXPECT_EQ(static_cast<int>(found.size()), pose.nodes);
  double largest = 0;
  for (const auto& [node, u] : found)
    largest = std::max(largest, (u.transpose() - (pose.answer.row(node - 1) - pose.X.row(node - 1))).norm());
  return largest;
}

#define NEEDS_CALCULIX() \
  if (!has_program("ccx")) GTEST_SKIP() << "CalculiX is not installed (apt-get install calculix-ccx)"

// The .dat file has seven digits.
TEST(SecondOpinion, CalculixFindsTheSameShapesOfTissueOnACurvedMuscle) {
  NEEDS_CALCULIX();
  Model model = exportable(BulkLaw::neo_hookean_calculix, false);
  model.breast.young_modulus_kpa.value = 1.5;
  for (const ExportedPose& pose : solved(model)) EXPECT_LT(calculix_difference_mm(pose), 5e-5) << pose.name;
}

// Its membrane is compressible by a thousandth of its shear modulus.
TEST(SecondOpinion, CalculixFindsTheSameShapesWithSkinAndEffects) {
  NEEDS_CALCULIX();
  Model model = exportable(BulkLaw::neo_hookean_calculix, true);
  model.effects = {effect("ligament", "stiffness_kpa_per_mm", 0.4), effect("stiffness_gradient", "lateral", 0.5),
                   effect("chest_wall_motion", "amplitude_mm", 3)};
  for (const ExportedPose& pose : solved(model)) {
    EXPECT_GT(pose.materials.size(), 20u);
    EXPECT_LT(calculix_difference_mm(pose), 0.02) << pose.name;
  }
}

/// What the reader of the format says of the file; its exit code is nonzero when the forces do not balance.
void expect_balance(Solver solver, const ExportedPose& pose, const char* bound) {
  TemporaryFolder folder;
  const auto file = folder / ("model" + export_extension(solver));
  write_export(solver, pose, file);
  write_displacements(pose, folder / "answer.csv");
  const std::string run = "python3 " SUPINE_SOURCE_DIR "/tests/simulation/export/read_export.py " + file.string() +
                          " " + (folder / "answer.csv").string() + " " + bound + " > " + (folder / "log").string() +
                          " 2>&1";
  EXPECT_EQ(std::system(run.c_str()), 0) << pose.name << ": " << pipeline::read_text(folder / "log");
}

TEST(SecondOpinion, FebioFileIsInBalanceAtOurAnswer) {
  for (const ExportedPose& pose : solved(exportable(BulkLaw::neo_hookean, false)))
    expect_balance(Solver::febio, pose, "1e-5");
  for (const ExportedPose& pose : solved(exportable(BulkLaw::neo_hookean, true)))
    expect_balance(Solver::febio, pose, "1e-2");
}

TEST(SecondOpinion, SofaSceneIsInBalanceAtOurAnswer) {
  for (const ExportedPose& pose : solved(exportable(BulkLaw::neo_hookean, true)))
    expect_balance(Solver::sofa, pose, "1e-2");
  Model model = exportable(BulkLaw::corotational, true, SkinLaw::corotational);
  model.breast.young_modulus_kpa.value = 3;
  model.effects = {effect("stiffness_gradient", "lateral", 0.5)};
  // Moduli are rounded to a thousandth.
  for (const ExportedPose& pose : solved(model)) expect_balance(Solver::sofa, pose, "1e-3");
}

TEST(SecondOpinion, TheReaderSeesAWrongForce) {
  ExportedPose pose = solved(exportable(BulkLaw::neo_hookean, false)).back();
  pose.force *= 1.01;
  TemporaryFolder folder;
  write_export(Solver::febio, pose, folder / "model.feb");
  write_displacements(pose, folder / "answer.csv");
  EXPECT_NE(std::system(("python3 " SUPINE_SOURCE_DIR "/tests/simulation/export/read_export.py " +
                         (folder / "model.feb").string() + " " + (folder / "answer.csv").string() + " 1e-3 > " +
                         (folder / "log").string() + " 2>&1")
                            .c_str()),
            0);
}

TEST(SecondOpinion, SkinTetrahedronHoldsAreaTimesThickness) {
  const Model model = exportable(BulkLaw::neo_hookean, true);
  const ExportedPose pose = solved(model).back();
  ASSERT_GT(pose.skin.rows(), 0);
  for (Eigen::Index f = 0; f < pose.skin.rows(); ++f) {
    const Eigen::RowVector3d a = pose.X.row(pose.skin(f, 0)), b = pose.X.row(pose.skin(f, 1)),
                             c = pose.X.row(pose.skin(f, 2)), d = pose.X.row(pose.skin(f, 3));
    const double area = 0.5 * (b - a).cross(c - a).norm(), volume = (b - a).cross(c - a).dot(d - a) / 6;
    EXPECT_NEAR(volume, area * model.skin.thickness_mm.value, 1e-9 * volume);
  }
}

TEST(SecondOpinion, SameModelSameBytes) {
  TemporaryFolder folder;
  const ExportedPose pose = solved(exportable(BulkLaw::neo_hookean, true)).back();
  for (const Solver solver : {Solver::calculix, Solver::febio, Solver::sofa}) {
    write_export(solver, pose, folder / "one");
    write_export(solver, pose, folder / "two");
    EXPECT_EQ(pipeline::read_text(folder / "one"), pipeline::read_text(folder / "two"));
  }
}

std::string refusal(Solver solver, const Model& model, int order = 1) {
  const auto& scene = testing::dome_scene(order);
  return input_error([&] { check_exportable(solver, scene.mesh, scene.anatomy, model, poses); });
}

TEST(SecondOpinion, RefusesWhatTheOtherSolverHasNoWordsFor) {
  const Model calculix = exportable(BulkLaw::neo_hookean_calculix, true),
              febio = exportable(BulkLaw::neo_hookean, true);
  EXPECT_EQ(refusal(Solver::calculix, calculix), "");
  EXPECT_EQ(refusal(Solver::febio, febio), "");
  expect_words(refusal(Solver::calculix, febio), {"CalculiX", "breast.law = \"neo_hookean\"", "neo_hookean_calculix"});
  expect_words(refusal(Solver::febio, calculix), {"FEBio", "neo_hookean_calculix", "use \"neo_hookean\""});
  expect_words(refusal(Solver::sofa, exportable(BulkLaw::gent, true)), {"SOFA", "gent", "corotational_qr"});
  expect_words(refusal(Solver::calculix, calculix, 2), {"quadratic", "--order 1"});
  Model wrinkling = calculix;
  wrinkling.skin.compression = Compression::tension_field;
  expect_words(refusal(Solver::calculix, wrinkling), {"tension_field", "\"full\"", "skin.young_modulus_kpa = 0"});
  Model fading = febio;
  fading.skin.fade_mm = 10;
  expect_words(refusal(Solver::febio, fading), {"FEBio", "skin.fade_mm"});
  Model bending = febio;
  bending.skin.bending_share = 1;
  expect_words(refusal(Solver::febio, bending), {"FEBio", "skin.bending_share"});
  expect_words(refusal(Solver::febio, exportable(BulkLaw::neo_hookean, true, SkinLaw::corotational)),
               {"skin.law = \"corotational\"", "neo_hookean"});
}

TEST(SecondOpinion, RefusesEffectsByName) {
  const std::vector<EffectSetting> effects = {
      effect("strain_stiffening", "exponent", 2), effect("fibre_anisotropy", "modulus_kpa", 1),
      effect("skin_prestretch", "excess", 0.05), effect("skin_stiffening", "exponent", 2),
      effect("friction", "coefficient", 0.3)};
  for (const EffectSetting& setting : effects) {
    Model model = exportable(BulkLaw::neo_hookean, true);
    // Whatever its parameter is called, the first row of the catalogue is meant.
    EffectSetting named = setting;
    named.parameters = {{find_effect(setting.name)->parameters().front().name, setting.parameters.begin()->second}};
    model.effects = {named};
    expect_words(refusal(Solver::febio, model), {setting.name, "supine-model remove " + setting.name});
  }
  Model uneven = exportable(BulkLaw::neo_hookean, true);
  uneven.effects = {effect("stiffness_gradient", "lateral", 0.5)};
  EXPECT_EQ(refusal(Solver::febio, uneven), "");
  expect_words(refusal(Solver::sofa, uneven), {"SOFA", "modulus varies", "corotational"});
}

}  // namespace
}  // namespace supine::simulation
