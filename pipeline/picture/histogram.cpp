// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>

#include "pipeline/picture/picture.h"
#include "pipeline/picture/sheet.h"

namespace supine::pipeline {
namespace {

constexpr double left = 90, right = width - 40, ground = 110, top = height - 120;  // of the bars, pixels
constexpr Colour bar_colour = {0.57, 0.77, 0.87};

/// A round step that divides @p span into about @p parts.
double round_step(double span, int parts) {
  const double raw = span / parts, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * power >= raw) return step * power;
  return 10 * power;
}

struct Axis {
  explicit Axis(const std::vector<double>& values) {
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    step = round_step(std::max(*most - *least, 1e-9), 6);
    low = step * std::floor(*least / step);
    high = std::max(step * std::ceil(*most / step), low + step);
  }
  double share(double value) const { return (value - low) / (high - low); }
  double place(double value) const { return left + (right - left) * share(value); }

  double low, high, step;
};

void draw_bars(vtkRenderer& pane, const std::vector<double>& values, const Axis& axis) {
  const int bins = std::clamp(static_cast<int>(2 * std::cbrt(static_cast<double>(values.size()))), 8, 60);
  std::vector<int> count(static_cast<std::size_t>(bins), 0);
  for (const double v : values)
    ++count[static_cast<std::size_t>(std::min(bins - 1, static_cast<int>(bins * axis.share(v))))];
  const int tallest = *std::max_element(count.begin(), count.end());
  const double across = (right - left) / bins;
  std::vector<Bar> bars;
  for (int b = 0; b < bins; ++b)
    if (const int n = count[static_cast<std::size_t>(b)]; n > 0)
      bars.push_back(
          {left + across * b + 1, ground, left + across * (b + 1) - 1, ground + (top - ground) * n / tallest});
  fill(pane, bars, bar_colour);
  write_text(pane, fmt::format("tallest: {} of {}", tallest, values.size()), (left - 60) / width, (top + 14) / height,
             {.size = text_size - 3, .across = Across::left, .up = Up::bottom});
}

void draw_axis(vtkRenderer& pane, const Axis& axis) {
  std::vector<Bar> lines = {{left, ground - 2, right, ground}};
  for (int k = 0; axis.low + k * axis.step <= axis.high + 0.5 * axis.step; ++k) {
    const double value = axis.low + k * axis.step, x = axis.place(value);
    lines.push_back({x - 1, ground - 8, x + 1, ground});
    write_text(pane, fmt::format("{:.4g}", value), x / width, (ground - 12) / height, {.up = Up::top});
  }
  fill(pane, lines, ink);
}

void draw_marks(vtkRenderer& pane, const Histogram& histogram, const Axis& axis) {
  std::vector<Bar> lines;
  for (std::size_t m = 0; m < histogram.marks.size(); ++m) {
    const auto& [name, value] = histogram.marks[m];
    const double x = axis.place(value);
    lines.push_back({x - 1.5, ground, x + 1.5, top + 10});
    write_text(pane, fmt::format("{} {:.2f}", name, value), x / width, (top + 14 + 24 * (m % 2)) / height,
               {.up = Up::bottom});
  }
  fill(pane, lines, ink);
}

}  // namespace

void draw_histogram(const Histogram& histogram, const std::filesystem::path& png) {
  const Axis axis(histogram.values);
  Sheet sheet(histogram.title);
  vtkRenderer& pane = sheet.whole();
  draw_bars(pane, histogram.values, axis);
  draw_axis(pane, axis);
  draw_marks(pane, histogram, axis);
  write_text(pane, histogram.axis, 0.5, 0.04);
  sheet.write(png);
}

}  // namespace supine::pipeline
