// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/failing_devices.hpp"

#include <algorithm>
#include <cstring>

namespace takt::sim {
namespace {

size_t row_bytes(ImageView<uint8_t> image) {
  return static_cast<size_t>(image.width) * static_cast<size_t>(image.channels);
}

void keep(ImageView<uint8_t> from, std::vector<uint8_t>& to) {
  for (int y = 0; y < from.height; ++y)
    std::memcpy(to.data() + static_cast<size_t>(y) * row_bytes(from), from.row(y), row_bytes(from));
}

void give_again(const std::vector<uint8_t>& from, ImageView<uint8_t> to) {
  for (int y = 0; y < to.height; ++y)
    std::memcpy(to.row(y), from.data() + static_cast<size_t>(y) * row_bytes(to), row_bytes(to));
}

/// As a transfer that broke off: the lower half never came.
void damage(ImageView<uint8_t> image) {
  for (int y = image.height / 2; y < image.height; ++y) std::memset(image.row(y), 0, row_bytes(image));
}

}  // namespace

DeviceResult FailingCamera::open() {
  DeviceResult opened = inner().open();
  if (!opened) return opened;
  const StereoFormat format = inner().format();
  const size_t bytes =
      static_cast<size_t>(format.width) * static_cast<size_t>(format.height) * static_cast<size_t>(format.channels);
  kept_left_.resize(bytes);
  kept_right_.resize(bytes);
  return opened;
}

void FailingCamera::trigger(int64_t at_ns) {
  triggered_ns_ = at_ns;
  inner().trigger(at_ns);
}

StereoFrame FailingCamera::read(ImageView<uint8_t> left, ImageView<uint8_t> right, int64_t deadline_ns) {
  const auto failure = failure_at(triggered_ns_.value_or(clock_.now_ns()));
  if (const auto status = nothing(failure)) return {*status};
  StereoFrame frame = inner().read(left, right, deadline_ns);
  if (frame.status != ReadStatus::ok || !failure) return frame;
  if (*failure == Misbehaviour::garbage) {
    frame.status = ReadStatus::partial;
    damage(left);
    damage(right);
  } else if (!std::exchange(kept_, true)) {
    keep(left, kept_left_);
    keep(right, kept_right_);
  } else {
    give_again(kept_left_, left);
    give_again(kept_right_, right);
  }
  return frame;
}

DeviceResult FailingLaser::open() {
  DeviceResult opened = inner().open();
  if (opened) kept_range_m_.resize(inner().format().beams);
  return opened;
}

ScanReading FailingLaser::read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) {
  const auto failure = failure_at(wanted_ns);
  if (const auto status = nothing(failure)) return {*status};
  ScanReading reading = inner().read(range_m, wanted_ns, deadline_ns);
  if (reading.status != ReadStatus::ok || !failure) return reading;
  const size_t beams = std::min(range_m.size(), kept_range_m_.size());
  const auto given = range_m.begin();
  if (*failure == Misbehaviour::garbage) {
    reading.status = ReadStatus::partial;
    std::fill(given + static_cast<std::ptrdiff_t>(beams / 2), range_m.end(), 0.0f);
  } else if (!std::exchange(kept_, true)) {
    std::copy_n(given, beams, kept_range_m_.begin());
  } else {
    std::copy_n(kept_range_m_.begin(), beams, given);
  }
  return reading;
}

HeadReading FailingHead::read(int64_t wanted_ns, int64_t deadline_ns) {
  const auto failure = failure_at(wanted_ns);
  if (const auto status = nothing(failure)) return {*status};
  HeadReading reading = inner().read(wanted_ns, deadline_ns);
  spoil(reading, kept_reading_, failure);
  return reading;
}

BaseReading FailingBase::read(int64_t wanted_ns, int64_t deadline_ns) {
  const auto failure = failure_at(wanted_ns);
  if (const auto status = nothing(failure)) return {*status};
  BaseReading reading = inner().read(wanted_ns, deadline_ns);
  spoil(reading, kept_reading_, failure);
  return reading;
}

LinesReading FailingLines::read(int64_t wanted_ns) {
  const auto failure = failure_at(wanted_ns);
  if (const auto status = nothing(failure)) return {*status};
  LinesReading reading = inner().read(wanted_ns);
  spoil(reading, kept_reading_, failure);
  return reading;
}

DeviceResult FailingObjectSensor::open() {
  DeviceResult opened = inner().open();
  if (!opened) return opened;
  kept_names_.reserve(inner().most_objects());
  kept_places_.reserve(inner().most_objects());
  kept_attributes_.reserve(8 * size_t{inner().most_objects()});
  return opened;
}

ObjectReading FailingObjectSensor::read(ObjectReports& reports, int64_t wanted_ns, int64_t deadline_ns) {
  const auto failure = failure_at(wanted_ns);
  if (const auto status = nothing(failure)) return {*status};
  ObjectReading reading = inner().read(reports, wanted_ns, deadline_ns);
  if (reading.status != ReadStatus::ok || !failure) return reading;
  const auto keep = [](const auto& from, auto& to) { to.assign(from.data(), from.data() + from.size); };
  const auto give = [](const auto& from, auto& to) {
    to.resize(from.size());
    std::copy(from.begin(), from.end(), to.data());
  };
  if (*failure == Misbehaviour::garbage) {
    reading.status = ReadStatus::partial;
    reports.places.resize(reports.places.size / 2);
  } else if (!std::exchange(kept_, true)) {
    keep(reports.names, kept_names_);
    keep(reports.places, kept_places_);
    keep(reports.attributes, kept_attributes_);
  } else {
    give(kept_names_, reports.names);
    give(kept_places_, reports.places);
    give(kept_attributes_, reports.attributes);
  }
  return reading;
}

ActorReading FailingActor::read(int64_t wanted_ns, int64_t deadline_ns) {
  // Also while it is silent: what it does goes on, and other robots wait for its instants.
  ActorReading reading = inner().read(wanted_ns, deadline_ns);
  const auto failure = failure_at(wanted_ns);
  if (const auto status = nothing(failure)) return {*status, 0, {}};
  spoil(reading, kept_reading_, failure);
  return reading;
}

}  // namespace takt::sim
