// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/intensity.h"

#include <fmt/format.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkImageGaussianSmooth.h>
#include <vtkImageMedian3D.h>
#include <vtkNew.h>
#include <vtkPointData.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "segmentation/blur.h"
#include "segmentation/steps/otsu.h"

namespace supine::segmentation {
namespace {

constexpr double outlier_sd = 2.5;
constexpr std::size_t most_samples = 1'500'000;
constexpr int fit_rounds = 8;
constexpr int reselections = 3;
constexpr double nearest_share = 0.7;  // of the fat's grey; muscle and gland lie below

/// Monomials x^a y^b z^c, a + b + c <= degree, of coordinates scaled to about [-1, 1] over the image.
class Polynomial {
 public:
  Polynomial(const Grid& grid, int degree) : grid_(grid), degree_(degree) {
    const Eigen::Vector3d last = (grid.size - Eigen::Vector3i::Ones()).cast<double>();
    centre_ = grid.point(last / 2);
    scale_mm_ = std::max(1e-9, (grid.point(last) - grid.point(Eigen::Vector3d::Zero())).norm() / 2);
    for (int total = 0; total <= degree; ++total)
      for (int a = total; a >= 0; --a)
        for (int b = total - a; b >= 0; --b) powers_.push_back({a, b, total - a - b});
  }
  Eigen::Index terms() const { return static_cast<Eigen::Index>(powers_.size()); }
  void evaluate(int i, int j, int k, Eigen::VectorXd& values) const {
    const Eigen::Vector3d x = (grid_.point(Eigen::Vector3d(i, j, k)) - centre_) / scale_mm_;
    double power[3][5];
    for (int c = 0; c < 3; ++c) {
      power[c][0] = 1;
      for (int d = 1; d <= degree_; ++d) power[c][d] = power[c][d - 1] * x[c];
    }
    for (Eigen::Index t = 0; t < terms(); ++t)
      values[t] = power[0][powers_[t][0]] * power[1][powers_[t][1]] * power[2][powers_[t][2]];
  }

 private:
  const Grid& grid_;
  int degree_;
  Eigen::Vector3d centre_;
  double scale_mm_;
  std::vector<std::array<int, 3>> powers_;
};

/// One voxel of the tissue.
struct Sample {
  int i, j, k;
  double log_grey, residual;
  bool used;
};

bool is_automatic(const Bias& step) {
  return std::isinf(step.tissue.lower) && std::isinf(step.tissue.upper) && step.within.empty();
}

/// The tissue's range: the step's, or the upper of two classes of what is brighter than the air.
GreyRange tissue_range(const GreyImage& image, const Bias& step) {
  if (!is_automatic(step)) return step.tissue;
  const double air = otsu_levels(image.voxels, 4).front();
  std::vector<float> greys;
  for (const float grey : image.voxels)
    if (grey >= air) greys.push_back(grey);
  return {static_cast<float>(otsu_levels(greys, 2).front()), std::numeric_limits<float>::infinity()};
}

std::vector<Sample> collect_samples(const GreyImage& image, const GreyRange& range, const Mask& within) {
  std::vector<Sample> samples;
  const Grid& grid = image.grid;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const float grey = image.at(i, j, k);
        if (grey > 0 && range.contains(grey) && (within.empty() || within[grid.index(i, j, k)]))
          samples.push_back({i, j, k, std::log(static_cast<double>(grey)), 0, true});
      }
  return samples;
}

/// Least squares over the used samples, residuals of all.
Eigen::VectorXd fit(const Polynomial& polynomial, std::vector<Sample>& samples) {
  const Eigen::Index terms = polynomial.terms();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(terms, terms);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(terms), row(terms);
  for (const Sample& s : samples) {
    if (!s.used) continue;
    polynomial.evaluate(s.i, s.j, s.k, row);
    normal.selfadjointView<Eigen::Lower>().rankUpdate(row);
    right += row * s.log_grey;
  }
  const Eigen::VectorXd coefficients = normal.selfadjointView<Eigen::Lower>().ldlt().solve(right);
  for (Sample& s : samples) {
    polynomial.evaluate(s.i, s.j, s.k, row);
    s.residual = s.log_grey - row.dot(coefficients);
  }
  return coefficients;
}

/// Drops samples beyond outlier_sd robust standard deviations of the used ones. @return that bound
double drop_outliers(std::vector<Sample>& samples) {
  std::vector<double> sizes;
  for (const Sample& s : samples)
    if (s.used) sizes.push_back(std::abs(s.residual));
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  const double bound = outlier_sd * 1.4826 * *middle;  // 1.4826: median absolute deviation to sd of a normal law
  for (Sample& s : samples) s.used = std::abs(s.residual) <= bound;
  return bound;
}

/// Of many samples every n-th is fitted: a polynomial of a few terms is not known better by more.
Eigen::VectorXd settle(const Polynomial& polynomial, std::vector<Sample>& samples) {
  const std::size_t stride = samples.size() / most_samples + 1;
  std::vector<Sample> few;
  if (stride > 1)
    for (std::size_t n = 0; n < samples.size(); n += stride) few.push_back(samples[n]);
  std::vector<Sample>& fitted = stride > 1 ? few : samples;
  Eigen::VectorXd coefficients = fit(polynomial, fitted);
  double bound = 0;
  for (int round = 1; round < fit_rounds; ++round) {
    bound = drop_outliers(fitted);
    coefficients = fit(polynomial, fitted);
  }
  if (stride == 1) return coefficients;
  Eigen::VectorXd row(polynomial.terms());
  for (Sample& s : samples) {
    polynomial.evaluate(s.i, s.j, s.k, row);
    s.residual = s.log_grey - row.dot(coefficients);
    s.used = std::abs(s.residual) <= bound;
  }
  return coefficients;
}

/// The voxels, every n-th of them, whose grey, freed of the shading found so far, is near that of the tissue.
std::vector<Sample> reselect(const GreyImage& image, const Polynomial& polynomial, const Eigen::VectorXd& coefficients,
                             int stride) {
  std::vector<Sample> samples;
  const Grid& grid = image.grid;
  Eigen::VectorXd row(coefficients.size());
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const double grey = image.at(i, j, k);
        if (grey <= 0 || (i + 7 * j + 11 * k) % stride != 0) continue;
        polynomial.evaluate(i, j, k, row);
        const double share = grey / std::exp(row.dot(coefficients));
        if (share > nearest_share && share < 1 / nearest_share) samples.push_back({i, j, k, std::log(grey), 0, true});
      }
  return samples;
}

/// Divides by the fitted field, which is not let beyond what it is at the tissue's voxels (ln `low` to `high`): in the
/// air far from them a polynomial runs away, and noise with it.
void divide(GreyImage& image, const Polynomial& polynomial, const Eigen::VectorXd& coefficients, float level,
            double low, double high) {
  const Grid& grid = image.grid;
#pragma omp parallel
  {
    Eigen::VectorXd row(coefficients.size());
#pragma omp for schedule(static)
    for (int k = 0; k < grid.size.z(); ++k)
      for (int j = 0; j < grid.size.y(); ++j)
        for (int i = 0; i < grid.size.x(); ++i) {
          polynomial.evaluate(i, j, k, row);
          float& grey = image.at(i, j, k);
          grey = static_cast<float>(level * grey / std::exp(std::clamp(row.dot(coefficients), low, high)));
        }
  }
}

/// Divides by the local mean of the tissue's voxels, a Gaussian of step.local_mm wide; far from any it stays as it is.
void divide_local(GreyImage& image, const std::vector<Sample>& samples, const Bias& step) {
  std::vector<float> weight(image.voxels.size(), 0.0f), sum(image.voxels.size(), 0.0f);
  for (const Sample& s : samples) {
    if (!s.used) continue;
    const std::size_t n = image.grid.index(s.i, s.j, s.k);
    weight[n] = 1;
    sum[n] = image.voxels[n];
  }
  gaussian_blur(weight, image.grid, step.local_mm);
  gaussian_blur(sum, image.grid, step.local_mm);
  constexpr float held = 1e-3f;  // weight of "no shading left", so that the far field is defined
  for (std::size_t n = 0; n < weight.size(); ++n)
    image.voxels[n] *= step.level * (weight[n] + held) / (sum[n] + held * step.level);
}

}  // namespace

double remove_noise_floor(GreyImage& image, const NoiseFloor& step) {
  const double air_below = step.air_below > 0 ? step.air_below : otsu_levels(image.voxels, 4).front();
  std::vector<float> air;
  for (const float grey : image.voxels)
    if (grey < air_below) air.push_back(grey);
  if (air.empty())
    throw InputError(fmt::format(
        "noise_floor: no grey value is below air_below = {}; raise it above the greys of the air", air_below));
  const auto middle = air.begin() + static_cast<std::ptrdiff_t>(air.size() / 2);
  std::nth_element(air.begin(), middle, air.end());
  const double sigma = *middle / std::sqrt(2 * std::numbers::ln2);
  const auto floor = static_cast<float>(2 * sigma * sigma);
  for (float& grey : image.voxels) grey = std::sqrt(std::max(0.0f, grey * grey - floor));
  return sigma;
}

BiasFit correct_bias(GreyImage& image, const Bias& step, const Mask& within) {
  const Polynomial polynomial(image.grid, step.degree);
  const GreyRange range = tissue_range(image, step);
  std::vector<Sample> samples = collect_samples(image, range, within);
  const auto needed = static_cast<std::size_t>(10 * polynomial.terms());
  if (samples.size() < needed)
    throw InputError(fmt::format(
        "bias: {} voxels lie in the greys {} to {}, {} are needed for degree {}; choose the range of the fat's greys",
        samples.size(), range.lower, range.upper, needed, step.degree));
  Eigen::VectorXd coefficients = settle(polynomial, samples);
  if (is_automatic(
          step)) {  // the first range is one grey for the whole volume: now take the tissue where it is dark too
    const int stride = static_cast<int>(samples.size() / most_samples) + 1;
    for (int round = 0; round < reselections; ++round) {
      const bool last = round + 1 == reselections;  // whose samples the local mean takes
      samples = reselect(image, polynomial, coefficients, last ? 1 : stride);
      coefficients = settle(polynomial, samples);
    }
  }
  BiasFit result;
  double squares = 0, low = INFINITY, high = -INFINITY, sum = 0;
  for (const Sample& s : samples) {
    if (!s.used) continue;
    const double field = s.log_grey - s.residual;
    ++result.voxels;
    squares += s.residual * s.residual;
    sum += field;
    low = std::min(low, field);
    high = std::max(high, field);
  }
  const double mean = sum / static_cast<double>(result.voxels);
  result.residual_sd = std::sqrt(squares / static_cast<double>(result.voxels));
  result.lowest = std::exp(low - mean);
  result.highest = std::exp(high - mean);
  divide(image, polynomial, coefficients, step.level, low, high);
  if (step.local_mm > 0) divide_local(image, samples, step);
  return result;
}

void smooth(GreyImage& image, const Smooth& step) {
  const Grid& grid = image.grid;
  vtkNew<vtkFloatArray> greys;
  greys->SetArray(image.voxels.data(), static_cast<vtkIdType>(image.voxels.size()), 1);
  vtkNew<vtkImageData> data;
  data->SetDimensions(grid.size.x(), grid.size.y(), grid.size.z());
  data->GetPointData()->SetScalars(greys);
  const Eigen::Vector3d radius = step.radius_mm * grid.spacing_mm.cwiseInverse();
  vtkNew<vtkImageMedian3D> median;
  vtkNew<vtkImageGaussianSmooth> gaussian;
  vtkThreadedImageAlgorithm* filter = nullptr;
  if (step.kind == Smooth::Kind::median) {
    const Eigen::Vector3i half = (radius.array() + 1e-6).floor().cast<int>();
    median->SetKernelSize(2 * half.x() + 1, 2 * half.y() + 1, 2 * half.z() + 1);
    filter = median;
  } else {
    gaussian->SetStandardDeviations(radius.x(), radius.y(), radius.z());
    gaussian->SetRadiusFactors(3, 3, 3);
    filter = gaussian;
  }
  filter->SetInputData(data);
  filter->Update();
  auto* smoothed = vtkFloatArray::SafeDownCast(filter->GetOutput()->GetPointData()->GetScalars());
  std::copy_n(smoothed->GetPointer(0), image.voxels.size(), image.voxels.begin());
}

}  // namespace supine::segmentation
