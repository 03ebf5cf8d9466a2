// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "meshing/imaged_mesh.h"
#include "python/bindings/arrays.h"
#include "python/bindings/objects.h"

namespace supine::python {

namespace py = pybind11;

namespace {

std::unique_ptr<Mesh> read(const std::filesystem::path& file, const pipeline::Case& description) {
  const py::gil_scoped_release free;
  auto mesh = std::make_unique<Mesh>();
  mesh->file = file;
  mesh->mesh = meshing::read_imaged_mesh(file, description.side);
  mesh->anatomy = meshing::compute_anatomy(mesh->mesh, description.side, description.imaged_pose);
  return mesh;
}

py::dict fractions(const py::object& self) {
  const auto& mesh = self.cast<const Mesh&>().mesh;
  py::dict by_tissue;
  for (int tissue = 0; tissue < segmentation::tissue_count; ++tissue)
    if (mesh.fraction.col(tissue).sum() > 0)
      by_tissue[py::str(std::string(segmentation::tissue_names[tissue]))] =
          copy_of(Eigen::VectorXd(mesh.fraction.col(tissue)));
  return by_tissue;
}

/// Of one breast a number, of two by side, of an object None.
py::object nipple(const Mesh& mesh) {
  if (mesh.anatomy.breasts.empty())
    return mesh.anatomy.nipple_point < 0 ? py::none() : py::object(py::int_(mesh.anatomy.nipple_point));
  py::dict by_side;
  for (const meshing::Anatomy& one : mesh.anatomy.breasts) by_side[py::str(one.side)] = one.nipple_point;
  return by_side;
}

template <class Member>
auto view_as(Member member) {
  return [member](const py::object& self) { return view_of(self.cast<const Mesh&>().mesh.*member, self); };
}

}  // namespace

void bind_mesh(py::module_& module) {
  using meshing::TetMesh;
  py::class_<Mesh>(module, "Mesh",
                   "The imaged (prone) mesh of a case: all but the muscle, in mm. Arrays are views and cannot be "
                   "written.")
      .def(py::init(&read), py::arg("file"), py::arg("case"),
           "Reads a mesh.vtu of supine-tetrahedralise and finds the anatomy of the case in it.")
      .def_readonly("file", &Mesh::file)
      .def_property_readonly("points", view_as(&TetMesh::points), "N by 3, mm: the nodes as imaged.")
      .def_property_readonly("cells", view_as(&TetMesh::cells), "C by 4 or 10: rows of points, in the order of VTK.")
      .def_property_readonly("tissue", view_as(&TetMesh::tissue), "C: the tissue with the largest share of a cell.")
      .def_property_readonly("fractions", &fractions, "By tissue: its share of every cell, C.")
      .def_property_readonly("faces", view_as(&TetMesh::faces), "F by 3 or 6: the boundary.")
      .def_property_readonly("region", view_as(&TetMesh::region), "F: inner 1, skin 2, ligament 3, cut 4.")
      .def_property_readonly("face_cell", view_as(&TetMesh::face_cell), "F: the cell of a face.")
      .def_property_readonly(
          "q", [](const py::object& self) { return view_of(self.cast<const Mesh&>().anatomy.q, self); },
          "N by 2: (lateral, head) from the centre of the breast's foot, in radii of the foot.")
      .def_property_readonly("nipple", &nipple, "Row of `points`; of two breasts by side; None of an object.")
      .def_property_readonly("order", [](const Mesh& m) { return m.mesh.order(); })
      .def(
          "area",
          [](const Mesh& m, Eigen::Index point) {
            if (point < 0 || point >= m.mesh.points.rows())
              throw InputError(fmt::format("point {}: the mesh has points 0 to {}", point, m.mesh.points.rows() - 1));
            return m.anatomy.area_name_of(point);
          },
          py::arg("point"), "Name of the area of a skin point: upper outer, nipple area, fold, …")
      .def("__repr__", [](const Mesh& m) {
        return fmt::format("<supine.Mesh {}: {} points, {} tetrahedra of order {}>", m.file.string(),
                           m.mesh.points.rows(), m.mesh.cells.rows(), m.mesh.order());
      });
}

}  // namespace supine::python
