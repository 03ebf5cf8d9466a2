// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/mechanics.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "common/suggestion.h"
#include "simulation/elements/tet_geometry.h"
#include "simulation/model_fields.h"
#include "simulation/terms/bulk.h"
#include "simulation/terms/cut.h"
#include "simulation/terms/fibres.h"
#include "simulation/terms/gravity.h"
#include "simulation/terms/interface.h"
#include "simulation/terms/skin.h"
#include "simulation/terms/skin_bending.h"
#include "simulation/terms/skin_end_fade.h"
#include "simulation/terms/support.h"
#include "simulation/terms/traction.h"

namespace supine::simulation {
namespace {

Indices rows_of(const Indices& table, const Eigen::VectorXi& rows) { return table(rows, Eigen::all); }

template <class Face>
using MembraneFace = std::conditional_t<Face::nodes == 3, Tri3Centroid, Face>;

template <class Cell, class Face>
std::vector<std::unique_ptr<Term>> make_terms(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy,
                                              const Model& model, const Layout& layout, const Pattern& pattern,
                                              const std::shared_ptr<const Elements>& cells) {
  std::vector<std::unique_ptr<Term>> terms;
  terms.push_back(std::make_unique<BulkTerm<Cell>>(cells, BulkSettings{model.breast.law, model.breast.volumetric}));
  terms.push_back(std::make_unique<FibreTerm<Cell>>(cells, anatomy.muscle));
  terms.push_back(std::make_unique<GravityTerm<Cell>>(cells, mesh.points, model.breast.density_refers_to));
  if (model.skin.young_modulus_kpa.value > 0)
    terms.push_back(std::make_unique<SkinTerm<MembraneFace<Face>>>(
        rows_of(mesh.faces, layout.skin.faces), pattern, SkinSettings{model.skin.law, model.skin.compression},
        fade_from_skin_end<MembraneFace<Face>>(mesh, layout.skin.faces, model.skin.fade_mm)));
  terms.push_back(std::make_unique<TractionTerm<Face>>(rows_of(mesh.faces, layout.skin.faces), pattern));
  for (std::size_t s = 0; s < layout.support_begin.size() - 1; ++s) {
    const int first = layout.support_begin[s], count = layout.support_begin[s + 1] - first;
    const Indices faces = rows_of(mesh.faces, layout.interface.faces.segment(first, count));
    const InterfaceKind kind = kind_of_support(model, mesh, static_cast<int>(s));
    if (kind == InterfaceKind::sliding)
      terms.push_back(std::make_unique<InterfaceTerm<Face>>(faces, pattern, anatomy.support(s), first * Face::points));
    else if (is_tied(kind, mesh))
      terms.push_back(std::make_unique<SupportTerm<Face>>(faces, pattern, mesh.points, first * Face::points));
  }
  if (model.cut.kind == CutKind::elastic)
    terms.push_back(
        std::make_unique<CutTerm<Face>>(rows_of(mesh.faces, layout.cut.faces), pattern,
                                        fade_from_skin_end<Face>(mesh, layout.cut.faces, model.skin.fade_mm)));
  return terms;
}

template <class Element>
Eigen::VectorXd det_f_of(const Indices& cells, const Points& x, const Points& X, bool corners) {
  Eigen::VectorXd smallest(cells.rows());
  for (int c = 0; c < cells.rows(); ++c) {
    const auto now = gather<Element::nodes>(x, cells, c), rest = gather<Element::nodes>(X, cells, c);
    double least = 1e300;
    for (int p = 0; p < Element::points; ++p) {
      const auto point = tet_point<Element>(rest, p);
      least = std::min(least, point.det > 0 ? (now.transpose() * point.b).determinant() : point.det);
    }
    if constexpr (Element::nodes == 10)
      if (corners)
        for (const auto& gradient : tet10_corner_gradients()) {
          const double before = (rest.transpose() * gradient).determinant();
          least = std::min(least, before > 0 ? (now.transpose() * gradient).determinant() / before : before);
        }
    smallest[c] = least;
  }
  return smallest;
}

template <class Element>
double volume_of(const Indices& cells, const Points& x) {
  double volume = 0;
  for (int c = 0; c < cells.rows(); ++c) {
    const auto nodes = gather<Element::nodes>(x, cells, c);
    for (int p = 0; p < Element::points; ++p) volume += Element::table().weight[p] * tet_point<Element>(nodes, p).det;
  }
  return volume;
}

}  // namespace

Mechanics::Mechanics(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
                     const Mechanics* same_mesh)
    : mesh_(mesh), anatomy_(anatomy), layout_(make_layout(mesh, anatomy)), held_(mesh.points.rows(), 0) {
  if (layout_.interface.faces.size() == 0)
    throw InputError(anatomy.is_object()
                         ? "the mesh has no inner faces: no support holds the body"
                         : "the mesh has no inner faces: nothing lies on the muscle, so nothing holds the breast");
  for (const auto& [name, own] : model.supports)
    if (std::find(mesh.support_names.begin(), mesh.support_names.end(), name) == mesh.support_names.end())
      throw InputError(
          fmt::format("[supports.{}] of the model is no support of this body; {}", name,
                      mesh.support_names.empty() ? "it has none with a name" : suggestion(name, mesh.support_names)));
  const TrianglePatches patches = model.skin.bending_share > 0 && model.skin.young_modulus_kpa.value > 0
                                      ? triangle_patches(rows_of(mesh.faces, layout_.skin.faces))
                                      : TrianglePatches{};
  bends_ = patches.nodes.rows() > 0;
  const bool shared = same_mesh != nullptr && same_mesh->bends_ == bends_;
  pattern_ =
      shared ? same_mesh->pattern_ : std::make_shared<const Pattern>(mesh.cells, patches.nodes, mesh.points.rows());
  cells_ = shared ? same_mesh->cells_ : std::make_shared<const Elements>(mesh.cells, *pattern_);
  terms_ = mesh.order() == 2 ? make_terms<Tet10, Tri6>(mesh, anatomy, model, layout_, *pattern_, cells_)
                             : make_terms<Tet4, Tri3>(mesh, anatomy, model, layout_, *pattern_, cells_);
  volume_ = dynamic_cast<const VolumeStrainTerm*>(terms_.front().get());
  if (bends_)
    terms_.push_back(std::make_unique<SkinBendingTerm>(patches, *pattern_, model.skin.law == SkinLaw::neo_hookean));
  add_contact(model.contact);
  const auto hold_group = [this, &mesh](const FaceGroup& group) {
    for (const int face : group.faces)
      for (const int node : mesh.faces.row(face)) held_[node] = 1;
    any_held_ = true;
  };
  if (model.interface.kind == InterfaceKind::fixed && mesh.support_names.empty()) hold_group(layout_.interface);
  if (model.cut.kind == CutKind::held) hold_group(layout_.cut);
}

void Mechanics::add_contact(const ContactSettings& settings) {
  const Indices skin = rows_of(mesh_.faces, layout_.skin.faces);
  if (settings.with_skin()) {
    auto contact = std::make_unique<SkinContactTerm>(skin, mesh_.points, settings);
    contact_ = contact.get();
    terms_.push_back(std::move(contact));
  }
  if (!settings.with_chest()) return;
  const std::optional<meshing::ChestBeside> chest = meshing::chest_beside(mesh_, anatomy_);
  if (!chest)
    throw InputError(
        fmt::format("contact.kind = \"chest\" or \"all\" needs a chest beside the body: {}; take \"skin\" or \"off\"",
                    anatomy_.is_object() ? "an object has none" : "here the skin is closed and ends nowhere"));
  std::unique_ptr<ChestContact> contact;
  if (mesh_.order() == 2)
    contact = std::make_unique<ChestContactTerm<Tri6>>(skin, *pattern_, mesh_.points, *chest, settings);
  else
    contact = std::make_unique<ChestContactTerm<Tri3>>(skin, *pattern_, mesh_.points, *chest, settings);
  chest_contact_ = contact.get();
  terms_.push_back(std::move(contact));
}

bool Mechanics::has_energy() const {
  for (const auto& term : terms_)
    if (!term->has_energy()) return false;
  return true;
}

void Mechanics::set_fields(const Fields<double>& fields) {
  for (const auto& term : terms_) term->set_fields(fields);
}

void Mechanics::evaluate(const State& state, const Demand& demand, Sums& sums) const {
  sums.clear(demand);
  for (const auto& term : terms_) {
    term->add(state, demand, sums);
    if (!sums.valid) return;
  }
  if (any_held_) hold(demand, sums);
}

void Mechanics::parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  const Demand demand{.residual = true};
  sums.clear(demand);
  for (const auto& term : terms_) term->add_parameter_derivative(state, fields, sums);
  if (any_held_) hold(demand, sums);
}

void Mechanics::hold(const Demand& demand, Sums& sums) const {
  if (demand.residual)
    for (std::size_t n = 0; n < held_.size(); ++n)
      if (held_[n]) sums.residual.segment<3>(3 * static_cast<Eigen::Index>(n)).setZero();
  const auto hold_rows = [this](SparseMatrix& matrix, double diagonal) {
    for (int column = 0; column < matrix.outerSize(); ++column)
      for (SparseMatrix::InnerIterator entry(matrix, column); entry; ++entry)
        if (held_[column / 3] || held_[entry.row() / 3]) entry.valueRef() = entry.row() == column ? diagonal : 0.0;
  };
  if (demand.tangent) {
    hold_rows(sums.tangent, 1);
    hold_rows(sums.contact, 0);
  }
  if (demand.reference_tangent) hold_rows(sums.reference_tangent, 1);
}

double volume_mm3(const Indices& cells, const Points& x) {
  return cells.cols() == 10 ? volume_of<Tet10>(cells, x) : volume_of<Tet4>(cells, x);
}

Eigen::VectorXd cell_det_f(const Indices& cells, const Points& x, const Points& X) {
  return cells.cols() == 10 ? det_f_of<Tet10>(cells, x, X, true) : det_f_of<Tet4>(cells, x, X, true);
}

Eigen::VectorXd cell_det_f_at_points(const Indices& cells, const Points& x, const Points& X) {
  return cells.cols() == 10 ? det_f_of<Tet10>(cells, x, X, false) : det_f_of<Tet4>(cells, x, X, false);
}

}  // namespace supine::simulation
