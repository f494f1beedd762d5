// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/lms400/session.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace takt::lms400 {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kAnswer_ns = 1000 * kMs, kSilent_ns = 1000 * kMs, kAfterRefusal_ns = 1000 * kMs;
constexpr int kTries = 3;
constexpr double kTenThousandths = 1e4;

std::span<const uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

int64_t period_of(double rate_hz) { return std::llround(1e9 / rate_hz); }

}  // namespace

uint32_t beams_of(const ScanConfiguration& scan) {
  return static_cast<uint32_t>(std::lround(scan.fov_deg / scan.step_deg));
}

Session::Session(const SessionSettings& settings)
    : settings_(settings),
      configure_text_(configure_scan(settings.scan)),
      receiver_(Parser{}),
      instants_(period_of(settings.scan.rate_hz)),
      period_ns_(period_of(settings.scan.rate_hz)) {
  scan_.range_m.assign(beams_of(settings.scan), 0.0f);
}

ScanFormat Session::format() const {
  constexpr double kDegree = std::numbers::pi / 180;
  const ScanConfiguration& scan = settings_.scan;
  ScanFormat format;
  format.beams = beams_of(scan);
  format.first_angle_rad = (scan.first_deg - 90) * kDegree;
  format.step_rad = scan.step_deg * kDegree;
  format.max_range_m = settings_.max_range_m;
  format.sweep_s = 1 / scan.rate_hz;  // at most: how much of its period a sweep takes is not documented
  const size_t bytes = kFraming + 38 + 2 * size_t{format.beams};
  const double sending_s = static_cast<double>(bytes) * static_cast<double>(byte_time_ns(settings_.baud)) * 1e-9;
  const double interval_s = std::max(1.0, std::ceil(sending_s * scan.rate_hz)) / scan.rate_hz;
  format.rate_hz = 1 / interval_s;
  format.stamps = {std::llround(1e9 * (format.sweep_s + sending_s)), std::llround(1e9 * interval_s), 0, {}};
  return format;
}

// The conversation ---------------------------------------------------------------------------------------------------

void Session::begin(int64_t now_ns) {
  receiver_.begin(0);
  order_baud_ = settings_.baud != 0;
  order_reopen_ = false;
  trouble_ = "no answer yet";
  remark_ = "";
  not_before_ns_ = now_ns;
  enter(Step::stop, now_ns);
}

void Session::line_has(uint32_t baud) {
  receiver_.begin(baud);
  if (baud != settings_.baud) remark_ = "the serial line does not do the rate asked for";
}

void Session::ask(std::string_view text) {
  request_text_ = text;
  request_ = Frame(bytes_of(text));
  tries_ = 0;
  unsent_ = true;
}

void Session::enter(Step step, int64_t now_ns) {
  step_ = step;
  switch (step) {
    case Step::stop: return ask(kStop);
    case Step::login: return ask(kLogin);
    case Step::configure: return ask(configure_text_);
    case Step::run: return ask(kRun);
    case Step::request: return ask(kSendDistances);
    case Step::stream:
      instants_ = PeriodicInstants(period_ns_);
      number_.reset();
      last_scan_ns_ = now_ns;
      return;
  }
}

LineOrder Session::repeat(int64_t now_ns) {
  unsent_ = false;
  ++tries_;
  deadline_ns_ = now_ns + kAnswer_ns;
  return LineOrder::send(request_.bytes());
}

LineOrder Session::farewell() {
  ask(kStop);
  return repeat(0);
}

LineOrder Session::next(int64_t now_ns) {
  if (std::exchange(order_baud_, false)) return LineOrder::set_baud(settings_.baud);
  if (std::exchange(order_reopen_, false)) return LineOrder::reopen();
  if (now_ns < not_before_ns_) return LineOrder::wait(not_before_ns_);
  if (step_ == Step::stream) {
    if (now_ns < last_scan_ns_ + kSilent_ns) return LineOrder::wait(last_scan_ns_ + kSilent_ns);
    trouble_ = "the scanner has stopped sending scans";
    return LineOrder::reopen();
  }
  if (unsent_) return repeat(now_ns);
  if (now_ns < deadline_ns_) return LineOrder::wait(deadline_ns_);
  if (tries_ < kTries) return repeat(now_ns);
  trouble_ = "the scanner does not answer";
  return LineOrder::reopen();
}

void Session::refuse(const char* why, int64_t now_ns) {
  trouble_ = why;
  not_before_ns_ = now_ns + kAfterRefusal_ns;
  enter(Step::stop, now_ns);
}

const ReceivedScan* Session::receive(std::span<const uint8_t> bytes, int64_t now_ns) {
  scan_ready_ = false;
  receiver_.receive(bytes, now_ns, [&](const Event& event) { hear(event, now_ns); });
  return scan_ready_ ? &scan_ : nullptr;
}

void Session::hear(const Event& event, int64_t now_ns) {
  if (event.kind != EventKind::frame) return receiver_.count_damage();
  if (const auto measurement = read_measurement(event.payload))
    return hear_measurement(*measurement, event.position, now_ns);
  if (const auto answer = read_answer(event.payload)) hear_answer(*answer, now_ns);
}

void Session::hear_answer(const Answer& answer, int64_t now_ns) {
  if (step_ == Step::stream || unsent_) return;
  if (answer.kind == Kind::fault) return refuse("the scanner refuses a command", now_ns);
  if (answer.kind != Kind::result || answer.name != name_of(request_text_)) return;
  switch (step_) {
    case Step::stop: return enter(Step::login, now_ns);
    case Step::login:
      if (read_hex(answer.word(0)) != 1u) return refuse("the scanner refuses the login", now_ns);
      return enter(Step::configure, now_ns);
    case Step::configure: return hear_configuration(answer, now_ns);
    case Step::run: return enter(Step::request, now_ns);
    case Step::request:
      if (read_hex(answer.word(0)) != 0u) return refuse("the scanner refuses to send distances", now_ns);
      return enter(Step::stream, now_ns);
    case Step::stream: return;
  }
}

/// Not every pair of rate and resolution is possible: the scanner says what it made of them.
void Session::hear_configuration(const Answer& answer, int64_t now_ns) {
  const auto rate_hz = read_float_bits(answer.word(1)), step_deg = read_float_bits(answer.word(2));
  const ScanConfiguration& asked = settings_.scan;
  if (read_hex(answer.word(0)) != 0u || !rate_hz || !step_deg || !(*rate_hz >= 1 && *rate_hz <= 10'000))
    return refuse("the scanner refuses rate, resolution or field of view", now_ns);
  if (!(std::abs(static_cast<double>(*step_deg) - asked.step_deg) < 0.01 * asked.step_deg))
    return refuse("the scanner cannot do this resolution at this rate", now_ns);
  period_ns_ = period_of(static_cast<double>(*rate_hz));
  if (std::abs(static_cast<double>(*rate_hz) - asked.rate_hz) > 0.01 * asked.rate_hz)
    remark_ = "the scanner measures at another rate than was asked for";
  enter(Step::run, now_ns);
}

void Session::hear_measurement(const Measurement& m, uint64_t position, int64_t now_ns) {
  if (step_ != Step::stream) return;  // of a stream that is being stopped or has just been asked for
  const ScanConfiguration& asked = settings_.scan;
  if (m.format == Format::remission || m.count() != scan_.range_m.size() ||
      m.step_tdeg != std::lround(asked.step_deg * kTenThousandths) ||
      m.first_tdeg != std::lround(asked.first_deg * kTenThousandths)) {
    receiver_.count_damage();
    return;
  }
  last_scan_ns_ = now_ns;
  for (size_t i = 0; i < m.count(); ++i) {
    const double range_m = 0.001 * m.distance(i) * m.distance_scale;
    scan_.range_m[i] = range_m <= settings_.max_range_m ? static_cast<float>(range_m) : 0.0f;
  }
  scan_.stamp_ns = instants_.refine(receiver_.began_ns(position) - period_ns_);
  if (sweeps_ > 0) {
    const uint32_t apart = number_ ? std::max<uint32_t>(1, static_cast<uint16_t>(m.number - *number_)) : 1;
    scan_number_ += apart;
    missing_ += apart - 1;
  }
  number_ = m.number;
  scan_.scan_number = scan_number_;
  scan_ready_ = true;
  ++sweeps_;
  trouble_ = remark_;
}

}  // namespace takt::lms400
