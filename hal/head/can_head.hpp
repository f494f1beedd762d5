// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>

#include "hal/can/host_driver.hpp"
#include "hal/can/stuck.hpp"
#include "hal/head/camera_head.hpp"
#include "hal/head/head_messages.hpp"

namespace takt::head {

/// D-4.1, less the soft margins: how far, fast and hard the head may be moved.
constexpr HeadLimits kDefaultLimits{118 * kDegree, 43 * kDegree, 200 * kDegree, 150 * kDegree, 1000 * kDegree};

struct CanHeadSettings {
  std::string interface;
  HeadLimits limits = kDefaultLimits;
  bool eyelids = true;  ///< open while it runs unless told otherwise, closed at the stop
};

/// What the head said last.
struct HeadView {
  bool known = false;  ///< anything of the following
  State state = State::not_ready;
  bool homed = false, emergency_stop = false, fault = false;
  double pan_deg = 0, tilt_deg = 0;
  uint16_t emergency = 0;  ///< code of the emergency message in force; 0: none
};

struct HeadAngles {
  double pan_deg, tilt_deg;
};

struct Lids {
  bool left_closed = false, right_closed = false;
  bool operator==(const Lids&) const = default;
};

/// What to ask the head for next; `target`: where somebody wants it to be. It is homed first, then enabled where it
/// stands (no jump), then moved; without a target it holds. Stopped, or with an emergency in force, it is disabled.
struct HeadRequest {
  Mode mode = Mode::disable;
  HeadAngles angles{};
  friend bool operator==(const HeadRequest& a, const HeadRequest& b) {
    return a.mode == b.mode && a.angles.pan_deg == b.angles.pan_deg && a.angles.tilt_deg == b.angles.tilt_deg;
  }
};
HeadRequest next_request(const HeadView& view, const std::optional<HeadAngles>& target);

/// The camera head on a CAN bus. All that is sent is sent in reads: at least eleven a second keep the head enabled.
class CanHead final : public can::HostDriver<CameraHead, HeadReading> {
 public:
  CanHead(std::string id, CanHeadSettings settings, const Clock& clock);
  /// The settings', narrowed by what the head has said of itself.
  HeadLimits limits() const override { return limits_; }
  HeadReading read(int64_t wanted_ns, int64_t deadline_ns) override;
  /// In force until the next read. False also while the head does not follow: stopped, not homed or not enabled yet.
  bool command(double pan_rad, double tilt_rad, int64_t at_ns) override;
  void close_lids(bool left, bool right, int64_t at_ns) override;

  /// Also what the head says of its temperatures, its supply and its lids.
  const char* trouble() const override;

  const HeadView& view() const { return view_; }

 private:
  void take(const can::Incoming& incoming) override;
  void forget() override;
  void rest() override;
  bool faulted() const override { return view_.fault; }
  void reset_fault() override { send({Mode::fault_reset, {}}); }

  void take_status(const can::Incoming& incoming);
  void take_health(std::span<const double> values);
  void narrow(std::span<const double> limits);
  void send(const HeadRequest& request);
  void send_lids(const Lids& closed);

  CanHeadSettings settings_;
  HeadLimits limits_;
  HeadView view_;
  std::optional<HeadAngles> target_, sent_;  ///< wanted of the next read; asked of the head with the last one
  can::Stuck stuck_;
  const char* health_ = "";  ///< what is not well, for a while or for good
  bool lids_stuck_ = false;
  double pan_rad_s_ = 0, tilt_rad_s_ = 0;
  Lids lids_;                      ///< wanted of the next read
  std::optional<Lids> lids_told_;  ///< none: nothing yet
  uint8_t lid_token_ = 0;
};

}  // namespace takt::head
