// SPDX-License-Identifier: AGPL-3.0-or-later
// A block on two supports through make, once as a label map and once as a surface.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <sstream>

#include "meshing/mesh_io.h"
#include "meshing/supports.h"
#include "meshing/topology.h"
#include "reconstruction/surface_io.h"
#include "tests/pipeline/process.h"
#include "tests/pipeline/simulated_scan.h"
#include "tests/pipeline/small_run.h"
#include "tests/pipeline/temporary_folder.h"
#include "tests/support/shapes.h"

namespace supine::pipeline {
namespace {

const Eigen::Vector3d size_mm(60, 20, 20);
constexpr double voxel_mm = 2;
constexpr int margin = 3;  // voxels of air or support around the block

const std::string head = "[case]\nname = \"block\"\nbody = \"object\"\n[image]\npose = \"undeformed\"\n";
const std::string tail = "[pose.tilted]\ngravity = [0.6, -0.8, 0.0]\n";

/// Where the block lies on the table, in x and z: a part of its lower side y = 0.
constexpr std::array<double, 2> table_x_mm{20, 52}, table_z_mm{4, 16};

/// Soft, clamped at x = 0, sliding on the table.
const std::string model = R"([breast]
law = "neo_hookean"
young_modulus_kpa = 5
poisson_ratio = 0.45
density_kg_m3 = 1000
[skin]
young_modulus_kpa = 0
[interface]
kind = "sliding"
[supports.clamp]
kind = "fixed"
)";

/// 0 air, 1 block, 2 clamp, 3 table, 4 a pin of 4 by 6 mm under the free end.
void write_labels(const std::filesystem::path& file) {
  const Eigen::Vector3i inside = (size_mm / voxel_mm).cast<int>(), all = inside.array() + 2 * margin;
  std::string voxels;
  for (int k = -margin; k < inside.z() + margin; ++k)
    for (int j = -margin; j < inside.y() + margin; ++j)
      for (int i = -margin; i < inside.x() + margin; ++i) {
        const double x = (i + 0.5) * voxel_mm, z = (k + 0.5) * voxel_mm;
        const bool beside = k < 0 || k >= inside.z() || j < 0 || j >= inside.y() || i >= inside.x();
        const bool below = j < 0 && x > table_x_mm[0] && x < table_x_mm[1] && z > table_z_mm[0] && z < table_z_mm[1];
        const bool pin = j < 0 && i >= inside.x() - 3 && i < inside.x() - 1 && k >= 4 && k < 7;
        voxels.push_back(static_cast<char>(below ? 3 : pin ? 4 : beside ? 0 : i < 0 ? 2 : 1));
      }
  const double first = (0.5 - margin) * voxel_mm;
  std::ostringstream header;
  header << "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: " << all.transpose()
         << "\nspace directions: (2,0,0) (0,2,0) (0,0,2)\nkinds: domain domain domain\nencoding: raw\nspace origin: ("
         << first << "," << first << "," << first << ")\n\n";
  write_text(file, header.str() + voxels);
}

/// @param values  the lines of [image.labels] on air and supports
void write_label_case(const std::filesystem::path& folder, const std::string& values) {
  write_labels(folder / "labels.nrrd");
  write_text(folder / "model.toml", model);
  write_text(folder / "case.toml",
             head + "file = \"labels.nrrd\"\nkind = \"labels\"\n[image.labels]\nadipose = [1]\n" + values + tail);
}

void write_surface_case(const std::filesystem::path& folder) {
  reconstruction::Surface block = testing::boundary_surface(testing::box_mesh(15, 5, 5, size_mm));
  block.region.resize(0);
  write_text(folder / "model.toml", model);
  write_text(folder / "case.toml", head +
                                       "file = \"block.vtp\"\nkind = \"surface\"\n[image.supports.clamp]\n"
                                       "point = [0, 0, 0]\nnormal = [-1, 0, 0]\n[image.supports.table]\n"
                                       "file = \"table.vtp\"\nwithin_mm = 0.1\n" +
                                       tail);
  reconstruction::write_surface(block, folder / "block.vtp");
  reconstruction::Surface table;
  table.points.resize(4, 3);
  table.triangles.resize(2, 3);
  table.triangles << 0, 1, 2, 1, 3, 2;
  for (int corner = 0; corner < 4; ++corner)
    table.points.row(corner) << table_x_mm[corner / 2], 0, table_z_mm[corner % 2];
  reconstruction::write_surface(table, folder / "table.vtp");
}

Finished make(const std::filesystem::path& folder, const std::string& target) {
  std::vector<std::string> command = make_command(folder);
  command.insert(command.end(), {"ORDER=2", "EDGE_MM=5", target});
  return run_process(command);
}

/// What became of the block: areas of its supports, and how it moved on the mean and at its free end.
struct Outcome {
  std::vector<std::string> names;
  Eigen::Vector2d area_cm2;
  Eigen::Vector3d mean_mm = Eigen::Vector3d::Zero(), end_mm = Eigen::Vector3d::Zero();
};

Outcome outcome_of(const std::filesystem::path& folder) {
  const meshing::PoseMesh pose = meshing::read_pose(folder / "out/tilted.vtu");
  Outcome outcome{pose.mesh.support_names, {}};
  const Eigen::VectorXi support = meshing::support_of_faces(pose.mesh);
  for (int s = 0; s < 2; ++s) outcome.area_cm2[s] = meshing::support_area(pose.mesh, support, s).area_mm2 / 100;
  double all = 0, end = 0;
  for (Eigen::Index c = 0; c < pose.mesh.cells.rows(); ++c) {
    const double volume = meshing::cell_volume_mm3(pose.mesh.points, pose.mesh.cells, c);
    Eigen::Vector3d moved = Eigen::Vector3d::Zero(), at = moved;
    for (int k = 0; k < 4; ++k) {
      const int node = pose.mesh.cells(c, k);
      at += pose.mesh.points.row(node).transpose() / 4;
      moved += (pose.positions.row(node) - pose.mesh.points.row(node)).transpose() / 4;
    }
    outcome.mean_mm += volume * moved, all += volume;
    if (at.x() > size_mm.x() - 10) outcome.end_mm += volume * moved, end += volume;
  }
  outcome.mean_mm /= all;
  outcome.end_mm /= end;
  return outcome;
}

TEST(LabelSupports, HoldABlockAsTheSameOnesOfASurfaceDo) {
  const TemporaryFolder folder;
  write_label_case(folder / "labels", "air = [0, 4]\nsupport.clamp = [2]\nsupport.table = [3]\n");
  write_surface_case(folder / "surface");
  for (const char* name : {"labels", "surface"}) {
    const Finished made = make(folder / name, "report");
    ASSERT_EQ(made.code, 0) << made.out << made.err;
    EXPECT_TRUE(std::filesystem::exists(folder / name / "out/report.html"));
  }
  const Outcome ours = outcome_of(folder / "labels"), theirs = outcome_of(folder / "surface");
  EXPECT_EQ(ours.names, (std::vector<std::string>{"clamp", "table"}));
  // The rounded edges of the voxels and the facets of the surface.
  EXPECT_LT((ours.area_cm2 - Eigen::Vector2d(4, 3.84)).cwiseAbs().maxCoeff(), 0.3);
  EXPECT_LT((theirs.area_cm2 - Eigen::Vector2d(4, 3.84)).cwiseAbs().maxCoeff(), 0.3);
  EXPECT_GT(theirs.end_mm.x(), 2) << "it slides on the table";
  EXPECT_LT((ours.mean_mm - theirs.mean_mm).norm(), 0.1)
      << ours.mean_mm.transpose() << " / " << theirs.mean_mm.transpose();
  EXPECT_LT((ours.end_mm - theirs.end_mm).norm(), 0.15)
      << ours.end_mm.transpose() << " / " << theirs.end_mm.transpose();
  RecordProperty("end_mm", fmt::format("{:.3f} {:.3f} {:.3f}", ours.end_mm.x(), ours.end_mm.y(), ours.end_mm.z()));
  RecordProperty("mean_difference_mm", fmt::format("{:.3f}", (ours.mean_mm - theirs.mean_mm).norm()));
  RecordProperty("end_difference_mm", fmt::format("{:.3f}", (ours.end_mm - theirs.end_mm).norm()));
}

TEST(LabelSupports, AModulusIsFoundAndNothingElseIsMissing) {
  const TemporaryFolder folder;
  const std::filesystem::path block = folder / "block";
  write_label_case(block, "air = [0, 4]\nsupport.clamp = [2]\nsupport.table = [3]\n");
  ASSERT_EQ(make(block, "simulate").code, 0);
  write_simulated_scan(block / "out/tilted.vtu", block / "scan.vtp");
  write_text(block / "case.toml", read_text(block / "case.toml") + "surface = \"scan.vtp\"\nnoise_mm = 0.2\n");
  write_text(block / "model.toml",
             replaced(model, "young_modulus_kpa = 5",
                      "young_modulus_kpa = { value = 8, prior_sd = 8, lower = 0.5, upper = 100 }"));
  const Finished fitted = make(block, "calibrate");
  ASSERT_EQ(fitted.code, 0) << fitted.out << fitted.err;
  const auto found = nlohmann::json::parse(read_text(block / "out/calibration.json"))["parameters"][0];
  EXPECT_NEAR(found["value"].get<double>(), 5, 0.3);
  EXPECT_LT(found["interval95"][0].get<double>(), 5);
  EXPECT_GT(found["interval95"][1].get<double>(), 5);
  const Finished asked =
      run_process({tool("diagnose"), block.string(), (block / "out/mesh.vtu").string(), "--model",
                   (block / "out/model.toml").string(), "--no-other-meshes", "-o", (block / "asked").string()});
  ASSERT_EQ(asked.code, 0) << asked.err;
  const auto diagnosis = nlohmann::json::parse(read_text(block / "asked/diagnosis.json"));
  EXPECT_EQ(diagnosis["verdict"], "nothing_missing") << asked.out;
  for (const char* word : {"nipple", "muscle", "quadrant", "prone"})
    EXPECT_EQ((asked.out + fitted.out).find(word), std::string::npos) << word << " in\n" << fitted.out << asked.out;
}

TEST(LabelSupports, OneThatNoFaceOfTheMeshLiesOnIsRefused) {
  const TemporaryFolder folder;
  write_label_case(folder / "case", "air = [0]\nsupport.clamp = [2]\nsupport.table = [3]\nsupport.pin = [4]\n");
  const Finished made = make(folder / "case", "mesh");
  EXPECT_EQ(made.code, 2);
  expect_words(made.err, {"supine-tetrahedralise: error", "coarse.vtp", "'pin'", "20 mm2"});
  EXPECT_FALSE(std::filesystem::exists(folder / "case/out/mesh.vtu"));
}

}  // namespace
}  // namespace supine::pipeline
