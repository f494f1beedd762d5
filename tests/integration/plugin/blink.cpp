// SPDX-License-Identifier: Apache-2.0
// A plug-in for plugin.sh, as a stranger writes it. The environment variable BLINK says what goes wrong while it is
// loaded or in the setup of a blinker, the parameter `trouble` what goes wrong in the job of that number.
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <string_view>
#include <thread>

#include "graph/plugin.hpp"
#include "rt/msg/image.hpp"
#include "rt/node.hpp"

namespace {

bool asked_for(std::string_view trouble) {
  const char* const word = std::getenv("BLINK");
  return word != nullptr && word == trouble;
}

volatile int endless = 1;

struct Initialiser {
  Initialiser() {
    if (asked_for("crash")) std::abort();
    if (asked_for("exit")) std::exit(0);
    if (asked_for("throw early")) throw std::runtime_error("nobody can catch this");
    while (asked_for("loop") && endless != 0) {
    }
    if (asked_for("thread")) std::thread([] { pause(); }).detach();
    if (asked_for("fork") && fork() == 0) pause();
  }
} const initialiser;

void trouble_in_setup() {
  if (asked_for("setup crash")) std::abort();
  if (asked_for("setup exit")) std::exit(0);
  if ((asked_for("setup fork") || asked_for("setup fork loop")) && fork() == 0) {
    setsid();
    if (fork() == 0) pause();
    std::_Exit(0);
  }
  if (asked_for("setup handlers") || asked_for("setup deaf"))
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGABRT, SIGCHLD}) std::signal(signal, SIG_IGN);
  while ((asked_for("setup loop") || asked_for("setup fork loop") || asked_for("setup deaf")) && endless != 0) {
  }
}

/// A message of the plug-in's own: its functions are its code, too.
struct Glow {
  static constexpr std::string_view type_name = "glow";
  uint32_t brightness = 0;
  takt::Array<char> words;
  takt::Array<uint8_t> pixels;
  bool sound() const { return pixels.size == 0 || pixels.size == 4; }
  void show(takt::Viewer& to) const { to.picture({pixels.data(), 2, 2}); }
  TAKT_FIELDS(Glow, (brightness, "1"), (words, "", capacity.count), (pixels, "", 2 * capacity.width))
};

void put(Glow& glow, std::string_view words) {
  glow.words.resize(words.size());
  std::copy(words.begin(), words.end(), glow.words.data());
  glow.pixels.resize(4);
  std::fill_n(glow.pixels.data(), 4, static_cast<uint8_t>(glow.brightness));
}

constexpr double kPi = 3.14159265358979323846;

class Blinker final : public takt::Node {
 public:
  void setup(takt::Setup&) override {
    trouble_in_setup();
    light_.reserve({2, 0, 1, 3});
  }
  void run(takt::Job& job) override {
    if (job.index() == static_cast<uint64_t>(at_())) cause_trouble();
    Glow* const message = light_.loan();
    if (message == nullptr) return job.no_result();
    message->brightness = static_cast<uint32_t>(brightness_());
    put(*message, job.index() % 2 == 0 ? "on" : "off");
    light_.send(job.release_ns());
  }
  void finish() override {
    if (asked_for("finish slowly")) sleep(8);  // its files go to a slow disk
  }

 private:
  void cause_trouble() {
    switch (trouble_()) {
      case 1: throw std::runtime_error("a node of a plug-in throws");
      case 2: std::abort();
      case 3:
        while (endless != 0) {
        }
        break;
      default: break;
    }
  }

  takt::Output<Glow> light_{this, "light", "on or off"};
  takt::Levels levels_{this, {{"bright"}, {"dim", 0.5, "half as bright"}}};
  takt::Param<double> angle_{this, "angle", 0.0, {-kPi, kPi}, "rad", "where it shines"};
  takt::Param<int> brightness_{this, "brightness", 7, {0, 255}, "", "of the pixels"};
  takt::Choice trouble_{this, "trouble", "none", {"none", "throw", "crash", "loop"}, "in job number `at`"};
  takt::Param<int> at_{this, "at", 5, {0, 1000}, "", "the job in which it happens"};
};

class Watcher final : public takt::Node {
 public:
  void setup(takt::Setup&) override { seen_.reserve({2, 0, 1, 3}); }
  void run(takt::Job& job) override {
    Glow* const message = seen_.loan();
    if (message == nullptr) return job.no_result();
    put(*message, light_.empty() ? "no" : "yes");
    seen_.send(light_.empty() ? job.release_ns() : light_.stamp_ns());
  }

 private:
  takt::Input<Glow> light_{this, "light", "of a blinker"};
  takt::Output<Glow> seen_{this, "seen", "whether it was seen"};
};

void register_blink(takt::Registry& registry) {
  if (asked_for("throw") || asked_for("fork")) throw std::runtime_error("the lamp is missing");
  registry.nodes.add<Blinker>("blinker", takt::Layer::processing, "says on and off in turn");
  registry.nodes.add<Watcher>("watcher", takt::Layer::processing, "looks at a blinker");
  if (asked_for("taken")) registry.nodes.add<Watcher>("stereo", takt::Layer::processing, "a name of Takt's own");
}

}  // namespace

TAKT_PLUGIN(register_blink)
