// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/export/calculix.h"

#include <fmt/ostream.h>

namespace supine::simulation {
namespace {

// Bulk over shear modulus of the skin's tetrahedra: the membrane is right to about the inverse of it.
constexpr double skin_bulk_over_shear = 1000;

void write_nodes(std::ostream& out, const ExportedPose& pose) {
  fmt::print(out, "*NODE,NSET=ALLNODES\n");
  for (Eigen::Index n = 0; n < pose.X.rows(); ++n)
    fmt::print(out, "{},{:.12e},{:.12e},{:.12e}\n", n + 1, pose.X(n, 0), pose.X(n, 1), pose.X(n, 2));
  // Places of the springs' own nodes mean nothing: their first degree of freedom is a length along a direction.
  for (std::size_t s = 0; s < pose.springs.size(); ++s) fmt::print(out, "{},0.,0.,0.\n", pose.X.rows() + s + 1);
  fmt::print(out, "*NSET,NSET=BREAST,GENERATE\n1,{}\n", pose.nodes);
}

void write_tetrahedron(std::ostream& out, Eigen::Index id, const Eigen::RowVector4i& cell) {
  fmt::print(out, "{},{},{},{},{}\n", id, cell[0] + 1, cell[1] + 1, cell[2] + 1, cell[3] + 1);
}

void write_neo_hookean(std::ostream& out, const std::string& set, double mu_kpa, double bulk_kpa) {
  fmt::print(out,
             "*MATERIAL,NAME={0}\n*HYPERELASTIC,NEO HOOKE\n{1:.12e},{2:.12e}\n*SOLID SECTION,ELSET={0},MATERIAL={0}\n",
             set, mu_kpa / 2, 2 / bulk_kpa);
}

Eigen::Index write_bulk(std::ostream& out, const ExportedPose& pose) {
  Eigen::Index id = 0;
  std::vector<std::vector<int>> cells_of(pose.materials.size());
  for (int c = 0; c < pose.cells.rows(); ++c) cells_of[pose.material[c]].push_back(c);
  for (std::size_t m = 0; m < cells_of.size(); ++m) {
    fmt::print(out, "*ELEMENT,TYPE=C3D4,ELSET=TISSUE{}\n", m + 1);
    for (const int c : cells_of[m]) write_tetrahedron(out, ++id, pose.cells.row(c));
    const auto [young, nu] = pose.materials[m];
    write_neo_hookean(out, fmt::format("TISSUE{}", m + 1), young / (2 * (1 + nu)), young / (3 * (1 - 2 * nu)));
  }
  return id;
}

Eigen::Index write_skin(std::ostream& out, const ExportedPose& pose, Eigen::Index id) {
  if (pose.skin.rows() == 0) return id;
  fmt::print(out, "** the skin: plane stress by an apex of each triangle's own\n*ELEMENT,TYPE=C3D4,ELSET=SKIN\n");
  for (Eigen::Index f = 0; f < pose.skin.rows(); ++f) write_tetrahedron(out, ++id, pose.skin.row(f));
  const double mu_kpa = pose.skin_material.young_kpa / 3;
  write_neo_hookean(out, "SKIN", mu_kpa, skin_bulk_over_shear * mu_kpa);
  return id;
}

/// Degree 1 of the spring's node is √k d·u, bound by an equation; one spring of unit stiffness then serves all.
void write_springs(std::ostream& out, const ExportedPose& pose, Eigen::Index id) {
  if (pose.springs.empty()) return;
  fmt::print(out, "** springs on muscle and cut\n");
  for (std::size_t s = 0; s < pose.springs.size(); ++s) {
    const FaceSpring& spring = pose.springs[s];
    const double root = std::sqrt(spring.stiffness);
    std::string terms;
    int count = 1;
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < 3; ++k) {
        const double factor = -root * spring.weight[a] * spring.direction[k];
        if (factor == 0) continue;
        if (count % 4 == 0) terms += "\n";
        terms += fmt::format("{},{},{:.12e},", spring.nodes[a] + 1, k + 1, factor);
        ++count;
      }
    fmt::print(out, "*EQUATION\n{}\n{},1,1.,{}\n", count, pose.X.rows() + s + 1, terms);
  }
  fmt::print(out, "*ELEMENT,TYPE=SPRING1,ELSET=SPRINGS\n");
  for (std::size_t s = 0; s < pose.springs.size(); ++s)
    fmt::print(out, "{},{}\n", id + static_cast<Eigen::Index>(s) + 1, pose.X.rows() + s + 1);
  fmt::print(out, "*SPRING,ELSET=SPRINGS\n1\n1.\n*NSET,NSET=SPRINGNODES,GENERATE\n{},{}\n*BOUNDARY\nSPRINGNODES,2,3\n",
             pose.X.rows() + 1, pose.X.rows() + static_cast<Eigen::Index>(pose.springs.size()));
}

void write_forces(std::ostream& out, const ExportedPose& pose) {
  const Points force = force_with_springs_at_rest(pose);
  fmt::print(out, "*CLOAD\n");
  for (int n = 0; n < pose.nodes; ++n)
    for (int k = 0; k < 3; ++k)
      if (force(n, k) != 0) fmt::print(out, "{},{},{:.12e}\n", n + 1, k + 1, force(n, k));
}

}  // namespace

void write_calculix(std::ostream& out, const ExportedPose& pose) {
  fmt::print(out, "** {}: from the undeformed shape, mm kg s (mN, kPa); run: ccx FILE without .inp\n", pose.name);
  write_nodes(out, pose);
  write_springs(out, pose, write_skin(out, pose, write_bulk(out, pose)));
  if (!pose.held.empty()) {
    fmt::print(out, "*BOUNDARY\n");
    for (const int n : pose.held) fmt::print(out, "{},1,3\n", n + 1);
  }
  fmt::print(out, "*STEP,NLGEOM,INC=1000\n*STATIC\n0.25,1.,1e-6,1.\n");
  fmt::print(out, "*CONTROLS,PARAMETERS=FIELD\n1e-7,1e-6\n");
  write_forces(out, pose);
  fmt::print(out, "*NODE PRINT,NSET=BREAST,FREQUENCY=1000\nU\n*NODE FILE,FREQUENCY=1000\nU\n*END STEP\n");
}

}  // namespace supine::simulation
