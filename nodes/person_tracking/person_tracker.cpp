// SPDX-License-Identifier: Apache-2.0
#include "nodes/person_tracking/person_tracker.hpp"

#include <algorithm>

namespace takt::person_tracking {

void PersonTracker::wait(int64_t now_ns) {
  sight_ = Sight::none;
  if (!tracked_) return;
  if (to_seconds(now_ns - seen_ns_) <= p_.lost_after_s && to_seconds(now_ns - shirt_ns_) <= p_.shirt_within_s) return;
  tracked_ = false;
  seen_in_a_row_ = 0;
}

Estimate PersonTracker::at(int64_t stamp_ns) const {
  return filter_.after(std::max(0.0, to_seconds(stamp_ns - stamp_ns_)));
}

void PersonTracker::step(int64_t stamp_ns, std::span<const Place> shirts, std::span<const Place> bodies) {
  wait(stamp_ns);
  if (active()) filter_.predict(std::max(0.0, to_seconds(stamp_ns - stamp_ns_)));
  stamp_ns_ = stamp_ns;
  shirt_ = active() ? nearest(shirts) : shirts.size();
  if (shirt_ < shirts.size()) {
    filter_.update(shirts[shirt_]);
    note(Sight::shirt);
  } else if (tracked_) {
    const size_t body = nearest(bodies);
    if (body == bodies.size()) return;
    filter_.update(bodies[body]);
    note(Sight::body);
  } else {
    seen_in_a_row_ = 0;  // nobody yet, or a candidate that was not seen again
    const auto first = std::find_if(shirts.begin(), shirts.end(), [](const Place& shirt) { return shirt.sure; });
    if (first == shirts.end()) return;
    shirt_ = static_cast<size_t>(first - shirts.begin());
    filter_.begin(*first);
    note(Sight::shirt);
  }
}

void PersonTracker::note(Sight sight) {
  sight_ = sight;
  seen_ns_ = stamp_ns_;
  if (sight != Sight::shirt) return;
  shirt_ns_ = stamp_ns_;
  if (tracked_ || ++seen_in_a_row_ < p_.confirm) return;
  tracked_ = true;
  ++number_;
}

size_t PersonTracker::nearest(std::span<const Place> places) const {
  size_t best = places.size();
  double least = p_.gate;
  const bool lately = unseen_s(stamp_ns_) <= p_.unsure_within_s;  // afterwards the gate is wide
  for (size_t i = 0; i < places.size(); ++i) {
    if (!places[i].sure && !lately) continue;
    if (const double d2 = filter_.distance2(places[i]); d2 <= least) least = d2, best = i;
  }
  return best;
}

}  // namespace takt::person_tracking
