// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/mesh_io.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/error.h"
#include "meshing/topology.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

class MeshFile : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() / (std::string("supine_mesh_io_") + info->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::string bytes(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  static meshing::TetMesh mixed_mesh() {
    meshing::TetMesh mesh = testing::dome_mesh({.rings = 3, .layers = 2, .muscle_rings = 5});
    mesh.fraction(0, 1) = 0.25;
    mesh.fraction(0, 2) = 0.75;
    mesh.tissue[0] = 2;
    mesh.region[0] = 3;
    return mesh;
  }

  std::filesystem::path folder_;
};

void expect_same(const meshing::TetMesh& a, const meshing::TetMesh& b) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.cells, b.cells);
  EXPECT_EQ(a.tissue, b.tissue);
  EXPECT_EQ(a.fraction, b.fraction);
  EXPECT_EQ(a.faces, b.faces);
  EXPECT_EQ(a.region, b.region);
  EXPECT_EQ(a.face_cell, b.face_cell);
  EXPECT_EQ(a.muscle.points, b.muscle.points);
  EXPECT_EQ(a.muscle.triangles, b.muscle.triangles);
}

TEST_F(MeshFile, LinearMeshComesBackExactly) {
  const meshing::TetMesh mesh = mixed_mesh();
  meshing::write_mesh(mesh, folder_ / "mesh.vtu", "right");
  expect_same(meshing::read_mesh(folder_ / "mesh.vtu"), mesh);
  EXPECT_EQ(meshing::read_side(folder_ / "mesh.vtu"), "right");
}

TEST_F(MeshFile, QuadraticMeshComesBackExactly) {
  const meshing::TetMesh mesh = meshing::to_quadratic(mixed_mesh());
  meshing::write_mesh(mesh, folder_ / "mesh.vtu");
  expect_same(meshing::read_mesh(folder_ / "mesh.vtu"), mesh);
  EXPECT_EQ(meshing::read_side(folder_ / "mesh.vtu"), "");
}

TEST_F(MeshFile, SameMeshSameBytes) {
  meshing::write_mesh(mixed_mesh(), folder_ / "a.vtu");
  meshing::write_mesh(mixed_mesh(), folder_ / "b.vtu");
  EXPECT_EQ(bytes(folder_ / "a.vtu"), bytes(folder_ / "b.vtu"));
}

TEST_F(MeshFile, PoseGivesBackProneAndPositions) {
  const meshing::TetMesh mesh = mixed_mesh();
  Points moved = mesh.points;
  moved.array() *= 1.125;
  const Table pressure = Table::Constant(mesh.cells.rows(), 1, 2.5);
  const Table force = Table::Random(mesh.points.rows(), 3);
  meshing::write_pose(mesh, moved, {{"force_mn", force}}, {{"pressure_kpa", pressure}}, folder_ / "supine.vtu");
  const meshing::PoseMesh pose = meshing::read_pose(folder_ / "supine.vtu");
  EXPECT_EQ(pose.positions, moved);
  EXPECT_LT((pose.mesh.points - mesh.points).cwiseAbs().maxCoeff(), 1e-12 * 100);
  EXPECT_EQ(pose.mesh.region, mesh.region);
  ASSERT_EQ(pose.point_arrays.size(), 1u);
  EXPECT_EQ(pose.point_arrays[0].first, "force_mn");
  EXPECT_EQ(pose.point_arrays[0].second, force);
}

TEST_F(MeshFile, APoseIsNotTakenForAnother) {
  const meshing::TetMesh mesh = mixed_mesh();
  const auto named = folder_ / "named.vtu", nameless = folder_ / "nameless.vtu";
  meshing::write_pose(mesh, mesh.points, {}, {}, named, "left", "undeformed");
  meshing::write_pose(mesh, mesh.points, {}, {}, nameless);
  EXPECT_NO_THROW(meshing::read_pose(named, "undeformed"));
  EXPECT_NO_THROW(meshing::read_pose(named));
  EXPECT_NO_THROW(meshing::read_pose(nameless, "supine"));
  EXPECT_THROW(meshing::read_pose(named, "supine"), InputError);
}

TEST_F(MeshFile, PoseArraysMustFitTheMesh) {
  const meshing::TetMesh mesh = mixed_mesh();
  EXPECT_THROW(meshing::write_pose(mesh, mesh.points.topRows(3), {}, {}, folder_ / "x.vtu"), InputError);
  EXPECT_THROW(meshing::write_pose(mesh, mesh.points, {{"a", Table(2, 1)}}, {}, folder_ / "x.vtu"), InputError);
  EXPECT_THROW(meshing::write_pose(mesh, mesh.points, {}, {{"a", Table(2, 1)}}, folder_ / "x.vtu"), InputError);
}

TEST_F(MeshFile, RefusesAMissingFile) { EXPECT_THROW(meshing::read_mesh(folder_ / "none.vtu"), InputError); }

TEST_F(MeshFile, RefusesACutOffFile) {
  meshing::write_mesh(mixed_mesh(), folder_ / "mesh.vtu");
  std::filesystem::resize_file(folder_ / "mesh.vtu", std::filesystem::file_size(folder_ / "mesh.vtu") / 2);
  EXPECT_THROW(meshing::read_mesh(folder_ / "mesh.vtu"), InputError);
}

TEST_F(MeshFile, RefusesAPoseWithoutDisplacement) {
  meshing::write_mesh(mixed_mesh(), folder_ / "mesh.vtu");
  EXPECT_THROW(meshing::read_pose(folder_ / "mesh.vtu"), InputError);
}

TEST_F(MeshFile, RefusesAnInvertedTetrahedronNamingTheFile) {
  meshing::TetMesh mesh = mixed_mesh();
  std::swap(mesh.cells(5, 0), mesh.cells(5, 1));
  meshing::write_mesh(mesh, folder_ / "mesh.vtu");
  try {
    meshing::read_mesh(folder_ / "mesh.vtu");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("mesh.vtu: tetrahedron 5"), std::string::npos) << error.what();
  }
}

/// A file of one tetrahedron, or what is said to be one.
std::string one_cell(const std::string& connectivity, int nodes, int type) {
  return "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><UnstructuredGrid>"
         "<Piece NumberOfPoints=\"5\" NumberOfCells=\"1\"><Points><DataArray type=\"Float64\" "
         "NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1 1 1 1</DataArray></Points><Cells>"
         "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">" +
         connectivity + "</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">" +
         std::to_string(nodes) + "</DataArray><DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">" +
         std::to_string(type) + "</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>";
}

TEST_F(MeshFile, RefusesCellsWithOtherNodesThanTheirKindHas) {
  const auto refusal = [this](const std::string& text) {
    std::ofstream(folder_ / "cell.vtu") << text;
    try {
      meshing::read_mesh(folder_ / "cell.vtu");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(refusal(one_cell("0 1 2 3 4", 5, 10)).find("cell 0 has 5 nodes; its kind has 4"), std::string::npos);
  EXPECT_NE(refusal(one_cell("0 1 2", 3, 10)).find("cell 0 has 3 nodes; its kind has 4"), std::string::npos);
  EXPECT_NE(refusal(one_cell("0 1 2 3", 4, 24)).find("cell 0 has 4 nodes; its kind has 10"), std::string::npos);
  EXPECT_NE(refusal(one_cell("0 1 2 7", 4, 10)).find("cell 0 names point 7, the file has 5"), std::string::npos);
  EXPECT_NE(refusal(one_cell("0 1 2 -1", 4, 10)).find("cell 0 names point -1"), std::string::npos);
}

TEST_F(MeshFile, DamagedIsReadOrRefusedNeverWorse) {
  meshing::write_mesh(mixed_mesh(), folder_ / "mesh.vtu");
  const std::string whole = bytes(folder_ / "mesh.vtu");
  int refused = 0;
  for (std::size_t at = 0; at < whole.size(); at += 1 + at / 12) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 2);
    std::ofstream(folder_ / "damaged.vtu", std::ios::binary) << damaged;
    try {
      meshing::read_mesh(folder_ / "damaged.vtu");
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 20);
}

TEST_F(MeshFile, RefusesAFolderItCannotWriteTo) {
  EXPECT_THROW(meshing::write_mesh(mixed_mesh(), folder_ / "none" / "mesh.vtu"), InputError);
}

}  // namespace
}  // namespace supine
