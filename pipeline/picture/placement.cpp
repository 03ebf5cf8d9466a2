// SPDX-License-Identifier: AGPL-3.0-or-later
#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>

#include "common/error.h"
#include "pipeline/picture/picture.h"
#include "pipeline/picture/sheet.h"

namespace supine::pipeline {
namespace {

// Okabe and Ito (2008): vermilion and blue.
constexpr Colour given = {0.84, 0.37, 0.00}, found = {0.00, 0.45, 0.70}, body_grey = {0.75, 0.75, 0.75};

void add_surface(vtkRenderer& pane, const reconstruction::Surface& surface, const Colour& colour, double opacity) {
  vtkNew<vtkPoints> points;
  for (Eigen::Index p = 0; p < surface.points.rows(); ++p) points->InsertNextPoint(surface.points.row(p).data());
  vtkNew<vtkPolyData> poly;
  poly->SetPoints(points);
  vtkNew<vtkCellArray> cells;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t)
    cells->InsertNextCell({surface.triangles(t, 0), surface.triangles(t, 1), surface.triangles(t, 2)});
  if (surface.triangles.rows() > 0) {
    poly->SetPolys(cells);
  } else {
    for (vtkIdType p = 0; p < surface.points.rows(); ++p) cells->InsertNextCell({p});
    poly->SetVerts(cells);
  }
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(poly);
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(colour[0], colour[1], colour[2]);
  actor->GetProperty()->SetOpacity(opacity);
  actor->GetProperty()->SetPointSize(3);
  actor->GetProperty()->SetAmbient(0.35);
  actor->GetProperty()->SetDiffuse(0.7);
  pane.AddActor(actor);
}

void widen(const Points& points, double bounds[6]) {
  for (int axis = 0; axis < 3; ++axis) {
    bounds[2 * axis] = std::min(bounds[2 * axis], points.col(axis).minCoeff());
    bounds[2 * axis + 1] = std::max(bounds[2 * axis + 1], points.col(axis).maxCoeff());
  }
}

void write_legend(vtkRenderer& pane) {
  const std::pair<const char*, Colour> entries[] = {
      {"the body", body_grey}, {"scan as given", given}, {"scan as found", found}};
  double up = 0.65;
  for (const auto& [name, colour] : entries) {
    const double middle = height * 0.93 * up;
    fill(pane, {{10, middle - 10, 30, middle + 10}}, colour);
    write_text(pane, name, 0.18, up, {.size = text_size - 3, .across = Across::left});
    up -= 0.08;
  }
}

}  // namespace

void draw_placement(const Placed& placed, const std::string& title, const std::filesystem::path& png) {
  if (placed.body.triangles.rows() == 0) throw InputError("the body has no triangles to draw");
  double bounds[6] = {1e300, -1e300, 1e300, -1e300, 1e300, -1e300};
  const std::vector<int> nodes(placed.body.triangles.data(),
                               placed.body.triangles.data() + placed.body.triangles.size());
  widen(placed.body.points(nodes, Eigen::all), bounds);
  widen(placed.before.points, bounds);
  widen(placed.after.points, bounds);
  Sheet sheet(title);
  const View flat = object_view(bounds, false), edge = object_view(bounds, true);
  const std::pair<const View*, std::pair<double, double>> places[] = {
      {placed.object ? &flat : &front, {0, 0.42}}, {placed.object ? &edge : &from_left, {0.42, 0.84}}};
  for (const auto& [view, across] : places) {
    vtkRenderer& pane = sheet.pane(across.first, 0, across.second, 0.93);
    add_surface(pane, placed.body, body_grey, 1);
    add_surface(pane, placed.before, given, 0.8);
    add_surface(pane, placed.after, found, 0.8);
    look(pane, *view, bounds);
    scale_line(pane);
  }
  write_legend(sheet.pane(0.84, 0, 1, 0.93));
  sheet.write(png);
}

}  // namespace supine::pipeline
