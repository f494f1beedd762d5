// SPDX-License-Identifier: Apache-2.0
#include "hal/interaction/speaking.hpp"

#include "hal/interaction/espeak.hpp"
#include "hal/interaction/voice_double.hpp"

namespace takt {

DeviceResult SpeakingTo::open() {
  if (auto opened = person_->open(); !opened) return opened;
  return speaker_->open();
}

void SpeakingTo::close() {
  speaker_->stop();
  person_->close();
}

DeviceResult SpeakingTo::start(int64_t epoch_ns) {
  speaker_->start(epoch_ns);
  return person_->start(epoch_ns);
}

void SpeakingTo::stop() {
  speaker_->stop();
  person_->stop();
}

SourceCounts SpeakingTo::counts() const {
  SourceCounts counts = person_->counts();
  counts.unsent += speaker_->dropped();
  return counts;
}

const char* SpeakingTo::trouble() const {
  const char* const trouble = person_->trouble();
  return *trouble != '\0' ? trouble : speaker_->trouble();
}

bool SpeakingTo::say(std::string_view text) {
  speaker_->say(text);
  return person_->say(text);
}

void SpeakingTo::go_on_after(uint32_t number, std::string_view last) {
  speaker_->go_on();
  person_->go_on_after(number, last);
}

namespace hal {
namespace {

constexpr const char* kSoundCard = "sound card";

std::unique_ptr<Voice> voice_of(const std::string& speech, const DeviceConfig& config, Settings& settings) {
  const std::string to = settings.text("speech_to", kSoundCard);
  EspeakSettings espeak;
  espeak.voice = settings.text("voice", espeak.voice);
  espeak.words_per_minute = static_cast<int>(settings.count("words_per_minute", espeak.words_per_minute, 80, 450));
  if (speech == "double") {
    if (to == kSoundCard) settings.fail("the double of a loudspeaker writes a file", "give `speech_to: FILE`");
    return std::make_unique<VoiceDouble>(config.id, to);
  }
  if (to != kSoundCard) espeak.file = to;
  if (to != kSoundCard && !to.ends_with(".wav"))
    settings.fail("`speech_to` is " + to, "give `sound card` or a file whose name ends with .wav");
  return std::make_unique<EspeakVoice>(config.id, espeak);
}

}  // namespace

std::unique_ptr<Interaction> with_speech(std::unique_ptr<Interaction> person, const DeviceConfig& config,
                                         Settings& settings, const Clock& clock) {
  const std::string speech = settings.text("speech", "none");
  if (speech == "none") {
    for (const char* name : {"speech_to", "voice", "words_per_minute"})
      if (settings.has(name))
        settings.fail("there is `" + std::string(name) + "` and no `speech`", "add `speech: espeak-ng`");
    return person;
  }
  if (speech != "espeak-ng" && speech != "double") {
    settings.fail("`speech` is " + speech, "use none, espeak-ng or double");
    return person;
  }
  auto voice = voice_of(speech, config, settings);
  // What only checks a graph needs neither the program nor the file's folder.
  if (!config.plugged || settings.error()) return person;
  return std::make_unique<SpeakingTo>(std::move(person),
                                      std::make_unique<Loudspeaker>(config.id, std::move(voice), clock));
}

std::vector<SettingInfo> speech_settings() {
  using enum SettingKind;
  return {
      {"speech", "", text, false, "what says aloud what the robot says: none, espeak-ng or double; none"},
      {"speech_to", "", text, false,
       "where it is heard: sound card or FILE.wav; of the double a file with a sentence a line; sound card"},
      {"voice", "", text, false, "of espeak-ng, as espeak-ng --voices lists them; en"},
      {"words_per_minute", "", count, false, "how quickly espeak-ng speaks, 80..450; 160"},
  };
}

}  // namespace hal
}  // namespace takt
