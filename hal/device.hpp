// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/device.hpp>: hal, experimental.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "hal/stamp_law.hpp"
#include "rt/memory/job_calls.hpp"
#include "rt/source_state.hpp"

namespace takt {

/// Why a device could not be opened or started. `what` names the file (with its line where there is one) and the value
/// at fault, `fix` the next step of the person who reads it.
struct DeviceError {
  std::string id;  ///< the device's id in the graph
  std::string what;
  std::string fix;
  bool bad_input = true;  ///< false: the settings and files are right, but the hardware fails
  std::string text() const { return id + ": " + what + (fix.empty() ? "" : "\n  fix: " + fix); }
};

class FaultSwitch;

using DeviceResult = tl::expected<void, DeviceError>;

inline tl::unexpected<DeviceError> device_error(std::string id, std::string what, std::string fix) {
  return tl::unexpected(DeviceError{std::move(id), std::move(what), std::move(fix), true});
}

/// Settings and files are right; the hardware is absent, busy or broken.
inline tl::unexpected<DeviceError> device_failure(std::string id, std::string what, std::string fix) {
  return tl::unexpected(DeviceError{std::move(id), std::move(what), std::move(fix), false});
}

/// What a read found. A read never throws and never blocks beyond its deadline.
enum class ReadStatus : uint8_t {
  ok,            ///< the views hold new data
  no_data,       ///< nothing new before the deadline; the views are untouched
  partial,       ///< data arrived damaged or short; the views hold what there was
  disconnected,  ///< the device is gone, until restart() succeeds
  end_of_data,   ///< a replayed source is exhausted; every later read says so too
};

inline const char* to_text(ReadStatus status) {
  switch (status) {
    case ReadStatus::ok: return "ok";
    case ReadStatus::no_data: return "no_data";
    case ReadStatus::partial: return "partial";
    case ReadStatus::disconnected: return "disconnected";
    case ReadStatus::end_of_data: return "end_of_data";
  }
  return "?";
}

/// Bits of JobCall with the reason for them. `reason` must outlive the device: a literal.
struct DeclaredCalls {
  uint32_t calls = 0;
  std::string_view reason;
};

/// The life of every device: constructed (settings only) -> open() (claims hardware or files, checks everything,
/// allocates everything) -> start(epoch) -> read ... -> stop() -> close(). open, start, stop and close run on the
/// thread that composes the graph, before and after jobs; reads, triggers and commands on the job thread of the one
/// node that owns the device, and they neither allocate nor lock (drivers of real hardware: one bounded read of a
/// descriptor), except for what declared_calls() says. All stamps are CLOCK_MONOTONIC nanoseconds of the Clock that the
/// driver was constructed with.
class Device {
 public:
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  virtual ~Device() = default;

  /// Calling it again while open changes nothing.
  virtual DeviceResult open() = 0;
  virtual void close() = 0;
  /// `epoch_ns` is the first planned instant of the run: sources that own their time line (replay, sim) begin there.
  virtual DeviceResult start(int64_t epoch_ns) = 0;
  virtual void stop() = 0;
  /// From start() to its first data, at most, if the device is there and well: so long nothing is no loss.
  virtual int64_t starts_within_ns() const { return 0; }
  /// On the job thread, after a read said `disconnected` or start() failed: one try to get the device going again, on
  /// the time line it had. Neither waits nor allocates in drivers that can say `disconnected`; true if reads may
  /// succeed again.
  virtual bool restart(int64_t now_ns) {
    stop();
    return start(now_ns).has_value();
  }
  /// How old what it gives can be: of hardware before open() from the settings alone, of recordings once they are open.
  virtual StampLaw stamp_law(const JobTimes& jobs) const = 0;
  /// What was lost on the way, and why nothing comes (see SourceReport); on the job thread.
  virtual SourceCounts counts() const { return {}; }
  virtual const char* trouble() const { return ""; }
  /// Of simulated devices: what can be made to go wrong with it while it runs (`takt fault`). Null: nothing.
  virtual FaultSwitch* faults() { return nullptr; }
  /// Calls that reads, triggers and commands make although no job should, and why; known once the device is open.
  virtual DeclaredCalls declared_calls() const { return {}; }
};

}  // namespace takt
