// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/surface_io.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "common/error.h"
#include "reconstruction/surface_check.h"
#include "tests/reconstruction/volumes.h"

namespace supine::reconstruction {
namespace {

using testing::ball;
using testing::message_of;

class SurfaceFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() / fmt::format("supine_surface_{}_{}", test->name(), ::getpid());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  std::string refusal(const std::string& name, const std::string& text) const {
    const auto file = write(name, text);
    return message_of([&file] { read_surface(file); });
  }

  std::filesystem::path folder_;
};

constexpr const char* tetrahedron_faces = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
std::string ply(const std::string& comment, const std::string& faces = tetrahedron_faces, int face_count = 4) {
  return fmt::format(
      "ply\nformat ascii 1.0\n{}element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face "
      "{}\n"
      "property list uchar int vertex_indices\nend_header\n0 0 0\n10 0 0\n0 20 0\n0 0 30\n{}",
      comment, face_count, faces);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST_F(SurfaceFiles, OurOwnFormatGivesBackEveryBitOfPointsTrianglesAndRegions) {
  Surface in = ball(33.3, 2);
  in.region = Eigen::VectorXi::LinSpaced(in.triangles.rows(), 1, 4);
  write_surface(in, folder_ / "a.vtp");
  const SurfaceFile out = read_surface_file(folder_ / "a.vtp");
  EXPECT_EQ(out.frame, "LPS");
  EXPECT_EQ(out.surface.points, in.points);
  EXPECT_EQ(out.surface.triangles, in.triangles);
  EXPECT_EQ(out.surface.region, in.region);
}

TEST_F(SurfaceFiles, SameSurfaceSameBytes) {
  const auto bytes = [](const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  write_surface(ball(10, 1), folder_ / "a.vtp");
  write_surface(ball(10, 1), folder_ / "b.vtp");
  EXPECT_EQ(bytes(folder_ / "a.vtp"), bytes(folder_ / "b.vtp"));
}

TEST_F(SurfaceFiles, BarePointsStayPoints) {
  Surface points;
  points.points = ball(10, 0).points;
  write_surface(points, folder_ / "points.vtp");
  EXPECT_EQ(read_surface(folder_ / "points.vtp").points, points.points);
  const auto file =
      write("p.ply",
            "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
            "end_header\n1 2 3\n4 5 6\n");
  const Surface read = read_surface(file);
  EXPECT_EQ(read.points.rows(), 2);
  EXPECT_EQ(read.triangles.rows(), 0);
  EXPECT_EQ(read.points.row(1), Eigen::RowVector3d(4, 5, 6));
  EXPECT_EQ(read_surface(write("p.obj", "v 1 2 3\nv 4 5 6\nv 7 8 9\n")).points.rows(), 3);
}

TEST_F(SurfaceFiles, WhatStandsTwiceIsReadOnce) {
  std::string points = "0 0 0\n10 0 0\n0 20 0\n0 0 30\n", again = "3 4 6 5\n3 4 5 7\n3 5 6 7\n3 4 7 6\n";
  const std::string doubled = replaced(ply("", tetrahedron_faces + again, 8), "vertex 4", "vertex 8");
  const Surface twice = read_surface(write("twice.ply", replaced(doubled, points, points + points)));
  const Surface once = read_surface(write("once.ply", ply("")));
  EXPECT_EQ(twice.triangles, once.triangles) << "with points of its own";
  EXPECT_EQ(twice.points, once.points);
  const Surface cloud = read_surface(write("cloud.ply",
                                           "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n"
                                           "property float y\nproperty float z\nend_header\n"
                                           "1 2 3\n4 5 6\n1 2 3\n1 2 4\n"));
  ASSERT_EQ(cloud.points.rows(), 3);
  EXPECT_EQ(cloud.points.row(1), Eigen::RowVector3d(4, 5, 6));
  EXPECT_EQ(cloud.points.row(2), Eigen::RowVector3d(1, 2, 4));
}

TEST_F(SurfaceFiles, AnObjWithPartsLinesAndPointsGivesItsFaces) {
  const Surface read = read_surface(write("a.obj",
                                          "o a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no b\nl 1 2\np 3\n"
                                          "vn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1\nf -4 -2 -1\n"));
  EXPECT_EQ(read.triangles.rows(), 2);
  EXPECT_EQ(read.points.rows(), 4);
}

TEST_F(SurfaceFiles, EndingsMayBeInCapitals) {
  EXPECT_EQ(read_surface(write("A.PLY", ply(""))).triangles.rows(), 4);
  write_surface(ball(10, 0), folder_ / "B.VTP");
  EXPECT_EQ(read_surface(folder_ / "B.VTP").triangles.rows(), 20);
}

TEST_F(SurfaceFiles, PlyTextAndItsFrame) {
  const SurfaceFile bare = read_surface_file(write("a.ply", ply("")));
  EXPECT_FALSE(bare.frame);
  EXPECT_DOUBLE_EQ(check_surface(bare.surface).volume_mm3, 1000);
  EXPECT_EQ(read_surface_file(write("b.ply", ply("comment frame LPS, unit mm\n"))).frame, "LPS");
  const Surface turned = read_surface(write("c.ply", ply("comment frame RAS\n")), "LPS");
  EXPECT_EQ(turned.points.row(1), Eigen::RowVector3d(-10, 0, 0));
  EXPECT_EQ(turned.points.row(2), Eigen::RowVector3d(0, -20, 0));
  EXPECT_DOUBLE_EQ(check_surface(turned).volume_mm3, 1000) << "a turn keeps the orientation";
  EXPECT_EQ(read_surface(write("d.ply", ply("comment SPACE=RAS\n")), "LPS").points, turned.points) << "3D Slicer";
  EXPECT_EQ(read_surface(folder_ / "a.ply", "RAS").points, turned.points) << "a bare file takes the frame of the case";
  EXPECT_EQ(read_surface(folder_ / "b.ply", "RAS").points, bare.surface.points) << "the file's own word goes first";
}

TEST_F(SurfaceFiles, PolygonsBecomeTriangles) {
  const Surface square = read_surface(write("quad.ply", ply("", "4 0 1 3 2\n", 1)));
  EXPECT_EQ(square.triangles.rows(), 2);
  const Surface obj = read_surface(write("quad.obj", "# frame: LPS\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"));
  EXPECT_EQ(obj.triangles.rows(), 2);
  EXPECT_NEAR(check_surface(obj).area_mm2, 1, 1e-6);
}

TEST_F(SurfaceFiles, StlPointsAreMerged) {
  std::string text = "solid frame LPS\n";
  const Surface in = ball(10, 0);
  for (Eigen::Index t = 0; t < in.triangles.rows(); ++t) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (int c = 0; c < 3; ++c) {
      const auto p = in.points.row(in.triangles(t, c));
      text += fmt::format("vertex {} {} {}\n", p.x(), p.y(), p.z());
    }
    text += "endloop\nendfacet\n";
  }
  const SurfaceFile read = read_surface_file(write("a.stl", text + "endsolid\n"));
  EXPECT_EQ(read.frame, "LPS");
  EXPECT_EQ(read.surface.points.rows(), 12);
  EXPECT_TRUE(check_surface(read.surface).closed());
  EXPECT_NE(refusal("cut.stl", text).find("cut short"), std::string::npos);
}

TEST_F(SurfaceFiles, BinaryStl) {
  std::string bytes(80, ' ');
  const std::uint32_t count = 1;
  bytes.append(reinterpret_cast<const char*>(&count), 4);
  const float numbers[12] = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
  bytes.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
  bytes.append(2, '\0');
  EXPECT_EQ(read_surface(write("b.stl", bytes)).triangles.rows(), 1);
  bytes.pop_back();
  EXPECT_NE(refusal("c.stl", bytes).find("cut short"), std::string::npos);
}

TEST_F(SurfaceFiles, EachRefusalNamesTheFileAndTheFault) {
  const auto expect = [](const std::string& message, std::initializer_list<const char*> words) {
    for (const char* word : words) EXPECT_NE(message.find(word), std::string::npos) << word << " in: " << message;
  };
  expect(message_of([this] { read_surface(folder_ / "none.ply"); }), {"none.ply", "no such file"});
  expect(refusal("a.txt", "x"), {"a.txt", ".ply", ".vtp"});
  expect(refusal("a.ply", "solid"), {"a.ply", "not a PLY"});
  expect(refusal("short.ply", ply("").substr(0, ply("").size() - 10)), {"short.ply", "cut short"});
  expect(refusal("head.ply", "ply\nformat ascii 1.0\n"), {"end_header"});
  expect(refusal("index.ply", ply("", "3 0 1 9\n", 1)), {"index.ply", "line 14", "vertex 9", "4"});
  expect(refusal("comma.ply", replaced(ply(""), "10 0 0", "10,5 0 0")), {"line 11", "\"10,5\"", "point"});
  expect(refusal("more.ply", replaced(ply(""), "10 0 0", "10 5 0 0")), {"line 11", "4 numbers", "3"});
  expect(refusal("blank.ply", replaced(ply(""), "10 0 0", "")), {"line 11", "cut short"});
  expect(refusal("flaot.ply", replaced(ply(""), "float x", "flaot x")), {"line 4", "known type"});
  expect(refusal("noy.ply", replaced(ply(""), "float y", "float w")), {"no property y"});
  expect(refusal("edge.ply", ply("", "2 0 1\n", 1)), {"line 14", "corners", "2"});
  expect(refusal("point.ply", ply("", "0\n", 1)), {"line 14", "corners", "0"});
  expect(refusal("list.ply", replaced(ply(""), "vertex_indices", "corners")), {"vertex_indices"});
  expect(refusal("format.ply", replaced(ply(""), "format ascii", "format text")), {"format", "binary_little_endian"});
  expect(refusal("both.ply", ply("comment frame LPS\ncomment frame RAS\n")), {"both.ply", "LPS", "RAS"});
  expect(refusal("frame.ply", ply("comment frame XYZ\n")), {"XYZ"});
  expect(refusal("unit.ply", ply("comment unit m\n")), {"\"m\"", "mm"});
  expect(refusal("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
         {"line.obj", "none of its triangles has an area"});
  expect(refusal("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), {"index.obj", "line 4", "4", "3"});
  expect(refusal("empty.obj", "# nothing\n"), {"empty.obj", "no vertices"});
  expect(refusal("a.stl", "hello"), {"a.stl", "not an STL"});
  expect(refusal("a.vtp", "<VTKFile"), {"a.vtp", "not a readable"});
  expect(message_of([this] { read_surface(write("ok.ply", ply("")), "XYZ"); }), {"XYZ", "LPS", "RAS"});
}

/// The tetrahedron as a binary file.
std::string binary_ply(bool big_endian) {
  std::string bytes = replaced(ply("", "", 4), "ascii", big_endian ? "binary_big_endian" : "binary_little_endian");
  bytes.resize(bytes.find("end_header\n") + 11);
  const auto add = [&](const auto& value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    if (big_endian) std::reverse(raw, raw + sizeof value);
    bytes.append(raw, sizeof value);
  };
  for (const float number : {0, 0, 0, 10, 0, 0, 0, 20, 0, 0, 0, 30}) add(number);
  for (const std::array<int, 3>& face : {std::array{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}) {
    bytes += '\3';
    for (const int corner : face) add(corner);
  }
  return bytes;
}

TEST_F(SurfaceFiles, BinaryPlyOfBothByteOrders) {
  const Surface text = read_surface(write("text.ply", ply("")));
  for (const bool big : {false, true}) {
    const Surface read = read_surface(write("binary.ply", binary_ply(big)));
    EXPECT_EQ(read.points, text.points) << big;
    EXPECT_EQ(read.triangles, text.triangles) << big;
  }
}

TEST_F(SurfaceFiles, DamagedPlyIsReadOrRefusedNeverWorse) {
  for (const std::string& whole : {ply(""), binary_ply(false), binary_ply(true)}) {
    int refused = 0;
    const auto attempt = [&](const std::string& bytes) {
      try {
        read_surface(write("damaged.ply", bytes));
      } catch (const InputError&) {
        ++refused;
      }
    };
    for (std::size_t size = 0; size < whole.size(); ++size) attempt(whole.substr(0, size));
    EXPECT_GT(refused, static_cast<int>(whole.size()) - 3) << "only the last line's end may be missing";
    for (std::size_t at = 0; at < whole.size(); ++at)
      for (const int bit : {1, 64}) {
        std::string flipped = whole;
        flipped[at] = static_cast<char>(flipped[at] ^ bit);
        attempt(flipped);
      }
  }
}

TEST_F(SurfaceFiles, ATriangleThatStandsTwiceIsOneSurface) {
  const std::string doubled = std::string(tetrahedron_faces) + "3 2 1 0\n3 0 1 3\n";
  EXPECT_EQ(read_surface(write("doubled.ply", ply("", doubled, 6))).triangles.rows(), 4);
}

TEST_F(SurfaceFiles, NotANumberIsRefusedWithItsPoint) {
  Surface bad = ball(10, 0);
  bad.points(7, 1) = std::nan("");
  write_surface(bad, folder_ / "nan.vtp");
  const std::string message = message_of([this] { read_surface(folder_ / "nan.vtp"); });
  EXPECT_NE(message.find("point 7"), std::string::npos) << message;
}

TEST_F(SurfaceFiles, RegionOutOfRangeIsRefused) {
  Surface bad = ball(10, 0);
  bad.region = Eigen::VectorXi::Constant(bad.triangles.rows(), 9);
  write_surface(bad, folder_ / "region.vtp");
  const std::string message = message_of([this] { read_surface(folder_ / "region.vtp"); });
  EXPECT_NE(message.find("region 9"), std::string::npos) << message;
}

TEST_F(SurfaceFiles, UnwritablePathIsRefused) {
  EXPECT_NE(message_of([] { write_surface(ball(1, 0), "/no/such/folder/a.vtp"); }).find("cannot be written"),
            std::string::npos);
}

}  // namespace
}  // namespace supine::reconstruction
