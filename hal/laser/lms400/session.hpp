// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "hal/laser/frame_receiver.hpp"
#include "hal/laser/laser_session.hpp"
#include "hal/laser/lms400/frame.hpp"
#include "hal/laser/lms400/messages.hpp"

namespace takt::lms400 {

struct SessionSettings {
  ScanConfiguration scan;
  double max_range_m = 3.0;  ///< larger distances are no return
  uint32_t baud = 0;         ///< 0: a connection without a rate
};

/// Beams of a scan: field of view by step, without one more at its end (D-2.4).
uint32_t beams_of(const ScanConfiguration& scan);

/// The host's side of a conversation with an LMS 400: stops what a dead client has left streaming, logs in, sets rate,
/// resolution and field and reads back what became of them, asks for distances; begins anew, over a new connection,
/// where the scanner falls silent.
class Session final : public LaserSession {
 public:
  explicit Session(const SessionSettings& settings);
  ScanFormat format() const override;
  void begin(int64_t now_ns) override;
  const ReceivedScan* receive(std::span<const uint8_t> bytes, int64_t now_ns) override;
  LineOrder next(int64_t now_ns) override;
  void line_has(uint32_t baud) override;
  LineOrder farewell() override;
  uint64_t sweeps() const override { return sweeps_; }
  uint64_t missing() const override { return missing_; }
  uint64_t resyncs() const override { return receiver_.resyncs(); }
  uint64_t damaged() const override { return receiver_.damaged(); }
  const char* trouble() const override { return trouble_; }

  /// Scans are coming.
  bool running() const { return step_ == Step::stream; }

 private:
  enum class Step : uint8_t { stop, login, configure, run, request, stream };
  void enter(Step step, int64_t now_ns);
  void ask(std::string_view text);
  LineOrder repeat(int64_t now_ns);
  /// The scanner answers, but not as it should: from the beginning, after a while.
  void refuse(const char* why, int64_t now_ns);
  void hear(const Event& event, int64_t now_ns);
  void hear_answer(const Answer& answer, int64_t now_ns);
  void hear_configuration(const Answer& answer, int64_t now_ns);
  void hear_measurement(const Measurement& measurement, uint64_t position, int64_t now_ns);

  SessionSettings settings_;
  std::string configure_text_;
  FrameReceiver<Parser> receiver_;
  PeriodicInstants instants_;
  int64_t period_ns_;
  const char* trouble_ = "not asked yet";
  const char* remark_ = "";  ///< what stays so while scans come

  Step step_ = Step::stop;
  bool order_baud_ = false, order_reopen_ = false, unsent_ = false;
  std::string_view request_text_;
  Frame request_;
  int tries_ = 0;
  int64_t not_before_ns_ = 0, deadline_ns_ = 0;

  ReceivedScan scan_;
  bool scan_ready_ = false;
  uint64_t sweeps_ = 0, missing_ = 0;
  int64_t last_scan_ns_ = 0;
  std::optional<uint16_t> number_;  ///< of the last measurement
  uint32_t scan_number_ = 0;
};

}  // namespace takt::lms400
