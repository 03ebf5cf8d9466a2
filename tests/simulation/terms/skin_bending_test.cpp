// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/skin_bending.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "simulation/model_fields.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

constexpr double side_mm = 40, modulus_kpa_mm = 30, bending_mm2 = 0.25;
constexpr double plate_mn_mm = modulus_kpa_mm * bending_mm2;

struct Sheet {
  Points points;
  Indices faces;
};

/// A square in z = 0 of n × n squares, each of two triangles; @p shift moves the inner nodes, in shares of a square.
Sheet sheet(int n, int order = 1, double shift = 0) {
  const int per_side = order * n + 1;
  const auto node = [per_side](int i, int j) { return i * per_side + j; };
  const Eigen::MatrixXd random = testing::random_matrix(per_side * per_side, 2, 7);
  Sheet result;
  result.points = Points::Zero(per_side * per_side, 3);
  for (int i = 0; i < per_side; ++i)
    for (int j = 0; j < per_side; ++j) {
      const bool inner = i > 0 && j > 0 && i < per_side - 1 && j < per_side - 1;
      const Eigen::RowVector2d place = Eigen::RowVector2d(i, j) + (inner ? shift : 0) * random.row(node(i, j));
      result.points.row(node(i, j)).head<2>() = side_mm / (per_side - 1) * place;
    }
  result.faces.resize(2 * n * n, order == 2 ? 6 : 3);
  Eigen::Index face = 0;
  for (int i = 0; i < per_side - 1; i += order)
    for (int j = 0; j < per_side - 1; j += order) {
      const int a = node(i, j), b = node(i + order, j), c = node(i + order, j + order), d = node(i, j + order);
      if (order == 1) {
        result.faces.row(face++) << a, b, c;
        result.faces.row(face++) << a, c, d;
        continue;
      }
      const int middle = node(i + 1, j + 1);
      result.faces.row(face++) << a, b, c, node(i + 1, j), node(i + 2, j + 1), middle;
      result.faces.row(face++) << a, c, d, middle, node(i + 1, j + 2), node(i, j + 1);
    }
  return result;
}

using Motion = std::function<Eigen::RowVector3d(const Eigen::RowVector3d&)>;

/// Energy of the sheet in its moved shape, in units of D × area.
/// @param incompressible  ν is ½, else 0.3
double energy(const Sheet& sheet, const Motion& motion, bool incompressible = true) {
  const TrianglePatches patches = triangle_patches(sheet.faces);
  const Pattern pattern(sheet.faces, patches.nodes, sheet.points.rows());
  SkinBendingTerm term(patches, pattern, incompressible);
  Fields<double> fields;
  fields.skin_modulus = Eigen::VectorXd::Constant(sheet.faces.rows(), modulus_kpa_mm);
  fields.skin_bending = Eigen::VectorXd::Constant(sheet.faces.rows(), bending_mm2);
  fields.skin_poisson = Eigen::VectorXd::Constant(sheet.faces.rows(), 0.3);
  term.set_fields(fields);
  Points x = sheet.points;
  for (Eigen::Index n = 0; n < x.rows(); ++n) x.row(n) = motion(sheet.points.row(n));
  Sums sums(pattern);
  term.add({x, sheet.points}, Demand{.energy = true}, sums);
  return sums.energy / (plate_mn_mm * side_mm * side_mm);
}

Hinge<double> folded(double angle) { return {{3, 0, 0}, {1, 2, 0}, {0.5, -2 * std::cos(angle), -2 * std::sin(angle)}}; }

TEST(Hinge, BendIsTwiceTheTangentOfHalfTheAngle) {
  for (const double angle : {-2.9, -1.0, 0.0, 0.2, 1.5, 3.0})
    EXPECT_NEAR(bend(folded(angle)), 2 * std::tan(angle / 2), 1e-12) << angle;
}

TEST(Hinge, GradientIsTheDerivativeAndBlindToMotionsOfTheWhole) {
  const Hinge<double> hinge = folded(1.1);
  const auto gradient = bend_gradient(hinge);
  const HingeJet derivative = bend(with_derivatives(hinge));
  for (int a = 0; a < 4; ++a)
    EXPECT_LT((gradient.row(a).transpose() - by_nodes(derivative).segment<3>(3 * a)).norm(), 1e-12) << a;
  EXPECT_LT(gradient.colwise().sum().norm(), 1e-12);
  const Eigen::Vector3d moment = hinge.edge.cross(gradient.row(1).transpose()) +
                                 hinge.first.cross(gradient.row(2).transpose()) +
                                 hinge.second.cross(gradient.row(3).transpose());
  EXPECT_LT(moment.norm(), 1e-12);
}

// A plate of curvatures κx, κy and twist τ holds ½ D [(κx + κy)² − 2 (1 − ν) (κx κy − τ²)] per area. Here ν is ½; the
// triangles on the free edges lack a neighbour, so that the inner share of a sheet is compared.
struct Bent {
  const char* name;
  double across, along, twist;
};

double plate_energy(const Bent& bent) {
  const double sum = bent.across + bent.along;
  return 0.5 * (sum * sum - (bent.across * bent.along - bent.twist * bent.twist));
}

class BentSheet : public ::testing::TestWithParam<Bent> {
 protected:
  double error(int n, int order, double shift) const {
    const Bent& bent = GetParam();
    const Motion lift = [&bent](const Eigen::RowVector3d& p) -> Eigen::RowVector3d {
      const double height = 0.5 * bent.across * p.x() * p.x() + 0.5 * bent.along * p.y() * p.y();
      return p + Eigen::RowVector3d(0, 0, height + bent.twist * p.x() * p.y());
    };
    return energy(sheet(n, order, shift), lift) / plate_energy(bent) - 1;
  }
};

TEST_P(BentSheet, HoldsTheEnergyOfAThinPlate) {
  for (const int order : {1, 2}) {
    const double coarse = error(20 / order, order, 0), fine = error(80 / order, order, 0);
    EXPECT_LT(std::abs(coarse), 0.2);
    // What is missing is a row of triangles at the edges.
    EXPECT_LT(std::abs(fine), 0.3 * std::abs(coarse) + 1e-3);
    EXPECT_LT(std::abs(fine), 0.05);
  }
}

TEST_P(BentSheet, HoldsItNearlyOnAnUnevenMesh) {
  EXPECT_LT(std::abs(error(80, 1, 0.2)), 0.2);
  EXPECT_LT(std::abs(error(40, 2, 0.2)), 0.2);
}

constexpr double slight = 1e-3;  // per mm
INSTANTIATE_TEST_SUITE_P(Plates, BentSheet,
                         ::testing::Values(Bent{"rolled", slight, 0, 0}, Bent{"rolled the other way", 0, slight, 0},
                                           Bent{"domed", slight, slight, 0}, Bent{"saddled", slight, -slight, 0},
                                           Bent{"twisted", 0, 0, slight}));

TEST(SkinBending, ASheetRolledToAQuarterOfACylinderHoldsHalfTheSquareOfItsCurvature) {
  const double radius_mm = side_mm / (0.5 * std::numbers::pi);
  const Motion roll = [radius_mm](const Eigen::RowVector3d& p) -> Eigen::RowVector3d {
    const double angle = p.x() / radius_mm;
    return {radius_mm * std::sin(angle), p.y(), radius_mm * (1 - std::cos(angle))};
  };
  EXPECT_NEAR(energy(sheet(40), roll) * 2 * radius_mm * radius_mm, 1, 0.04);
}

TEST(SkinBending, HasTheRatioOfTheSkinWhereThatIsNotIncompressible) {
  const Motion dome = [](const Eigen::RowVector3d& p) -> Eigen::RowVector3d {
    return p + Eigen::RowVector3d(0, 0, 0.5 * slight * p.squaredNorm());
  };
  // A dome of curvature κ holds D (1 + ν) κ² per area.
  EXPECT_NEAR(energy(sheet(80), dome, false) / (1.3 * slight * slight), 1, 0.05);
  EXPECT_NEAR(energy(sheet(80), dome, true) / (1.5 * slight * slight), 1, 0.05);
}

TEST(SkinBending, StiffnessIsThatOfAPlateOfTheSkinsThickness) {
  const testing::TestScene scene = testing::box_scene(2, {60, 50, 40});
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  const auto stiffness_mn_mm = [&](SkinLaw law) {
    Model model = testing::soft_model(BulkLaw::neo_hookean, law);
    model.skin.young_modulus_kpa.value = 20, model.skin.thickness_mm.value = 3, model.skin.bending_share = 2;
    model.skin.poisson_ratio.value = 0.3;
    const auto fields = make_fields(model, {scene.mesh, scene.anatomy, layout, "prone"}, Eigen::Vector3d::UnitZ());
    return (fields.skin_modulus[0] * fields.skin_bending[0]).a;
  };
  EXPECT_NEAR(stiffness_mn_mm(SkinLaw::neo_hookean), 2 * 20 * 27 / 9.0, 1e-9);
  EXPECT_NEAR(stiffness_mn_mm(SkinLaw::corotational), 2 * 20 * 27 / (12 * 0.91), 1e-9);
}

TEST(SkinBending, PatchesKnowTheirNeighboursAndTheEndOfTheSkin) {
  const Sheet two = sheet(1);
  const TrianglePatches patches = triangle_patches(two.faces);
  ASSERT_EQ(patches.nodes.rows(), 2);
  int hinges = 0;
  for (int t = 0; t < 2; ++t)
    for (int k = 0; k < 3; ++k) hinges += patches.hinged[t][k];
  EXPECT_EQ(hinges, 2) << "the diagonal, from both sides";
  EXPECT_EQ(triangle_patches(sheet(1, 2).faces).nodes.rows(), 8);
}

}  // namespace
}  // namespace supine::simulation
