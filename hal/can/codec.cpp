// SPDX-License-Identifier: Apache-2.0
#include "hal/can/codec.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace takt::can {
namespace {

static_assert(std::endian::native == std::endian::little, "Intel signals are read as one number");

uint64_t mask(const Signal& signal) { return (uint64_t{1} << signal.bits) - 1; }

uint64_t number(const Frame& frame) { return std::bit_cast<uint64_t>(frame.data); }

int64_t raw(const Signal& signal, uint64_t bits) {
  const uint64_t field = bits >> signal.start & mask(signal);
  const bool negative = signal.is_signed && (field >> (signal.bits - 1) & 1) != 0;
  return static_cast<int64_t>(negative ? field | ~mask(signal) : field);
}

double physical(const Signal& signal, uint64_t bits) {
  return static_cast<double>(raw(signal, bits)) * signal.factor + signal.offset;
}

bool in_range(const Signal& signal, double value) {
  const double tolerance = signal.factor / 2;  // of the last bit
  return value > signal.low - tolerance && value < signal.high + tolerance;
}

/// The page that the values say; kEveryPage without pages.
template <class PageOf>
int page_of(const Message& message, PageOf page) {
  for (size_t i = 0; i < message.signals.size(); ++i) {
    if (message.signals[i].page == kPageNumber) return static_cast<int>(page(i));
  }
  return kEveryPage;
}

bool is_on(const Signal& signal, int page) { return signal.page < 0 || signal.page == page; }

}  // namespace

Frame encode(const Message& message, std::span<const double> values) {
  uint64_t bits = 0;
  const int page = page_of(message, [&](size_t i) { return values[i]; });
  for (size_t i = 0; i < message.signals.size(); ++i) {
    const Signal& signal = message.signals[i];
    if (!is_on(signal, page)) continue;
    const double value = std::clamp(std::isnan(values[i]) ? 0.0 : values[i], signal.low, signal.high);
    bits |= (static_cast<uint64_t>(std::llround((value - signal.offset) / signal.factor)) & mask(signal))
            << signal.start;
  }
  return {message.id, message.length, std::bit_cast<std::array<uint8_t, 8>>(bits)};
}

bool decode(const Message& message, const Frame& frame, std::span<double> values) {
  if (frame.length != message.length) return false;
  const uint64_t bits = number(frame);
  const int page = page_of(message, [&](size_t i) { return raw(message.signals[i], bits); });
  for (const Signal& signal : message.signals) {
    if (is_on(signal, page) && !in_range(signal, physical(signal, bits))) return false;
  }
  for (size_t i = 0; i < message.signals.size(); ++i) {
    if (is_on(message.signals[i], page)) values[i] = physical(message.signals[i], bits);
  }
  return true;
}

}  // namespace takt::can
