// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/simulation/manufactured_problem.h"

#include <ceres/jet.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace supine::testing {
namespace {

using simulation::BulkLaw;

template <class T>
using Vector = Eigen::Matrix<T, 3, 1>;
template <class T>
using Matrix = Eigen::Matrix<T, 3, 3>;
using Along = ceres::Jet<double, 3>;  // carries ∂/∂X
using Twice = ceres::Jet<Along, 3>;   // carries ∂/∂X of it again

// A number without derivatives, however deep T nests.
template <class T>
T constant(double value) {
  if constexpr (std::is_same_v<T, double>)
    return value;
  else
    return T(constant<typename T::Scalar>(value));
}

template <class T>
Vector<T> deformed(const Vector<T>& X, double size) {
  using std::cos;
  using std::sin;
  const auto k = [](double value) { return constant<T>(value); };
  const T a = X[0] * k(1 / size) - k(0.5), b = X[1] * k(1 / size) - k(0.5), z = X[2] * k(1 / size);
  const T angle = k(0.8) * z * z, widening = k(1) + k(0.1) * z * z + k(0.1) * z * sin(k(2) * a);
  const T c = cos(angle), s = sin(angle);
  Vector<T> x;
  x[0] = k(size) * (widening * (c * a - s * b) + k(0.5));
  x[1] = k(size) * (widening * (s * a + c * b) + k(0.5));
  x[2] = k(size) * z * (k(1) + k(0.3) * z + k(0.15) * z * sin(k(2) * a) * cos(k(2) * b));
  return x;
}

// det F F⁻ᵀ. Spelt out: Eigen's sums ask for T(0), which nested Jets do not have.
template <class T>
Matrix<T> cofactors(const Matrix<T>& f) {
  Matrix<T> g;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
      g(i, k) = f(i1, k1) * f(i2, k2) - f(i1, k2) * f(i2, k1);
    }
  return g;
}

// Σ a_ik b_ik
template <class T>
T product(const Matrix<T>& a, const Matrix<T>& b) {
  T sum = constant<T>(0);
  for (int i = 0; i < 9; ++i) sum += a(i / 3, i % 3) * b(i / 3, i % 3);
  return sum;
}

template <class T>
T determinant(const Matrix<T>& f) {
  return product<T>(f, cofactors<T>(f)) * constant<T>(1.0 / 3);
}

template <class T>
Matrix<T> inverse_transpose(const Matrix<T>& f) {
  return cofactors<T>(f) * (constant<T>(1) / determinant<T>(f));
}

double plain(double x) { return x; }
template <class T, int N>
double plain(const ceres::Jet<T, N>& x) {
  return plain(x.a);
}

// Rotation factor by R ← (R + R⁻ᵀ)/2 (Higham 1986). The number of derivatives that are right doubles with every step
// once the value is, so the last steps are made after the value has settled.
template <class T>
Matrix<T> rotation(const Matrix<T>& f) {
  Matrix<T> r = f;
  for (int after = 0; after < 2;) {
    const Matrix<T> next = (r + inverse_transpose<T>(r)) * constant<T>(0.5);
    double moved = 0;
    for (int i = 0; i < 9; ++i) moved = std::max(moved, std::abs(plain(next(i / 3, i % 3)) - plain(r(i / 3, i % 3))));
    r = next;
    if (moved < 1e-6) ++after;
  }
  return r;
}

// First Piola-Kirchhoff stress from the formulas of docs/mechanics.md.
template <class T>
Matrix<T> stress_of(BulkLaw law, const Matrix<T>& f, double mu, double lambda) {
  using std::log;
  const auto k = [](double value) { return constant<T>(value); };
  if (law == BulkLaw::neo_hookean) {
    const T log_j = log(determinant<T>(f));
    return f * k(mu) + inverse_transpose<T>(f) * (k(lambda) * log_j - k(mu));
  }
  if (law == BulkLaw::corotational) {
    const Matrix<T> r = rotation<T>(f);
    return (f - r) * k(2 * mu) + r * (k(lambda) * (product<T>(r, f) - k(3)));
  }
  throw std::invalid_argument("no stress written for this law");
}

// Gauss and Legendre on [0, 1]: three points for linear cells, four for quadratic ones.
struct Line {
  std::vector<double> at, weight;
};

const Line& line_rule(int order) {
  static const Line three = {{0.5 - std::sqrt(0.15), 0.5, 0.5 + std::sqrt(0.15)}, {5.0 / 18, 4.0 / 9, 5.0 / 18}};
  static const Line four = {
      {0.069431844202973712388, 0.33000947820757186760, 0.66999052179242813240, 0.93056815579702628761},
      {0.17392742256872692869, 0.32607257743127307131, 0.32607257743127307131, 0.17392742256872692869}};
  return order == 1 ? three : four;
}

template <int Corners>
struct Sample {
  Eigen::Matrix<double, Corners, 1> b;  // barycentric
  double share;                         // of the volume or area; sums to 1
};

// Collapsed-coordinate rules, exact to degree 3 on linear and 5 on quadratic cells.
std::vector<Sample<4>> tet_rule(int order) {
  const auto& [at, weight] = line_rule(order);
  std::vector<Sample<4>> all;
  for (std::size_t i = 0; i < at.size(); ++i)
    for (std::size_t j = 0; j < at.size(); ++j)
      for (std::size_t k = 0; k < at.size(); ++k) {
        const double u = at[i], v = at[j] * (1 - u), w = at[k] * (1 - u - v);
        all.push_back({{u, v, w, 1 - u - v - w}, 6 * weight[i] * weight[j] * weight[k] * (1 - u) * (1 - u - v)});
      }
  return all;
}

std::vector<Sample<3>> triangle_rule(int order) {
  const auto& [at, weight] = line_rule(order);
  std::vector<Sample<3>> all;
  for (std::size_t i = 0; i < at.size(); ++i)
    for (std::size_t j = 0; j < at.size(); ++j) {
      const double u = at[i], v = at[j] * (1 - u);
      all.push_back({{u, v, 1 - u - v}, 2 * weight[i] * weight[j] * (1 - u)});
    }
  return all;
}

constexpr int tet_edges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
constexpr int face_edges[3][2] = {{0, 1}, {1, 2}, {2, 0}};

// Shape functions of a linear or quadratic simplex in barycentric coordinates, and their derivatives by them.
template <int Corners, int Edges>
void shape(const Eigen::Matrix<double, Corners, 1>& b, const int (&edges)[Edges][2], bool quadratic,
           Eigen::VectorXd& value, Eigen::MatrixXd& derivative) {
  value.setZero(quadratic ? Corners + Edges : Corners);
  derivative.setZero(value.size(), Corners);
  for (int a = 0; a < Corners; ++a) {
    value[a] = quadratic ? b[a] * (2 * b[a] - 1) : b[a];
    derivative(a, a) = quadratic ? 4 * b[a] - 1 : 1;
  }
  if (!quadratic) return;
  for (int e = 0; e < Edges; ++e) {
    const auto [i, j] = edges[e];
    value[Corners + e] = 4 * b[i] * b[j];
    derivative(Corners + e, i) = 4 * b[j];
    derivative(Corners + e, j) = 4 * b[i];
  }
}

// Corner coordinates as columns, and the gradients of the barycentric coordinates as rows (straight cells).
struct Cell {
  Eigen::Matrix<double, 3, 4> corners;
  Eigen::Matrix<double, 4, 3> gradient;
  double volume;
};

Cell cell_of(const meshing::TetMesh& mesh, Eigen::Index c) {
  Cell cell;
  for (int a = 0; a < 4; ++a) cell.corners.col(a) = mesh.points.row(mesh.cells(c, a)).transpose();
  const Eigen::Matrix3d edges = cell.corners.rightCols<3>().colwise() - cell.corners.col(0);
  cell.volume = edges.determinant() / 6;
  cell.gradient.bottomRows<3>() = edges.inverse();
  cell.gradient.row(0) = -cell.gradient.bottomRows<3>().colwise().sum();
  return cell;
}

}  // namespace

ManufacturedProblem::ManufacturedProblem(BulkLaw law, double size_mm, double young_kpa, double poisson)
    : law_(law),
      size_mm_(size_mm),
      mu_kpa_(young_kpa / (2 * (1 + poisson))),
      lambda_kpa_(young_kpa * poisson / ((1 + poisson) * (1 - 2 * poisson))) {}

Eigen::Vector3d ManufacturedProblem::map(const Eigen::Vector3d& X) const { return deformed<double>(X, size_mm_); }

Eigen::Matrix3d ManufacturedProblem::gradient(const Eigen::Vector3d& X) const {
  Vector<Along> seeded;
  for (int i = 0; i < 3; ++i) seeded[i] = Along(X[i], i);
  const Vector<Along> x = deformed<Along>(seeded, size_mm_);
  Eigen::Matrix3d f;
  for (int i = 0; i < 3; ++i) f.row(i) = x[i].v.transpose();
  return f;
}

ManufacturedProblem::Point ManufacturedProblem::at(const Eigen::Vector3d& X) const {
  Vector<Twice> seeded;
  for (int i = 0; i < 3; ++i) {
    seeded[i] = Twice(Along(X[i], i));
    seeded[i].v[i] = constant<Along>(1);
  }
  const Vector<Twice> x = deformed<Twice>(seeded, size_mm_);
  Matrix<Along> f;
  for (int i = 0; i < 3; ++i) f.row(i) = x[i].v.transpose();
  const Matrix<Along> p = stress_of<Along>(law_, f, mu_kpa_, lambda_kpa_);
  Point point;
  point.body_force.setZero();
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      point.f(i, k) = f(i, k).a;
      point.stress(i, k) = p(i, k).a;
      point.body_force[i] -= p(i, k).v[k];
    }
  return point;
}

Eigen::VectorXd ManufacturedProblem::external_forces(const meshing::TetMesh& mesh) const {
  Eigen::VectorXd force = Eigen::VectorXd::Zero(3 * mesh.points.rows()), value;
  Eigen::MatrixXd derivative;
  const auto add = [&](const auto& nodes, const Eigen::Vector3d& density) {
    for (Eigen::Index a = 0; a < value.size(); ++a) force.segment<3>(3 * nodes[a]) += value[a] * density;
  };
  const auto rule = tet_rule(mesh.order());
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const Cell cell = cell_of(mesh, c);
    for (const auto& [b, share] : rule) {
      shape<4, 6>(b, tet_edges, mesh.order() == 2, value, derivative);
      add(mesh.cells.row(c), share * cell.volume * at(cell.corners * b).body_force);
    }
  }
  const auto face_rule = triangle_rule(mesh.order());
  for (Eigen::Index s = 0; s < mesh.faces.rows(); ++s) {
    Eigen::Matrix3d corners;
    for (int a = 0; a < 3; ++a) corners.col(a) = mesh.points.row(mesh.faces(s, a)).transpose();
    if (corners.row(2).maxCoeff() < 1e-9 * size_mm_) continue;
    const Eigen::Vector3d area =
        0.5 * Eigen::Vector3d(corners.col(1) - corners.col(0)).cross(Eigen::Vector3d(corners.col(2) - corners.col(0)));
    for (const auto& [b, share] : face_rule) {
      shape<3, 3>(b, face_edges, mesh.order() == 2, value, derivative);
      add(mesh.faces.row(s), share * at(corners * b).stress * area);
    }
  }
  return force;
}

ManufacturedProblem::Errors ManufacturedProblem::errors(const meshing::TetMesh& mesh, const Points& x) const {
  Errors sum{0, 0};
  const auto rule = tet_rule(mesh.order());
  Eigen::VectorXd value;
  Eigen::MatrixXd derivative;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const Cell cell = cell_of(mesh, c);
    Eigen::Matrix<double, 3, Eigen::Dynamic> nodes(3, mesh.cells.cols());
    for (Eigen::Index a = 0; a < nodes.cols(); ++a) nodes.col(a) = x.row(mesh.cells(c, a)).transpose();
    for (const auto& [b, share] : rule) {
      shape<4, 6>(b, tet_edges, mesh.order() == 2, value, derivative);
      const Eigen::Vector3d X = cell.corners * b;
      sum.l2 += share * cell.volume * (nodes * value - map(X)).squaredNorm();
      sum.h1 += share * cell.volume * (nodes * derivative * cell.gradient - gradient(X)).squaredNorm();
    }
  }
  return {std::sqrt(sum.l2), std::sqrt(sum.h1)};
}

}  // namespace supine::testing
