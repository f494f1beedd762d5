// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/lms400/lms400_double.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "hal/laser/lms400/session.hpp"

namespace takt::lms400 {
namespace {

constexpr int64_t kMs = 1'000'000, kAnswerAfter_ns = 2 * kMs;
constexpr double kLargest_m = 3.6;

std::string hex(uint32_t value) {
  std::array<char, 9> text;
  std::snprintf(text.data(), text.size(), "%08X", value);
  return text.data();
}

}  // namespace

Lms400Double::Lms400Double(std::unique_ptr<ByteStream> stream, RangeSource source, uint32_t baud, int64_t on_ns)
    : LineDouble(std::move(stream)), source_(std::move(source)), last_end_ns_(on_ns) {
  line().set_baud(baud);
}

void Lms400Double::hear(std::span<const uint8_t> bytes, int64_t now_ns) {
  parse(parser_, bytes, [&](const Event& event) {
    if (event.kind != EventKind::frame) return;
    obey({reinterpret_cast<const char*>(event.payload.data()), event.payload.size()}, now_ns);
  });
}

void Lms400Double::say_text(std::string_view text, int64_t at_ns) {
  say(at_ns, Frame({reinterpret_cast<const uint8_t*>(text.data()), text.size()}).bytes());
}

void Lms400Double::obey(std::string_view text, int64_t now_ns) {
  const std::string name(name_of(text));
  const int64_t at_ns = now_ns + kAnswerAfter_ns;
  if (text.starts_with("sWN ")) return say_text("sWA " + name, at_ns);
  const bool known = name == "mLRstopdata" || name == "SetAccessMode" || name == "Run" || name == "mSCsetscanconfig" ||
                     name == "mLRreqdata";
  if (!text.starts_with("sMN ") || !known) return say_text("sFA FF", at_ns);
  say_text("sMA " + name, at_ns);
  const std::string_view arguments = text.substr(std::min(text.size(), 4 + name.size() + 1));
  if (name == "mSCsetscanconfig") return configure(arguments, at_ns);
  if (name == "SetAccessMode") logged_in_ = text == kLogin;
  if (name == "Run") logged_in_ = false;
  if (name == "mLRstopdata") streaming_ = false;
  if (name == "mLRreqdata") streaming_ = true;
  const char* result = name == "SetAccessMode" ? (logged_in_ ? " 1" : " 0") : name == "Run" ? " 1" : " 00000000";
  say_text("sAN " + name + result, at_ns);
}

void Lms400Double::configure(std::string_view arguments, int64_t at_ns) {
  ScanConfiguration wanted;
  const std::string text(arguments);
  const bool good = std::sscanf(text.c_str(), "%lf %lf %lf %lf", &wanted.rate_hz, &wanted.step_deg, &wanted.first_deg,
                                &wanted.fov_deg) == 4 &&
                    wanted.rate_hz >= 200 && wanted.rate_hz <= 500 && wanted.step_deg >= 0.1 && wanted.step_deg <= 1 &&
                    wanted.first_deg >= 55 && wanted.fov_deg >= wanted.step_deg &&
                    wanted.first_deg + wanted.fov_deg <= 125.001;
  if (good && logged_in_) scan_ = wanted;
  const auto bits = [](double value) { return hex(std::bit_cast<uint32_t>(static_cast<float>(value))); };
  say_text("sAN mSCsetscanconfig " + hex(good && logged_in_ ? 0 : 1) + " " + bits(scan_.rate_hz) + " " +
               bits(scan_.step_deg) + " 0000000A",
           at_ns);
}

void Lms400Double::act(int64_t now_ns) {
  const int64_t period_ns = std::llround(1e9 / scan_.rate_hz);
  // Nobody looks at scans that passed long ago.
  if (const int64_t passed = (now_ns - last_end_ns_) / period_ns - 64; passed > 0) {
    last_end_ns_ += passed * period_ns;
    number_ = static_cast<uint16_t>(number_ + passed);
  }
  while (last_end_ns_ + period_ns <= now_ns) {
    last_end_ns_ += period_ns;
    ++number_;
    if (streaming_ && line().free_ns() <= last_end_ns_) send_scan(last_end_ns_);
  }
}

void Lms400Double::send_scan(int64_t end_ns) {
  const size_t beams = beams_of(scan_);
  const double period_s = 1 / scan_.rate_hz;
  if (misbehaviour() != Misbehaviour::frozen || range_m_.size() != beams) {
    range_m_.assign(beams, 0.0f);
    constexpr double kDegree = std::numbers::pi / 180;
    source_(
        {end_ns - std::llround(1e9 * period_s), (scan_.first_deg - 90) * kDegree, scan_.step_deg * kDegree, period_s},
        range_m_);
  }
  beams_.resize(2 * beams);
  for (size_t i = 0; i < beams; ++i) {
    const double range = static_cast<double>(range_m_[i]);
    const auto distance = static_cast<uint16_t>(range <= kLargest_m ? std::lround(1e3 * range) : 0);
    beams_[2 * i] = static_cast<uint8_t>(distance);
    beams_[2 * i + 1] = static_cast<uint8_t>(distance >> 8);
  }
  Measurement m;
  m.first_tdeg = static_cast<int32_t>(std::lround(scan_.first_deg * 1e4));
  m.step_tdeg = static_cast<uint16_t>(std::lround(scan_.step_deg * 1e4));
  m.rate_hz = static_cast<uint16_t>(std::lround(scan_.rate_hz));
  m.remission_end = 255;
  m.beams = beams_;
  m.number = number_;
  payload_.resize(kLargestPayload);
  const size_t size = write_measurement(m, payload_);
  say(end_ns, Frame(std::span(payload_).first(size)).bytes());
  ++scans_sent_;
}

}  // namespace takt::lms400
