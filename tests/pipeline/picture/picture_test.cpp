// SPDX-License-Identifier: AGPL-3.0-or-later
// --png of the tools, without a display.
#include "pipeline/picture/picture.h"

#include <gtest/gtest.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "common/error.h"
#include "common/vtk_files.h"
#include "reconstruction/surface_io.h"
#include "tests/pipeline/process.h"
#include "tests/pipeline/small_run.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

Finished without_display(std::vector<std::string> command) {
  command.insert(command.begin(), {"env", "-u", "DISPLAY"});
  return run_process(command);
}

bool can_draw() { return run_process({"sh", "-c", "command -v Xvfb"}).code == 0; }

#define NEEDS_XVFB() \
  if (!can_draw()) GTEST_SKIP() << "Xvfb is not installed (apt-get install xvfb)"

/// Of the pixels of a picture that are no shade of grey.
double coloured_share(const fs::path& png) {
  vtkNew<vtkPNGReader> reader;
  reader->SetFileName(png.c_str());
  reader->Update();
  vtkDataArray* pixels = reader->GetOutput()->GetPointData()->GetScalars();
  double coloured = 0;
  for (vtkIdType p = 0; p < pixels->GetNumberOfTuples(); ++p) {
    const double* c = pixels->GetTuple(p);
    const auto [least, most] = std::minmax({c[0], c[1], c[2]});
    coloured += most - least > 40;
  }
  return coloured / static_cast<double>(pixels->GetNumberOfTuples());
}

class Pictures : public testing::Test {
 protected:
  std::vector<std::string> compare(const std::string& png, std::vector<std::string> more = {}) const {
    std::vector<std::string> command = {tool("compare"),
                                        small_run().string(),
                                        (small_run() / "out/supine.vtu").string(),
                                        "-o",
                                        folder_.path().string(),
                                        "--png",
                                        (folder_ / png).string()};
    command.insert(command.end(), more.begin(), more.end());
    return command;
  }
  /// A picture of some size that a viewer would open: signature, width and height.
  void expect_picture(const std::string& name) const {
    const std::string bytes = read_text(folder_ / name);
    ASSERT_GT(bytes.size(), 15000u) << name;
    EXPECT_EQ(bytes.substr(0, 8), "\x89PNG\r\n\x1a\n");
    const auto number = [&bytes](std::size_t at) {
      return 256 * static_cast<unsigned char>(bytes[at + 2]) + static_cast<unsigned char>(bytes[at + 3]);
    };
    EXPECT_EQ(number(16), 1500);
    EXPECT_EQ(number(20), 820);
  }
  TemporaryFolder folder_;
};

TEST_F(Pictures, CompareDrawsTheSameBytesTwiceWithoutADisplay) {
  NEEDS_XVFB();
  const Finished first = without_display(compare("comparison.png"));
  ASSERT_EQ(first.code, 0) << first.err;
  expect_picture("comparison.png");
  const std::string bytes = read_text(folder_ / "comparison.png");
  ASSERT_EQ(without_display(compare("comparison.png", {"--force"})).code, 0);
  EXPECT_EQ(read_text(folder_ / "comparison.png"), bytes);
  const auto sidecar = nlohmann::json::parse(read_text(folder_ / "comparison.json"));
  EXPECT_TRUE(sidecar.contains("rms_mm"));  // one sidecar for the file and its picture
}

TEST_F(Pictures, APictureOfAnotherNameHasItsOwnSidecar) {
  NEEDS_XVFB();
  ASSERT_EQ(without_display(compare("map.png")).code, 0);
  const auto sidecar = nlohmann::json::parse(read_text(folder_ / "map.json"));
  EXPECT_EQ(sidecar["drawn_from"], "comparison.vtp");
  EXPECT_EQ(sidecar["provenance"]["tool"], "supine-compare");
}

TEST_F(Pictures, TheOuterSideIsThatOfTheBreastAndOfBothBreasts) {
  NEEDS_XVFB();
  std::vector<std::string> drawn;
  for (const std::string side : {"left", "right", "both"}) {
    draw_distances(small_run() / "out/comparison.vtp", "the same title", side, folder_ / (side + ".png"));
    expect_picture(side + ".png");
    drawn.push_back(read_text(folder_ / (side + ".png")));
  }
  EXPECT_NE(drawn[0], drawn[1]);
  EXPECT_NE(drawn[0], drawn[2]);
  EXPECT_NE(drawn[1], drawn[2]);
}

TEST_F(Pictures, AScanThatCoversNothingIsDrawnItself) {
  NEEDS_XVFB();
  const fs::path scan = small_run() / "out/scan.vtp";
  draw_distances(small_run() / "out/comparison.vtp", "the same title", "left", folder_ / "skin.png", scan);
  draw_distances(small_run() / "out/comparison.vtp", "the same title", "left", folder_ / "alone.png");
  EXPECT_EQ(read_text(folder_ / "skin.png"), read_text(folder_ / "alone.png"));

  vtkSmartPointer<vtkPolyData> bare = read_vtp(small_run() / "out/comparison.vtp");
  bare->GetPointData()->GetArray("covered")->Fill(0);
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(bare);
  writer->SetFileName((folder_ / "bare.vtp").c_str());
  writer->Write();
  draw_distances(folder_ / "bare.vtp", "the same title", "left", folder_ / "scan.png", scan);
  draw_distances(folder_ / "bare.vtp", "the same title", "left", folder_ / "grey.png");
  EXPECT_GT(coloured_share(folder_ / "scan.png"), coloured_share(folder_ / "grey.png") + 0.02);
  try {
    draw_distances(folder_ / "bare.vtp", "", "left", folder_ / "none.png", small_run() / "out/breast.vtp");
    FAIL();
  } catch (const InputError& error) {
    expect_words(error.what(), {"breast.vtp", "no points with distance_mm"});
  }
}

TEST_F(Pictures, APlacementShowsTheScanAsGivenAndAsFound) {
  NEEDS_XVFB();
  const reconstruction::Surface body = reconstruction::read_surface(small_run() / "out/comparison.vtp", "LPS");
  reconstruction::Surface contour = body, moved = body;
  contour.triangles.resize(0, 3);
  moved.points.col(0).array() += 20;
  const std::pair<std::string, Placed> sheets[] = {{"same", {body, body, body}},
                                                   {"moved", {body, moved, body}},
                                                   {"contour", {body, contour, body}},
                                                   {"object", {body, moved, body, true}}};
  std::set<std::string> drawn;
  for (const auto& [name, placed] : sheets) {
    draw_placement(placed, "the same title", folder_ / (name + ".png"));
    expect_picture(name + ".png");
    drawn.insert(read_text(folder_ / (name + ".png")));
  }
  EXPECT_EQ(drawn.size(), std::size(sheets));
  reconstruction::Surface none = body;
  none.triangles.resize(0, 3);
  EXPECT_THROW(draw_placement({none, body, body}, "none", folder_ / "none.png"), InputError);
  EXPECT_FALSE(fs::exists(folder_ / "none.png"));
}

TEST_F(Pictures, TetrahedraliseDrawsItsRegions) {
  NEEDS_XVFB();
  const fs::path out = small_run() / "out";
  const Finished finished = without_display(
      {tool("tetrahedralise"), (out / "coarse.vtp").string(), (out / "muscle.vtp").string(),
       (out / "labels.vti").string(), "-o", (folder_ / "mesh.vtu").string(), "--png", (folder_ / "mesh.png").string()});
  ASSERT_LE(finished.code, 1) << finished.err;
  expect_picture("mesh.png");
}

TEST_F(Pictures, SensitivityDrawsAHistogram) {
  NEEDS_XVFB();
  const Finished finished =
      without_display({tool("sensitivity"), small_run().string(), (small_run() / "out/mesh.vtu").string(), "--samples",
                       "12", "-o", folder_.path().string(), "--png", (folder_ / "sensitivity.png").string()});
  ASSERT_EQ(finished.code, 0) << finished.err;
  expect_picture("sensitivity.png");
}

TEST_F(Pictures, RefusesBeforeAnyWork) {
  const Finished other = without_display(compare("map.jpg"));
  EXPECT_EQ(other.code, 2);
  expect_words(other.err, {"--png", "map.jpg", "ends in .png"});
  write_text(folder_ / "map.png", "mine");
  const Finished there = without_display(compare("map.png"));
  EXPECT_EQ(there.code, 2);
  expect_words(there.err, {"map.png", "--force"});
  write_text(folder_ / "supine.vtu", "a pose");
  const Finished clash = without_display(compare("supine.png"));
  EXPECT_EQ(clash.code, 2);
  expect_words(clash.err, {"supine.json", "supine.vtu", "another name"});
  EXPECT_EQ(read_text(folder_ / "map.png"), "mine");
  EXPECT_FALSE(fs::exists(folder_ / "comparison.vtp"));
}

TEST_F(Pictures, SaysWhatIsMissingWithoutXvfb) {
  std::vector<std::string> command = compare("map.png");
  command.insert(command.begin(), {"env", "-u", "DISPLAY", "PATH=/nowhere"});
  const Finished finished = run_process(command);
  EXPECT_EQ(finished.code, 2);
  expect_words(finished.err, {"Xvfb", "apt-get install xvfb", "leave --png"});
  EXPECT_EQ(files_in(folder_.path()), std::vector<std::string>{});
}

}  // namespace
}  // namespace supine::pipeline
