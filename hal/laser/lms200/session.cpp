// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/lms200/session.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace takt::lms200 {
namespace {

constexpr int64_t kMs = 1'000'000;
/// The manual's 60 ms, and what adapters and schedulers add.
constexpr int64_t kAck_ns = 150 * kMs;
constexpr int64_t kReply_ns = 1000 * kMs, kModeReply_ns = 3000 * kMs, kWriteReply_ns = 15'000 * kMs;
constexpr int64_t kAfterNak_ns = 30 * kMs, kAfterNewRate_ns = 250 * kMs;
/// The scanner loses bytes that follow one another faster than 55 us: at 500000 baud they would.
constexpr int64_t kSlowly_ns = 60'000;
constexpr int kTries = 3;

}  // namespace

bool valid(const Variant& v) {
  return (v.angle_deg == 100 || v.angle_deg == 180) && (v.step_cdeg == 100 || v.step_cdeg == 50 || v.step_cdeg == 25);
}

Session::Session(const SessionSettings& settings)
    : settings_(settings),
      receiver_(Parser::of_replies()),
      instants_(turns_of(settings.variant) * kTurn_ns),
      wanted_baud_(settings.baud) {
  assembled_.range_m.assign(beams_of(settings.variant), 0.0f);
  whole_ = assembled_;
}

int64_t Session::telegram_ns(uint32_t baud) const {
  const int64_t beams = interlaced(settings_.variant) ? 181 : beams_of(settings_.variant);
  return (2 * beams + 10) * byte_time_ns(baud);
}

int64_t Session::interval_ns(uint32_t baud) const {
  return (telegram_ns(baud) + scan_ns() - 1) / scan_ns() * scan_ns();
}

ScanFormat Session::format() const {
  const double degree = std::numbers::pi / 180, fov_deg = settings_.variant.angle_deg;
  const int bits = distance_bits(settings_.measuring_mode).value_or(13);
  ScanFormat format;
  format.beams = beams_of(settings_.variant);
  format.first_angle_rad = -fov_deg / 2 * degree;
  format.step_rad = settings_.variant.step_cdeg * 0.01 * degree;
  format.max_range_m = largest_distance(bits) * (settings_.millimetres ? 0.001 : 0.01);
  format.sweep_s = fov_deg / 360 * static_cast<double>(kTurn_ns) * 1e-9;
  format.rate_hz = 1e9 / static_cast<double>(interval_ns(settings_.baud));
  // The oldest scan that a read can get: measured, sent, and all but followed by the next one.
  format.stamps = {scan_ns() + telegram_ns(settings_.baud), interval_ns(settings_.baud), 0, {}};
  return format;
}

/// Each rate three times in vain but for the last, then what is asked and set, at 9600 baud where no more is wanted.
int64_t Session::starts_within_ns() const { return 5000 * kMs; }

// The conversation ---------------------------------------------------------------------------------------------------

void Session::begin(int64_t now_ns) {
  wanted_baud_ = settings_.baud;
  highest_baud_ = kBauds.front();
  remark_ = "";
  // After a host that died it may still send, at the rate wanted; trying that first also shows whether the line can.
  try_rate(wanted_baud_);
  trouble_ = "no answer yet";
  error_ = "";
  not_before_ns_ = now_ns;
  last_scan_ns_ = now_ns;
  enter(Step::find, now_ns);
}

void Session::try_rate(uint32_t baud) {
  order_baud_ = baud_ = baud;
  rate_proven_ = false;
}

void Session::try_next_rate() {
  constexpr std::array<uint32_t, 4> kLikely{9600, 38400, 500000, 19200};
  const uint32_t before = baud_;
  for (size_t i = 0; i < kLikely.size(); ++i) {
    const uint32_t baud = kLikely[next_rate_++ % kLikely.size()];
    if (baud != before && baud <= highest_baud_) return try_rate(baud);
  }
}

void Session::line_has(uint32_t baud) {
  receiver_.begin(baud_);
  const auto wrong = std::abs(static_cast<int64_t>(baud) - static_cast<int64_t>(baud_));
  if (baud == 0 || wrong * 50 <= baud_) return;  // a UART bears some 2 %
  const auto lower = std::find_if(kBauds.begin(), kBauds.end(), [&](uint32_t known) { return known < baud_; });
  if (lower == kBauds.end()) return;
  highest_baud_ = *lower;
  if (wanted_baud_ > highest_baud_) {
    wanted_baud_ = highest_baud_;
    remark_ = "the serial line does not do the rate asked for: a lower one is used";
  }
  try_rate(highest_baud_);
}

void Session::ask(const Telegram& telegram, Reply reply, int64_t reply_within_ns) {
  request_ = telegram;
  reply_ = reply;
  reply_within_ns_ = reply_within_ns;
  tries_ = 0;
  unsent_ = true;
}

void Session::enter(Step step, int64_t now_ns) {
  step_ = step;
  switch (step) {
    case Step::find: return ask(switch_mode(Mode::on_request), Reply::mode, kModeReply_ns);
    case Step::raise: return ask(switch_baud(wanted_baud_), Reply::mode, kModeReply_ns);
    case Step::confirm:
    case Step::health: return ask(command(Command::status), Reply::status, kReply_ns);
    case Step::type: return ask(command(Command::type), Reply::type, kReply_ns);
    case Step::variant: {
      // Partial scans are asked for by the mode of the stream, and come of a variant of whole degrees.
      const Variant& v = settings_.variant;
      return ask(switch_variant(interlaced(v) ? Variant{v.angle_deg, 100} : v), Reply::variant, kModeReply_ns);
    }
    case Step::read: return ask(command(Command::read_configuration), Reply::configuration, kReply_ns);
    case Step::install: return ask(enter_installation(), Reply::mode, kModeReply_ns);
    case Step::write: return ask(write_configuration(configuration_), Reply::configuration_written, kWriteReply_ns);
    case Step::leave: return ask(switch_mode(Mode::on_request), Reply::mode, kModeReply_ns);
    case Step::errors: return ask(command(Command::errors), Reply::errors, kReply_ns);
    case Step::start:
      return ask(switch_mode(interlaced(settings_.variant) ? Mode::stream_partial : Mode::stream), Reply::mode,
                 kModeReply_ns);
    case Step::run:
      instants_.reset();
      next_quarter_ = 0;
      last_scan_ns_ = now_ns;
      return;
  }
}

void Session::fail(const char* why, int64_t now_ns) {
  trouble_ = why;
  if (!rate_proven_) try_next_rate();
  rate_proven_ = false;
  enter(Step::find, now_ns);
}

LineOrder Session::next(int64_t now_ns) {
  if (order_baud_ != 0) return LineOrder::set_baud(std::exchange(order_baud_, 0));
  if (now_ns < not_before_ns_) return LineOrder::wait(not_before_ns_);
  if (step_ == Step::run) {
    const int64_t silent_ns = last_scan_ns_ + std::max(1000 * kMs, 4 * interval_ns(baud_));
    if (now_ns < silent_ns) return LineOrder::wait(silent_ns);
    fail("the scanner has stopped sending scans", now_ns);
    return next(now_ns);
  }
  if (unsent_) return repeat(now_ns);
  if (now_ns < deadline_ns_) return LineOrder::wait(deadline_ns_);
  if (tries_ < kTries) return repeat(now_ns);
  fail(acknowledged_            ? "the scanner takes commands but does not answer them"
       : step_ == Step::confirm ? "the scanner does not answer at the rate it was asked to use"
                                : "the scanner does not answer: is it on, is the cable the right one?",
       now_ns);
  return next(now_ns);
}

LineOrder Session::repeat(int64_t now_ns) {
  unsent_ = acknowledged_ = false;
  ++tries_;
  deadline_ns_ = now_ns + kAck_ns + static_cast<int64_t>(request_.bytes().size()) * byte_time_ns(baud_);
  return LineOrder::send(request_.bytes(), byte_time_ns(baud_) < kSlowly_ns ? kSlowly_ns : 0);
}

LineOrder Session::farewell() {
  request_ = switch_mode(Mode::on_request);
  return repeat(0);
}

const ReceivedScan* Session::receive(std::span<const uint8_t> bytes, int64_t now_ns) {
  scan_ready_ = false;
  receiver_.receive(bytes, now_ns, [&](const Event& event) { hear(event, now_ns); });
  return scan_ready_ ? &whole_ : nullptr;
}

void Session::hear(const Event& event, int64_t now_ns) {
  const bool asking = step_ != Step::run && !unsent_;
  switch (event.kind) {
    case EventKind::ack:
      if (!asking || acknowledged_) return;
      acknowledged_ = true;
      deadline_ns_ = now_ns + reply_within_ns_;
      return;
    case EventKind::nak:
      if (!asking || acknowledged_) return;
      not_before_ns_ = deadline_ns_ = now_ns + kAfterNak_ns;
      return;
    case EventKind::crc_error:  // perhaps of the reply that is waited for
    case EventKind::length_error:
      receiver_.count_damage();
      if (asking && acknowledged_) deadline_ns_ = std::min(deadline_ns_, now_ns + kAck_ns);
      return;
    case EventKind::telegram: break;
  }
  const auto code = reply_code(event.payload);
  if (!code) return;
  if (!std::exchange(rate_proven_, true) && step_ == Step::find) tries_ = 0;  // it is there, and busy sending
  if (*code == Reply::scan) return hear_scan(event.payload, event.position, now_ns);
  if (*code == Reply::power_on && step_ != Step::find) return fail("the scanner was switched on just now", now_ns);
  if (!asking) return;
  if (*code == Reply::not_permitted) return fail("the scanner does not permit a command", now_ns);
  if (*code == reply_) hear_reply(event.payload, now_ns);
}

void Session::hear_reply(std::span<const uint8_t> payload, int64_t now_ns) {
  const bool done = read_success(payload);
  switch (step_) {
    case Step::find:
      if (done) enter(baud_ == wanted_baud_ ? Step::type : Step::raise, now_ns);
      return;
    case Step::raise:
      if (!done) return fail("the scanner refuses the rate asked for", now_ns);
      try_rate(wanted_baud_);
      not_before_ns_ = now_ns + kAfterNewRate_ns;
      return enter(Step::confirm, now_ns);
    case Step::confirm: return enter(Step::type, now_ns);
    case Step::type:
      if (!read_text(payload).starts_with("LMS2")) remark_ = "the scanner says that it is no LMS 2xx";
      return enter(Step::variant, now_ns);
    case Step::variant:
      if (!done) return fail("the scanner refuses field of view and resolution", now_ns);
      return enter(Step::read, now_ns);
    case Step::read: return hear_configuration(payload, now_ns);
    case Step::install:
      if (!done) return fail("the scanner refuses the installation password", now_ns);
      return enter(Step::write, now_ns);
    case Step::write:
      if (!done) return fail("the scanner refuses its configuration", now_ns);
      return enter(Step::leave, now_ns);
    case Step::leave: return enter(Step::health, now_ns);
    case Step::health:
      status_ = read_status(payload);
      if (status_ && status_->defective) remark_ = "the scanner says that it is defective";
      return enter(Step::start, now_ns);
    case Step::start:
      if (!done) return fail("the scanner refuses to stream scans", now_ns);
      return enter(Step::run, now_ns);
    case Step::errors:
      if (const auto number = read_error(payload)) error_ = trouble_ = error_text(*number);
      return enter(Step::run, now_ns);
    case Step::run: return;
  }
}

/// Its memory bears few writes: only a real difference is written.
void Session::hear_configuration(std::span<const uint8_t> payload, int64_t now_ns) {
  const auto found = read_configuration(payload);
  if (!found) return fail("the scanner's configuration cannot be read", now_ns);
  const bool right =
      found->measuring_mode() == settings_.measuring_mode && found->millimetres() == settings_.millimetres;
  configuration_ = *found;
  configuration_.set(settings_.measuring_mode, settings_.millimetres);
  enter(right ? Step::health : Step::install, now_ns);
}

// Scans --------------------------------------------------------------------------------------------------------------

void Session::hear_scan(std::span<const uint8_t> payload, uint64_t position, int64_t now_ns) {
  if (!running()) return;  // of a stream that is being stopped, measured as nobody here asked
  const auto scan = read_scan(payload);
  if (!scan || scan->millimetres != settings_.millimetres || scan->partial != interlaced(settings_.variant) ||
      scan->beams() != beams_in(*scan)) {
    receiver_.count_damage();
    return;
  }
  last_scan_ns_ = now_ns;
  if (!hear_status(scan->status, now_ns)) return receiver_.count_damage();
  // The first beam left when the first of its turns began; the telegram began when the last one had ended.
  const int64_t turns_ns = scan->partial ? kTurn_ns : scan_ns();
  if (!assemble(*scan, receiver_.began_ns(position) - turns_ns)) return;
  if (!sees()) return receiver_.count_damage();
  std::swap(assembled_, whole_);
  whole_.stamp_ns = instants_.refine(whole_.stamp_ns);
  // Scans that no line of this rate can carry are not counted as lost.
  const int64_t interval_ns = this->interval_ns(baud_);
  const int64_t intervals = (instants_.periods() * scan_ns() + interval_ns / 2) / interval_ns;
  if (sweeps_++ > 0) {
    pace_ += intervals;
    scan_number_ = std::max(scan_number_ + 1, static_cast<uint32_t>(pace_));
    missing_ = static_cast<uint64_t>(std::max<int64_t>(0, static_cast<int64_t>(missing_) + intervals - 1));
  }
  whole_.scan_number = scan_number_;
  scan_ready_ = true;
  trouble_ = (scan->status & kImplausible) != 0 ? "the scanner says that values are implausible"
             : (scan->status & kPolluted) != 0  ? "the scanner says that its front pane is dirty"
                                                : remark_;
}

bool Session::hear_status(uint8_t status, int64_t now_ns) {
  const bool in_error = severity(status) >= Severity::error;
  if (in_error && *error_ == 0) {
    error_ = trouble_ = error_text(0);
    enter(Step::errors, now_ns);
  }
  if (!in_error) error_ = "";
  return !in_error;
}

// Of a few blinded beams the way may be judged (they are NaN), of a blinded scanner not.
bool Session::sees() {
  const auto blind = static_cast<double>(std::count_if(assembled_.range_m.begin(), assembled_.range_m.end(),
                                                       [](float range) { return std::isnan(range); }));
  if (blind <= settings_.blinded_max * static_cast<double>(assembled_.range_m.size())) return true;
  trouble_ = "the scanner is blinded: too many beams say nothing of what is there";
  return false;
}

size_t Session::beams_in(const Scan& scan) const {
  const size_t all = beams_of(settings_.variant);
  return scan.partial ? (all - scan.quarters + 3) / 4 : all;
}

bool Session::assemble(const Scan& scan, int64_t stamp_ns) {
  const size_t first = scan.partial ? scan.quarters : 0, step = scan.partial ? 4 : 1;
  if (first == 0) assembled_.stamp_ns = stamp_ns;
  // Joined in the middle, or a part was lost.
  const int64_t off_ns = stamp_ns - assembled_.stamp_ns - static_cast<int64_t>(first) * kTurn_ns;
  if (first != 0 && (first != next_quarter_ || std::abs(off_ns) > 2 * kTurn_ns)) {
    next_quarter_ = 0;
    return false;
  }
  for (size_t i = 0; i < scan.beams(); ++i)
    assembled_.range_m[first + i * step] = range_m(scan.word(i), settings_.measuring_mode, scan.millimetres);
  if (!scan.partial) return true;
  next_quarter_ = static_cast<uint8_t>((first + 1) % 4);
  return first == 3;
}

}  // namespace takt::lms200
