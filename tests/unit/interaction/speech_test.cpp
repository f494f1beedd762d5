// SPDX-License-Identifier: Apache-2.0
// What the robot says, aloud: a bounded queue, WAV files, a program that is missing, fails or speaks.
#include <doctest/doctest.h>
#include <sched.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <mutex>

#include "hal/interaction/espeak.hpp"
#include "hal/interaction/loudspeaker.hpp"
#include "hal/interaction/speaking.hpp"
#include "hal/interaction/voice_double.hpp"
#include "hal/interaction/web.hpp"
#include "rt/time/clock.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using test::has;

namespace {

/// Says nothing until it is let, and remembers what it said.
class HeldVoice final : public Voice {
 public:
  struct Shared {
    std::atomic<bool> let{true}, busy{false}, fails{false};
    std::atomic<int> rounds{0};
    std::mutex lock;
    std::vector<Sentence> said;
    size_t count() {
      const std::lock_guard guard(lock);
      return said.size();
    }
  };
  HeldVoice(Shared& shared, bool file) : shared_(shared), file_(file) {}
  DeviceResult open() override { return {}; }
  bool start(bool) override { return true; }
  bool speak(const Sentence& sentence, const std::function<bool()>& go_on) override {
    shared_.busy.store(true);
    while (!shared_.let.load()) {
      if (!go_on()) return false;
      ++shared_.rounds;
      sched_yield();
    }
    if (shared_.fails.load()) return false;
    const std::lock_guard guard(shared_.lock);
    shared_.said.push_back(sentence);
    return true;
  }
  bool catches_up() const override { return file_; }
  std::string problem() const override { return "it is hoarse"; }

 private:
  Shared& shared_;
  bool file_;
};

void until(const std::function<bool()>& done) {
  while (!done()) sched_yield();
}

std::vector<uint8_t> bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string text_of(const std::filesystem::path& path) {
  const auto bytes = bytes_of(path);
  return {bytes.begin(), bytes.end()};
}

/// Mono, 8000 samples a second, 16 bits.
const std::vector<uint8_t> kFormat{1, 0, 1, 0, 0x40, 0x1f, 0, 0, 0x80, 0x3e, 0, 0, 2, 0, 16, 0};
constexpr size_t kPauseBytes = 8000 * 300 / 1000 * 2;

/// A program in the place of espeak-ng: it keeps its arguments and what it is to say, and prints a WAV file of 5
/// samples whose header promises more, as espeak-ng does.
struct Program {
  test::TemporaryFolder folder;
  std::filesystem::path path;
  explicit Program(const std::string& more = "") {
    path = folder.write(
        "espeak",
        "#!/bin/sh\nwords=$(cat)\n" + more + "\n[ -z \"$words\" ] && exit 0\necho \"$*|$words\" >>" +
            (folder.path / "told").string() +
            "\nprintf 'RIFF\\044\\360\\377\\177WAVEfmt \\020\\000\\000\\000\\001\\000\\001\\000\\100\\037\\000\\000"
            "\\200\\076\\000\\000\\002\\000\\020\\000data\\000\\360\\377\\177abcdefghij'\n");
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  }
  EspeakSettings settings(const char* file = "said.wav") const {
    EspeakSettings settings;
    settings.program = path;
    if (*file != '\0') settings.file = folder.path / file;
    return settings;
  }
};

bool always() { return true; }

}  // namespace

TEST_CASE("loudspeaker: one sentence a line, in order, with its time") {
  HeldVoice::Shared shared;
  VirtualClock clock(5'000);
  Loudspeaker speaker("person", std::make_unique<HeldVoice>(shared, true), clock);
  speaker.start(1'000);
  speaker.say("I stop\n\ngoal: done");
  clock.advance_to(7'000);
  const std::string word(99, 'w');
  speaker.say(word + " " + word + " " + word + " " + word + " " + word);
  speaker.stop();
  REQUIRE(shared.said.size() == 4);
  CHECK(shared.said[0].text == "I stop");
  CHECK(shared.said[0].at_ns == 4'000);
  CHECK(shared.said[1].text == "goal: done");
  CHECK(shared.said[2].text.size() == 400);  // pieces end between words
  CHECK(shared.said[2].text.back() == ' ');
  CHECK(shared.said[3].text == word);
  CHECK(shared.said[3].at_ns == 6'000);
  CHECK(speaker.dropped() == 0);
  CHECK(std::string(speaker.trouble()).empty());
}

TEST_CASE("loudspeaker: of more than there is time for the newest are said, the others are counted") {
  HeldVoice::Shared shared;
  shared.let.store(false);
  VirtualClock clock;
  Loudspeaker speaker("person", std::make_unique<HeldVoice>(shared, true), clock);
  speaker.start(0);
  speaker.say("first");
  until([&] { return shared.busy.load(); });
  for (int i = 0; i < 20; ++i) speaker.say(std::to_string(i));
  // Two rounds: the second one began after the last sentence came.
  const int before = shared.rounds.load();
  until([&] { return shared.rounds.load() >= before + 2; });
  CHECK(speaker.dropped() == 12);
  shared.let.store(true);
  speaker.stop();
  REQUIRE(shared.said.size() == 1 + Loudspeaker::kMostWaiting);
  CHECK(shared.said.front().text == "first");
  for (size_t i = 0; i < Loudspeaker::kMostWaiting; ++i) CHECK(shared.said[1 + i].text == std::to_string(12 + i));
  CHECK(speaker.dropped() == 12);
}

TEST_CASE("loudspeaker: the end of the run interrupts a sound card, and what is left is counted") {
  HeldVoice::Shared shared;
  shared.let.store(false);
  VirtualClock clock;
  Loudspeaker speaker("person", std::make_unique<HeldVoice>(shared, false), clock);
  speaker.start(0);
  speaker.say("first");
  until([&] { return shared.busy.load(); });
  speaker.say("second\nthird");
  speaker.stop();
  CHECK(shared.said.empty());
  CHECK(speaker.dropped() == 3);
}

TEST_CASE("a loudspeaker that fails is the device's trouble until it speaks again; what it did not say is unsent") {
  HeldVoice::Shared shared;
  shared.fails.store(true);
  VirtualClock clock;
  SpeakingTo person(std::make_unique<WebScreen>(),
                    std::make_unique<Loudspeaker>("person", std::make_unique<HeldVoice>(shared, false), clock));
  REQUIRE(person.open());
  REQUIRE(person.start(0));
  CHECK(person.say("one"));
  until([&] { return person.counts().unsent == 1; });
  CHECK(has(person.trouble(), "does not speak"));
  shared.fails.store(false);
  CHECK(person.say("two"));
  until([&] { return shared.count() == 1 && std::string(person.trouble()).empty(); });
  CHECK(person.answer("stop"));
  CHECK(person.read(7).task == "stop");
  CHECK(person.counts().received == 1);
  person.stop();
  CHECK(person.counts().unsent == 1);
}

TEST_CASE("the double of a loudspeaker writes what it would say, and goes on after a restart") {
  const test::TemporaryFolder folder;
  const auto file = folder.path / "said";
  VirtualClock clock(2'500'000'000);
  const auto say = [&](const char* words, bool again) {
    Loudspeaker speaker("person", std::make_unique<VoiceDouble>("person", file), clock);
    REQUIRE(speaker.open());
    if (again) speaker.go_on();
    speaker.start(1'000'000'000);
    speaker.say(words);
    speaker.stop();
  };
  say("I stop", false);
  clock.advance_to(13'340'000'000);
  say("explore: done", true);
  CHECK(text_of(file) == "1.500 s I stop\n12.340 s explore: done\n");
  say("anew", false);
  CHECK(text_of(file) == "12.340 s anew\n");
  const auto nowhere = VoiceDouble("person", "/nowhere/at/all").open();
  REQUIRE_FALSE(nowhere);
  CHECK(has(nowhere.error().text(), "person: `speech_to`: /nowhere/at/all: No such file"));
}

TEST_CASE("a WAV file is whole after each sound, goes on, and takes no other kind of samples") {
  const test::TemporaryFolder folder;
  const auto path = folder.path / "said.wav";
  const std::vector<uint8_t> samples{1, 2, 3, 4};
  {
    WavFile file;
    REQUIRE(file.open(path, false));
    REQUIRE(file.add({kFormat, samples}));
    const auto bytes = bytes_of(path);
    CHECK(bytes.size() == 48);
    const auto sound = sound_in(bytes);
    REQUIRE(sound);
    CHECK(sound->format == kFormat);
    CHECK(std::vector<uint8_t>(sound->samples.begin(), sound->samples.end()) == samples);
    auto other = kFormat;
    other[4] = 0;
    CHECK_FALSE(file.add({other, samples}));
    CHECK(has(file.problem(), "another kind of samples"));
  }
  {
    WavFile file;
    REQUIRE(file.open(path, true));
    REQUIRE(file.add({kFormat, samples}));
  }
  const auto bytes = bytes_of(path);
  const auto sound = sound_in(bytes);
  REQUIRE(sound);
  CHECK(bytes.size() == 44 + 4 + kPauseBytes + 4);
  CHECK(sound->samples.size() == bytes.size() - 44);
  CHECK(sound->samples[4] == 0);
  CHECK(sound->samples.back() == 4);
  const auto words = folder.write("words", "no sound at all, but quite a few words that are longer than a header");
  WavFile none;
  CHECK_FALSE(none.open(words, true));
  CHECK(has(none.problem(), "is no WAV file"));
  CHECK_FALSE(none.add({kFormat, samples}));
}

TEST_CASE("what a WAV file says of its sizes is not believed; every cut of one is refused or whole") {
  const Program program;
  EspeakVoice voice("person", program.settings());
  REQUIRE(voice.open());
  REQUIRE(voice.start(false));
  REQUIRE(voice.speak({0, "a"}, always));
  auto bytes = bytes_of(program.folder.path / "said.wav");
  REQUIRE(bytes.size() == 54);
  for (size_t size = 0; size <= bytes.size(); ++size) {
    const auto sound = sound_in(std::span(bytes).first(size));
    CHECK(sound.has_value() == (size >= 44));
    if (sound) CHECK(sound->samples.size() == (size - 44) / 2 * 2);
  }
  for (size_t at = 0; at < 44; ++at) {
    auto damaged = bytes;
    damaged[at] = 0xff;
    if (const auto sound = sound_in(damaged)) CHECK(sound->samples.size() <= 10);
  }
}

TEST_CASE("espeak-ng: the words are no options, voice and speed are; each sentence is added to the file") {
  const Program program;
  EspeakSettings settings = program.settings();
  settings.voice = "de";
  settings.words_per_minute = 200;
  EspeakVoice voice("person", settings);
  REQUIRE(voice.open());
  CHECK_FALSE(std::filesystem::exists(settings.file));
  REQUIRE(voice.start(false));
  CHECK(voice.speak({0, "--version"}, always));
  CHECK(voice.speak({0, "I stop; `rm x`"}, always));
  CHECK(text_of(program.folder.path / "told") ==
        "-v de -s 200 --stdin --stdout|--version\n-v de -s 200 --stdin --stdout|I stop; `rm x`\n");
  const auto bytes = bytes_of(settings.file);
  const auto sound = sound_in(bytes);
  REQUIRE(sound);
  CHECK(sound->samples.size() == 10 + kPauseBytes + 10);
}

TEST_CASE("espeak-ng: missing, with a voice that it does not know, with a file that nobody may write") {
  EspeakSettings settings;
  settings.program = "/nowhere/espeak-ng";
  const auto missing = EspeakVoice("person", settings).open();
  REQUIRE_FALSE(missing);
  CHECK_FALSE(missing.error().bad_input);
  CHECK(has(missing.error().text(), "/nowhere/espeak-ng: No such file"));
  CHECK(has(missing.error().text(), "fix: apt install espeak-ng"));
  const Program program("[ $2 = xx ] && { echo 'Error: no such voice' >&2; exit 1; }");
  settings = program.settings();
  settings.voice = "xx";
  const auto unknown = EspeakVoice("person", settings).open();
  REQUIRE_FALSE(unknown);
  CHECK(has(unknown.error().text(), "`voice` is xx"));
  CHECK(has(unknown.error().text(), "Error: no such voice"));
  settings = program.settings();
  settings.file = "/nowhere/at.wav";
  const auto nowhere = EspeakVoice("person", settings).open();
  REQUIRE_FALSE(nowhere);
  CHECK(has(nowhere.error().text(), "`speech_to`: /nowhere/at.wav"));
}

TEST_CASE("espeak-ng: no sound card, a crash and a sentence that is left off are no speech") {
  const Program no_card(
      "echo 'ALSA lib: no card' >&2; [ -n \"$words\" ] && { echo 'error: No such file' >&2; exit 0; }");
  EspeakVoice mute("person", no_card.settings(""));
  REQUIRE(mute.open());
  REQUIRE(mute.start(false));
  CHECK_FALSE(mute.speak({0, "a"}, always));
  CHECK(has(mute.problem(), "error: No such file"));
  const Program crashes("[ -n \"$words\" ] && kill -SEGV $$");
  EspeakVoice hurt("person", crashes.settings(""));
  REQUIRE(hurt.open());
  CHECK_FALSE(hurt.speak({0, "a"}, always));
  CHECK(has(hurt.problem(), "was ended by signal 11"));
  const Program endless("[ -n \"$words\" ] && exec sleep 1000");
  EspeakVoice patient("person", endless.settings(""));
  REQUIRE(patient.open());
  int looks = 0;
  CHECK_FALSE(patient.speak({0, "a"}, [&] { return ++looks < 3; }));
  CHECK(looks >= 3);
}

TEST_CASE("espeak-ng itself, where it is installed: more words are a longer file") {
  const test::TemporaryFolder folder;
  EspeakSettings settings;
  settings.file = folder.path / "said.wav";
  if (access(settings.program.c_str(), X_OK) != 0) {
    MESSAGE("NOT RUN: espeak-ng is missing: apt install espeak-ng");
    return;
  }
  EspeakVoice voice("person", settings);
  REQUIRE(voice.open());
  REQUIRE(voice.start(false));
  const auto seconds = [&] {
    const auto bytes = bytes_of(settings.file);
    const auto sound = sound_in(bytes);
    REQUIRE(sound);
    CHECK(sound->format == std::vector<uint8_t>{1, 0, 1, 0, 0x22, 0x56, 0, 0, 0x44, 0xac, 0, 0, 2, 0, 16, 0});
    return static_cast<double>(sound->samples.size()) / 2 / 22050;
  };
  REQUIRE(voice.speak({0, "yes"}, always));
  const double one = seconds();
  CHECK(one > 0.2);
  CHECK(one < 2);
  REQUIRE(voice.speak({0, "which way does one go to the place in the middle of the town?"}, always));
  CHECK(seconds() > 2 * one + 0.3);
  EspeakSettings unknown;
  unknown.voice = "xx";
  CHECK_FALSE(EspeakVoice("person", unknown).open());
}
