// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/export/sofa.h"

#include <fmt/ostream.h>

namespace supine::simulation {
namespace {

// SOFA's springs turn with their ends: anchors this far off keep the direction to 1e-4 rad over 10 mm.
constexpr double anchor_mm = 1e5;

constexpr double skin_poisson = 0.4999;  // of the neo-Hookean skin's tetrahedra

struct Lame {
  double mu_kpa, lambda_kpa;
};

Lame lame(double young_kpa, double nu) {
  return {young_kpa / (2 * (1 + nu)), young_kpa * nu / ((1 + nu) * (1 - 2 * nu))};
}

void write_head(std::ostream& out, const ExportedPose& pose) {
  fmt::print(out, R"(<?xml version="1.0"?>
<!-- {}: from the undeformed shape, mm kg s (mN, kPa); runSofa -g batch -n 1 FILE -->
<Node name="root" gravity="0 0 0" dt="1">
)",
             pose.name);
  for (const char* plugin : {"Constraint.Projective", "LinearSolver.Direct", "Mapping.Linear", "MechanicalLoad",
                             "ODESolver.Backward", "SolidMechanics.FEM.Elastic", "SolidMechanics.FEM.HyperElastic",
                             "SolidMechanics.Spring", "StateContainer", "Topology.Container.Dynamic", "IO.Mesh"})
    fmt::print(out, "  <RequiredPlugin name=\"Sofa.Component.{}\"/>\n", plugin);
  fmt::print(out, "  <DefaultAnimationLoop/>\n");
}

void write_points(std::ostream& out, const Points& points) {
  for (Eigen::Index n = 0; n < points.rows(); ++n)
    fmt::print(out, "{:.14g} {:.14g} {:.14g} ", points(n, 0), points(n, 1), points(n, 2));
}

void write_topology(std::ostream& out, const Indices& cells, const char* name) {
  fmt::print(out,
             "<TetrahedronSetTopologyContainer name=\"{}\" position=\"@/breast/nodes.rest_position\" tetrahedra=\"",
             name);
  for (Eigen::Index c = 0; c < cells.rows(); ++c)
    fmt::print(out, "{} {} {} {} ", cells(c, 0), cells(c, 1), cells(c, 2), cells(c, 3));
  fmt::print(out, "\"/>\n");
}

void write_neo_hookean(std::ostream& out, const Lame& material) {
  fmt::print(out,
             "      <TetrahedronHyperelasticityFEMForceField topology=\"@cells\" materialName=\"NeoHookean\" "
             "ParameterSet=\"{:.14g} {:.14g}\"/>\n",
             material.mu_kpa, material.lambda_kpa);
}

void write_bulk(std::ostream& out, const ExportedPose& pose) {
  fmt::print(out, "    <Node name=\"tissue\">\n      ");
  write_topology(out, pose.cells, "cells");
  if (pose.law == BulkLaw::neo_hookean) {
    write_neo_hookean(out, lame(pose.materials[0].young_kpa, pose.materials[0].poisson));
  } else {
    fmt::print(out,
               "      <TetrahedronFEMForceField topology=\"@cells\" method=\"{}\" poissonRatio=\"{:.14g}\" "
               "youngModulus=\"",
               pose.law == BulkLaw::corotational ? "svd" : "large", pose.materials[0].poisson);
    for (Eigen::Index c = 0; c < pose.cells.rows(); ++c)
      fmt::print(out, "{:.14g} ", pose.materials[pose.material[c]].young_kpa);
    fmt::print(out, "\"/>\n");
  }
  fmt::print(out, "    </Node>\n");
}

void write_skin(std::ostream& out, const ExportedPose& pose) {
  if (pose.skin.rows() == 0) return;
  fmt::print(out, "    <Node name=\"skin\">\n      ");
  write_topology(out, pose.skin, "cells");
  const auto [young, nu] = pose.skin_material;
  if (pose.skin_law == SkinLaw::neo_hookean) {
    write_neo_hookean(out, lame(young * 2 * (1 + skin_poisson) / 3, skin_poisson));
  } else {
    fmt::print(out,
               "      <TetrahedronFEMForceField topology=\"@cells\" method=\"svd\" poissonRatio=\"{:.14g}\" "
               "youngModulus=\"{:.14g}\"/>\n",
               nu, young);
  }
  fmt::print(out, "    </Node>\n");
}

Points spring_points(const ExportedPose& pose) {
  Points points = Points::Zero(static_cast<Eigen::Index>(pose.springs.size()), 3);
  for (std::size_t s = 0; s < pose.springs.size(); ++s)
    for (int a = 0; a < 3; ++a)
      points.row(static_cast<Eigen::Index>(s)) += pose.springs[s].weight[a] * pose.X.row(pose.springs[s].nodes[a]);
  return points;
}

void write_springs(std::ostream& out, const ExportedPose& pose, const Points& points) {
  if (pose.springs.empty()) return;
  fmt::print(out, "    <Node name=\"springs\">\n      <MechanicalObject name=\"points\" position=\"");
  write_points(out, points);
  fmt::print(out,
             "\"/>\n      <BarycentricMapping input=\"@/breast/nodes\" output=\"@points\" "
             "topology=\"@/breast/tissue/cells\"/>\n"
             "      <SpringForceField object1=\"@/anchors/nodes\" object2=\"@points\" spring=\"");
  for (std::size_t s = 0; s < pose.springs.size(); ++s)
    fmt::print(out, "{0} {0} {1:.14g} 0 {2:.14g} ", s, pose.springs[s].stiffness, anchor_mm + pose.springs[s].rest_mm);
  fmt::print(out, "\"/>\n    </Node>\n");
}

void write_anchors(std::ostream& out, const ExportedPose& pose, Points points) {
  if (pose.springs.empty()) return;
  for (std::size_t s = 0; s < pose.springs.size(); ++s)
    points.row(static_cast<Eigen::Index>(s)) -= anchor_mm * pose.springs[s].direction.transpose();
  fmt::print(out, "  <Node name=\"anchors\">\n    <MechanicalObject name=\"nodes\" position=\"");
  write_points(out, points);
  fmt::print(out, "\"/>\n    <FixedProjectiveConstraint fixAll=\"1\"/>\n  </Node>\n");
}

void write_loads(std::ostream& out, const ExportedPose& pose) {
  fmt::print(out, "    <ConstantForceField indices=\"");
  for (int n = 0; n < pose.nodes; ++n) fmt::print(out, "{} ", n);
  fmt::print(out, "\" forces=\"");
  write_points(out, pose.force);
  fmt::print(out, "\"/>\n");
  if (pose.held.empty()) return;
  fmt::print(out, "    <FixedProjectiveConstraint indices=\"");
  for (const int n : pose.held) fmt::print(out, "{} ", n);
  fmt::print(out, "\"/>\n");
}

}  // namespace

void write_sofa(std::ostream& out, const ExportedPose& pose) {
  const Points points = spring_points(pose);
  write_head(out, pose);
  write_anchors(out, pose, points);
  fmt::print(out, R"(  <Node name="breast">
    <NewtonRaphsonSolver name="newton" maxNbIterationsNewton="200" relativeSuccessiveStoppingThreshold="0"
      absoluteResidualStoppingThreshold="1e-9" relativeInitialStoppingThreshold="1e-8" maxNbIterationsLineSearch="20"/>
    <StaticSolver newtonSolver="@newton"/>
    <SparseLDLSolver template="CompressedRowSparseMatrixMat3x3d"/>
    <MechanicalObject name="nodes" position=")");
  write_points(out, pose.X);
  fmt::print(out, "\"/>\n");
  write_loads(out, pose);
  write_bulk(out, pose);
  write_skin(out, pose);
  write_springs(out, pose, points);
  fmt::print(out, "    <WriteState filename=\"{}_sofa\" writeX=\"1\" time=\"1\"/>\n  </Node>\n</Node>\n", pose.name);
}

}  // namespace supine::simulation
