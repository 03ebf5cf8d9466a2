// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCore>

#include "simulation/mechanics.h"
#include "simulation/model_fields.h"
#include "simulation/terms/bulk.h"
#include "simulation/terms/skin.h"
#include "simulation/terms/skin_end_fade.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

using testing::random_matrix;
using testing::taylor_order;

struct Case {
  int order;
  BulkLaw law;
  SkinLaw skin;
  Compression compression;
  DensityReference density;
  double poisson = 0.45;
  double fade_mm = 0;
  double bending_share = 0;
};

testing::TestScene small_box(int order) {
  testing::TestScene scene = testing::box_scene(2, {60, 50, 40});
  if (order == 1) return scene;
  scene.mesh = testing::quadratic(scene.mesh);
  auto& a = scene.anatomy;
  a.q.resize(scene.mesh.points.rows(), 2);
  for (Eigen::Index p = 0; p < a.q.rows(); ++p)
    a.q.row(p) = (scene.mesh.points.row(p).transpose() - a.foot_centre_mm).head<2>().transpose() / a.foot_radius_mm;
  return scene;
}

// All terms at once on a small box, away from equilibrium, with x and X both moved from the imaged shape.
class TermsTest : public ::testing::TestWithParam<Case> {
 protected:
  TermsTest() {
    scene = small_box(GetParam().order);
    model = testing::soft_model(GetParam().law, GetParam().skin);
    model.skin.compression = GetParam().compression;
    model.skin.fade_mm = GetParam().fade_mm;
    model.skin.bending_share = GetParam().bending_share;
    model.breast.density_refers_to = GetParam().density;
    model.breast.poisson_ratio.value = GetParam().poisson;
    model.breast.yeoh_c3_ratio.value = 0.3;
    model.interface.tangential_kpa_per_mm.value = 0.2;
    mechanics = std::make_unique<Mechanics>(scene.mesh, scene.anatomy, model);
    fields = make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics->layout(), "prone"}, {0.3, -0.2, 0.9});
    for (Dual& b : fields.stiffening) b += 0.3;
    for (Dual& k : fields.fibre_modulus) k += 0.7;
    for (Dual& p : fields.skin_prestretch) p += 0.05;
    for (Dual& b : fields.skin_stiffening) b += 0.7;
    for (Dual& mu : fields.interface_friction) mu += 0.4;
    for (Dual& d : fields.muscle_offset) d += 0.6;
    vary(fields.skin_traction, 0.3, 21);
    vary(fields.imaged_offset, 1.0, 22);
    mechanics->set_fields(values_of(fields));
    sums = std::make_unique<Sums>(mechanics->pattern());
    const int n = static_cast<int>(scene.mesh.points.rows());
    X = scene.mesh.points + 1.5 * random_matrix(n, 3, 1);
    x = X + 2.0 * random_matrix(n, 3, 2);
    x.col(2) *= 1.15;
    x.col(0) *= 0.9;
    v = random_matrix(n, 3, 3);
  }

  static void vary(Fields<Dual>::Column& column, double size, unsigned seed) {
    const Eigen::MatrixXd random = random_matrix(static_cast<int>(column.size()), 1, seed);
    for (Eigen::Index i = 0; i < column.size(); ++i) column[i] += size * random(i);
  }
  void without_friction() {
    for (Dual& mu : fields.interface_friction) mu = Dual(0.0);
    mechanics->set_fields(values_of(fields));
  }
  double energy(const Points& now, const Points& rest) {
    mechanics->evaluate({now, rest}, Demand{.energy = true}, *sums);
    EXPECT_TRUE(sums->valid);
    return sums->energy;
  }
  Eigen::VectorXd residual(const Points& now, const Points& rest) {
    mechanics->evaluate({now, rest}, Demand{.residual = true}, *sums);
    EXPECT_TRUE(sums->valid);
    return sums->residual;
  }
  /// Whether the forces of this case depend on a field.
  bool reads(const std::string& field) const {
    if (field == "stiffening") return model.breast.law == BulkLaw::neo_hookean;
    if (field == "law_shape_1")
      return model.breast.law == BulkLaw::mooney_rivlin || model.breast.law == BulkLaw::yeoh ||
             model.breast.law == BulkLaw::gent;
    if (field == "law_shape_2") return model.breast.law == BulkLaw::yeoh;
    if (field == "skin_poisson") return model.skin.law == SkinLaw::corotational;
    if (field == "skin_bending") return model.skin.bending_share > 0;
    if (field == "skin_stiffening") return model.skin.law == SkinLaw::neo_hookean;
    if (field == "imaged_offset") return model.breast.density_refers_to == DensityReference::imaged;
    if (field == "skin_compression") return model.skin.compression == Compression::tension_field;
    return field != "scan_motion";
  }
  Eigen::VectorXd flat_direction() const { return Eigen::Map<const Eigen::VectorXd>(v.data(), v.size()); }

  testing::TestScene scene;
  Model model;
  std::unique_ptr<Mechanics> mechanics;
  Fields<Dual> fields;
  std::unique_ptr<Sums> sums;
  Points X, x, v;
};

TEST_P(TermsTest, ResidualIsTheDerivativeOfTheEnergy) {
  EXPECT_FALSE(mechanics->has_energy()) << "friction has none";
  without_friction();
  if (!mechanics->has_energy()) return;
  const double slope = residual(x, X).dot(flat_direction());
  ASSERT_GT(std::abs(slope), 1e-3);
  EXPECT_GT(taylor_order([&](double h) { return energy(x + h * v, X); }, slope), 1.9);
}

TEST_P(TermsTest, TangentIsTheDerivativeWithRespectToTheDeformedShape) {
  mechanics->evaluate({x, X}, Demand{.residual = true, .tangent = true}, *sums);
  const Eigen::VectorXd slope = sums->tangent * flat_direction();
  ASSERT_GT(slope.norm(), 1e-3);
  EXPECT_GT(taylor_order([&](double h) { return residual(x + h * v, X); }, slope), 1.9);
}

TEST_P(TermsTest, ReferenceTangentIsTheDerivativeWithRespectToTheUndeformedShape) {
  mechanics->evaluate({x, X}, Demand{.residual = true, .reference_tangent = true}, *sums);
  const Eigen::VectorXd slope = sums->reference_tangent * flat_direction();
  ASSERT_GT(slope.norm(), 1e-3);
  EXPECT_GT(taylor_order([&](double h) { return residual(x, X + h * v); }, slope), 1.9);
}

template <class Element>
Eigen::MatrixXd tissue_tangent(const Indices& cells, const Model& model, const Fields<Dual>& fields, const State& state,
                               bool convex) {
  const Pattern pattern(cells, state.X.rows());
  BulkTerm<Element> tissue(std::make_shared<const Elements>(cells, pattern), {.law = model.breast.law});
  tissue.set_fields(values_of(fields));
  Sums sums(pattern);
  tissue.add(state, Demand{.residual = true, .tangent = true, .convex = convex}, sums);
  return sums.tangent;
}

TEST_P(TermsTest, TheConvexTangentOfSqueezedTissueIsNoSofterThanTheExactOneAndNowhereNegative) {
  without_friction();
  if (!mechanics->has_energy()) return;
  x.col(2) *= 0.3;
  const auto tangent = [&](bool convex) {
    const Indices& cells = scene.mesh.cells;
    return GetParam().order == 2 ? tissue_tangent<Tet10>(cells, model, fields, {x, X}, convex)
                                 : tissue_tangent<Tet4>(cells, model, fields, {x, X}, convex);
  };
  const Eigen::MatrixXd exact = tangent(false), convex = tangent(true);
  const auto least = [](const Eigen::MatrixXd& m) {
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(m, Eigen::EigenvaluesOnly).eigenvalues()[0];
  };
  const double rounding = 1e-10 * convex.norm();
  ASSERT_LT(least(exact), -1e3 * rounding) << "nothing to take off";
  EXPECT_GT(least(convex), -rounding);
  EXPECT_GT(least(convex - exact), -rounding);
}

TEST_P(TermsTest, EveryFieldHasItsDerivative) {
  // Each field alone moves along a random direction with a curvature, so that the remainder is of second order.
  for (const auto& [name, member] : field_columns<Dual>) {
    if (!reads(name)) continue;
    const Eigen::VectorXd direction = random_matrix(static_cast<int>((fields.*member).size()), 1, 11);
    const auto moved = [&, member = member](const Dual& h) {
      Fields<Dual> f = fields;
      for (Eigen::Index i = 0; i < direction.size(); ++i) (f.*member)[i] *= 1.0 + 0.1 * direction[i] * h + 0.02 * h * h;
      return f;
    };
    mechanics->parameter_derivative({x, X}, moved(Dual(0.0, 0)), *sums);
    const Eigen::VectorXd slope = sums->residual;
    ASSERT_GT(slope.norm(), 1e-6) << name;
    const double order = taylor_order(
        [&](double h) {
          mechanics->set_fields(values_of(moved(Dual(h))));
          return residual(x, X);
        },
        slope, 0.1);
    mechanics->set_fields(values_of(fields));
    EXPECT_GT(order, 1.9) << name;
  }
}

TEST_P(TermsTest, SpringsAndTissueAreForceFreeInTheUndeformedShapeWithoutLoad) {
  for (Dual& p : fields.skin_prestretch) p = Dual(1.0);  // tractions and the muscle's motion grow with the load
  mechanics->set_fields(values_of(fields));
  mechanics->evaluate({X, X, 0.0}, Demand{.energy = true, .residual = true}, *sums);
  EXPECT_LT(sums->residual.norm(), 1e-10);
  EXPECT_LT(std::abs(sums->energy), 1e-10);
}

TEST_P(TermsTest, InvertedElementsAreReported) {
  Points turned = x;
  turned.col(2) *= -1;
  mechanics->evaluate({turned, X}, Demand{.residual = true}, *sums);
  EXPECT_FALSE(sums->valid);
  EXPECT_LT(sums->min_det_f, 0);
  EXPECT_GE(sums->min_cell, 0);
}

// Mass is density × imaged volume, or × undeformed volume; both elements, all of it.
TEST(Weight, IsDensityTimesGravityTimesVolume) {
  for (const int order : {1, 2})
    for (const DensityReference reference : {DensityReference::imaged, DensityReference::undeformed}) {
      const testing::TestScene scene = small_box(order);
      Model model = testing::soft_model();
      model.breast.density_kg_m3.value = 950;
      model.breast.density_refers_to = reference;
      Mechanics mechanics(scene.mesh, scene.anatomy, model);
      const Points X = 1.1 * scene.mesh.points;
      const auto force_mn = [&](const Eigen::Vector3d& down) {
        mechanics.set_fields(
            values_of(make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics.layout(), "prone"}, down)));
        Sums sums(mechanics.pattern());
        mechanics.evaluate({X, X}, Demand{.residual = true}, sums);
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (Eigen::Index n = 0; n < X.rows(); ++n) sum += sums.residual.segment<3>(3 * n);
        return sum;
      };
      const double volume_mm3 = 60.0 * 50 * 40 * (reference == DensityReference::imaged ? 1 : 1.331);
      const double weight_mn = 950e-9 * 9810 * volume_mm3;  // kg/mm³ × mm/s²
      const Eigen::Vector3d weight = force_mn({0, -0.6, 0.8}) - force_mn(Eigen::Vector3d::Zero());
      EXPECT_LT((weight - weight_mn * Eigen::Vector3d(0, 0.6, -0.8)).norm(), 1e-6 * weight_mn) << "order " << order;
    }
}

/// Energy, and the sum of the forces on the nodes, of a body without weight that was moved from the imaged shape.
struct Carried {
  double energy_mj;  // mN mm
  Eigen::Vector3d force_mn;
};

Carried carried(const testing::TestScene& scene, const Model& model, const Points& x) {
  Mechanics mechanics(scene.mesh, scene.anatomy, model);
  mechanics.set_fields(values_of(
      make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics.layout(), "prone"}, Eigen::Vector3d::Zero())));
  Sums sums(mechanics.pattern());
  mechanics.evaluate({x, scene.mesh.points}, Demand{.energy = true, .residual = true}, sums);
  Carried result{sums.energy, Eigen::Vector3d::Zero()};
  for (Eigen::Index n = 0; n < x.rows(); ++n) result.force_mn += sums.residual.segment<3>(3 * n);
  return result;
}

// A body moved as a whole off a plane muscle: only the springs carry, and their forces are stiffness × area × way.
TEST(Springs, CarryStiffnessTimesAreaTimesWay) {
  const testing::TestScene scene = testing::box_scene(2, {60, 50, 40});
  Model model = testing::soft_model();
  model.interface.tangential_kpa_per_mm.value = 0.2;
  const auto [energy, force] = carried(scene, model, scene.mesh.points.rowwise() + Eigen::RowVector3d(0.3, 0, 0.5));
  const double base = 60 * 50, sides = 2 * (60 + 50) * 40;  // mm²; cut springs 1 kPa/mm on the sides
  EXPECT_NEAR(force.x(), (0.2 * base + 1.0 * sides) * 0.3, 1e-3);
  EXPECT_NEAR(force.z(), (3.0 * base + 1.0 * sides) * 0.5, 1e-3);
  EXPECT_NEAR(energy, 0.5 * ((0.2 * base + sides) * 0.09 + (3.0 * base + sides) * 0.25), 1e-3);
}

// The same with a cut that fades: its force is that of what is left of the stiffness at each point.
TEST(Springs, FadeWhereTheSkinEnds) {
  const testing::TestScene scene = testing::box_scene(4, {60, 50, 40});
  Model model = testing::soft_model();
  model.interface.tangential_kpa_per_mm.value = 0.2;
  model.skin.fade_mm = 15;
  const FaceGroup cut = make_layout(scene.mesh, scene.anatomy).cut;
  const double sides = fade_from_skin_end<Tri3>(scene.mesh, cut.faces, 15).dot(cut.area_mm2);
  // Over the 15 mm under the rim half is left, on the lower 25 all.
  EXPECT_NEAR(sides, 2 * (60 + 50) * (25 + 7.5), 0.05 * sides);
  const Carried moved = carried(scene, model, scene.mesh.points.rowwise() + Eigen::RowVector3d(0.3, 0, 0));
  EXPECT_NEAR(moved.force_mn.x(), (0.2 * 60 * 50 + 1.0 * sides) * 0.3, 1e-3);
}

// A stretch by a tenth: what skin of 20 kPa more adds to the energy is that of what is left of it.
TEST(Skin, FadesWhereItEnds) {
  const testing::TestScene scene = testing::box_scene(4, {60, 50, 40});
  const FaceGroup skin = make_layout(scene.mesh, scene.anatomy).skin;
  const auto added_mj = [&scene](double fade_mm) {
    Model softer = testing::soft_model(), stiffer = softer;
    softer.skin.young_modulus_kpa.value = 20, stiffer.skin.young_modulus_kpa.value = 40;
    softer.skin.fade_mm = stiffer.skin.fade_mm = fade_mm;
    const Points x = 1.1 * scene.mesh.points;
    return carried(scene, stiffer, x).energy_mj - carried(scene, softer, x).energy_mj;
  };
  const double left = fade_from_skin_end<Tri3Centroid>(scene.mesh, skin.faces, 15).dot(skin.area_mm2);
  EXPECT_LT(left, 0.9 * skin.area_mm2.sum());
  EXPECT_NEAR(added_mj(15) / added_mj(0), left / skin.area_mm2.sum(), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(
    All, TermsTest,
    ::testing::Values(
        Case{1, BulkLaw::neo_hookean, SkinLaw::neo_hookean, Compression::tension_field, DensityReference::imaged},
        Case{1, BulkLaw::neo_hookean, SkinLaw::neo_hookean, Compression::full, DensityReference::undeformed},
        Case{1, BulkLaw::corotational, SkinLaw::corotational, Compression::full, DensityReference::undeformed},
        Case{1, BulkLaw::corotational_qr, SkinLaw::corotational, Compression::full, DensityReference::imaged},
        Case{2, BulkLaw::neo_hookean, SkinLaw::neo_hookean, Compression::full, DensityReference::undeformed},
        Case{2, BulkLaw::corotational, SkinLaw::corotational, Compression::full, DensityReference::imaged},
        Case{1, BulkLaw::mooney_rivlin, SkinLaw::neo_hookean, Compression::full, DensityReference::imaged},
        Case{1, BulkLaw::gent, SkinLaw::neo_hookean, Compression::full, DensityReference::imaged},
        Case{1, BulkLaw::neo_hookean_calculix, SkinLaw::neo_hookean, Compression::full, DensityReference::imaged},
        Case{2, BulkLaw::yeoh, SkinLaw::neo_hookean, Compression::full, DensityReference::undeformed},
        Case{1, BulkLaw::neo_hookean, SkinLaw::neo_hookean, Compression::full, DensityReference::imaged, 0.45, 20},
        Case{2, BulkLaw::neo_hookean, SkinLaw::neo_hookean, Compression::full, DensityReference::imaged, 0.45, 20},
        // Skin that resists bending, stiffer than skin is: 1.5 mm thick it would hardly be seen beside the rest.
        Case{1, BulkLaw::neo_hookean, SkinLaw::neo_hookean, Compression::tension_field, DensityReference::imaged, 0.45,
             0, 500},
        Case{2, BulkLaw::neo_hookean, SkinLaw::neo_hookean, Compression::full, DensityReference::imaged, 0.45, 0, 500},
        Case{2, BulkLaw::corotational, SkinLaw::corotational, Compression::full, DensityReference::imaged, 0.45, 0,
             500},
        // Nearly incompressible: the mean dilation of each cell carries most of λ.
        Case{2, BulkLaw::neo_hookean, SkinLaw::neo_hookean, Compression::full, DensityReference::imaged, 0.49},
        Case{2, BulkLaw::mooney_rivlin, SkinLaw::neo_hookean, Compression::full, DensityReference::imaged, 0.49},
        Case{2, BulkLaw::neo_hookean_calculix, SkinLaw::neo_hookean, Compression::full, DensityReference::imaged, 0.49},
        Case{2, BulkLaw::corotational, SkinLaw::corotational, Compression::full, DensityReference::imaged, 0.49}));

}  // namespace
}  // namespace supine::simulation
