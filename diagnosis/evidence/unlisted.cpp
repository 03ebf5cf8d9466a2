// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/unlisted.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "common/log_sum.h"
#include "common/statistics.h"
#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/evidence/field_modes.h"
#include "diagnosis/evidence/hypotheses.h"
#include "simulation/effects/local_stiffness.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int most_places = 50;  // of each kind
const auto& sizes = local_cause_sizes;
constexpr double out_of_sight = 60;  // of the logarithm: no gain lifts a hypothesis from so far below

/// Where the elements of one field lie.
struct FieldPlaces {
  Points mm, anatomy;
};

/// Of the points of the interface: those of one face lie in its middle in mm.
FieldPlaces interface_places(const simulation::Mechanics& mechanics) {
  const simulation::FaceGroup& group = mechanics.layout().interface;
  const Points faces = middles(mechanics.mesh().points, mechanics.mesh().faces(group.faces, Eigen::all), 3);
  FieldPlaces places{Points(group.q.rows(), 3), Points::Zero(group.q.rows(), 3)};
  const Index per_face = faces.rows() > 0 ? places.mm.rows() / faces.rows() : 1;
  for (Index p = 0; p < places.mm.rows(); ++p) places.mm.row(p) = faces.row(p / per_face);
  places.anatomy.leftCols(2) = group.q;
  return places;
}

/// Of cells or faces: the middles of their first @p corners nodes.
FieldPlaces places_of(const simulation::Mechanics& mechanics, const Indices& nodes, int corners) {
  const simulation::Scene scene{mechanics.mesh(), mechanics.anatomy(), mechanics.layout(), ""};
  FieldPlaces places{middles(mechanics.mesh().points, nodes, corners), Points(nodes.rows(), 3)};
  for (Index e = 0; e < nodes.rows(); ++e)
    places.anatomy.row(e) = simulation::anatomy_place(scene, nodes.row(e).head(corners)).transpose();
  return places;
}

/// Adds the bumps of one field. @param shapes  what its modes do  @param modes  of it at @p where
void add_bumps(LocalKind kind, const MatrixXd& shapes, const MatrixXd& modes, const FieldPlaces& where, double unit,
               LocalCauses& all) {
  const Points& places = where.mm;
  if (places.rows() == 0 || modes.cols() == 0 || !(unit > 0)) return;
  const std::vector<int> centres = spread_out(places, most_places);
  for (const int centre : centres) {
    const VectorXd there = modes.row(centre);
    if (!(there.norm() > 0)) continue;
    const Index k = all.columns.cols();
    all.columns.conservativeResize(shapes.rows(), k + 1);
    all.columns.col(k) = shapes * there / there.norm();
    all.kind.push_back(kind);
    all.place.conservativeResize(k + 1, 3);
    all.place.row(k) = places.row(centre);
    all.anatomy.conservativeResize(k + 1, 3);
    all.anatomy.row(k) = where.anatomy.row(centre);
    all.unit.conservativeResize(k + 1);
    all.unit[k] = unit;
  }
}

/// What local causes do, in the coordinates of one evidence: asked for every hypothesis that goes by it.
class OneMore {
 public:
  OneMore(const LinearEvidence& evidence, const MatrixXd& columns) {
    const ErrorCovariance& errors = evidence.errors();
    const MatrixXd more = errors.turned(columns), all = errors.turned(evidence.directions().columns);
    const VectorXd y = errors.turned(evidence.distances());
    for (const double s : errors.sizes_mm()) {
      const VectorXd weight = (1 + s * s * errors.lambda().array()).inverse();
      const MatrixXd weighted = more.transpose() * weight.asDiagonal();
      by_size_.push_back({weighted * all, weighted * y, (weighted.array() * more.transpose().array()).rowwise().sum()});
    }
  }

  /// Of the numbers of the columns, by bin: slope of F and curvature, with all else free.
  struct Fall {
    VectorXd slope, curvature;
  };
  Fall fall(std::size_t bin, const std::vector<int>& which, const Weighed& weighed) const {
    const Products& at = by_size_[bin];
    const MatrixXd beside = at.with_all(Eigen::all, which);
    return {at.with_y + beside * weighed.mean[bin],
            at.square - ((beside * weighed.covariance[bin]).array() * beside.array()).rowwise().sum().matrix()};
  }

 private:
  struct Products {
    MatrixXd with_all;  // #columns by #directions
    VectorXd with_y, square;
  };
  std::vector<Products> by_size_;
};

/// ln gain of each column for one sd, by bins of s weighed by their posterior.
VectorXd ln_gain(const OneMore& more, const std::vector<int>& which, const Weighed& weighed, double sd) {
  const auto bins = static_cast<Index>(weighed.mean.size());
  MatrixXd logs;
  for (Index b = 0; b < bins; ++b) {
    const OneMore::Fall fall = more.fall(static_cast<std::size_t>(b), which, weighed);
    if (b == 0) logs.resize(fall.slope.size(), bins);
    const Eigen::ArrayXd curvature = fall.curvature.array().max(0.0);
    logs.col(b) = 0.5 * fall.slope.array().square() / (1 / (sd * sd) + curvature) -
                  0.5 * (1 + sd * sd * curvature).log() + std::log(std::max(weighed.size_probability[b], 1e-300));
  }
  VectorXd gain(logs.rows());
  for (Index k = 0; k < gain.size(); ++k) gain[k] = log_sum(logs.row(k).transpose());
  return gain;
}

/// ln gain of each cause over all sizes it may have.
VectorXd over_sizes(const OneMore& more, const Hypothesis& h) {
  MatrixXd by_size;
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const VectorXd gain = ln_gain(more, h.rows, h.weighed, sizes[k]);
    if (k == 0) by_size.resize(gain.size(), static_cast<Index>(sizes.size()));
    by_size.col(static_cast<Index>(k)) = gain;
  }
  VectorXd gain(by_size.rows());
  for (Index c = 0; c < gain.size(); ++c)
    gain[c] = log_sum(by_size.row(c).transpose()) - std::log(static_cast<double>(sizes.size()));
  return gain;
}

/// ln of the mean over the places of each kind; of a kind that has none, of nothing.
std::array<double, local_kinds> over_places(const LocalCauses& causes, const VectorXd& gain) {
  std::array<double, local_kinds> mean;
  for (std::size_t kind = 0; kind < local_kinds; ++kind) {
    std::vector<int> of_kind;
    for (std::size_t c = 0; c < causes.kind.size(); ++c)
      if (causes.kind[c] == static_cast<LocalKind>(kind)) of_kind.push_back(static_cast<int>(c));
    mean[kind] = of_kind.empty() ? 0 : log_sum(VectorXd(gain(of_kind))) - std::log(static_cast<double>(of_kind.size()));
  }
  return mean;
}

/// Size of cause @p c beside a hypothesis, mean and standard deviation over bins and what it may be.
std::pair<double, double> size_of(const OneMore& more, const Hypothesis& h, Index c) {
  double sum = 0, first = 0, second = 0;
  for (const double sd : sizes)
    for (std::size_t b = 0; b < h.weighed.mean.size(); ++b) {
      const OneMore::Fall fall = more.fall(b, h.rows, h.weighed);
      const double precision = 1 / (sd * sd) + std::max(0.0, fall.curvature[c]), at = -fall.slope[c] / precision;
      const double ln = 0.5 * fall.slope[c] * fall.slope[c] / precision - 0.5 * std::log(precision * sd * sd);
      const double weight = h.weighed.size_probability[static_cast<Index>(b)] * std::exp(std::min(ln, 600.0));
      sum += weight, first += weight * at, second += weight * (at * at + 1 / precision);
    }
  if (!(sum > 0)) return {0, 0};
  const double mean = first / sum;
  return {mean, std::sqrt(std::max(0.0, second / sum - mean * mean))};
}

/// The likeliest place of a kind; -1 where it has none.
Index likeliest_of(const LocalCauses& causes, const VectorXd& gain, LocalKind kind) {
  Index best = -1;
  for (Index c = 0; c < gain.size(); ++c)
    if (causes.kind[static_cast<std::size_t>(c)] == kind && (best < 0 || gain[c] > gain[best])) best = c;
  return best;
}

/// What following showed of a kind, beside what lines say of all its places.
void take_followed(const std::vector<FollowedCause>& followed, std::array<double, local_kinds>& of_kind) {
  for (const FollowedCause& one : followed) {
    double& gain = of_kind[static_cast<std::size_t>(one.kind)];
    gain = std::max(gain, one.ln_gain);
  }
}

/// rms distance of the places of a kind from one of them, each as likely as it is.
double spread_about(const LocalCauses& causes, const VectorXd& gain, Index best) {
  const auto at = [&causes](Index c) { return causes.kind[static_cast<std::size_t>(c)]; };
  double weights = 0, spread = 0;
  for (Index c = 0; c < gain.size(); ++c) {
    if (at(c) != at(best)) continue;
    const double weight = std::exp(gain[c] - gain[best]);
    weights += weight;
    spread += weight * (causes.place.row(c) - causes.place.row(best)).squaredNorm();
  }
  return std::sqrt(spread / weights);
}

/// Place and size of the likeliest cause of the likeliest kind.
void tell_likeliest(const LocalCauses& causes, const OneMore& more, const Hypothesis& h,
                    const std::vector<FollowedCause>& followed, Unlisted& found) {
  found.kind =
      static_cast<LocalKind>(std::max_element(found.by_kind.begin(), found.by_kind.end()) - found.by_kind.begin());
  const VectorXd gain = over_sizes(more, h);
  const Index best = likeliest_of(causes, gain, found.kind);
  if (best < 0) return;
  const auto known = std::find_if(followed.begin(), followed.end(),
                                  [&found](const FollowedCause& one) { return one.kind == found.kind; });
  if (h.effects.empty() && known != followed.end() &&
      known->ln_gain > over_places(causes, gain)[static_cast<std::size_t>(found.kind)]) {
    found.place_mm = known->place_mm, found.within_mm = known->within_mm;
    found.size = known->size, found.low = known->low, found.high = known->high;
    found.effect = known->effect;
    return;
  }
  found.within_mm = spread_about(causes, gain, best);
  found.place_mm = causes.place.row(best);
  const auto [mean, sd] = size_of(more, h, best);
  found.size = causes.unit[best] * mean;
  found.low = causes.unit[best] * (mean - normal_reach95() * sd);
  found.high = causes.unit[best] * (mean + normal_reach95() * sd);
}

double sum_of(const std::array<double, local_kinds>& kinds) { return std::accumulate(kinds.begin(), kinds.end(), 0.0); }

/// A hypothesis with and without such a cause beside it.
void weigh_beside(double prior, const std::array<double, local_kinds>& gain, Hypothesis& h) {
  VectorXd logs(local_kinds + 1);
  for (std::size_t kind = 0; kind < local_kinds; ++kind)
    logs[static_cast<Index>(kind)] = std::log(prior / static_cast<double>(local_kinds)) + gain[kind];
  logs[local_kinds] = std::log1p(-prior);
  h.ln_unlisted = log_sum(logs);
  for (std::size_t kind = 0; kind < local_kinds; ++kind)
    h.with_unlisted[kind] = std::exp(logs[static_cast<Index>(kind)] - h.ln_unlisted);
}

}  // namespace

std::string local_kind_name(LocalKind kind) {
  switch (kind) {
    case LocalKind::tissue:
      return "tissue";
    case LocalKind::skin:
      return "skin";
    default:
      return "muscle";
  }
}

LocalCauses local_causes(const simulation::Mechanics& mechanics, const Patchiness& patchiness, const MatrixXd& shapes) {
  const PatchyFields fields = patchy_fields(mechanics, patchiness);
  const meshing::TetMesh& mesh = mechanics.mesh();
  LocalCauses all;
  all.columns.resize(shapes.rows(), 0);
  Index from = 0;
  const auto add = [&](LocalKind kind, const MatrixXd& modes, const FieldPlaces& places, double unit) {
    add_bumps(kind, shapes.middleCols(from, modes.cols()), modes, places, unit, all);
    from += modes.cols();
  };
  add(LocalKind::tissue, fields.tissue, places_of(mechanics, mesh.cells, 4), patchiness.tissue);
  add(LocalKind::skin, fields.skin, places_of(mechanics, mesh.faces(mechanics.layout().skin.faces, Eigen::all), 3),
      patchiness.skin);
  add(LocalKind::muscle, fields.muscle, interface_places(mechanics), patchiness.muscle_mm);
  return all;
}

VectorXd ln_gain_of_one_more(const LinearEvidence& evidence, const std::vector<int>& which, const Weighed& weighed,
                             const MatrixXd& columns, double sd) {
  return ln_gain(OneMore(evidence, columns), which, weighed, sd);
}

std::array<LikeliestCause, local_kinds> likeliest_causes(const LocalCauses& causes, const Hypothesis& h) {
  std::array<LikeliestCause, local_kinds> found;
  if (causes.columns.cols() == 0) return found;
  const OneMore more(*h.evidence, causes.columns);
  const VectorXd gain = over_sizes(more, h);
  const auto mean = over_places(causes, gain);
  for (std::size_t kind = 0; kind < local_kinds; ++kind) {
    LikeliestCause& one = found[kind];
    one.cause = likeliest_of(causes, gain, static_cast<LocalKind>(kind));
    if (one.cause < 0) continue;
    one.ln_gain = gain[one.cause], one.ln_of_kind = mean[kind];
    one.size = size_of(more, h, one.cause).first;
  }
  return found;
}

Unlisted weigh_unlisted(const BaseFit& base, const Priors& priors, std::vector<Hypothesis>& hypotheses,
                        const std::vector<FollowedCause>& followed) {
  Unlisted found;
  if (base.local.columns.cols() == 0 || !(priors.unlisted > 0)) return found;
  double most = -std::numeric_limits<double>::infinity();
  for (const Hypothesis& h : hypotheses) most = std::max(most, ln_weight(h));
  std::map<const LinearEvidence*, OneMore> by_evidence;
  for (Hypothesis& h : hypotheses) {
    std::array<double, local_kinds> gain{};
    if (ln_weight(h) > most - out_of_sight || h.effects.empty()) {
      const auto more = by_evidence.try_emplace(h.evidence.get(), *h.evidence, base.local.columns).first;
      gain = over_places(base.local, over_sizes(more->second, h));
      if (h.effects.empty()) take_followed(followed, gain);
    }
    weigh_beside(priors.unlisted, gain, h);
  }
  normalise(hypotheses);
  const Hypothesis* beside = &hypotheses.front();
  for (const Hypothesis& h : hypotheses) {
    for (std::size_t kind = 0; kind < local_kinds; ++kind) found.by_kind[kind] += h.probability * h.with_unlisted[kind];
    if (h.probability * sum_of(h.with_unlisted) > beside->probability * sum_of(beside->with_unlisted)) beside = &h;
  }
  found.probability = sum_of(found.by_kind);
  const auto more = by_evidence.find(beside->evidence.get());
  if (more != by_evidence.end()) tell_likeliest(base.local, more->second, *beside, followed, found);
  return found;
}

}  // namespace supine::diagnosis
