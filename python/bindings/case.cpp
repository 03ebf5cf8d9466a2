// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/case.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/bindings/arrays.h"
#include "python/bindings/objects.h"

namespace supine::python {

namespace py = pybind11;
using pipeline::Case;
using pipeline::Pose;

namespace {

py::list pose_names(const Case& description) {
  py::list names;
  for (const Pose& pose : description.poses) names.append(pose.name);
  return names;
}

}  // namespace

void bind_case(py::module_& module) {
  py::class_<Case>(module, "Case",
                   "What was measured of a patient: a folder with case.toml.\n\n"
                   "Coordinates are mm, patient LPS, whatever frame the file names.")
      .def(py::init([](const std::filesystem::path& folder) { return pipeline::read_case(folder); }), py::arg("folder"),
           "Reads and checks FOLDER/case.toml.")
      .def_readonly("folder", &Case::folder)
      .def_readonly("name", &Case::name)
      .def_readonly("body", &Case::body, "breast or object")
      .def_readonly("side", &Case::side, "left, right or both; empty of an object")
      .def_readonly("imaged_pose", &Case::imaged_pose, "The pose that was imaged; undeformed: free of load.")
      .def_readonly("calibrated_poses", &Case::calibrated_poses, "The poses that a calibration fits.")
      .def_property_readonly("poses", &pose_names, "Names, the imaged one first.")
      .def(
          "gravity", [](const Case& c, const std::string& pose) { return copy_of(c.pose(pose).gravity); },
          py::arg("pose"), "The way things fall in a pose: unit vector of 3, LPS.")
      .def(
          "surface", [](const Case& c, const std::string& pose) { return c.pose(pose).surface; }, py::arg("pose"),
          "File of the surface measured in a pose, or None.")
      .def("__repr__", [](const Case& c) { return "<supine.Case " + c.name + " in " + c.folder.string() + ">"; });
}

}  // namespace supine::python
