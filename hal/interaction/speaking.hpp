// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/devices.hpp"
#include "hal/interaction/interaction.hpp"
#include "hal/interaction/loudspeaker.hpp"

namespace takt {

/// A person who also hears what the robot says: any driver with a loudspeaker. A driver that is opened anew in a job
/// leaves the loudspeaker as it is.
class SpeakingTo final : public Interaction {
 public:
  SpeakingTo(std::unique_ptr<Interaction> person, std::unique_ptr<Loudspeaker> speaker)
      : person_(std::move(person)), speaker_(std::move(speaker)) {}
  DeviceResult open() override;
  void close() override;
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override;
  bool restart(int64_t now_ns) override { return person_->restart(now_ns); }
  StampLaw stamp_law(const JobTimes& jobs) const override { return person_->stamp_law(jobs); }
  SourceCounts counts() const override;
  const char* trouble() const override;
  FaultSwitch* faults() override { return person_->faults(); }
  DeclaredCalls declared_calls() const override { return person_->declared_calls(); }
  InteractionReading read(int64_t wanted_ns) override { return person_->read(wanted_ns); }
  bool say(std::string_view text) override;
  void go_on_after(uint32_t number, std::string_view last) override;
  bool takes_answers() const override { return person_->takes_answers(); }
  bool answer(std::string_view words) override { return person_->answer(words); }

 private:
  std::unique_ptr<Interaction> person_;
  std::unique_ptr<Loudspeaker> speaker_;
};

namespace hal {

/// The settings `speech`, `speech_to`, `voice` and `words_per_minute`, which all drivers of kind `interaction` have:
/// the person as it is, or with a loudspeaker. `clock` must outlive it.
std::unique_ptr<Interaction> with_speech(std::unique_ptr<Interaction> person, const DeviceConfig& config,
                                         Settings& settings, const Clock& clock);
/// Their listing.
std::vector<SettingInfo> speech_settings();

}  // namespace hal
}  // namespace takt
