// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/laws/skin_laws.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

using testing::taylor_order;

PlaneInvariants<double> of_stretches(double l1, double l2) { return {l1 * l1 + l2 * l2, l1 * l1 * l2 * l2}; }

SkinMaterial<double> material(double share = 0.05, double stiffening = 0) { return {1, 0.45, share, 1, stiffening}; }

class SkinLawTest : public ::testing::TestWithParam<SkinLaw> {};

// taut, wrinkled, slack
const std::vector<std::pair<double, double>> places = {{1.3, 1.1}, {1.3, 0.7}, {0.9, 0.8}};

TEST_P(SkinLawTest, DerivativesFollowTheEnergyInEveryRegime) {
  for (const Compression compression : {Compression::tension_field, Compression::full})
    for (const double stiffening : {0.0, 2.5})
      for (const auto& [l1, l2] : places) {
        const auto c = of_stretches(l1, l2);
        const SkinSettings s{GetParam(), compression};
        const auto m = material(0.05, stiffening);
        const auto e = skin_energy<double>(s, m, c);
        EXPECT_GT(taylor_order(
                      [&](double h) {
                        return skin_energy<double>(s, m, {c.a + h, c.b - 0.7 * h}).psi;
                      },
                      e.psi_a - 0.7 * e.psi_b),
                  1.9)
            << l1 << " " << l2 << " " << stiffening;
      }
}

TEST_P(SkinLawTest, RelaxedEnergyAndStressAreContinuousAcrossTheBorders) {
  const SkinSettings s{GetParam(), Compression::tension_field};
  const double natural = GetParam() == SkinLaw::neo_hookean ? 1 / std::sqrt(1.3) : 1 - 0.45 * 0.3;
  for (const auto& [l1, l2] : std::vector<std::pair<double, double>>{{1.3, natural}, {1.0, 0.8}}) {
    const bool along_first = l1 == 1.0;
    for (const double stiffening : {0.0, 2.5}) {
      const auto at = [&, l1 = l1, l2 = l2](double d) {
        return skin_energy<double>(s, material(0, stiffening),
                                   along_first ? of_stretches(l1 + d, l2) : of_stretches(l1, l2 + d));
      };
      const auto below = at(-1e-7), above = at(1e-7);
      EXPECT_NEAR(below.psi, above.psi, 1e-6);
      EXPECT_NEAR(below.psi_a, above.psi_a, 1e-6);
      EXPECT_NEAR(below.psi_b, above.psi_b, 1e-6);
    }
  }
}

TEST_P(SkinLawTest, RelaxedNeverExceedsFullAndAgreesWhereTaut) {
  for (double l1 = 0.6; l1 < 1.6; l1 += 0.07)
    for (double l2 = 0.5; l2 <= l1; l2 += 0.07) {
      const auto c = of_stretches(l1, l2);
      const double full = skin_energy<double>(SkinSettings{GetParam(), Compression::full}, material(), c).psi;
      const double relaxed =
          skin_energy<double>(SkinSettings{GetParam(), Compression::tension_field}, material(0), c).psi;
      EXPECT_LE(relaxed, full + 1e-12);
      EXPECT_GE(relaxed, 0);
      if (l2 >= 1) {
        EXPECT_NEAR(relaxed, full, 1e-12);
      }
    }
}

TEST_P(SkinLawTest, UniaxialTensionGivesYoungsModulus) {
  // A free narrow strip: stress along it over strain is E, because the second stretch takes its natural width.
  const SkinSettings s{GetParam(), Compression::tension_field};
  const double strain = 1e-4;
  const double energy = skin_energy<double>(s, material(0), of_stretches(1 + strain, 0.9)).psi;
  EXPECT_NEAR(energy, 0.5 * strain * strain, 2e-3 * 0.5 * strain * strain);
}

TEST(SkinStiffening, IsTheExponentialOfTheInvariant) {
  const auto c = of_stretches(1.3, 1.1);
  const double w = c.a + 1 / c.b - 3, b = 2.5;
  const SkinSettings s{SkinLaw::neo_hookean, Compression::tension_field};
  const auto stiff = skin_energy<double>(s, material(0.05, b), c), plain = skin_energy<double>(s, material(), c);
  EXPECT_NEAR(stiff.psi, (std::exp(b * w) - 1) / (6 * b), 1e-14);
  EXPECT_NEAR(stiff.psi_a, std::exp(b * w) * plain.psi_a, 1e-14);
  EXPECT_NEAR(stiff.psi_b, std::exp(b * w) * plain.psi_b, 1e-14);
}

TEST(SkinStiffening, RelaxedEnergyIsTheLowestOverTheWidths) {
  const SkinSettings full{SkinLaw::neo_hookean, Compression::full};
  const SkinSettings relaxed{SkinLaw::neo_hookean, Compression::tension_field};
  double lowest = 1e300;
  for (double l2 = 0.6; l2 < 1.2; l2 += 1e-4)
    lowest = std::min(lowest, skin_energy<double>(full, material(0, 2.5), of_stretches(1.3, l2)).psi);
  EXPECT_NEAR(skin_energy<double>(relaxed, material(0, 2.5), of_stretches(1.3, 0.7)).psi, lowest, 1e-8);
}

TEST(SkinStiffening, LeavesCompressedWrinklesWeak) {
  const SkinSettings s{SkinLaw::neo_hookean, Compression::tension_field};
  const auto c = of_stretches(0.9, 0.5);
  EXPECT_EQ(skin_energy<double>(s, material(0.05, 6), c).psi, skin_energy<double>(s, material(0.05), c).psi);
}

TEST(SkinStiffening, SlopeInTheExponentIsRightAtNull) {
  using J = ceres::Jet<double, 1>;
  const SkinSettings s{SkinLaw::neo_hookean, Compression::tension_field};
  const auto c = of_stretches(1.3, 1.1);
  const double w = c.a + 1 / c.b - 3;
  const SkinMaterial<J> m{J(1.0), J(0.45), J(0.05), J(1.0), J(0.0, 0)};
  const auto e = skin_energy<J>(s, m, PlaneInvariants<J>{J(c.a), J(c.b)});
  EXPECT_NEAR(e.psi.v[0], w * w / 12, 1e-15);
  EXPECT_NEAR(e.psi_a.v[0], w / 6, 1e-15);
}

// The series of (e^z - 1)/z and the quotient meet at |z| = 1e-3.
TEST(SkinStiffening, IsSmoothWhereTheFormulaChanges) {
  const SkinSettings s{SkinLaw::neo_hookean, Compression::full};
  const auto c = of_stretches(1.2, 1.1);
  const double w = c.a + 1 / c.b - 3, b = 1e-3 / w;
  const double below = skin_energy<double>(s, material(0, b * (1 - 1e-9)), c).psi;
  EXPECT_NEAR(below, skin_energy<double>(s, material(0, b * (1 + 1e-9)), c).psi, 1e-11 * below);
}

INSTANTIATE_TEST_SUITE_P(Laws, SkinLawTest, ::testing::Values(SkinLaw::neo_hookean, SkinLaw::corotational));

}  // namespace
}  // namespace supine::simulation
