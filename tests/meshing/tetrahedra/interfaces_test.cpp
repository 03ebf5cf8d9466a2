// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/interfaces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <string>

#include "common/error.h"
#include "meshing/mesh_check.h"
#include "meshing/quality.h"
#include "meshing/tetrahedra/tetrahedralise.h"
#include "meshing/topology.h"
#include "reconstruction/surface_check.h"
#include "tests/meshing/surface_shapes.h"
#include "tests/support/shapes.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;
using segmentation::Tissue;

constexpr int gland = static_cast<int>(Tissue::gland), tumour = static_cast<int>(Tissue::tumour),
              adipose = static_cast<int>(Tissue::adipose);

Surface block(int n, double size_mm, const Eigen::RowVector3d& corner_mm) {
  Surface s = testing::boundary_surface(testing::box_mesh(n, n, n, {size_mm, size_mm, size_mm}));
  s.points.rowwise() += corner_mm;
  return s;
}

Surface body() { return block(5, 40, {0, 0, 0}); }

// A gland of 20 mm with a tumour of 8 mm in it.
Inside nested() {
  return {{{block(3, 20, {10, 10, 10}), Tissue::gland, "gland.vtp"},
           {block(2, 8, {16, 15, 14}), Tissue::tumour, "tumour.vtp"}},
          nullptr};
}

std::string message_of(const Inside& inside) {
  try {
    tetrahedralise(body(), inside, {}, "body.vtp");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

void expect_words(const std::string& message, const std::vector<std::string>& words) {
  for (const std::string& word : words) EXPECT_NE(message.find(word), std::string::npos) << word << " in: " << message;
}

TEST(Interfaces, CellsEndOnThemAndEnclosedVolumesAreExact) {
  const FilledMesh filled = tetrahedralise(body(), nested(), {});
  Eigen::Vector3d volume = Eigen::Vector3d::Zero();  // outside, gland, tumour
  for (Eigen::Index c = 0; c < filled.mesh.cells.rows(); ++c)
    volume[filled.enclosing[c] + 1] += cell_volume_mm3(filled.mesh.points, filled.mesh.cells, c);
  EXPECT_NEAR(volume[2], 512, 1e-6);
  EXPECT_NEAR(volume[1], 8000 - 512, 1e-6);
  EXPECT_NEAR(volume[0], 64000 - 8000, 1e-6);
  const QualityReport quality = measure_quality(filled.mesh);
  EXPECT_EQ(quality.inverted, 0);
  EXPECT_GT(quality.min_dihedral_deg, 5);
  EXPECT_EQ(filled.mesh.faces.rows(), body().triangles.rows()) << "interfaces are no boundary";
}

TEST(Interfaces, EveryTriangleOfThemIsAFaceOfTwoCells) {
  const Inside inside = nested();
  const FilledMesh filled = tetrahedralise(body(), inside, {});
  const auto key = [](const Points& points, const auto& corners) {
    std::array<std::array<double, 3>, 3> k;
    for (int i = 0; i < 3; ++i) k[i] = {points(corners[i], 0), points(corners[i], 1), points(corners[i], 2)};
    std::sort(k.begin(), k.end());
    return k;
  };
  std::multiset<std::array<std::array<double, 3>, 3>> faces;
  for (Eigen::Index c = 0; c < filled.mesh.cells.rows(); ++c)
    for (const auto& f : tet_faces)
      faces.insert(key(filled.mesh.points,
                       std::array{filled.mesh.cells(c, f[0]), filled.mesh.cells(c, f[1]), filled.mesh.cells(c, f[2])}));
  for (const Interface& interface : inside.interfaces)
    for (Eigen::Index t = 0; t < interface.surface.triangles.rows(); ++t)
      EXPECT_EQ(faces.count(key(interface.surface.points, interface.surface.triangles.row(t))), 2u);
}

TEST(Interfaces, TissueIsTheirsInsideAndNotTheirsOutside) {
  const Inside inside = nested();
  FilledMesh filled = tetrahedralise(body(), inside, {});
  TetMesh& mesh = filled.mesh;
  // As labels with a blurred border would have it: a third gland everywhere, or gland alone.
  mesh.tissue = Eigen::VectorXi::Constant(mesh.cells.rows(), adipose);
  mesh.fraction = Table::Zero(mesh.cells.rows(), segmentation::tissue_count);
  mesh.fraction.col(gland).setConstant(1.0 / 3);
  mesh.fraction.col(adipose).setConstant(2.0 / 3);
  mesh.fraction.row(0).setZero();
  mesh.fraction(0, gland) = 1;
  impose_interfaces(mesh, filled.enclosing, inside.interfaces);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const int wanted = filled.enclosing[c] < 0 ? adipose : filled.enclosing[c] == 0 ? gland : tumour;
    EXPECT_EQ(mesh.tissue[c], wanted);
    EXPECT_NEAR(mesh.fraction(c, wanted), 1, 1e-12);
    EXPECT_NEAR(mesh.fraction.row(c).sum(), 1, 1e-12);
  }
  EXPECT_NO_THROW(check_mesh(mesh));
  const QualityReport quality = measure_quality(mesh);
  EXPECT_NEAR(quality.tissue_ml[gland], 7.488, 1e-9);
  EXPECT_NEAR(quality.tissue_ml[tumour], 0.512, 1e-9);
}

TEST(Interfaces, RefusalsNameTheFileAndThePlace) {
  const auto one = [](Surface s, Tissue tissue = Tissue::gland) {
    return Inside{{{std::move(s), tissue, "gland.vtp"}}, nullptr};
  };
  expect_words(message_of(one(block(2, 20, {30, 10, 10}))), {"gland.vtp", "lies outside body.vtp", ") mm"});
  expect_words(message_of(one(block(2, 20, {70, 10, 10}))), {"gland.vtp", "lies outside body.vtp", ") mm"});
  Surface spike = block(2, 10, {15, 15, 15});
  spike.points.row(0) = Eigen::RowVector3d(20, 20, -15);
  expect_words(message_of(one(spike)), {"gland.vtp"});
  expect_words(message_of(one(testing::inside_out(block(2, 10, {15, 15, 15})))), {"gland.vtp", "face inward", ") mm"});
  expect_words(message_of(one(block(2, 10, {15, 15, 15}), Tissue::muscle)), {"gland.vtp", "muscle", "not meshed"});
  Inside crossing = one(block(2, 10, {15, 15, 15}));
  crossing.interfaces.push_back({block(2, 10, {18, 18, 18}), Tissue::tumour, "tumour.vtp"});
  expect_words(message_of(crossing), {"tumour.vtp crosses gland.vtp", ") mm"});
}

}  // namespace
}  // namespace supine::meshing
