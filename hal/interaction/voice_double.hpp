// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <fstream>

#include "hal/interaction/voice.hpp"

namespace takt {

/// Stands in for a loudspeaker: writes what it would say, a sentence a line with its time since the epoch:
///
///     12.340 s goal cup_1.level=full: done
class VoiceDouble final : public Voice {
 public:
  VoiceDouble(std::string id, std::filesystem::path file) : id_(std::move(id)), file_(std::move(file)) {}
  DeviceResult open() override;
  bool start(bool goes_on) override;
  bool speak(const Sentence& sentence, const std::function<bool()>& go_on) override;
  bool catches_up() const override { return true; }
  std::string problem() const override { return file_.string() + " cannot be written"; }

 private:
  std::string id_;
  std::filesystem::path file_;
  std::ofstream out_;
};

/// Whether a file can be made there.
DeviceResult check_speech_file(const std::string& id, const std::filesystem::path& file);

}  // namespace takt
