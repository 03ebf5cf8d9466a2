// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/picture/sheet.h"

#include <vtkActor2D.h>
#include <vtkAutoInit.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper2D.h>
#include <vtkProperty2D.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkWindowToImageFilter.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/error.h"
#include "pipeline/picture/virtual_display.h"

VTK_MODULE_INIT(vtkRenderingOpenGL2);
VTK_MODULE_INIT(vtkRenderingFreeType);

namespace supine::pipeline {

namespace fs = std::filesystem;

struct Sheet::Window {
  VirtualDisplay display;  // outlives the window
  vtkNew<vtkRenderWindow> pixels;
  std::vector<vtkSmartPointer<vtkRenderer>> panes;
};

Sheet::Sheet(const std::string& title) : window_(std::make_unique<Window>()) {
  window_->pixels->SetOffScreenRendering(1);
  window_->pixels->SetSize(width, height);
  window_->pixels->SetMultiSamples(8);
  write_text(pane(0, 0, 1, 1), title, 0.5, 0.965, {.size = title_size, .bold = true});
}

Sheet::~Sheet() = default;

vtkRenderer& Sheet::pane(double x0, double y0, double x1, double y1) {
  auto& panes = window_->panes;
  panes.push_back(vtkSmartPointer<vtkRenderer>::New());
  panes.back()->SetViewport(x0, y0, x1, y1);
  panes.back()->SetBackground(1, 1, 1);
  window_->pixels->AddRenderer(panes.back());
  return *panes.back();
}

vtkRenderer& Sheet::whole() { return *window_->panes.front(); }

void Sheet::write(const fs::path& png) {
  window_->pixels->Render();
  vtkNew<vtkWindowToImageFilter> pixels;
  pixels->SetInput(window_->pixels);
  pixels->ReadFrontBufferOff();
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputConnection(pixels->GetOutputPort());
  writer->SetFileName(png.c_str());
  writer->Write();
  if (writer->GetErrorCode() != 0 || !fs::exists(png) || fs::file_size(png) == 0)
    throw InputError("writing " + png.string() + " failed; check the folder and the free space on the disk");
}

void write_text(vtkRenderer& pane, const std::string& text, double x, double y, const TextStyle& style) {
  vtkNew<vtkTextActor> actor;
  actor->SetInput(text.c_str());
  actor->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
  actor->SetPosition(x, y);
  vtkTextProperty* property = actor->GetTextProperty();
  property->SetFontSize(style.size);
  property->SetColor(ink[0], ink[1], ink[2]);
  property->SetBold(style.bold);
  property->SetJustification(static_cast<int>(style.across));
  property->SetVerticalJustification(static_cast<int>(style.up));
  pane.AddActor2D(actor);
}

void fill(vtkRenderer& pane, const std::vector<Bar>& bars, const Colour& colour) {
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> cells;
  for (const auto& [x0, y0, x1, y1] : bars) {
    const vtkIdType first = points->InsertNextPoint(x0, y0, 0);
    points->InsertNextPoint(x1, y0, 0);
    points->InsertNextPoint(x1, y1, 0);
    points->InsertNextPoint(x0, y1, 0);
    const vtkIdType corners[4] = {first, first + 1, first + 2, first + 3};
    cells->InsertNextCell(4, corners);
  }
  vtkNew<vtkPolyData> rectangles;
  rectangles->SetPoints(points);
  rectangles->SetPolys(cells);
  vtkNew<vtkPolyDataMapper2D> mapper;
  mapper->SetInputData(rectangles);
  vtkNew<vtkActor2D> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(colour[0], colour[1], colour[2]);
  pane.AddActor2D(actor);
}

const View front = {"from the front", {0, -1, 0}, "R", "L"}, behind = {"from behind", {0, 1, 0}, "L", "R"},
           from_left = {"from the left", {1, 0, 0}, "A", "P"}, from_right = {"from the right", {-1, 0, 0}, "P", "A"};

View object_view(const double bounds[6], bool second) {
  std::array<int, 3> axes = {0, 1, 2};
  const auto length = [bounds](int axis) { return bounds[2 * axis + 1] - bounds[2 * axis]; };
  std::sort(axes.begin(), axes.end(), [&](int a, int b) { return length(a) < length(b); });
  const int from = axes[second ? 1 : 0], up = from == 1 ? 2 : (from == 2 ? 1 : 2), across = 3 - from - up;
  static const char* const plus[] = {"+x", "+y", "+z"};
  static const char* const minus[] = {"-x", "-y", "-z"};
  static const char* const names[] = {"from +x", "from +y", "from +z"};
  View view{names[from], Eigen::Vector3d::Unit(from), minus[across], plus[across], Eigen::Vector3d::Unit(up), plus[up],
            minus[up]};
  // The right of the picture is up × from: where that is the negative axis the letters change places.
  if (view.up.cross(view.from)[across] < 0) std::swap(view.left, view.right);
  return view;
}

void look(vtkRenderer& pane, const View& view, const double bounds[6]) {
  vtkCamera* camera = pane.GetActiveCamera();
  const Eigen::Vector3d centre(0.5 * (bounds[0] + bounds[1]), 0.5 * (bounds[2] + bounds[3]),
                               0.5 * (bounds[4] + bounds[5]));
  const Eigen::Vector3d eye = centre + 1000 * view.from;
  camera->ParallelProjectionOn();
  camera->SetFocalPoint(centre.data());
  camera->SetPosition(eye.data());
  camera->SetViewUp(view.up.data());
  const auto length = [bounds](const Eigen::Vector3d& axis) {
    Eigen::Index row = 0;
    axis.cwiseAbs().maxCoeff(&row);
    return bounds[2 * row + 1] - bounds[2 * row];
  };
  const double across = length(view.up.cross(view.from));
  const int* size = pane.GetSize();
  const double shape = static_cast<double>(size[0]) / std::max(1, size[1]);
  camera->SetParallelScale(0.62 * std::max(length(view.up), across / shape));
  pane.ResetCameraClippingRange();
  write_text(pane, view.left, 0.02, 0.5, {.size = title_size, .across = Across::left});
  write_text(pane, view.right, 0.98, 0.5, {.size = title_size, .across = Across::right});
  write_text(pane, view.top, 0.5, 0.99, {.size = title_size, .up = Up::top});
  write_text(pane, view.bottom, 0.5, 0.07, {.size = title_size, .up = Up::bottom});
  write_text(pane, view.name, 0.5, 0.01, {.up = Up::bottom});
}

void scale_line(vtkRenderer& pane) {
  const int* size = pane.GetSize();
  const double pixels = 50 * size[1] / (2 * pane.GetActiveCamera()->GetParallelScale());
  fill(pane, {{30, 38, 30 + pixels, 41}}, ink);  // above the view's name
  write_text(pane, "50 mm", (30 + 0.5 * pixels) / size[0], 48.0 / size[1], {.size = text_size - 3, .up = Up::bottom});
}

}  // namespace supine::pipeline
