// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/laser/lms200/commands.hpp"
#include "hal/laser/lms200/scan.hpp"
#include "hal/laser/range_source.hpp"
#include "hal/stream/line_double.hpp"

namespace takt::lms200 {

/// An LMS 200 at the end of a serial line, as D-1 describes it: ACK and NAK, every command of `Command`, the
/// modes of `Mode`, baud rates, the power-on telegram after a reset; a mirror of 75 turns a second, whose scan is sent
/// if the line is free when it is complete, and is lost otherwise. A command cuts off what is being sent. Replies take
/// as long as those of a recorded scanner took.
class Lms200Double final : public LineDouble {
 public:
  /// Switched on at `on_ns`, at 9600 baud, silent until asked.
  Lms200Double(std::unique_ptr<ByteStream> line, RangeSource source, int64_t on_ns);
  std::span<const Misbehaviour> known() const override;
  void misbehave(Misbehaviour how) override;

  uint32_t baud() { return line().baud(); }
  Mode mode() const { return mode_; }
  const Variant& variant() const { return variant_; }
  /// How often its memory was written.
  int writes() const { return writes_; }
  uint64_t scans_sent() const { return scans_sent_; }

 protected:
  void hear(std::span<const uint8_t> bytes, int64_t now_ns) override;
  void act(int64_t now_ns) override;

 private:
  void power_on(int64_t now_ns);
  void obey(std::span<const uint8_t> payload, int64_t now_ns);
  void set_mode(std::span<const uint8_t> payload, int64_t now_ns);
  void answer(Reply code, std::span<const uint8_t> data, int64_t at_ns);
  int64_t reply_delay_ns();
  /// The scan whose last turn ended with turn number `turn`.
  void send_scan(int64_t turn);
  /// The words of one turn, every `step`-th of `words_` from `first` on.
  void measure(int64_t first_ns, size_t first, size_t step);
  int64_t turns() const;
  Status status();
  /// The status byte of a scan; what it does not say of values is measured all the same.
  uint8_t scan_status(int64_t now_ns);

  RangeSource source_;
  Parser parser_ = Parser::of_commands();
  int64_t on_ns_, last_byte_ns_ = 0, next_turn_ = 1;
  int64_t power_on_at_ns_ = INT64_MAX, new_baud_at_ns_ = INT64_MAX;
  int64_t polluted_since_ns_ = INT64_MAX;
  uint32_t new_baud_ = 0;
  Mode mode_ = Mode::on_request;
  Variant variant_;
  Configuration configuration_;
  bool keeps_baud_ = false, wanted_once_ = false;
  int writes_ = 0;
  size_t replies_ = 0;
  uint64_t scans_sent_ = 0;
  uint8_t scan_index_ = 0, telegram_index_ = 0;
  std::vector<float> range_m_;
  std::vector<uint8_t> words_;
};

}  // namespace takt::lms200
