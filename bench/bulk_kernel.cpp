// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Time of the tissue's term per element: residual, with ∂r/∂x, and with ∂r/∂X; one thread, median processor time
// of 15 passes.
//
//   OMP_NUM_THREADS=1 bench_bulk_kernel

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <iostream>

#include "simulation/terms/bulk.h"
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

template <class Element>
void measure(const testing::TestScene& scene, BulkLaw law, double poisson) {
  const auto cells = scene.mesh.cells.rows();
  const Pattern pattern(scene.mesh.cells, scene.mesh.points.rows());
  BulkTerm<Element> term(std::make_shared<const Elements>(scene.mesh.cells, pattern), BulkSettings{law});
  Fields<double> fields;
  fields.ln_young = fields.stiffening = fields.law_shape_1 = fields.law_shape_2 = Eigen::VectorXd::Zero(cells);
  if (law == BulkLaw::mooney_rivlin || law == BulkLaw::gent) fields.law_shape_1.setConstant(0.7);
  fields.poisson = Eigen::VectorXd::Constant(cells, poisson);
  term.set_fields(fields);
  const Points& X = scene.mesh.points;
  const Points x = X + 0.05 * testing::random_matrix(static_cast<int>(X.rows()), 3, 1);
  Sums sums(pattern);
  std::cout << fmt::format("| {} | {} | {} |", Element::nodes, name_of(law), poisson);
  for (const Demand& demand :
       {Demand{.energy = true, .residual = true}, Demand{.energy = true, .residual = true, .tangent = true},
        Demand{.residual = true, .reference_tangent = true}}) {
    const double seconds = median_seconds([&] {
      sums.clear(demand);
      term.add({x, X}, demand, sums);
    });
    std::cout << fmt::format(" {:.0f} |", 1e9 * seconds / static_cast<double>(cells));
  }
  std::cout << std::endl;
}

}  // namespace

int main() {
  testing::TestScene linear = testing::box_scene(8, {80, 80, 80}), quadratic = linear;
  quadratic.mesh = testing::quadratic(linear.mesh);
  std::cout << "| nodes | law | ν | residual ns | with tangent ns | with reference tangent ns |\n";
  for (const auto& [name, law] : bulk_law_names()) {
    measure<Tet4>(linear, law, 0.45);
    if (law != BulkLaw::corotational_qr) measure<Tet10>(quadratic, law, 0.45);
  }
  for (const BulkLaw law : {BulkLaw::neo_hookean, BulkLaw::corotational}) measure<Tet10>(quadratic, law, 0.499);
}
