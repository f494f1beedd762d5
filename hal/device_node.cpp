// SPDX-License-Identifier: Apache-2.0
#include "hal/device_node.hpp"

#include <algorithm>

namespace takt {

FaultParam::FaultParam(DeviceNode* owner)
    : ParamBase(owner, kName, "", "what goes wrong with a simulated device or double; takt fault switches it"),
      owner_(*owner) {}

tl::expected<void, std::string> FaultParam::set(const ParamValue& value) {
  FaultSwitch* const faults = owner_.faults();
  if (faults == nullptr) return tl::make_unexpected("cannot be set: the device is not simulated");
  const std::string word = std::holds_alternative<std::string>(value) ? std::get<std::string>(value) : "";
  const auto fault =
      static_cast<Misbehaviour>(std::find(kMisbehaviours.begin(), kMisbehaviours.end(), word) - kMisbehaviours.begin());
  if (!faults->set(fault))
    return tl::make_unexpected("is " + word + ", must be none or one of " + names_of(faults_of(faults->known())));
  on_ = fault;
  return {};
}

uint32_t DeviceNode::known_faults() {
  const FaultSwitch* const known = faults();
  return known == nullptr ? 0 : known->known();
}

void DeviceNode::open_in_setup(const Setup& setup) {
  if (!opens_) return;
  if (const auto opened = device().open(); !opened) throw SetupError(opened.error().text());
  const DeclaredCalls declared = device().declared_calls();
  if (declared.calls != 0) may(declared.calls, declared.reason);
  if (health_settings_.silent_after_ns == 0)
    health_settings_.silent_after_ns = default_silent_after_ns(setup.rate ? setup.rate->release_ns(0, 1) : 0);
  health_settings_.starts_within_ns = device().starts_within_ns();
  health_ = DeviceHealth(health_settings_);
  retry_ = {};
  reopen_tries_ = 0;
}

std::string DeviceNode::broken_declaration() {
  if (!declared_ || !declared_->unknown.empty()) return "";
  const StampLaw now = device().stamp_law({});
  if (!now.unknown.empty()) return "how old what it gives can be, nobody can tell now: " + now.unknown;
  const auto ms = [](int64_t ns) { return std::to_string(static_cast<double>(ns) / 1e6) + " ms"; };
  if (now.wait_ns > declared_->wait_ns)
    return "what it is asked for can come after " + ms(now.wait_ns) + "; with these settings it was to be " +
           ms(declared_->wait_ns);
  if (now.lag_ns() <= declared_->lag_ns()) return "";
  return "what it gives can be " + ms(now.lag_ns()) + " old (it takes " + ms(now.latency_ns) + " and comes every " +
         ms(now.period_ns) + "); with these settings it was to be " + ms(declared_->lag_ns());
}

bool DeviceNode::running(Job& job) {
  if (double_) double_->keep_up();
  if (started_) return true;
  const int64_t now_ns = job.release_ns();
  if (retry_.due(now_ns)) {
    ++reopen_tries_;
    // Not forgotten when it works: a device that comes for one read and goes again is not tried at every job.
    retry_.failed(now_ns);
    started_ = device().restart(now_ns);
  }
  if (!started_) judge(ReadStatus::disconnected, job, false);
  return started_;
}

bool DeviceNode::accept(ReadStatus status, Job& job, bool marks_damage, bool repeated) {
  if (double_) job.source_late(double_->late_ns());
  judge(status, job, repeated);
  if (status == ReadStatus::end_of_data) {
    job.end_of_data();
    return false;
  }
  if (status == ReadStatus::disconnected && started_) {
    started_ = false;
    // Gone in the very job that got it back: that is the try which failed.
    if (retry_.due(job.release_ns())) retry_.failed(job.release_ns());
  }
  const bool usable = status == ReadStatus::ok || (status == ReadStatus::partial && marks_damage);
  if (!usable) job.no_result();
  return usable;
}

void DeviceNode::judge(ReadStatus status, Job& job, bool repeated) {
  health_.observe(job.release_ns(), status, repeated);
  const auto state = health_.state();
  if (!state) return;
  if (*state == SourceState::ok) retry_.works();
  job.source_state({*state, reopen_tries_, device().counts(), device().trouble()});
}

}  // namespace takt
