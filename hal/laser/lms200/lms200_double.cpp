// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/lms200/lms200_double.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string_view>
#include <utility>

#include "hal/laser/lms200/session.hpp"

namespace takt::lms200 {
namespace {

constexpr uint8_t kWell = 0x10;  // status byte of a standard device without a message
constexpr uint32_t kFirstBaud = 9600, kOtherBaud = 19200;
constexpr int64_t kMs = 1'000'000, kUs = 1'000;
constexpr int64_t kAckAfter_ns = 10 * kMs;      // the manual allows 60
constexpr int64_t kHostGap_ns = 6 * kMs;        // between two bytes of a command
constexpr int64_t kSelfTest_ns = 1000 * kMs;    // after a reset; from power-on it may take a minute
constexpr int64_t kWarning_ns = 2000 * kMs;     // of a dirty pane, before it is an error
constexpr int64_t kWriting_ns = 106'000 * kUs;  // recorded, command 77h
/// From the last byte of a command to the first of its reply; recorded at 38400 baud, transfer times taken off.
constexpr std::array<int64_t, 7> kReplyAfter_us{61'600, 69'600, 70'500, 62'300, 66'600, 66'500, 61'500};
constexpr std::string_view kType = "LMS200;301063;V02.10 ";
constexpr std::array<uint8_t, 8> kFactory{0x00, 0x00, 0x70, 0x00, 0x00, 0x00, 0x01, 0x00};
constexpr uint16_t kTurn_us = 148;  // of a 1/90 of a turn
/// What its thread slept through is sent late, as long as a terminal holds it: 55 KB in two seconds at 500000 baud.
constexpr int64_t kTurnsMadeUpFor = 150;

}  // namespace

Lms200Double::Lms200Double(std::unique_ptr<ByteStream> stream, RangeSource source, int64_t on_ns)
    : LineDouble(std::move(stream)), source_(std::move(source)), on_ns_(on_ns) {
  line().set_baud(kFirstBaud);
  std::copy(kFactory.begin(), kFactory.end(), configuration_.bytes.begin());
}

std::span<const Misbehaviour> Lms200Double::known() const {
  static constexpr std::array kKnown{Misbehaviour::none,       Misbehaviour::silent,  Misbehaviour::unplugged,
                                     Misbehaviour::garbage,    Misbehaviour::frozen,  Misbehaviour::wrong_crc,
                                     Misbehaviour::wrong_baud, Misbehaviour::dazzled, Misbehaviour::polluted};
  return kKnown;
}

void Lms200Double::misbehave(Misbehaviour how) {
  LineDouble::misbehave(how);
  polluted_since_ns_ = INT64_MAX;
  if (how == Misbehaviour::wrong_baud) line().set_baud(kOtherBaud);
}

void Lms200Double::hear(std::span<const uint8_t> bytes, int64_t now_ns) {
  if (power_on_at_ns_ != INT64_MAX) return;
  if (now_ns - last_byte_ns_ > kHostGap_ns) parser_.reset();
  last_byte_ns_ = now_ns;
  parse(parser_, bytes, [&](const Event& event) {
    constexpr uint8_t ack = kAck, nak = kNak;
    if (event.kind == EventKind::ack || event.kind == EventKind::nak) return;
    line().interrupt(now_ns);
    if (event.kind != EventKind::telegram) return say(now_ns + kAckAfter_ns, {&nak, 1});
    say(now_ns + kAckAfter_ns, {&ack, 1});
    obey(event.payload, now_ns);
  });
}

void Lms200Double::act(int64_t now_ns) {
  if (now_ns >= power_on_at_ns_) {
    power_on_at_ns_ = INT64_MAX;
    power_on(now_ns);
  }
  if (now_ns >= new_baud_at_ns_) {
    new_baud_at_ns_ = INT64_MAX;
    line().run_to(now_ns);
    line().set_baud(new_baud_);
  }
  next_turn_ = std::max(next_turn_, (now_ns - on_ns_) / kTurn_ns - kTurnsMadeUpFor);
  for (; on_ns_ + next_turn_ * kTurn_ns <= now_ns; ++next_turn_) {
    const bool streaming = mode_ == Mode::stream || mode_ == Mode::stream_partial;
    const bool whole = mode_ == Mode::stream_partial || next_turn_ % turns() == 0;
    if (!whole || (!streaming && !wanted_once_) || line().free_ns() > on_ns_ + next_turn_ * kTurn_ns) continue;
    wanted_once_ = false;
    send_scan(next_turn_);
  }
}

int64_t Lms200Double::turns() const { return turns_of(variant_); }

void Lms200Double::power_on(int64_t now_ns) {
  if (!keeps_baud_) line().set_baud(kFirstBaud);
  mode_ = Mode::on_request;
  variant_ = {};
  answer(Reply::power_on, std::span(reinterpret_cast<const uint8_t*>(kType.data()), kType.size()), now_ns);
}

int64_t Lms200Double::reply_delay_ns() { return kReplyAfter_us[replies_++ % kReplyAfter_us.size()] * kUs; }

void Lms200Double::answer(Reply code, std::span<const uint8_t> data, int64_t at_ns) {
  say(at_ns, reply(code, data, kWell).bytes());
}

void Lms200Double::obey(std::span<const uint8_t> payload, int64_t now_ns) {
  const int64_t at_ns = now_ns + reply_delay_ns();
  const auto not_permitted = [&] { answer(Reply::not_permitted, {}, at_ns); };
  const auto has = [&](size_t bytes) { return payload.size() == bytes; };
  switch (static_cast<Command>(payload[0])) {
    case Command::reset:
      answer(Reply::reset, {}, at_ns);
      mode_ = Mode::on_request;
      power_on_at_ns_ = at_ns + kSelfTest_ns;
      return;
    case Command::mode: return has(1) ? not_permitted() : set_mode(payload, at_ns);
    case Command::scan:
      wanted_once_ = has(2) && payload[1] == 1;
      if (!wanted_once_) not_permitted();
      return;
    case Command::status: return answer(Reply::status, status_data(status()), at_ns);
    case Command::errors: {
      // Type and number; of an old dazzling, too, which is over.
      constexpr std::array<uint8_t, 5> dirty{2, 0x82, 5, 2, 18}, well{1, 0x82, 5};
      const bool in_error = severity(scan_status(now_ns)) >= Severity::error;
      return answer(Reply::errors, in_error ? std::span<const uint8_t>(dirty) : well, at_ns);
    }
    case Command::type:
      return answer(Reply::type, std::span(reinterpret_cast<const uint8_t*>(kType.data()), kType.size()), at_ns);
    case Command::variant: {
      if (!has(5)) return not_permitted();
      const Variant wanted{read_u16(payload, 1), read_u16(payload, 3)};
      const bool done = valid(wanted) && !interlaced(wanted);
      if (done) variant_ = wanted;
      const std::array<uint8_t, 5> data{done ? uint8_t{1} : uint8_t{0}, static_cast<uint8_t>(variant_.angle_deg), 0,
                                        static_cast<uint8_t>(variant_.step_cdeg), 0};
      return answer(Reply::variant, data, at_ns);
    }
    case Command::keep_baud: {
      if (!has(2)) return not_permitted();
      keeps_baud_ = payload[1] == 1;
      const std::array<uint8_t, 2> data{1, payload[1]};
      return answer(Reply::keep_baud, data, at_ns);
    }
    case Command::read_configuration: return answer(Reply::configuration, configuration_.bytes, at_ns);
    case Command::write_configuration: {
      if (!has(1 + configuration_.bytes.size()) || mode_ != Mode::installation) return not_permitted();
      std::copy(payload.begin() + 1, payload.end(), configuration_.bytes.begin());
      ++writes_;
      std::array<uint8_t, 35> data{1};
      std::copy(configuration_.bytes.begin(), configuration_.bytes.end(), data.begin() + 1);
      return answer(Reply::configuration_written, data, now_ns + kWriting_ns);
    }
  }
  not_permitted();
}

void Lms200Double::set_mode(std::span<const uint8_t> payload, int64_t at_ns) {
  const auto say_done = [&](bool done) {
    const uint8_t failed = done ? 0 : 1;
    answer(Reply::mode, {&failed, 1}, at_ns);
  };
  if (const auto baud = baud_of_mode(payload[1])) {
    say_done(true);
    new_baud_ = *baud;
    new_baud_at_ns_ = line().free_ns();
    return;
  }
  const auto mode = static_cast<Mode>(payload[1]);
  switch (mode) {
    case Mode::installation: {
      const auto password = payload.subspan(2);
      if (!std::equal(password.begin(), password.end(), kInstallationPassword.begin(), kInstallationPassword.end()))
        return say_done(false);
      break;
    }
    case Mode::diagnosis:
    case Mode::stream:
    case Mode::on_request:
    case Mode::stream_partial: break;
    default: return answer(Reply::not_permitted, {}, at_ns);
  }
  mode_ = mode;
  say_done(true);
}

Status Lms200Double::status() {
  Status s;
  std::memcpy(s.version.data(), "V02.10 ", s.version.size());
  s.mode = mode_;
  s.turn_us = kTurn_us;
  s.measuring_mode = configuration_.measuring_mode();
  s.variant = variant_;
  s.baud = line().baud();
  s.millimetres = configuration_.millimetres();
  s.laser_on = true;
  return s;
}

uint8_t Lms200Double::scan_status(int64_t now_ns) {
  constexpr uint8_t kWarned = kWell | kPolluted | static_cast<uint8_t>(Severity::warning),
                    kInError = kWell | kPolluted | kImplausible | static_cast<uint8_t>(Severity::error);
  if (misbehaviour() != Misbehaviour::polluted) return kWell;
  polluted_since_ns_ = std::min(polluted_since_ns_, now_ns);
  return now_ns - polluted_since_ns_ < kWarning_ns ? kWarned : kInError;
}

void Lms200Double::send_scan(int64_t turn) {
  const int64_t end_ns = on_ns_ + turn * kTurn_ns;
  const bool partial = mode_ == Mode::stream_partial;
  Scan scan;
  scan.millimetres = configuration_.millimetres();
  scan.status = scan_status(end_ns);
  if ((configuration_.availability() & kIndices) != 0) scan.indices = {scan_index_++, telegram_index_++};
  const bool again = misbehaviour() == Misbehaviour::frozen && !words_.empty();
  if (partial) {
    scan.partial = true;
    scan.quarters = static_cast<uint8_t>(turn % 4);
    const size_t beams = variant_.angle_deg + (scan.quarters == 0 ? 1u : 0u);
    if (!again || words_.size() != 2 * beams) {
      words_.assign(2 * beams, 0);
      measure(end_ns - kTurn_ns, scan.quarters, 4);
    }
  } else if (const size_t beams = beams_of(variant_); !again || words_.size() != 2 * beams) {
    words_.assign(2 * beams, 0);
    const int64_t turns = turns_of(variant_);
    for (int64_t i = 0; i < turns; ++i)
      measure(end_ns - (turns - i) * kTurn_ns, static_cast<size_t>(i), static_cast<size_t>(turns));
  }
  scan.words = words_;
  say(end_ns, scan_telegram(scan).bytes());
  ++scans_sent_;
}

/// Beams lie whole degrees apart; `first` of `step` parts of a degree tell by how much they are turned.
void Lms200Double::measure(int64_t first_ns, size_t first, size_t step) {
  constexpr double kDegree = std::numbers::pi / 180;
  const bool partial = mode_ == Mode::stream_partial;
  const size_t from = partial ? 0 : first, apart = partial ? 1 : step,
               beams = (words_.size() / 2 - from + apart - 1) / apart;
  const double fov_deg = variant_.angle_deg;
  range_m_.assign(beams, 0.0f);
  source_({first_ns, (-fov_deg / 2 + static_cast<double>(first) / static_cast<double>(step)) * kDegree, kDegree,
           fov_deg / 360 * static_cast<double>(kTurn_ns) * 1e-9},
          range_m_);
  const int bits = distance_bits(configuration_.measuring_mode()).value_or(13);
  const double unit_m = configuration_.millimetres() ? 0.001 : 0.01;
  for (size_t i = 0; i < beams; ++i) {
    const double distance = std::round(static_cast<double>(range_m_[i]) / unit_m);
    const bool seen = distance >= 1 && distance <= largest_distance(bits);
    const size_t beam = from + i * apart;
    const bool sun = misbehaviour() == Misbehaviour::dazzled && beam > words_.size() / 6 && beam < words_.size() / 3;
    const auto word = static_cast<uint16_t>(sun    ? no_echo(bits) - 1
                                            : seen ? static_cast<int>(distance)
                                                   : no_echo(bits));
    const size_t at = 2 * beam;
    words_[at] = static_cast<uint8_t>(word);
    words_[at + 1] = static_cast<uint8_t>(word >> 8);
  }
}

}  // namespace takt::lms200
