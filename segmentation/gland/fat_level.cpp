// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/fat_level.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "segmentation/gland/bspline_field.h"

namespace supine::segmentation {
namespace {

constexpr float least_grey = 1;  // per cent of fat; the logarithm of less says nothing
constexpr std::size_t most_samples = 300'000, least_samples = 1000;
constexpr double under_skin_scatter = 0.3;  // ln: what differs more from its neighbours under the skin is no fat
constexpr double first_spacing_mm = 90;
constexpr int rounds_a_level = 2;
constexpr double usual_pure = 0.7;   // contrast that the first look takes for pure gland
constexpr double other_side = 0.02;  // density of what is neither: vessels, markers, ghosts
constexpr double least_sd = 0.02;
constexpr double deviation_spacing_mm = 50;
constexpr double log_square_mean = -1.2704;  // of ln(z^2), z standard normal

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double contrast_of(double residual, GlandOptions::Contrast contrast) {
  return contrast == GlandOptions::Contrast::dark ? 1 - std::exp(residual) : std::exp(residual) - 1;
}

/// The samples the field is fitted to: their logarithms of grey stay, value becomes the residual.
struct Fit {
  std::vector<FieldSample> samples;
  std::vector<float> log_grey;
  std::vector<std::uint8_t> under_skin;
  double sd = 0.2, prior = 0.15;
};

Fit collect(const GreyImage& image, const Mask& inner, const Mask& under_skin) {
  const auto count = static_cast<std::size_t>(std::count(inner.begin(), inner.end(), 1));
  const std::size_t stride = std::max<std::size_t>(1, count / most_samples);
  Fit fit;
  const Grid& grid = image.grid;
  std::size_t seen = 0;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t n = grid.index(i, j, k);
        // A stride that has no common step with the rows.
        if (!inner[n] || (seen++ * 2654435761U >> 7) % stride != 0) continue;
        fit.samples.push_back({i, j, k, 0, 1});
        fit.log_grey.push_back(std::log(std::max(image.voxels[n], least_grey)));
        fit.under_skin.push_back(under_skin[n]);
      }
  const auto sure = static_cast<std::size_t>(std::count(fit.under_skin.begin(), fit.under_skin.end(), 1));
  if (fit.samples.size() < least_samples || sure < least_samples)
    throw InputError(fmt::format("gland: the breast has {} voxels, {} of them under the skin; {} of either are needed",
                                 fit.samples.size(), sure, least_samples));
  return fit;
}

void renew_residuals(Fit& fit, const BSplineField& field) {
#pragma omp parallel for schedule(static)
  for (std::size_t n = 0; n < fit.samples.size(); ++n) {
    FieldSample& s = fit.samples[n];
    s.value = static_cast<float>(fit.log_grey[n] - field.at(s.i, s.j, s.k));
  }
}

/// Under the skin alone: what differs much from the field weighs little.
void weigh_under_skin(Fit& fit) {
  for (std::size_t n = 0; n < fit.samples.size(); ++n) {
    const double t = fit.samples[n].value / under_skin_scatter;
    fit.samples[n].weight = fit.under_skin[n] ? static_cast<float>(1 / (1 + t * t)) : 0.0f;
  }
}

/// How likely each sample is fat, and from that the fat's scatter and share.
void weigh_by_class(Fit& fit, GlandOptions::Contrast contrast) {
  double squares = 0, sum = 0;
  for (FieldSample& s : fit.samples) {
    const double c = contrast_of(s.value, contrast), t = s.value / fit.sd;
    const double fat = (1 - fit.prior) * std::exp(-t * t / 2) / (fit.sd * std::sqrt(2 * std::numbers::pi));
    const double gland = c > 0 ? fit.prior / usual_pure : 0;
    s.weight = static_cast<float>(fat / (fat + gland + (c > 0 ? other_side : 0)));
    squares += s.weight * s.value * static_cast<double>(s.value);
    sum += s.weight;
  }
  fit.sd = std::max(least_sd, std::sqrt(squares / std::max(1.0, sum)));
  fit.prior = std::clamp(1 - sum / static_cast<double>(fit.samples.size()), 0.02, 0.9);
}

BSplineField fit_field(const Grid& grid, Fit& fit, GlandOptions::Contrast contrast, double shading_mm) {
  std::vector<double> greys;
  for (std::size_t n = 0; n < fit.samples.size(); ++n)
    if (fit.under_skin[n]) greys.push_back(fit.log_grey[n]);
  BSplineField field(grid, median(std::move(greys)));
  for (int round = 0; round < rounds_a_level; ++round) {
    renew_residuals(fit, field);
    weigh_under_skin(fit);
    field.add(fit.samples, first_spacing_mm);
  }
  for (double spacing = first_spacing_mm / 1.5; spacing > shading_mm * 1.01; spacing /= 1.5)
    for (int round = 0; round < rounds_a_level; ++round) {
      renew_residuals(fit, field);
      weigh_by_class(fit, contrast);
      field.add(fit.samples, spacing);
    }
  for (int round = 0; round < rounds_a_level; ++round) {
    renew_residuals(fit, field);
    weigh_by_class(fit, contrast);
    field.add(fit.samples, shading_mm);
  }
  renew_residuals(fit, field);
  weigh_by_class(fit, contrast);
  return field;
}

/// ln of the variance of the fat's residual, as a field of its own.
BSplineField fit_deviation(const Grid& grid, const Fit& fit) {
  const double common = 2 * std::log(fit.sd);
  std::vector<FieldSample> samples = fit.samples;
  for (FieldSample& s : samples)
    s.value = static_cast<float>(std::log(s.value * static_cast<double>(s.value) + 1e-6) - log_square_mean - common);
  BSplineField field(grid, common);
  field.add(samples, deviation_spacing_mm);
  return field;
}

}  // namespace

FatLevel find_fat_level(const GreyImage& image, const Mask& inner, const Mask& under_skin,
                        GlandOptions::Contrast contrast, double shading_mm) {
  Fit fit = collect(image, inner, under_skin);
  const BSplineField level = fit_field(image.grid, fit, contrast, shading_mm),
                     variance = fit_deviation(image.grid, fit);
  std::vector<double> levels, deviations;
  for (const FieldSample& s : fit.samples) {
    levels.push_back(level.at(s.i, s.j, s.k));
    deviations.push_back(std::exp(variance.at(s.i, s.j, s.k) / 2));
  }
  const double middle = median(std::move(levels));
  FatLevel result;
  result.sd = median(std::move(deviations));
  result.contrast.assign(inner.size(), 0);
  result.deviation.assign(inner.size(), 1);
  result.shading.assign(inner.size(), 1);
  const Grid& grid = image.grid;
#pragma omp parallel for schedule(static)
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j) {
      const std::vector<float> fat = level.row(j, k), log_variance = variance.row(j, k);
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t n = grid.index(i, j, k);
        if (!inner[n]) continue;
        result.contrast[n] =
            static_cast<float>(contrast_of(std::log(std::max(image.voxels[n], least_grey)) - fat[i], contrast));
        result.deviation[n] = static_cast<float>(std::max(least_sd, std::exp(log_variance[i] / 2.0)));
        result.shading[n] = static_cast<float>(std::exp(fat[i] - middle));
      }
    }
  return result;
}

}  // namespace supine::segmentation
