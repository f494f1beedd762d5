// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "hal/interaction/voice.hpp"
#include "hal/interaction/wav_file.hpp"

namespace takt {

struct EspeakSettings {
  std::string voice = "en";    ///< one that `espeak-ng --voices` lists
  int words_per_minute = 160;  ///< 80..450
  std::filesystem::path file;  ///< WAV file that grows; empty: the sound card
  std::filesystem::path program = "/usr/bin/espeak-ng";
};

/// Speaks with the program espeak-ng (Debian), one process a sentence. The words go to its standard input, so that
/// nothing that the robot says is an option. To a file it is some hundred times as quick as speech.
class EspeakVoice final : public Voice {
 public:
  EspeakVoice(std::string id, EspeakSettings settings) : id_(std::move(id)), settings_(std::move(settings)) {}
  DeviceResult open() override;
  bool start(bool goes_on) override;
  bool speak(const Sentence& sentence, const std::function<bool()>& go_on) override;
  bool catches_up() const override { return !settings_.file.empty(); }
  std::string problem() const override { return problem_; }

 private:
  std::string id_;
  EspeakSettings settings_;
  WavFile file_;
  std::string problem_;
  bool checked_ = false;
};

}  // namespace takt
