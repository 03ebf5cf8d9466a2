// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

class vtkRenderer;

namespace supine::pipeline {

using Colour = std::array<double, 3>;  ///< red, green, blue in [0, 1]

constexpr Colour ink = {0.1, 0.1, 0.1};
constexpr int width = 1500, height = 820, title_size = 24, text_size = 20;  ///< pixels

/// One picture of white panes, drawn on a virtual screen.
class Sheet {
 public:
  /// @throws InputError  no display
  explicit Sheet(const std::string& title);
  ~Sheet();

  /// A new pane between these shares of the picture, from the lower left. It lives as long as the sheet.
  vtkRenderer& pane(double x0, double y0, double x1, double y1);
  /// The pane under all others, with the title.
  vtkRenderer& whole();
  /// @throws InputError  not writable
  void write(const std::filesystem::path& png);

 private:
  struct Window;
  std::unique_ptr<Window> window_;
};

enum class Across { left, centre, right };
enum class Up { bottom, centre, top };

/// How a text looks and which of its points lies at the place given.
struct TextStyle {
  int size = text_size;
  Across across = Across::centre;
  Up up = Up::centre;
  bool bold = false;
};

/// @param x, y  share of the pane, from the lower left
void write_text(vtkRenderer& pane, const std::string& text, double x, double y, const TextStyle& style = {});

/// Corners of a rectangle in pixels of its pane, from the lower left.
struct Bar {
  double x0, y0, x1, y1;
};

void fill(vtkRenderer& pane, const std::vector<Bar>& bars, const Colour& colour);

/// How a pane looks at the patient, and the letters at its edges.
struct View {
  const char* name;
  Eigen::Vector3d from;  ///< patient LPS
  const char *left, *right;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const char *top = "H", *bottom = "F";
};
/// Of an object: along the shortest side of its box (x, y, z, each from and to; mm), and along the next.
View object_view(const double bounds[6], bool second);
extern const View front, behind, from_left, from_right;

/// Sets up the pane's camera for a body within @p bounds (x, y, z, each from and to; mm) and writes the letters.
void look(vtkRenderer& pane, const View& view, const double bounds[6]);

/// 50 mm at the lower left of a pane that look() has set up.
void scale_line(vtkRenderer& pane);

}  // namespace supine::pipeline
