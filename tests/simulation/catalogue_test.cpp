// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/catalogue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "common/error.h"
#include "simulation/effects/local_muscle.h"
#include "simulation/mechanics.h"
#include "simulation/model_fields.h"
#include "simulation/parameters.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

Eigen::VectorXd all_numbers(const Fields<double>& f) {
  std::vector<double> numbers;
  for (const auto& entry : field_columns<double>)
    numbers.insert(numbers.end(), (f.*entry.column).begin(), (f.*entry.column).end());
  return Eigen::Map<Eigen::VectorXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

class CatalogueTest : public ::testing::TestWithParam<const Effect*> {
 protected:
  CatalogueTest()
      : scene(GetParam()->name() == "left_right_stiffness" ? testing::two_breasts_scene() : testing::dome_scene()),
        layout(make_layout(scene.mesh, scene.anatomy)) {
    // Half gland, half fat, a little tumour: every tissue effect has something to act on.
    scene.mesh.fraction.setZero();
    for (Eigen::Index c = 0; c < scene.mesh.cells.rows(); ++c) {
      scene.mesh.fraction(c, static_cast<int>(segmentation::Tissue::adipose)) = 0.5;
      scene.mesh.fraction(c, static_cast<int>(segmentation::Tissue::gland)) = 0.4;
      scene.mesh.fraction(c, static_cast<int>(segmentation::Tissue::tumour)) = 0.1;
    }
    testing::name_parts_and_support(scene.mesh);
  }
  Fields<Dual> with(const std::vector<Dual>& values, const std::string& pose = "supine") const {
    Scene place{scene.mesh, scene.anatomy, layout, pose};
    place.tied_supports.assign(scene.mesh.support_names.size(), true);
    Fields<Dual> fields = make_fields(model, place, {0.1, 0.9, 0.4});
    std::map<std::string, std::string> options;
    for (const OptionRow& row : GetParam()->options()) options[row.name] = row.default_value;
    if (!values.empty()) GetParam()->apply(place, values, options, fields);
    return fields;
  }
  testing::TestScene scene;
  Layout layout;
  Model model = testing::soft_model();
};

TEST_P(CatalogueTest, NullValuesLeaveEveryFieldBitForBit) {
  std::vector<Dual> null;
  for (const Parameter& row : GetParam()->parameters()) null.emplace_back(row.null);
  for (const char* pose : {"prone", "supine"})
    EXPECT_EQ(all_numbers(values_of(with(null, pose))), all_numbers(values_of(with({}, pose))));
}

TEST_P(CatalogueTest, RangesHoldTheNullAndWhatIsUsual) {
  for (const Parameter& row : GetParam()->parameters()) {
    EXPECT_LT(row.lower, row.upper) << row.name;
    for (const double held : {row.null, row.median}) {
      EXPECT_GE(held, row.lower) << row.name;
      EXPECT_LE(held, row.upper) << row.name;
    }
    EXPECT_GT(row.spread, 0) << row.name;
    constexpr double e_squared = 2;  // of a number above zero it may be that of the logarithm
    const bool of_logarithm = row.lower >= 0 && row.median > 0;
    EXPECT_LE(row.spread, std::max(of_logarithm ? e_squared : 0, row.upper - row.lower))
        << row.name << ": a prior wider than what can be";
  }
}

TEST_P(CatalogueTest, RowsAreConsistent) {
  for (const Parameter& row : GetParam()->parameters()) {
    if (row.shape) {
      EXPECT_EQ(row.null, row.median) << row.name;
    }
    if (row.one_sided) {
      EXPECT_EQ(row.null, row.lower) << row.name;
      EXPECT_GT(row.median, 0) << row.name << ": its prior is log-normal";
    }
    EXPECT_FALSE(row.unit.empty()) << row.name;
    EXPECT_FALSE(row.meaning.empty()) << row.name;
  }
}

TEST_P(CatalogueTest, ActsWhereAndOnWhatItsTraitsSay) {
  const EffectTraits traits = GetParam()->traits();
  std::vector<Dual> sizes;
  for (const Parameter& row : GetParam()->parameters())
    sizes.emplace_back(row.median != row.null ? row.median : row.null + 0.25 * (row.upper - row.null));
  const auto changes = [&](const char* pose) {
    return all_numbers(values_of(with(sizes, pose))) != all_numbers(values_of(with({}, pose)));
  };
  EXPECT_EQ(changes("prone"), traits.acts_in != ActsIn::all_but_imaged);
  EXPECT_EQ(changes("supine"), traits.acts_in != ActsIn::imaged_only);
  const auto moved = values_of(with(sizes)), as_it_was = values_of(with({}));
  EXPECT_EQ(moved.scan_motion != as_it_was.scan_motion, traits.moves_scan);
  if (traits.moves_scan)
    for (const auto& [name, column] : field_columns<double>) {
      const bool same = moved.*column == as_it_was.*column;
      EXPECT_TRUE(same || std::string(name) == "scan_motion") << name;
    }
}

TEST_P(CatalogueTest, StandsForAnErrorOfTheMeasurementWhereItSaysSo) {
  const EffectTraits traits = GetParam()->traits();
  bool tolerated = false;
  for (const Parameter& row : GetParam()->parameters()) tolerated |= GetParam()->tolerance(row.unit, {}) > 0;
  EXPECT_EQ(tolerated, !traits.error_source.empty());
  EXPECT_EQ(GetParam()->tolerance({}, {}) > 0, tolerated);
  if (traits.error_of_each_scan) {
    EXPECT_TRUE(tolerated);
  }
}

TEST(Catalogue, CausesOfMeasurementAndNumbersAreNoneOfTheBody) {
  std::set<std::string> measurement;
  for (const Effect* effect : catalogue())
    if (is_measurement_effect(effect->name())) measurement.insert(effect->name());
  EXPECT_EQ(measurement,
            (std::set<std::string>{"misregistration", "gravity_tilt", "segmentation_offset", "incompressibility"}));
  EXPECT_EQ(place_of_scan().name(), "misregistration");
  EXPECT_FALSE(is_measurement_effect("nothing_of_that_name"));
}

TEST_P(CatalogueTest, EveryParameterHasTheDerivativeItStates) {
  const auto& rows = GetParam()->parameters();
  for (std::size_t p = 0; p < rows.size(); ++p) {
    double largest = 0;  // some act in prone alone, some in the other poses
    for (const char* pose : {"prone", "supine"}) {
      const auto at = [&](const Dual& h) {
        std::vector<Dual> values;
        for (std::size_t i = 0; i < rows.size(); ++i) {
          const double far = rows[i].null + 0.23 * (rows[i].upper - rows[i].null);
          values.push_back(Dual(rows[i].one_sided ? rows[i].median : far) + (i == p ? h : Dual(0.0)));
        }
        return with(values, pose);
      };
      const Eigen::VectorXd tangent = all_numbers(derivatives_of(at(Dual(0.0, 0))));
      const double h = 1e-5;
      const Eigen::VectorXd difference =
          (all_numbers(values_of(at(Dual(h)))) - all_numbers(values_of(at(Dual(-h))))) / (2 * h);
      EXPECT_LE((difference - tangent).norm(), 1e-4 * tangent.norm()) << rows[p].name << " " << pose;
      largest = std::max(largest, tangent.norm());
    }
    EXPECT_GT(largest, 1e-9) << rows[p].name << " changes nothing";
  }
}

TEST_P(CatalogueTest, PlaceAndShapeAreWhatMovesNothingWhileTheStrengthIsNull) {
  const auto& rows = GetParam()->parameters();
  for (std::size_t p = 0; p < rows.size(); ++p) {
    std::vector<Dual> values;
    for (const Parameter& row : rows) values.emplace_back(row.null);
    values[p].v[0] = 1;
    double largest = 0;
    for (const char* pose : {"prone", "supine"})
      largest = std::max(largest, all_numbers(derivatives_of(with(values, pose))).norm());
    EXPECT_EQ(largest == 0, rows[p].shape) << rows[p].name;
  }
}

INSTANTIATE_TEST_SUITE_P(Effects, CatalogueTest, ::testing::ValuesIn(catalogue()),
                         [](const auto& place) { return place.param->name(); });

TEST(Catalogue, NamesAreUniqueAndFound) {
  for (const Effect* effect : catalogue()) EXPECT_EQ(find_effect(effect->name()), effect);
  EXPECT_EQ(find_effect("ligamnet"), nullptr);
}

TEST(LocalStiffness, IsLargestInItsMiddleAndActsOnWhatItIsOfAlone) {
  const testing::TestScene& scene = testing::dome_scene();
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  const Scene place{scene.mesh, scene.anatomy, layout, "supine"};
  const Eigen::Vector3d middle(0.2, -0.3, 0.4);
  const auto with = [&](const char* of) {
    Model model = testing::soft_model();
    EffectSetting spot = null_setting(*find_effect("local_stiffness"));
    spot.parameters.at("log_ratio").value = 1.5;
    spot.parameters.at("centre_lateral").value = middle.x();
    spot.parameters.at("centre_head").value = middle.y();
    spot.parameters.at("height").value = middle.z();
    spot.options.at("of") = of;
    model.effects.push_back(spot);
    return values_of(make_fields(model, place, {0, 1, 0}));
  };
  const auto without = values_of(make_fields(testing::soft_model(), place, {0, 1, 0}));
  const auto tissue = with("tissue"), skin = with("skin");
  EXPECT_EQ(tissue.skin_modulus, without.skin_modulus);
  EXPECT_EQ(skin.ln_young, without.ln_young);
  const auto expected = [&](const auto& nodes) {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (const int n : nodes)
      at += Eigen::Vector3d(scene.anatomy.q(n, 0), scene.anatomy.q(n, 1),
                            scene.anatomy.thickness_mm[n] / scene.anatomy.foot_radius_mm) /
            static_cast<double>(nodes.size());
    return 1.5 * std::exp(-0.5 * (at - middle).squaredNorm() / (0.3 * 0.3));
  };
  for (Eigen::Index c = 0; c < scene.mesh.cells.rows(); ++c)
    EXPECT_NEAR(tissue.ln_young[c] - without.ln_young[c], expected(scene.mesh.cells.row(c).head(4).eval()), 1e-12);
  for (Eigen::Index f = 0; f < layout.skin.faces.size(); ++f)
    EXPECT_NEAR(std::log(skin.skin_modulus[f] / without.skin_modulus[f]),
                expected(scene.mesh.faces.row(layout.skin.faces[f]).head(3).eval()), 1e-12);
  EXPECT_GT((skin.skin_modulus - without.skin_modulus).maxCoeff(), 0.1 * without.skin_modulus.minCoeff());
}

TEST(LocalMuscle, IsFurthestOutInItsMiddleInEveryPoseButTheImagedOne) {
  const testing::TestScene& scene = testing::dome_scene();
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  const Eigen::Vector2d middle(0.7, -0.2);
  Model model = testing::soft_model();
  EffectSetting hill = null_setting(*find_effect("local_muscle"));
  hill.parameters.at("offset_mm").value = -6;
  hill.parameters.at("centre_lateral").value = middle.x();
  hill.parameters.at("centre_head").value = middle.y();
  model.effects.push_back(hill);
  const auto offset = [&](const char* pose) {
    return values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, pose}, {0, 1, 0})).muscle_offset;
  };
  EXPECT_EQ(offset("prone").cwiseAbs().maxCoeff(), 0);
  const auto supine = offset("supine");
  double most = 0;
  for (Eigen::Index p = 0; p < layout.interface.q.rows(); ++p) {
    const double squares = (layout.interface.q.row(p).transpose() - middle).squaredNorm();
    EXPECT_NEAR(supine[p], -6 * std::exp(-0.5 * squares / (0.4 * 0.4)), 1e-12);
    most = std::max(most, -supine[p]);
  }
  EXPECT_GT(most, 5.5);
}

TEST(LocalMuscle, IsListedWhereTheHillOfTheChestWallCanStandAsWideAsThatCanBe) {
  // (1 - r²)³ of radius 1 is as wide at half of its height as exp(-½ d²/0.386²).
  EXPECT_TRUE(LocalMuscle::is_listed({0.1, -0.3}, 0.386));
  EXPECT_FALSE(LocalMuscle::is_listed({0.5, 0}, 0.386)) << "its middle is within 0.4 radii";
  EXPECT_FALSE(LocalMuscle::is_listed({0, -0.6}, 0.386));
  EXPECT_FALSE(LocalMuscle::is_listed({0, 0}, 0.2)) << "its border is at 0.7 radii at least";
  EXPECT_FALSE(LocalMuscle::is_listed({0, 0}, 0.6));
}

TEST(StandIns, AreOfOneBreastByItself) {
  const testing::TestScene &one = testing::dome_scene(), &two = testing::two_breasts_scene();
  for (const char* name : {"local_stiffness", "local_muscle"}) {
    const Effect& effect = *find_effect(name);
    EXPECT_TRUE(effect.belongs_to(one.mesh, one.anatomy, testing::soft_model())) << name;
    EXPECT_FALSE(effect.belongs_to(two.mesh, two.anatomy, testing::soft_model())) << name;
  }
}

TEST(StandIns, StandForCausesThatNoEffectListsAndNoOtherEffectsDo) {
  for (const Effect* effect : catalogue())
    EXPECT_EQ(is_stand_in(*effect), effect->name().starts_with("local_")) << effect->name();
}

TEST(Ligament, ActsOnTheFootAlone) {
  const testing::TestScene& scene = testing::dome_scene();
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = testing::soft_model();
  model.effects.push_back({"ligament", {{"stiffness_kpa_per_mm", Setting{0.5}}, {"width_mm", Setting{12}}}, {}});
  const auto fields = values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, "supine"}, {0, 1, 0}));
  double inside = 0;
  for (Eigen::Index p = 0; p < layout.interface.q.rows(); ++p) {
    const double distance = std::abs(scene.anatomy.from_foot_mm(layout.interface.q.row(p).transpose()));
    const double added = fields.interface_normal[p] - model.interface.normal_kpa_per_mm.value;
    if (distance < 3.9) {
      EXPECT_NEAR(added, 0.5, 1e-12);
    } else if (distance > 8.1) {
      EXPECT_EQ(added, 0);
    }
    inside += added > 0;
  }
  EXPECT_GT(inside, 10);
}

TEST(Ligament, ArcsLeaveTheRightPartOut) {
  const testing::TestScene& scene = testing::dome_scene();
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  const auto share = [&](const std::string& arc) {
    Model model = testing::soft_model();
    model.effects.push_back({"ligament", {{"stiffness_kpa_per_mm", Setting{1}}}, {{"arc", arc}}});
    const auto fields = values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, "supine"}, {0, 1, 0}));
    const Eigen::VectorXd added = fields.interface_normal.array() - model.interface.normal_kpa_per_mm.value;
    for (Eigen::Index p = 0; p < added.size(); ++p) {
      const auto q = layout.interface.q.row(p);
      if ((arc == "lower" && q.y() > 0) || (arc == "open_medial" && q.x() < -0.51 * q.norm())) {
        EXPECT_LT(std::abs(added[p]), 1e-12);
      }
    }
    return added.dot(layout.interface.area_mm2);
  };
  const double full = share("full");
  EXPECT_NEAR(share("lower") / full, 1.0 / 2, 0.1);
  EXPECT_NEAR(share("open_medial") / full, 2.0 / 3, 0.1);
}

TEST(Ligament, RigidTieReproducesTheStudysCompliance) {
  const testing::TestScene& scene = testing::dome_scene();
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = testing::soft_model();
  model.effects.push_back({"ligament", {}, {{"tie", "rigid"}}});
  const auto fields = values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, "supine"}, {0, 1, 0}));
  const Eigen::VectorXd added = fields.interface_normal.array() - model.interface.normal_kpa_per_mm.value;
  const Eigen::VectorXd sideways = fields.interface_tangential.array() - model.interface.tangential_kpa_per_mm.value;
  EXPECT_LT((added - sideways).norm(), 1e-6 * added.norm());
  // Total stiffness over the ring in mN/mm: 1e8 for each node that is wholly inside, less for those at its edges.
  const double total = added.dot(layout.interface.area_mm2), full = added.maxCoeff();
  std::set<int> touched, inside;
  for (Eigen::Index f = 0; f < layout.interface.faces.size(); ++f)
    for (const int n : scene.mesh.faces.row(layout.interface.faces[f])) {
      if (added.segment<3>(3 * f).maxCoeff() > 0) touched.insert(n);
      if (added.segment<3>(3 * f).maxCoeff() > 0.999 * full) inside.insert(n);
    }
  ASSERT_GT(inside.size(), 10u);
  EXPECT_GE(total, 1e8 * static_cast<double>(inside.size()) * (1 - 1e-9));
  EXPECT_LE(total, 1e8 * static_cast<double>(touched.size()) * (1 + 1e-9));
}

TEST(MakeFields, UnknownEffectIsRefused) {
  const testing::TestScene& scene = testing::dome_scene();
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = testing::soft_model();
  model.effects.push_back({"ligamnet", {}, {}});
  EXPECT_THROW(make_fields(model, {scene.mesh, scene.anatomy, layout, "supine"}, {0, 1, 0}), InputError);
}

}  // namespace
}  // namespace supine::simulation
