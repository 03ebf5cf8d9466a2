// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/picture.h"

#include <fmt/format.h>
#include <vtkActor.h>
#include <vtkActor2D.h>
#include <vtkAutoInit.h>
#include <vtkBillboardTextActor3D.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkColorTransferFunction.h>
#include <vtkDoubleArray.h>
#include <vtkGeometryFilter.h>
#include <vtkLookupTable.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataMapper2D.h>
#include <vtkPolyDataNormals.h>
#include <vtkProperty.h>
#include <vtkProperty2D.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkScalarBarActor.h>
#include <vtkSmartPointer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkThreshold.h>
#include <vtkWindowToImageFilter.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "pipeline/virtual_display.h"

VTK_MODULE_INIT(vtkRenderingOpenGL2);
VTK_MODULE_INIT(vtkRenderingFreeType);

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Colour = std::array<double, 3>;
constexpr Colour ink = {0.1, 0.1, 0.1}, grey = {0.72, 0.72, 0.72};
constexpr int width = 1500, height = 820, title_size = 24, text_size = 20;

/// One window with white panes, written as PNG.
class Sheet {
 public:
  Sheet() {
    window_->SetOffScreenRendering(1);
    window_->SetSize(width, height);
    window_->SetMultiSamples(8);
    pane(0, 0, 1, 1);
  }

  vtkRenderer& pane(double x0, double y0, double x1, double y1) {
    panes_.push_back(vtkSmartPointer<vtkRenderer>::New());
    panes_.back()->SetViewport(x0, y0, x1, y1);
    panes_.back()->SetBackground(1, 1, 1);
    window_->AddRenderer(panes_.back());
    return *panes_.back();
  }

  vtkRenderer& whole() { return *panes_.front(); }

  void write(const fs::path& png) {
    window_->Render();
    vtkNew<vtkWindowToImageFilter> pixels;
    pixels->SetInput(window_);
    pixels->ReadFrontBufferOff();
    vtkNew<vtkPNGWriter> writer;
    writer->SetInputConnection(pixels->GetOutputPort());
    writer->SetFileName(png.c_str());
    writer->Write();
    if (writer->GetErrorCode() != 0 || !fs::exists(png) || fs::file_size(png) == 0)
      throw InputError("writing " + png.string() + " failed; check the folder and the free space on the disk");
  }

 private:
  VirtualDisplay display_;  // outlives the window
  vtkNew<vtkRenderWindow> window_;
  std::vector<vtkSmartPointer<vtkRenderer>> panes_;
};

/// @param x, y  share of the pane   @param align  0 left, 1 centre, 2 right; the same from the bottom
void write_text(vtkRenderer& pane, const std::string& text, double x, double y, int size, int align_x = 1,
                int align_y = 1, const Colour& colour = ink, bool bold = false) {
  vtkNew<vtkTextActor> actor;
  actor->SetInput(text.c_str());
  actor->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
  actor->SetPosition(x, y);
  vtkTextProperty* style = actor->GetTextProperty();
  style->SetFontSize(size);
  style->SetColor(colour[0], colour[1], colour[2]);
  style->SetBold(bold);
  style->SetJustification(align_x);
  style->SetVerticalJustification(align_y);
  pane.AddActor2D(actor);
}

/// Filled rectangles in pixels of the pane.
class Bars {
 public:
  explicit Bars(const Colour& colour) {
    actor_->GetProperty()->SetColor(colour[0], colour[1], colour[2]);
    poly_->SetPoints(points_);
    poly_->SetPolys(cells_);
    mapper_->SetInputData(poly_);
    actor_->SetMapper(mapper_);
  }
  void add(double x0, double y0, double x1, double y1) {
    const vtkIdType first = points_->InsertNextPoint(x0, y0, 0);
    points_->InsertNextPoint(x1, y0, 0);
    points_->InsertNextPoint(x1, y1, 0);
    points_->InsertNextPoint(x0, y1, 0);
    const vtkIdType corners[4] = {first, first + 1, first + 2, first + 3};
    cells_->InsertNextCell(4, corners);
  }
  void show(vtkRenderer& pane) { pane.AddActor2D(actor_); }

 private:
  vtkNew<vtkPoints> points_;
  vtkNew<vtkCellArray> cells_;
  vtkNew<vtkPolyData> poly_;
  vtkNew<vtkPolyDataMapper2D> mapper_;
  vtkNew<vtkActor2D> actor_;
};

// How a pane looks at the patient, and the letters at its edges.
struct View {
  const char* name;
  Eigen::Vector3d from;  // LPS
  const char *left, *right;
};
const View front = {"from the front", {0, -1, 0}, "R", "L"}, behind = {"from behind", {0, 1, 0}, "L", "R"},
           from_left = {"from the left", {1, 0, 0}, "A", "P"}, from_right = {"from the right", {-1, 0, 0}, "P", "A"};

void look(vtkRenderer& pane, const View& view, const double bounds[6]) {
  vtkCamera* camera = pane.GetActiveCamera();
  const Eigen::Vector3d centre(0.5 * (bounds[0] + bounds[1]), 0.5 * (bounds[2] + bounds[3]),
                               0.5 * (bounds[4] + bounds[5]));
  const Eigen::Vector3d eye = centre + 1000 * view.from;
  camera->ParallelProjectionOn();
  camera->SetFocalPoint(centre.data());
  camera->SetPosition(eye.data());
  camera->SetViewUp(0, 0, 1);
  const double across = std::abs(view.from.y()) > 0.5 ? bounds[1] - bounds[0] : bounds[3] - bounds[2];
  const int* size = pane.GetSize();
  const double shape = static_cast<double>(size[0]) / std::max(1, size[1]);
  camera->SetParallelScale(0.62 * std::max(bounds[5] - bounds[4], across / shape));
  pane.ResetCameraClippingRange();
  write_text(pane, view.left, 0.02, 0.5, title_size, 0);
  write_text(pane, view.right, 0.98, 0.5, title_size, 2);
  write_text(pane, "H", 0.5, 0.99, title_size, 1, 2);
  write_text(pane, "F", 0.5, 0.07, title_size, 1, 0);
  write_text(pane, view.name, 0.5, 0.01, text_size, 1, 0);
}

/// 50 mm at the lower left of a pane that look() has set up.
void scale_line(vtkRenderer& pane) {
  const int* size = pane.GetSize();
  const double pixels = 50 * size[1] / (2 * pane.GetActiveCamera()->GetParallelScale());
  Bars line(ink);
  line.add(30, 30, 30 + pixels, 33);
  line.show(pane);
  write_text(pane, "50 mm", (30 + 0.5 * pixels) / size[0], 40.0 / size[1], text_size - 3, 1, 0);
}

vtkSmartPointer<vtkPolyData> read_skin(const fs::path& file) {
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName(file.c_str());
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputConnection(reader->GetOutputPort());
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

std::vector<double> sizes_of(vtkPolyData& skin) {
  std::vector<double> sizes;
  vtkDataArray* shown = skin.GetPointData()->GetArray("shown");
  for (vtkIdType p = 0; p < skin.GetNumberOfPoints(); ++p)
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

void draw_legend(vtkRenderer& pane, vtkColorTransferFunction* colours) {
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
  write_text(pane, "distance, mm", 0.5, 0.93, text_size);
  write_text(pane, "+ scan outside", 0.5, 0.87, text_size - 3);
  write_text(pane, "- scan inside", 0.5, 0.15, text_size - 3);
  write_text(pane, "grey: not covered", 0.5, 0.08, text_size - 3);
}

void add_skin(vtkRenderer& pane, vtkPolyData* skin, vtkColorTransferFunction* colours) {
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(skin);
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
  pane.AddActor(actor);
}

// Okabe and Ito (2008), in the order of the regions inner, skin, ligament, cut.
constexpr Colour region_colours[] = {{0.00, 0.45, 0.70}, {0.94, 0.89, 0.26}, {0.84, 0.37, 0.00}, {0.80, 0.47, 0.65}};
constexpr const char* region_names[] = {"inner (on the muscle)", "skin", "ligament ring", "cut"};

vtkSmartPointer<vtkPolyData> read_boundary(const fs::path& file) {
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName(file.c_str());
  vtkNew<vtkThreshold> boundary;
  boundary->SetInputConnection(reader->GetOutputPort());
  boundary->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_CELLS, "region");
  boundary->SetThresholdFunction(vtkThreshold::THRESHOLD_UPPER);
  boundary->SetUpperThreshold(1);
  vtkNew<vtkGeometryFilter> surface;
  surface->SetInputConnection(boundary->GetOutputPort());
  surface->Update();
  vtkSmartPointer<vtkPolyData> found = surface->GetOutput();
  if (found->GetNumberOfPolys() == 0) throw InputError(file.string() + " has no boundary faces to draw");
  return found;
}

void add_regions(vtkRenderer& pane, vtkPolyData* boundary) {
  vtkNew<vtkLookupTable> colours;
  colours->SetNumberOfTableValues(4);
  colours->SetTableRange(1, 4);
  for (int r = 0; r < 4; ++r)
    colours->SetTableValue(r, region_colours[r][0], region_colours[r][1], region_colours[r][2]);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(boundary);
  mapper->SetScalarModeToUseCellFieldData();
  mapper->SelectColorArray("region");
  mapper->SetLookupTable(colours);
  mapper->UseLookupTableScalarRangeOn();
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->EdgeVisibilityOn();
  actor->GetProperty()->SetEdgeColor(0.25, 0.25, 0.25);
  actor->GetProperty()->SetInterpolationToFlat();
  actor->GetProperty()->SetAmbient(0.35);
  actor->GetProperty()->SetDiffuse(0.7);
  pane.AddActor(actor);
}

/// A round step that divides @p span into about @p parts.
double round_step(double span, int parts) {
  const double raw = span / parts, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * power >= raw) return step * power;
  return 10 * power;
}

}  // namespace

void declare_png(CLI::App& app, fs::path& file, const std::string& what) {
  app.add_option("--png", file, "also draw " + what + " into this file (.png); needs no display");
}

void announce_png(Run& run, const fs::path& file, const fs::path& output) {
  if (file.empty()) return;
  if (file.extension() != ".png") throw InputError(fmt::format("--png {}: the file ends in .png", file.string()));
  const bool beside = fs::weakly_canonical(fs::path(file).replace_extension()) ==
                      fs::weakly_canonical(fs::path(output).replace_extension());
  for (const char* other : {".vti", ".vtp", ".vtu", ".csv", ".toml", ".html"})
    if (const fs::path owner = fs::path(file).replace_extension(other); !beside && fs::exists(owner))
      throw InputError(fmt::format("--png {}: its figures would go into {}, which are those of {}; choose another name",
                                   file.string(), fs::path(file).replace_extension(".json").filename().string(),
                                   owner.filename().string()));
  run.output(file);
  if (!beside) run.figures(file) = {{"drawn_from", output.filename().string()}};
}

void draw_distances(const fs::path& file, const std::string& title, const fs::path& png) {
  const auto skin = read_skin(file);
  blank_uncovered(*skin);
  const auto colours = diverging(colour_range_mm(sizes_of(*skin)));
  const auto marks = hot_spots(*skin);
  double bounds[6];
  skin->GetBounds(bounds);
  double lateral = 0;  // the side the skin looks to, left or right
  for (const Mark& mark : marks) lateral += mark.normal.x();
  const View& aside = lateral < 0 ? from_right : from_left;
  Sheet sheet;
  write_text(sheet.whole(), title, 0.5, 0.965, title_size, 1, 1, ink, true);
  const std::pair<const View*, std::pair<double, double>> places[] = {{&front, {0, 0.43}}, {&aside, {0.43, 0.86}}};
  for (const auto& [view, across] : places) {
    vtkRenderer& pane = sheet.pane(across.first, 0, across.second, 0.93);
    add_skin(pane, skin, colours);
    for (const Mark& mark : marks) {
      const bool here = (view == &front) == (-mark.normal.y() >= mark.normal.dot(aside.from));
      if (here) draw_mark(pane, mark, *view);
    }
    look(pane, *view, bounds);
    scale_line(pane);
  }
  draw_legend(sheet.pane(0.86, 0, 1, 0.93), colours);
  sheet.write(png);
}

void draw_mesh(const fs::path& file, const std::string& title, const fs::path& png) {
  const auto boundary = read_boundary(file);
  double bounds[6];
  boundary->GetBounds(bounds);
  Sheet sheet;
  write_text(sheet.whole(), title, 0.5, 0.965, title_size, 1, 1, ink, true);
  const std::pair<const View*, std::pair<double, double>> places[] = {{&front, {0, 0.42}}, {&behind, {0.42, 0.84}}};
  for (const auto& [view, across] : places) {
    vtkRenderer& pane = sheet.pane(across.first, 0, across.second, 0.93);
    add_regions(pane, boundary);
    look(pane, *view, bounds);
    scale_line(pane);
  }
  vtkRenderer& legend = sheet.pane(0.84, 0, 1, 0.93);
  Bars boxes[] = {Bars(region_colours[0]), Bars(region_colours[1]), Bars(region_colours[2]), Bars(region_colours[3])};
  for (int r = 0; r < 4; ++r) {
    const double middle = height * 0.93 * (0.65 - 0.08 * r);
    boxes[r].add(10, middle - 10, 30, middle + 10);
    boxes[r].show(legend);
    write_text(legend, region_names[r], 0.18, 0.65 - 0.08 * r, text_size - 3, 0);
  }
  sheet.write(png);
}

void draw_histogram(const Histogram& h, const fs::path& png) {
  constexpr double left = 90, right = width - 40, floor = 110, top = height - 120;
  const auto [least, most] = std::minmax_element(h.values.begin(), h.values.end());
  const double step = round_step(std::max(*most - *least, 1e-9), 6);
  const double low = step * std::floor(*least / step), high = std::max(step * std::ceil(*most / step), low + step);
  const auto place = [&](double value) { return left + (right - left) * (value - low) / (high - low); };
  const int bins = std::clamp(static_cast<int>(2 * std::cbrt(static_cast<double>(h.values.size()))), 8, 60);
  std::vector<int> count(static_cast<std::size_t>(bins), 0);
  for (const double v : h.values)
    ++count[static_cast<std::size_t>(std::min(bins - 1, static_cast<int>(bins * (v - low) / (high - low))))];
  const int tallest = *std::max_element(count.begin(), count.end());
  Sheet sheet;
  vtkRenderer& pane = sheet.whole();
  Bars bars({0.57, 0.77, 0.87}), lines(ink);
  for (int b = 0; b < bins; ++b)
    if (count[static_cast<std::size_t>(b)] > 0)
      bars.add(left + (right - left) * b / bins + 1, floor, left + (right - left) * (b + 1) / bins - 1,
               floor + (top - floor) * count[static_cast<std::size_t>(b)] / tallest);
  lines.add(left, floor - 2, right, floor);
  for (int k = 0; low + k * step <= high + 0.5 * step; ++k) {
    lines.add(place(low + k * step) - 1, floor - 8, place(low + k * step) + 1, floor);
    write_text(pane, fmt::format("{:.4g}", low + k * step), place(low + k * step) / width, (floor - 12) / height,
               text_size, 1, 2);
  }
  for (std::size_t m = 0; m < h.marks.size(); ++m) {
    const double x = place(h.marks[m].second);
    lines.add(x - 1.5, floor, x + 1.5, top + 10);
    write_text(pane, fmt::format("{} {:.2f}", h.marks[m].first, h.marks[m].second), x / width,
               (top + 14 + 24 * (m % 2)) / height, text_size, 1, 0);
  }
  bars.show(pane);
  lines.show(pane);
  write_text(pane, h.axis, 0.5, 0.04, text_size);
  write_text(pane, fmt::format("tallest: {} of {}", tallest, h.values.size()), (left - 60) / width, (top + 14) / height,
             text_size - 3, 0, 0);
  write_text(pane, h.title, 0.5, 0.965, title_size, 1, 1, ink, true);
  sheet.write(png);
}

}  // namespace supine::pipeline
