// SPDX-License-Identifier: Apache-2.0
// Which of the places seen are the person's: confirmed before it counts, held while it is hidden, given up when it is
// gone. The shirt says who it is; a body near where the person should be says that he is still there.
#pragma once
#include <cstdint>
#include <span>

#include "nodes/person_tracking/person_filter.hpp"
#include "rt/state_archive.hpp"
#include "rt/time/units.hpp"

namespace takt::person_tracking {

struct TrackerParameters {
  FilterParameters filter;
  double gate = 9.21;            ///< squared Mahalanobis distance within which a place may be the person's: 99 %
  int confirm = 3;               ///< consecutive images with the shirt until it counts
  double lost_after_s = 1.0;     ///< without shirt or body the person is lost
  double shirt_within_s = 3.0;   ///< nor do bodies alone hold him longer
  double unsure_within_s = 0.2;  ///< shirts that are not sure only go on with a person who was seen so lately
};

enum class Sight : uint8_t { none, body, shirt };

class PersonTracker {
 public:
  explicit PersonTracker(const TrackerParameters& parameters) : p_(parameters), filter_(parameters.filter) {}
  void tune(const TrackerParameters& parameters) {
    p_ = parameters;
    filter_.tune(parameters.filter);
  }

  /// One image: the shirts seen in it, the likeliest first, and bodies seen since the last one. Stamps do not fall. A
  /// track begins with the first shirt that is sure.
  void step(int64_t stamp_ns, std::span<const Place> shirts, std::span<const Place> bodies);
  /// No image: whoever was not seen for too long is lost.
  void wait(int64_t now_ns);

  bool active() const { return seen_in_a_row_ > 0 || tracked_; }  ///< confirmed or not
  bool tracked() const { return tracked_; }
  /// Of the step's person.
  Sight sight() const { return sight_; }
  size_t shirt() const { return shirt_; }  ///< which of the step's shirts, if sight() says so
  /// At the last step's stamp, and later.
  const Estimate& estimate() const { return filter_.estimate(); }
  Estimate at(int64_t stamp_ns) const;
  double unseen_s(int64_t now_ns) const { return to_seconds(now_ns - seen_ns_); }
  uint32_t number() const { return number_; }  ///< counts persons, those found again included
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, filter_, stamp_ns_, seen_ns_, shirt_ns_, seen_in_a_row_, tracked_, sight_, shirt_, number_);
  }

 private:
  /// Index of the place nearest to the expected one, within the gate, sure or lately seen; the list's size if there is
  /// none.
  size_t nearest(std::span<const Place> places) const;
  void note(Sight sight);

  TrackerParameters p_;
  PersonFilter filter_;
  int64_t stamp_ns_ = 0, seen_ns_ = 0, shirt_ns_ = 0;
  int seen_in_a_row_ = 0;
  bool tracked_ = false;
  Sight sight_ = Sight::none;
  size_t shirt_ = 0;
  uint32_t number_ = 0;
};

}  // namespace takt::person_tracking
