// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <vtkActor.h>
#include <vtkBillboardTextActor3D.h>
#include <vtkBoundingBox.h>
#include <vtkCellArray.h>
#include <vtkColorTransferFunction.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataNormals.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkScalarBarActor.h>
#include <vtkSmartPointer.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "common/error.h"
#include "common/vtk_files.h"
#include "pipeline/picture/picture.h"
#include "pipeline/picture/sheet.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
constexpr double panes_share = 0.86;  // of the width; the legend has the rest
constexpr Colour grey = {0.72, 0.72, 0.72};

vtkSmartPointer<vtkPolyData> read_skin(const fs::path& file) {
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputData(read_vtp(file));
  normals->SplittingOff();
  normals->ConsistencyOff();
  normals->Update();
  vtkSmartPointer<vtkPolyData> skin = normals->GetOutput();
  if (skin->GetNumberOfPolys() == 0 || skin->GetPointData()->GetArray("distance_mm") == nullptr)
    throw InputError(file.string() + " has no triangles with distance_mm to draw");
  return skin;
}

/// NaN where the scan does not reach: drawn grey.
void blank_uncovered(vtkPolyData& skin) {
  vtkDataArray* distance = skin.GetPointData()->GetArray("distance_mm");
  vtkDataArray* covered = skin.GetPointData()->GetArray("covered");
  vtkNew<vtkDoubleArray> shown;
  shown->SetName("shown");
  for (vtkIdType p = 0; p < skin.GetNumberOfPoints(); ++p)
    shown->InsertNextValue(covered != nullptr && covered->GetTuple1(p) == 0 ? std::numeric_limits<double>::quiet_NaN()
                                                                            : distance->GetTuple1(p));
  skin.GetPointData()->AddArray(shown);
}

/// The points of a scan, whatever it is made of, with what they show.
vtkSmartPointer<vtkPolyData> read_scan(const fs::path& file) {
  auto scan = vtkSmartPointer<vtkPolyData>::New();
  scan->ShallowCopy(read_vtp(file));
  vtkDataArray* distance = scan->GetPointData()->GetArray("distance_mm");
  if (distance == nullptr) throw InputError(file.string() + " has no points with distance_mm to draw");
  vtkNew<vtkDoubleArray> shown;
  shown->DeepCopy(distance);
  shown->SetName("shown");
  scan->GetPointData()->AddArray(shown);
  vtkNew<vtkCellArray> points;
  for (vtkIdType p = 0; p < scan->GetNumberOfPoints(); ++p) points->InsertNextCell({p});
  scan->SetPolys(nullptr);
  scan->SetVerts(points);
  return scan;
}

std::vector<double> sizes_of(vtkPolyData& data) {
  std::vector<double> sizes;
  vtkDataArray* shown = data.GetPointData()->GetArray("shown");
  for (vtkIdType p = 0; p < data.GetNumberOfPoints(); ++p)
    if (const double d = shown->GetTuple1(p); std::isfinite(d)) sizes.push_back(std::abs(d));
  std::sort(sizes.begin(), sizes.end());
  return sizes;
}

/// 95 % of the sizes, up to the next of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten.
double colour_range_mm(const std::vector<double>& sizes) {
  const double wanted = sizes.empty() ? 1 : std::max(0.1, sizes[static_cast<std::size_t>(0.95 * (sizes.size() - 1))]);
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  for (const double step : {1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0})
    if (step * power >= wanted) return step * power;
  return 10 * power;
}

vtkSmartPointer<vtkColorTransferFunction> diverging(double range) {
  // ColorBrewer RdBu: red where the scan lies outside the model.
  constexpr Colour steps[] = {{0.13, 0.40, 0.67}, {0.26, 0.58, 0.76}, {0.57, 0.77, 0.87},
                              {0.82, 0.90, 0.94}, {0.97, 0.97, 0.97}, {0.99, 0.86, 0.78},
                              {0.96, 0.65, 0.51}, {0.84, 0.38, 0.30}, {0.70, 0.09, 0.17}};
  auto colours = vtkSmartPointer<vtkColorTransferFunction>::New();
  for (int s = 0; s < 9; ++s) colours->AddRGBPoint(range * (s - 4) / 4.0, steps[s][0], steps[s][1], steps[s][2]);
  colours->SetNanColor(grey[0], grey[1], grey[2]);
  return colours;
}

struct Mark {
  Eigen::Vector3d place, normal;
  double value;
};

/// The largest errors of the skin, 40 mm apart at least.
std::vector<Mark> hot_spots(vtkPolyData& skin) {
  constexpr std::size_t most = 4;
  constexpr double apart_mm = 40;
  vtkDataArray* shown = skin.GetPointData()->GetArray("shown");
  std::vector<vtkIdType> order;
  for (vtkIdType p = 0; p < skin.GetNumberOfPoints(); ++p)
    if (std::isfinite(shown->GetTuple1(p))) order.push_back(p);
  std::stable_sort(order.begin(), order.end(), [shown](vtkIdType a, vtkIdType b) {
    return std::abs(shown->GetTuple1(a)) > std::abs(shown->GetTuple1(b));
  });
  std::vector<Mark> marks;
  for (const vtkIdType p : order) {
    const Eigen::Vector3d place(skin.GetPoint(p)), normal(skin.GetPointData()->GetNormals()->GetTuple3(p));
    const bool near = std::any_of(marks.begin(), marks.end(),
                                  [&place](const Mark& m) { return (m.place - place).norm() < apart_mm; });
    if (!near) marks.push_back({place, normal, shown->GetTuple1(p)});
    if (marks.size() == most) break;
  }
  return marks;
}

void draw_mark(vtkRenderer& pane, const Mark& mark, const View& view) {
  const Eigen::Vector3d at = mark.place + 200 * view.from;  // in front of everything
  vtkNew<vtkBillboardTextActor3D> text;
  text->SetInput(fmt::format("{:+.1f}", mark.value).c_str());
  text->SetPosition(at[0], at[1], at[2]);
  vtkTextProperty* style = text->GetTextProperty();
  style->SetFontSize(text_size);
  style->SetColor(0, 0, 0);
  style->SetBackgroundColor(1, 1, 1);
  style->SetBackgroundOpacity(0.75);
  style->SetJustificationToCentered();
  style->SetVerticalJustificationToCentered();
  pane.AddActor(text);
}

void draw_legend(vtkRenderer& pane, vtkColorTransferFunction* colours, bool points) {
  vtkNew<vtkScalarBarActor> bar;
  bar->SetLookupTable(colours);
  bar->SetNumberOfLabels(5);
  bar->SetLabelFormat("%+.2g");
  bar->SetUnconstrainedFontSize(true);
  bar->GetLabelTextProperty()->SetFontSize(text_size);
  bar->GetLabelTextProperty()->SetColor(ink[0], ink[1], ink[2]);
  bar->GetLabelTextProperty()->SetItalic(0);
  bar->GetLabelTextProperty()->SetBold(0);
  bar->GetLabelTextProperty()->ShadowOff();
  bar->SetPosition(0.2, 0.2);
  bar->SetPosition2(0.6, 0.6);
  bar->SetBarRatio(0.35);
  pane.AddActor2D(bar);
  write_text(pane, "distance, mm", 0.5, 0.93);
  constexpr TextStyle small = {.size = text_size - 3};
  write_text(pane, "+ scan outside", 0.5, 0.87, small);
  write_text(pane, "- scan inside", 0.5, 0.15, small);
  write_text(pane, points ? "points of the scan" : "grey: not covered", 0.5, 0.08, small);
}

/// @param opacity  under 1: what lies in it is seen
void add_coloured(vtkRenderer& pane, vtkPolyData* data, vtkColorTransferFunction* colours, double opacity) {
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  mapper->SetScalarModeToUsePointFieldData();
  mapper->SelectColorArray("shown");
  mapper->SetLookupTable(colours);
  mapper->UseLookupTableScalarRangeOn();
  mapper->InterpolateScalarsBeforeMappingOff();  // a grey point must not spread NaN over its triangles' textures
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->SetAmbient(0.6);
  actor->GetProperty()->SetDiffuse(0.45);
  actor->GetProperty()->SetSpecular(0);
  actor->GetProperty()->SetOpacity(opacity);
  actor->GetProperty()->SetPointSize(4);
  pane.AddActor(actor);
}

/// From the front and from the outer side; with two breasts from the outer side of each.
std::vector<const View*> views_of(const std::string& side) {
  if (side == "both") return {&from_right, &front, &from_left};
  return {&front, side == "right" ? &from_right : &from_left};
}

/// Widths of the panes: as the body's in each view, so that it has one size in all; none less than half of another.
std::vector<double> shares_of(const std::vector<const View*>& views, const double bounds[6]) {
  const double wide = bounds[1] - bounds[0], deep = bounds[3] - bounds[2];
  std::vector<double> shares;
  for (const View* view : views)
    shares.push_back(view == &front ? std::max(wide, 0.5 * deep) : std::max(deep, 0.5 * wide));
  const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
  for (double& share : shares) share *= panes_share / sum;
  return shares;
}

/// The view that a mark faces; the first of equals.
const View* best_view(const Mark& mark, const std::vector<const View*>& views) {
  return *std::max_element(views.begin(), views.end(), [&mark](const View* a, const View* b) {
    return mark.normal.dot(a->from) < mark.normal.dot(b->from);
  });
}

}  // namespace

void draw_distances(const fs::path& file, const std::string& title, const std::string& side, const fs::path& png,
                    const fs::path& scan_file) {
  constexpr double see_through = 0.25;
  const auto skin = read_skin(file);
  blank_uncovered(*skin);
  vtkSmartPointer<vtkPolyData> scan;
  if (sizes_of(*skin).empty() && !scan_file.empty()) scan = read_scan(scan_file);
  const auto colours = diverging(colour_range_mm(sizes_of(scan != nullptr ? *scan : *skin)));
  const auto marks = hot_spots(*skin);
  double bounds[6];
  skin->GetBounds(bounds);
  if (scan != nullptr) {
    vtkBoundingBox both(bounds);
    both.AddBounds(scan->GetBounds());
    both.GetBounds(bounds);
  }
  const View flat = object_view(bounds, false), edge = object_view(bounds, true);
  const std::vector<const View*> views = side == "none" ? std::vector<const View*>{&flat, &edge} : views_of(side);
  const std::vector<double> shares =
      side == "none" ? std::vector<double>{0.6 * panes_share, 0.4 * panes_share} : shares_of(views, bounds);
  Sheet sheet(title);
  double from = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    vtkRenderer& pane = sheet.pane(from, 0, from + shares[v], 0.93);
    from += shares[v];
    add_coloured(pane, skin, colours, scan != nullptr ? see_through : 1);
    if (scan != nullptr) add_coloured(pane, scan, colours, 1);
    for (const Mark& mark : marks)
      if (best_view(mark, views) == views[v]) draw_mark(pane, mark, *views[v]);
    look(pane, *views[v], bounds);
    scale_line(pane);
  }
  draw_legend(sheet.pane(panes_share, 0, 1, 0.93), colours, scan != nullptr);
  sheet.write(png);
}

}  // namespace supine::pipeline
