// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>

#include "hal/laser/frame_receiver.hpp"
#include "hal/laser/laser_session.hpp"
#include "hal/laser/lms200/commands.hpp"
#include "hal/laser/lms200/scan.hpp"

namespace takt::lms200 {

inline constexpr int64_t kTurn_ns = 13'320'000;  ///< of the mirror (D-1.9)

struct SessionSettings {
  uint32_t baud = 38400;  ///< one of kBauds; where the line cannot do it, the highest one below
  /// Where it is 180 degrees and 0.25, four partial scans of a degree each make one; that needs 500000 baud.
  Variant variant;
  uint8_t measuring_mode = 0;  ///< with a distance_bits()
  bool millimetres = true;
  double blinded_max = 0.1;  ///< share of the beams of a scan that may be blinded; one with more is refused
};

/// True for fields and steps that the scanner knows.
bool valid(const Variant& variant);
/// One is made of four partial scans.
constexpr bool interlaced(const Variant& variant) { return variant == Variant{180, 25}; }
constexpr uint32_t beams_of(const Variant& variant) {
  return static_cast<uint32_t>(variant.angle_deg * 100 / variant.step_cdeg + 1);
}
/// It always fires at whole degrees; what lies between comes in further turns.
constexpr int64_t turns_of(const Variant& variant) { return 100 / variant.step_cdeg; }

/// The host's side of a conversation with an LMS 2xx: finds the rate at which it listens, stops what it sends, raises
/// the rate, sets variant and measuring mode (in its EEPROM only where that differs), looks at its health, has it send
/// every scan; and begins anew when it falls silent or says that it was switched on. Repeats what is not answered.
class Session final : public LaserSession {
 public:
  explicit Session(const SessionSettings& settings);
  ScanFormat format() const override;
  int64_t starts_within_ns() const override;
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
  bool running() const { return step_ == Step::run || step_ == Step::errors; }
  uint32_t baud() const { return baud_; }
  /// What the scanner said of itself on the way; nothing before.
  const std::optional<Status>& status() const { return status_; }

 private:
  enum class Step : uint8_t {
    find,     ///< asks it to be silent, at one rate after the other
    raise,    ///< asks for the rate wanted
    confirm,  ///< asks for anything at that rate
    type,
    variant,
    read,     ///< its configuration
    install,  ///< the mode in which that may be written
    write,
    leave,  ///< that mode
    health,
    start,  ///< the stream
    run,
    errors,  ///< asked for in the stream, once while it says that it is in error
  };
  void enter(Step step, int64_t now_ns);
  void ask(const Telegram& telegram, Reply reply, int64_t reply_within_ns);
  void try_rate(uint32_t baud);
  /// Of the rates, the next one to be tried.
  void try_next_rate();
  void fail(const char* why, int64_t now_ns);
  void hear(const Event& event, int64_t now_ns);
  void hear_reply(std::span<const uint8_t> payload, int64_t now_ns);
  void hear_configuration(std::span<const uint8_t> payload, int64_t now_ns);
  void hear_scan(std::span<const uint8_t> payload, uint64_t position, int64_t now_ns);
  /// How many a scan with these quarters must have.
  size_t beams_in(const Scan& scan) const;
  /// Puts the values where they belong; true if the scan is whole with them.
  bool assemble(const Scan& scan, int64_t stamp_ns);
  /// Refuses the scan that is whole if too much of it is blinded.
  bool sees();
  /// What the scanner says with each scan; false if the scan is not to be used.
  bool hear_status(uint8_t status, int64_t now_ns);
  LineOrder repeat(int64_t now_ns);
  int64_t scan_ns() const { return turns_of(settings_.variant) * kTurn_ns; }
  int64_t telegram_ns(uint32_t baud) const;
  /// Between scans at that rate: what is measured while one is being sent is lost.
  int64_t interval_ns(uint32_t baud) const;

  SessionSettings settings_;
  FrameReceiver<Parser> receiver_;
  PeriodicInstants instants_;
  const char* trouble_ = "not asked yet";
  const char* remark_ = "";  ///< what stays so while scans come
  const char* error_ = "";   ///< what the scanner calls its error, while it is in one; else empty
  std::optional<Status> status_;

  // The conversation.
  Step step_ = Step::find;
  uint32_t baud_ = 0, wanted_baud_ = 0, highest_baud_ = 0, order_baud_ = 0;
  size_t next_rate_ = 0;
  Telegram request_;
  Reply reply_ = Reply::mode;
  int64_t reply_within_ns_ = 0, not_before_ns_ = 0, deadline_ns_ = 0;
  int tries_ = 0;
  bool unsent_ = false, acknowledged_ = false, rate_proven_ = false;
  Configuration configuration_;

  // Scans.
  ReceivedScan assembled_, whole_;
  uint8_t next_quarter_ = 0;
  bool scan_ready_ = false;
  uint64_t sweeps_ = 0, missing_ = 0;
  int64_t last_scan_ns_ = 0;
  uint32_t scan_number_ = 0;
  int64_t pace_ = 0;  ///< scans by their instants; behind scan_number_ where one was seen too late, until some are lost
};

}  // namespace takt::lms200
