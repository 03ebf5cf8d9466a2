// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/base_parameters.h"

#include <utility>

#include "simulation/laws/bulk_laws.h"

namespace supine::simulation {
namespace {

using Breast = decltype(Model::breast);
using Skin = decltype(Model::skin);
using Interface = decltype(Model::interface);
using Cut = decltype(Model::cut);

/// The row of the number Model::*section.*number. @param row  without its median, which is the model's default
template <auto section, auto number>
BaseParameter base(Parameter row) {
  row.median = (Model().*section.*number).value;
  return {std::move(row), [](Model& model) -> Setting& { return model.*section.*number; },
          [](const Model& model) -> const Setting& { return model.*section.*number; }};
}

BaseParameter of_law(BulkLaw law, int law_shape, BaseParameter row) {
  row.bulk_law = law;
  row.law_shape = law_shape;
  row.why_not = "belongs to law = \"" + name_of(law) + "\"; leave it out or choose that law";
  return row;
}

BaseParameter of_skin_law(SkinLaw law, const char* why_not, BaseParameter row) {
  row.skin_law = law;
  row.why_not = why_not;
  return row;
}

std::vector<BaseParameter> elastic_rows() {
  return {base<&Model::breast, &Breast::young_modulus_kpa>({.name = "breast.young_modulus_kpa",
                                                            .unit = "kPa",
                                                            .lower = 1e-3,
                                                            .upper = 1e4,
                                                            .spread = 0.7,
                                                            .one_sided = true,
                                                            .meaning = "Young's modulus of the breast"}),
          base<&Model::breast, &Breast::poisson_ratio>({.name = "breast.poisson_ratio",
                                                        .unit = "1",
                                                        .lower = 0,
                                                        .upper = 0.4999,
                                                        .spread = 0.05,
                                                        .one_sided = true,
                                                        .meaning = "Poisson's ratio of the breast, below 0.5"})};
}

/// Further numbers of the laws of the breast.
std::vector<BaseParameter> law_rows() {
  return {
      of_law(BulkLaw::mooney_rivlin, 1,
             base<&Model::breast, &Breast::mooney_share>(
                 {.name = "breast.mooney_share",
                  .unit = "1",
                  .lower = 0,
                  .upper = 1,
                  .spread = 0.3,
                  .one_sided = true,
                  .meaning = "share of C01 in C10 + C01 of the mooney_rivlin law"})),
      of_law(BulkLaw::yeoh, 1,
             base<&Model::breast, &Breast::yeoh_c2_ratio>({.name = "breast.yeoh_c2_ratio",
                                                           .unit = "1",
                                                           .lower = 0,
                                                           .upper = 100,
                                                           .spread = 0.7,
                                                           .one_sided = true,
                                                           .meaning = "C2/C1 of the yeoh law"})),
      of_law(BulkLaw::yeoh, 2,
             base<&Model::breast, &Breast::yeoh_c3_ratio>({.name = "breast.yeoh_c3_ratio",
                                                           .unit = "1",
                                                           .lower = 0,
                                                           .upper = 100,
                                                           .spread = 0.7,
                                                           .one_sided = true,
                                                           .meaning = "C3/C1 of the yeoh law"})),
      of_law(BulkLaw::gent, 1,
             base<&Model::breast, &Breast::gent_limit>({.name = "breast.gent_limit",
                                                        .unit = "1",
                                                        .lower = 0.1,
                                                        .upper = 1000,
                                                        .spread = 0.7,
                                                        .one_sided = true,
                                                        .meaning = "Jm of the gent law: limit of I1 - 3 - 2 ln J"}))};
}

std::vector<BaseParameter> density_rows() {
  return {base<&Model::breast, &Breast::density_kg_m3>({.name = "breast.density_kg_m3",
                                                        .unit = "kg/m3",
                                                        .lower = 100,
                                                        .upper = 5000,
                                                        .spread = 0.05,
                                                        .one_sided = true,
                                                        .meaning = "density of the breast"})};
}

std::vector<BaseParameter> skin_rows() {
  return {
      base<&Model::skin, &Skin::young_modulus_kpa>({.name = "skin.young_modulus_kpa",
                                                    .unit = "kPa",
                                                    .lower = 0,
                                                    .upper = 1e6,
                                                    .spread = 0.8,
                                                    .one_sided = true,
                                                    .meaning = "Young's modulus of the skin; 0 = no skin membrane"}),
      base<&Model::skin, &Skin::thickness_mm>({.name = "skin.thickness_mm",
                                               .unit = "mm",
                                               .lower = 0.05,
                                               .upper = 10,
                                               .spread = 0.3,
                                               .one_sided = true,
                                               .meaning = "thickness of the skin"}),
      base<&Model::skin, &Skin::compression_share>(
          {.name = "skin.compression_share",
           .unit = "1",
           .lower = 0,
           .upper = 1,
           .spread = 0.5,
           .one_sided = true,
           .meaning = "share of the full energy kept where the skin wrinkles"}),
      of_skin_law(SkinLaw::corotational,
                  "the neo_hookean skin is incompressible and has none; leave it out or use law = \"corotational\"",
                  base<&Model::skin, &Skin::poisson_ratio>({.name = "skin.poisson_ratio",
                                                            .unit = "1",
                                                            .lower = 0,
                                                            .upper = 0.4999,
                                                            .spread = 0.05,
                                                            .one_sided = true,
                                                            .meaning = "Poisson's ratio of the corotational skin"}))};
}

std::vector<BaseParameter> interface_rows() {
  return {base<&Model::interface, &Interface::normal_kpa_per_mm>({.name = "interface.normal_kpa_per_mm",
                                                                  .unit = "kPa/mm",
                                                                  .lower = 1e-6,
                                                                  .upper = 1e6,
                                                                  .spread = 1,
                                                                  .one_sided = true,
                                                                  .meaning = "stiffness against leaving the muscle"}),
          base<&Model::interface, &Interface::tangential_kpa_per_mm>({.name = "interface.tangential_kpa_per_mm",
                                                                      .unit = "kPa/mm",
                                                                      .lower = 1e-9,
                                                                      .upper = 1e6,
                                                                      .spread = 1,
                                                                      .one_sided = true,
                                                                      .meaning = "stiffness against sliding, > 0"})};
}

std::vector<BaseParameter> cut_rows() {
  return {base<&Model::cut, &Cut::stiffness_kpa_per_mm>({.name = "cut.stiffness_kpa_per_mm",
                                                         .unit = "kPa/mm",
                                                         .lower = 1e-6,
                                                         .upper = 1e6,
                                                         .spread = 1,
                                                         .one_sided = true,
                                                         .meaning = "stiffness of the body behind the cut"})};
}

std::vector<BaseParameter> all_rows() {
  std::vector<BaseParameter> all;
  for (const auto& rows : {elastic_rows(), law_rows(), density_rows(), skin_rows(), interface_rows(), cut_rows()})
    all.insert(all.end(), rows.begin(), rows.end());
  return all;
}

}  // namespace

const std::vector<BaseParameter>& base_parameters() {
  static const std::vector<BaseParameter> rows = all_rows();
  return rows;
}

}  // namespace supine::simulation
