// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "diagnosis/examine.h"

namespace supine::diagnosis {

/// Steps of lines from what comes out first, at most.
inline constexpr std::size_t most_on_from_first = 5;

/// Sets of effects while they are followed through the chain (follow.h): the findings so far, which refits lines were
/// drawn from, and whether lines hold. Sets are told by ascending rows of the candidates. After everything that changes
/// an evidence the hypotheses are weighed anew.
class FollowedSets {
 public:
  FollowedSets(const Subject& what, const ExamineOptions& how, Findings& so_far)
      : subject(what), options(how), found(so_far) {}

  const Subject& subject;
  const ExamineOptions& options;
  Findings& found;

  /// Whether a refit ended far from what lines promised.
  bool lines_bend() const { return bent_; }
  bool first_holds_an_effect() const { return !found.hypotheses.front().effects.empty(); }
  void tell(const std::string& what, const std::vector<int>& effects) const;

  /// Whose errors a set is weighed under: those beside the most of it that they were measured beside.
  const BaseFit& ground_of(const std::vector<int>& effects) const;
  /// @pre  it was screened
  Hypothesis& hypothesis_of(const std::vector<int>& effects) const;
  bool was_screened(const std::vector<int>& effects) const;
  /// The solved refit of a set, or the end.
  std::vector<Refit>::iterator refit_of(const std::vector<int>& effects) const;
  /// The same, followed now where it was not; the number of refits where there is none.
  std::size_t refit_with(const std::vector<int>& effects);

  void weigh();
  void follow_one(std::vector<int> effects);
  /// A part of a set is followed from where the whole ended; of two fits of it the likelier is kept. Not weighed anew.
  void follow_within(const std::vector<int>& whole, const std::vector<int>& part);

  /// Strengths that are far from linear, of every set that is likely. @return  whether another set is the likeliest
  /// since
  bool settle_strengths();

  /// Lines from a refit to the set with each further effect, where none was drawn from a likelier part.
  void draw_from(std::size_t refit);
  bool were_drawn_from(std::size_t refit) const;
  /// Lines from refits that hold all of @p part may be drawn again.
  void forget_lines_with(const std::vector<int>& part);
  /// The refit of the likeliest hypothesis, where lines from it are of use and were not drawn yet; else the number of
  /// refits.
  std::size_t first_to_draw_from() const;
  /// Lines from the likeliest, where none were drawn yet, and what they promise followed. @return  whether there was
  /// any
  bool one_step_on_from_first();
  /// Whether "nothing" is followed from where a refit ended for the first time: a second one would end where that did.
  bool nothing_is_new_from(const Refit& refit);

 private:
  std::size_t next_to_settle() const;
  void hold_to_parts();
  double evidence_at(int refit) const;

  bool bent_ = false;
  std::vector<std::size_t> drawn_;                                          // refits
  std::vector<std::pair<std::vector<int>, Eigen::VectorXd>> nothing_from_;  // effects, and where the refit ended
};

}  // namespace supine::diagnosis
