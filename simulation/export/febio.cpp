// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/export/febio.h"

#include <fmt/ostream.h>

namespace supine::simulation {
namespace {

// Of the skin's tetrahedra: the membrane is right to about 1 - 2ν.
constexpr double skin_poisson = 0.4999;

// The springs' own ground nodes stand this far off, so that no spring ever turns over.
constexpr double ground_mm = 1e4;

void write_head(std::ostream& out) {
  fmt::print(out, "{}", R"(<?xml version="1.0" encoding="UTF-8"?>
<febio_spec version="4.0">
  <Module type="solid"/>
  <Control>
    <analysis>STATIC</analysis>
    <time_steps>4</time_steps>
    <step_size>0.25</step_size>
    <solver type="solid">
      <symmetric_stiffness>symmetric</symmetric_stiffness>
      <dtol>1e-6</dtol>
      <etol>1e-8</etol>
      <rtol>1e-8</rtol>
      <max_refs>50</max_refs>
    </solver>
    <time_stepper type="default">
      <max_retries>20</max_retries>
      <opt_iter>15</opt_iter>
      <dtmin>0.001</dtmin>
      <dtmax>0.25</dtmax>
    </time_stepper>
  </Control>
)");
}

std::string tissue(std::size_t m) { return fmt::format("tissue{}", m + 1); }

void write_materials(std::ostream& out, const ExportedPose& pose) {
  const auto write = [&out](std::size_t id, const std::string& name, double young_kpa, double poisson) {
    fmt::print(out,
               "    <material id=\"{}\" name=\"{}\" type=\"neo-Hookean\"><density>1</density><E>{:.14g}</E>"
               "<v>{:.14g}</v></material>\n",
               id, name, young_kpa, poisson);
  };
  fmt::print(out, "  <Material>\n");
  for (std::size_t m = 0; m < pose.materials.size(); ++m)
    write(m + 1, tissue(m), pose.materials[m].young_kpa, pose.materials[m].poisson);
  // The membrane's shear modulus is E/3, that of the nearly incompressible tetrahedron E/2(1 + ν).
  if (pose.skin.rows() > 0)
    write(pose.materials.size() + 1, "skin", pose.skin_material.young_kpa * 2 * (1 + skin_poisson) / 3, skin_poisson);
  fmt::print(out, "  </Material>\n");
}

template <class Cells>
void write_elements(std::ostream& out, const std::string& name, const Indices& cells, const Cells& chosen,
                    Eigen::Index& id) {
  fmt::print(out, "    <Elements type=\"tet4\" name=\"{}\">\n", name);
  for (const int c : chosen)
    fmt::print(out, "      <elem id=\"{}\">{},{},{},{}</elem>\n", ++id, cells(c, 0) + 1, cells(c, 1) + 1,
               cells(c, 2) + 1, cells(c, 3) + 1);
  fmt::print(out, "    </Elements>\n");
}

void write_nodes(std::ostream& out, const ExportedPose& pose) {
  fmt::print(out, "    <Nodes name=\"all\">\n");
  auto node = [&out, id = 0](double x, double y, double z) mutable {
    fmt::print(out, "      <node id=\"{}\">{:.14e},{:.14e},{:.14e}</node>\n", ++id, x, y, z);
  };
  for (Eigen::Index n = 0; n < pose.X.rows(); ++n) node(pose.X(n, 0), pose.X(n, 1), pose.X(n, 2));
  for (std::size_t s = 0; s < pose.springs.size(); ++s) node(0, 0, 0);
  node(-ground_mm, 0, 0);
  fmt::print(out, "    </Nodes>\n");
}

void write_node_set(std::ostream& out, const char* name, Eigen::Index first, Eigen::Index last) {
  fmt::print(out, "    <NodeSet name=\"{}\">{}", name, first);
  for (Eigen::Index n = first + 1; n <= last; ++n) fmt::print(out, ",{}", n);
  fmt::print(out, "</NodeSet>\n");
}

void write_mesh(std::ostream& out, const ExportedPose& pose) {
  fmt::print(out, "  <Mesh>\n");
  write_nodes(out, pose);
  std::vector<std::vector<int>> cells_of(pose.materials.size());
  for (int c = 0; c < pose.cells.rows(); ++c) cells_of[pose.material[c]].push_back(c);
  Eigen::Index id = 0;
  for (std::size_t m = 0; m < cells_of.size(); ++m) write_elements(out, tissue(m), pose.cells, cells_of[m], id);
  if (pose.skin.rows() > 0)
    write_elements(out, "skin", pose.skin, Eigen::VectorXi::LinSpaced(pose.skin.rows(), 0, pose.skin.rows() - 1), id);
  write_node_set(out, "breast", 1, pose.nodes);
  const auto springs = static_cast<Eigen::Index>(pose.springs.size()), first = pose.X.rows() + 1;
  if (springs > 0) {
    write_node_set(out, "spring_nodes", first, first + springs - 1);
    write_node_set(out, "ground", first + springs, first + springs);
    for (Eigen::Index s = 0; s < springs; ++s)
      fmt::print(out, "{}      <delem>{},{}</delem>\n", s == 0 ? "    <DiscreteSet name=\"springs\">\n" : "", first + s,
                 first + springs);
    fmt::print(out, "    </DiscreteSet>\n");
  }
  if (!pose.held.empty()) {
    fmt::print(out, "    <NodeSet name=\"held\">");
    for (std::size_t h = 0; h < pose.held.size(); ++h) fmt::print(out, "{}{}", h > 0 ? "," : "", pose.held[h] + 1);
    fmt::print(out, "</NodeSet>\n");
  }
  fmt::print(out, "  </Mesh>\n  <MeshDomains>\n");
  for (std::size_t m = 0; m < pose.materials.size(); ++m)
    fmt::print(out, "    <SolidDomain name=\"{0}\" mat=\"{0}\"/>\n", tissue(m));
  if (pose.skin.rows() > 0) fmt::print(out, "    <SolidDomain name=\"skin\" mat=\"skin\"/>\n");
  fmt::print(out, "  </MeshDomains>\n");
}

void write_zero(std::ostream& out, const char* set, const char* axes) {
  fmt::print(out, "    <bc name=\"{0}\" type=\"zero displacement\" node_set=\"{0}\">", set);
  for (const char axis : {'x', 'y', 'z'})
    fmt::print(out, "<{0}_dof>{1}</{0}_dof>", axis, std::string(axes).find(axis) != std::string::npos ? 1 : 0);
  fmt::print(out, "</bc>\n");
}

/// x of the spring's node is √k d·u, bound by a linear constraint; springs of unit stiffness to one ground node then
/// serve all.
void write_boundary(std::ostream& out, const ExportedPose& pose) {
  fmt::print(out, "  <Boundary>\n");
  if (!pose.held.empty()) write_zero(out, "held", "xyz");
  if (!pose.springs.empty()) {
    write_zero(out, "spring_nodes", "yz");
    write_zero(out, "ground", "xyz");
  }
  for (std::size_t s = 0; s < pose.springs.size(); ++s) {
    const FaceSpring& spring = pose.springs[s];
    fmt::print(out, "    <bc type=\"linear constraint\"><node>{}</node><dof>x</dof>", pose.X.rows() + s + 1);
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < 3; ++k)
        if (const double factor = std::sqrt(spring.stiffness) * spring.weight[a] * spring.direction[k]; factor != 0)
          fmt::print(out, "<child_dof><node>{}</node><dof>{}</dof><value>{:.14e}</value></child_dof>",
                     spring.nodes[a] + 1, "xyz"[k], factor);
    fmt::print(out, "</bc>\n");
  }
  fmt::print(out, "  </Boundary>\n");
}

void write_loads(std::ostream& out) {
  fmt::print(out, "{}", R"(  <Loads>
    <nodal_load name="weight" type="nodal_force" node_set="breast"><value lc="1" type="map">force</value></nodal_load>
  </Loads>
)");
}

void write_force_map(std::ostream& out, const ExportedPose& pose) {
  const Points force = force_with_springs_at_rest(pose);
  fmt::print(out, "  <MeshData>\n    <NodeData name=\"force\" node_set=\"breast\" data_type=\"vec3\">\n");
  for (int n = 0; n < pose.nodes; ++n)
    fmt::print(out, "      <node lid=\"{}\">{:.14e},{:.14e},{:.14e}</node>\n", n + 1, force(n, 0), force(n, 1),
               force(n, 2));
  fmt::print(out, "    </NodeData>\n  </MeshData>\n");
}

void write_tail(std::ostream& out, const ExportedPose& pose) {
  if (!pose.springs.empty())
    fmt::print(out, "{}", R"(  <Discrete>
    <discrete_material id="1" name="unit" type="linear spring"><E>1</E></discrete_material>
    <discrete dmat="1" discrete_set="springs"/>
  </Discrete>
)");
  fmt::print(out, R"(  <LoadData>
    <load_controller id="1" name="ramp" type="loadcurve">
      <interpolate>LINEAR</interpolate>
      <points><pt>0,0</pt><pt>1,1</pt></points>
    </load_controller>
  </LoadData>
  <Output>
    <plotfile type="febio"><var type="displacement"/></plotfile>
    <logfile><node_data data="ux;uy;uz" delim="," file="{}_febio_u.csv" node_set="breast"/></logfile>
  </Output>
</febio_spec>
)",
             pose.name);
}

}  // namespace

void write_febio(std::ostream& out, const ExportedPose& pose) {
  write_head(out);
  write_materials(out, pose);
  write_mesh(out, pose);
  write_force_map(out, pose);
  write_boundary(out, pose);
  write_loads(out);
  write_tail(out, pose);
}

}  // namespace supine::simulation
