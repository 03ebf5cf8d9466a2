// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Time of the terms of tissue and of fibres per element: residual, with ∂r/∂x, and with ∂r/∂X; one thread, median
// processor time of 15 passes.
//
//   OMP_NUM_THREADS=1 bench_bulk_kernel

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <iostream>

#include "simulation/terms/bulk.h"
#include "simulation/terms/fibres.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace {

using namespace supine;
using namespace supine::simulation;

template <class Work>
double median_seconds(const Work& work) {
  std::vector<double> times;
  for (int pass = 0; pass < 15; ++pass) {
    const std::clock_t start = std::clock();  // processor time: other work on the machine counts less
    work();
    times.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  std::nth_element(times.begin(), times.begin() + 7, times.end());
  return times[7];
}

/// @param stretch  of the shape along the muscle's normal, beside what is random: fibres pull where it is over 1
void measure(const Term& term, const testing::TestScene& scene, const Pattern& pattern, const std::string& what,
             double stretch) {
  const Points& X = scene.mesh.points;
  Points x = X + 0.05 * testing::random_matrix(static_cast<int>(X.rows()), 3, 1);
  x.col(2) *= stretch;
  Sums sums(pattern);
  std::cout << what;
  for (const Demand& demand :
       {Demand{.energy = true, .residual = true}, Demand{.energy = true, .residual = true, .tangent = true},
        Demand{.residual = true, .reference_tangent = true}}) {
    const double seconds = median_seconds([&] {
      sums.clear(demand);
      term.add({x, X}, demand, sums);
    });
    std::cout << fmt::format(" {:.0f} |", 1e9 * seconds / static_cast<double>(scene.mesh.cells.rows()));
  }
  std::cout << std::endl;
}

template <class Element>
void measure_bulk(const testing::TestScene& scene, BulkLaw law, double poisson) {
  const auto cells = scene.mesh.cells.rows();
  const Pattern pattern(scene.mesh.cells, scene.mesh.points.rows());
  BulkTerm<Element> term(std::make_shared<const Elements>(scene.mesh.cells, pattern), BulkSettings{law});
  Fields<double> fields;
  fields.ln_young = fields.stiffening = fields.law_shape_1 = fields.law_shape_2 = Eigen::VectorXd::Zero(cells);
  if (law == BulkLaw::mooney_rivlin || law == BulkLaw::gent) fields.law_shape_1.setConstant(0.7);
  fields.poisson = Eigen::VectorXd::Constant(cells, poisson);
  term.set_fields(fields);
  measure(term, scene, pattern, fmt::format("| {} | {} | {} |", Element::nodes, name_of(law), poisson), 1);
}

template <class Element>
void measure_fibres(const testing::TestScene& scene) {
  const Pattern pattern(scene.mesh.cells, scene.mesh.points.rows());
  FibreTerm<Element> term(std::make_shared<const Elements>(scene.mesh.cells, pattern), scene.anatomy.muscle);
  Fields<double> fields;
  fields.fibre_modulus = Eigen::VectorXd::Ones(scene.mesh.cells.rows());
  term.set_fields(fields);
  measure(term, scene, pattern, fmt::format("| {} | fibres | |", Element::nodes), 1.2);
}

}  // namespace

int main() {
  testing::TestScene linear = testing::box_scene(8, {80, 80, 80}), quadratic = linear;
  quadratic.mesh = testing::quadratic(linear.mesh);
  std::cout << "| nodes | law | ν | residual ns | with tangent ns | with reference tangent ns |\n";
  for (const auto& [name, law] : bulk_law_names()) {
    measure_bulk<Tet4>(linear, law, 0.45);
    if (law != BulkLaw::corotational_qr) measure_bulk<Tet10>(quadratic, law, 0.45);
  }
  for (const BulkLaw law : {BulkLaw::neo_hookean, BulkLaw::corotational}) measure_bulk<Tet10>(quadratic, law, 0.499);
  measure_fibres<Tet4>(linear);
  measure_fibres<Tet10>(quadratic);
}
