// SPDX-License-Identifier: AGPL-3.0-or-later
// Decimation side by side: field-aligned quads, isotropic triangles, and plain quadric decimation (VTK, OpenMesh) at
// the same number of triangles. Distances both ways by dense sampling, CPU time of each method without its measuring.
#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkQuadricDecimation.h>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <cstdio>
#include <ctime>
#include <string>

#include "common/error.h"
#include "meshing/decimate/measure.h"
#include "meshing/decimate/methods.h"
#include "meshing/quads/quad_remesh.h"
#include "reconstruction/surface_io.h"

namespace {

using supine::meshing::DecimateMeasure;
using supine::meshing::DecimateResult;
using supine::reconstruction::Surface;

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

Surface vtk_quadrics(const Surface& in, int triangles) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (Eigen::Index p = 0; p < in.points.rows(); ++p) points->InsertNextPoint(in.points.row(p).data());
  vtkNew<vtkCellArray> cells;
  for (Eigen::Index t = 0; t < in.triangles.rows(); ++t) {
    const vtkIdType ids[3] = {in.triangles(t, 0), in.triangles(t, 1), in.triangles(t, 2)};
    cells->InsertNextCell(3, ids);
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(cells);
  vtkNew<vtkQuadricDecimation> filter;
  filter->SetInputData(data);
  filter->SetTargetReduction(1 - static_cast<double>(triangles) / static_cast<double>(in.triangles.rows()));
  filter->VolumePreservationOn();
  filter->Update();
  vtkPolyData* made = filter->GetOutput();
  Surface out;
  out.points.resize(made->GetNumberOfPoints(), 3);
  for (vtkIdType p = 0; p < made->GetNumberOfPoints(); ++p) made->GetPoint(p, out.points.row(p).data());
  out.triangles.resize(made->GetNumberOfCells(), 3);
  vtkNew<vtkIdList> ids;
  for (vtkIdType t = 0; t < made->GetNumberOfCells(); ++t) {
    made->GetCellPoints(t, ids);
    for (int c = 0; c < 3; ++c) out.triangles(t, c) = static_cast<int>(ids->GetId(c));
  }
  return out;
}

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::PrevHalfedge);
  FaceAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Normal);
};

Surface openmesh_quadrics(const Surface& in, int triangles) {
  using Mesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;
  Mesh mesh;
  for (Eigen::Index p = 0; p < in.points.rows(); ++p)
    mesh.add_vertex({in.points(p, 0), in.points(p, 1), in.points(p, 2)});
  for (Eigen::Index t = 0; t < in.triangles.rows(); ++t)
    mesh.add_face(OpenMesh::VertexHandle(in.triangles(t, 0)), OpenMesh::VertexHandle(in.triangles(t, 1)),
                  OpenMesh::VertexHandle(in.triangles(t, 2)));
  mesh.update_face_normals();
  OpenMesh::Decimater::DecimaterT<Mesh> decimater(mesh);
  OpenMesh::Decimater::ModQuadricT<Mesh>::Handle quadric;
  decimater.add(quadric);
  decimater.module(quadric).unset_max_err();
  decimater.initialize();
  decimater.decimate_to_faces(0, static_cast<std::size_t>(triangles));
  mesh.garbage_collection();
  Surface out;
  out.points.resize(static_cast<Eigen::Index>(mesh.n_vertices()), 3);
  for (const auto v : mesh.vertices())
    for (int c = 0; c < 3; ++c) out.points(v.idx(), c) = mesh.point(v)[c];
  out.triangles.resize(static_cast<Eigen::Index>(mesh.n_faces()), 3);
  for (const auto f : mesh.faces()) {
    int c = 0;
    for (const auto v : f.vertices()) out.triangles(f.idx(), c++) = v.idx();
  }
  return out;
}

void row(const std::string& name, const DecimateMeasure& measure, DecimateResult result, double seconds) {
  measure.places_too_far(1e9, result);
  measure.measure_shape(result);
  const std::size_t crossings = supine::reconstruction::self_intersections(result.surface).size();
  fmt::print("| {} | {} | {:.1f} | {:.4f} / {:.2f} | {:.4f} / {:.2f} | {:+.4f} | {:.1f} | {:.1f} | {} | {:.2f} |\n",
             name, result.surface.triangles.rows(), 100.0 * result.quads / (result.quads + result.alone),
             result.mean_from_input_mm, result.from_input_mm, result.mean_to_input_mm, result.to_input_mm,
             100 * result.volume_change, result.smallest_angle_deg, result.mean_deviation_deg, crossings, seconds);
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  const Surface in = supine::reconstruction::read_surface(argv[1]);
  const DecimateMeasure measure(in);
  fmt::print("{}: {} triangles, {:.1f} ml\n\n", argv[1], in.triangles.rows(), measure.report().volume_mm3 / 1000);
  fmt::print(
      "| method | triangles | quads % | input → output mean / max mm | output → input mean / max mm | volume % | "
      "smallest angle ° | quad deviation ° | crossings | CPU s |\n|---|---|---|---|---|---|---|---|---|---|\n");
  double bound_mm = 0;
  for (int a = 2; a < argc; ++a) {
    if (const std::string word = argv[a]; word.starts_with("bound=")) {
      bound_mm = std::stod(word.substr(6));
      continue;
    }
    const int faces = std::stoi(argv[a]);
    double start = cpu_s();
    supine::meshing::QuadRemesher remesher(in, {}, supine::meshing::edge_for_triangles(in, {}, 2 * faces));
    supine::meshing::QuadMesh quads = remesher.make({.faces = faces});
    DecimateResult result;
    result.surface = std::move(quads.surface);
    measure.give_volume_back(result.surface);
    result.quad = quads.pairs.quad;
    result.quads = quads.pairs.quads;
    result.alone = quads.pairs.alone;
    const double seconds = cpu_s() - start;
    const auto triangles = static_cast<int>(result.surface.triangles.rows());
    row(fmt::format("quads, {} faces", faces), measure, result, seconds);
    if (bound_mm > 0) {
      start = cpu_s();
      const DecimateResult bounded =
          supine::meshing::decimate(in, {.max_distance_mm = bound_mm, .target_faces = faces});
      row(fmt::format("the same, checked, bound {} mm", bound_mm), measure, bounded, cpu_s() - start);
    }
    for (const bool vtk : {true, false}) {
      start = cpu_s();
      DecimateResult plain;
      plain.surface = vtk ? vtk_quadrics(in, triangles) : openmesh_quadrics(in, triangles);
      const double spent = cpu_s() - start;
      row(vtk ? "VTK quadrics" : "OpenMesh quadrics", measure, plain, spent);
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: bench_decimation SURFACE [bound=MM] FACES [FACES ...]\n");
    return 2;
  }
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_decimation: {}\n", error.what());
    return 2;
  }
}
