// SPDX-License-Identifier: AGPL-3.0-or-later
// Bad input to the built tools: exit code 2, a message that says what, where and what to do, and nothing written.
#include <gtest/gtest.h>

#include <functional>

#include "reconstruction/surface_io.h"
#include "tests/pipeline/process.h"
#include "tests/pipeline/small_case.h"
#include "tests/pipeline/small_run.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Spoil = std::function<void(const fs::path& folder)>;
using Place = std::array<double, 3>;

struct BadInput {
  std::string name, stage;
  Spoil spoil;
  std::vector<std::string> words;
};

void PrintTo(const BadInput& bad, std::ostream* out) { *out << bad.name; }

/// What each stage reads from the stages before, so that its own files are absent.
std::vector<std::string> inputs_of(const std::string& stage) {
  if (stage == "reconstruct") return {"labels.vti"};
  if (stage == "decimate") return {"breast.vtp"};
  if (stage == "tetrahedralise") return {"coarse.vtp", "muscle.vtp", "labels.vti"};
  if (stage == "simulate") return {"mesh.vtu"};
  if (stage == "compare") return {"supine.vtu"};
  return {};
}

class BadInputs : public testing::TestWithParam<BadInput> {};

TEST_P(BadInputs, EndWith2SayWhyAndWriteNothing) {
  const BadInput& bad = GetParam();
  TemporaryFolder folder;
  write_small_case(folder.path());
  for (const std::string& name : inputs_of(bad.stage)) {
    fs::create_directories(folder / "out");
    fs::copy_file(small_run() / "out" / name, folder.path() / "out" / name);
  }
  bad.spoil(folder.path());
  const auto before = files_in(folder.path());
  const Finished finished = run_process(stage_command(bad.stage, folder.path()));
  EXPECT_EQ(finished.code, 2) << finished.err;
  expect_words(finished.err, {"supine-" + bad.stage + ": error: "});
  expect_words(finished.err, bad.words);
  EXPECT_EQ(files_in(folder.path()), before);
}

Spoil in_file(const std::string& file, const std::string& from, const std::string& to) {
  return [=](const fs::path& folder) { write_text(folder / file, replaced(read_text(folder / file), from, to)); };
}

/// The volume with one change.
Spoil in_volume(const std::function<void(SmallVolume&)>& change) {
  return [=](const fs::path& folder) {
    SmallVolume volume;
    change(volume);
    volume.write(folder / "labels.nrrd", volume.spacing_mm);
  };
}

Spoil relabelled(int from, int to) {
  return in_volume([=](SmallVolume& volume) {
    std::replace(volume.voxels.begin(), volume.voxels.end(), static_cast<unsigned char>(from),
                 static_cast<unsigned char>(to));
  });
}

Spoil spaced(double spacing) {
  return [=](const fs::path& folder) { SmallVolume().write(folder / "labels.nrrd", spacing); };
}

Spoil scan_moved(const std::function<Place(Place)>& move) {
  return [=](const fs::path& folder) { write_scan(folder / "supine.ply", move); };
}

Spoil in_surface(const std::function<void(reconstruction::Surface&)>& change) {
  return [=](const fs::path& folder) {
    auto surface = reconstruction::read_surface(folder / "out/coarse.vtp");
    change(surface);
    reconstruction::write_surface(surface, folder / "out/coarse.vtp");
  };
}

void cut_short(const fs::path& file) { fs::resize_file(file, fs::file_size(file) / 2); }

void add_triangle(reconstruction::Surface& surface) {
  const Eigen::Index last = surface.triangles.rows();
  surface.triangles.conservativeResize(last + 1, 3);
  surface.triangles.row(last) << surface.triangles(0, 0), surface.triangles(0, 1), surface.triangles(last / 2, 0);
  surface.region.conservativeResize(last + 1);
  surface.region(last) = surface.region(0);
}

void drop_triangle(reconstruction::Surface& surface) {
  surface.triangles.conservativeResize(surface.triangles.rows() - 1, 3);
  surface.region.conservativeResize(surface.triangles.rows());
}

/// Pushes the point that is furthest out (lowest y) through the back.
void push_through(reconstruction::Surface& surface) {
  Eigen::Index tip = 0;
  surface.points.col(1).minCoeff(&tip);
  surface.points(tip, 1) += 80;
}

const std::vector<BadInput> labels = {
    {"CaseNotThere", "segment", [](const fs::path& f) { fs::remove(f / "case.toml"); }, {"case.toml", "cannot read"}},
    {"UnlistedLabel", "segment", in_file("case.toml", "gland = [2]\n", ""), {"labels.nrrd", "2", "image.labels"}},
    {"EmptyLabel", "segment", in_file("case.toml", "gland = [2]", "gland = []"), {"case.toml", "gland"}},
    {"TissueWithoutVoxels",
     "segment",
     in_file("case.toml", "gland = [2]", "gland = [2]\ntumour = [77]"),
     {"labels.nrrd", "empty label", "tumour", "77"}},
    {"LabelTwice", "segment", in_file("case.toml", "gland = [2]", "gland = [2, 1]"), {"case.toml", "1", "adipose"}},
    {"NoMuscleListed", "segment", in_file("case.toml", "muscle = [3]\n", ""), {"case.toml", "muscle"}},
    {"NoMuscleInTheVolume", "segment", relabelled(3, 5), {"labels.nrrd", "muscle"}},
    {"NoTissueInTheVolume",
     "segment",
     in_volume([](SmallVolume& v) {
       for (auto& voxel : v.voxels) voxel = voxel == 3 ? 3 : 0;
     }),
     {"labels.nrrd", "adipose"}},
    {"TissueAtTheEdge", "segment", in_volume([](SmallVolume& v) { v.voxels[45 * 12] = 1; }), {"edge", "cut", "mm"}},
    {"SpacingZero", "segment", spaced(0), {"labels.nrrd", "spac"}},
    {"VolumeInMetres", "segment", spaced(0.003), {"labels.nrrd", "mm"}},
    {"VolumeTruncated", "segment", [](const fs::path& f) { cut_short(f / "labels.nrrd"); }, {"labels.nrrd"}},
    {"VolumeIsNone", "segment", [](const fs::path& f) { write_text(f / "labels.nrrd", "hello"); }, {"labels.nrrd"}},
    {"VolumeNotThere",
     "segment",
     [](const fs::path& f) { fs::remove(f / "labels.nrrd"); },
     {"labels.nrrd", "not there"}},
    {"OutputFolderIsAFile", "segment", [](const fs::path& f) { write_text(f / "out", "x"); }, {"out", "-o"}},
};

const std::vector<BadInput> case_and_model = {
    {"GravityZero",
     "simulate",
     in_file("case.toml", "[0.0, 1.0, 0.0]", "[0.0, 0.0, 0.0]"),
     {"case.toml:", "gravity", "zero"}},
    {"GravityNotUnit",
     "simulate",
     in_file("case.toml", "[0.0, 1.0, 0.0]", "[0.0, 9.81, 0.0]"),
     {"case.toml:", "9.81", "length 1"}},
    {"GravityTheSame",
     "simulate",
     in_file("case.toml", "[0.0, 1.0, 0.0]", "[0.0, -1.0, 0.0]"),
     {"case.toml:", "[pose.prone]", "same"}},
    {"GravityIntoTheMuscleInProne",
     "simulate",
     [](const fs::path& f) {
       in_file("case.toml", "[0.0, 1.0, 0.0]", "[0.0, -2.0, 0.0]")(f);
       in_file("case.toml", "[0.0, -1.0, 0.0]", "[0.0, 1.0, 0.0]")(f);
       in_file("case.toml", "[0.0, -2.0, 0.0]", "[0.0, -1.0, 0.0]")(f);
     },
     {"gravity", "prone", "muscle"}},
    {"UnknownCaseKey",
     "simulate",
     in_file("case.toml", "side =", "sied ="),
     {"case.toml:4", "sied", "did you mean side?"}},
    {"UnknownModelKey",
     "simulate",
     in_file("model.toml", "thickness_mm", "thickness"),
     {"model.toml:", "thickness", "thickness_mm"}},
    {"MisspeltEffect",
     "simulate",
     in_file("model.toml", "[skin]", "[[effect]]\nname = \"ligamnet\"\n[skin]"),
     {"model.toml:", "ligamnet", "did you mean ligament?"}},
    {"NegativeModulus",
     "simulate",
     in_file("model.toml", "= 20\nthick", "= -20\nthick"),
     {"model.toml:", "young_modulus_kpa = -20", "kPa"}},
    {"PoissonAHalf", "simulate", in_file("model.toml", "0.45", "0.5"), {"model.toml:", "poisson_ratio = 0.5", "< 0.5"}},
    {"LandmarkOutsideTheBody",
     "simulate",
     [](const fs::path& f) {
       write_text(f / "prone.csv", "name,x,y,z\nnipple,500,0,0\n");
       write_text(f / "case.toml", read_text(f / "case.toml") + "\n[landmarks]\nprone = \"prone.csv\"\n");
     },
     {"prone.csv", "nipple", "outside", "bound 10 mm"}},
    {"EffectThatCannotAct",
     "simulate",
     [](const fs::path& f) {
       write_text(f / "model.toml", read_text(f / "model.toml") + "\n[[effect]]\nname = \"tumour_stiffness\"\n");
     },
     {"tumour_stiffness", "cannot change anything"}},
    {"ModelNotThere", "simulate", [](const fs::path& f) { fs::remove(f / "model.toml"); }, {"model.toml"}},
    {"MeshTruncated", "simulate", [](const fs::path& f) { cut_short(f / "out/mesh.vtu"); }, {"mesh.vtu"}},
};

const std::vector<BadInput> surfaces = {
    {"LabelsTruncated", "reconstruct", [](const fs::path& f) { cut_short(f / "out/labels.vti"); }, {"labels.vti"}},
    {"SurfaceTruncated", "decimate", [](const fs::path& f) { cut_short(f / "out/breast.vtp"); }, {"breast.vtp"}},
    {"NonManifold", "tetrahedralise", in_surface(add_triangle), {"manifold"}},
    {"Open", "tetrahedralise", in_surface(drop_triangle), {"closed"}},
    {"SelfIntersecting", "tetrahedralise", in_surface(push_through), {"intersect", "mm"}},
    {"MuscleNotThere", "tetrahedralise", [](const fs::path& f) { fs::remove(f / "out/muscle.vtp"); }, {"muscle.vtp"}},
};

const std::vector<BadInput> scans = {
    {"ScanInMetres",
     "compare",
     scan_moved([](Place p) {
       return Place{p[0] / 1000, p[1] / 1000, p[2] / 1000};
     }),
     {"supine.ply", "mm"}},
    {"ScanFlipped",
     "compare",
     scan_moved([](Place p) {
       return Place{-p[0], -p[1], p[2]};
     }),
     {"supine.ply", "RAS"}},
    {"ScanFarAway",
     "compare",
     scan_moved([](Place p) {
       return Place{p[0] + 200, p[1], p[2]};
     }),
     {"supine.ply", "mm"}},
    {"ScanOfThreePoints",
     "compare",
     [](const fs::path& f) {
       write_text(f / "supine.ply",
                  "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                  "end_header\n0 -30 0\n10 -30 0\n0 -30 10\n");
     },
     {"supine.ply", "3"}},
    {"ScanTruncated", "compare", [](const fs::path& f) { cut_short(f / "supine.ply"); }, {"supine.ply"}},
    {"NoScan", "compare", in_file("case.toml", "surface = \"supine.ply\"\n", ""), {"case.toml", "surface"}},
};

const auto name_of = [](const auto& info) { return info.param.name; };
INSTANTIATE_TEST_SUITE_P(Labels, BadInputs, testing::ValuesIn(labels), name_of);
INSTANTIATE_TEST_SUITE_P(CaseAndModel, BadInputs, testing::ValuesIn(case_and_model), name_of);
INSTANTIATE_TEST_SUITE_P(Surfaces, BadInputs, testing::ValuesIn(surfaces), name_of);
INSTANTIATE_TEST_SUITE_P(Scans, BadInputs, testing::ValuesIn(scans), name_of);

TEST(StartingModel, NeedsABreastAndItsMesh) {
  const auto start = [](std::vector<std::string> words) {
    words.insert(words.begin(), {tool("model"), "start"});
    return run_process(words);
  };
  const Finished object = start({std::string(SUPINE_SOURCE_DIR) + "/samples/silicone_bar/both", "none.vtu"});
  EXPECT_EQ(object.code, 2);
  EXPECT_NE(object.err.find("is not a breast"), std::string::npos) << object.err;
  const Finished alone = start({std::string(SUPINE_SOURCE_DIR) + "/samples/ligament"});
  EXPECT_EQ(alone.code, 2);
  EXPECT_NE(alone.err.find("start takes a case folder and its mesh"), std::string::npos) << alone.err;
}

}  // namespace
}  // namespace supine::pipeline
