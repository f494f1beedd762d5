// SPDX-License-Identifier: Apache-2.0
// Silence, and who keeps a group with its daemon alive. The groups are processes that do one thing; time runs by 50 ms
// at each look.
#include "rt/supervise/group_keeper.hpp"

#include <doctest/doctest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <csignal>
#include <new>

#include "tests/nanoseconds.hpp"

namespace {

using namespace takt;
using test::kMs;

class HastyClock final : public Clock {
 public:
  int64_t now_ns() const override { return now_.fetch_add(50 * kMs); }
  bool is_virtual() const override { return true; }

 private:
  mutable std::atomic<int64_t> now_{1000 * kMs};
};

/// What keeper and groups share: signs, and how many groups there were.
struct GroupScene {
  struct Shared {
    GroupSigns signs;
    std::atomic<int> groups{0};
    std::atomic<pid_t> member{0};
  };
  Shared* shared;
  HastyClock clock;
  GroupKeeper::Options options;
  std::vector<pid_t> cleaned;
  std::vector<std::string> said;

  GroupScene() {
    void* memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    REQUIRE(memory != MAP_FAILED);
    shared = ::new (memory) Shared;
    options.silence_ns = 1000 * kMs;
    shared->signs.ordinary.store(false);
    options.restarts.step_ns = 0;
    options.restarts.most_in_window = 3;
    options.clean_up = [this](pid_t pid) { cleaned.push_back(pid); };
    options.say = [this](const std::string& what) { said.push_back(what); };
  }
  ~GroupScene() { munmap(shared, sizeof(Shared)); }
  GroupScene(const GroupScene&) = delete;
  GroupScene& operator=(const GroupScene&) = delete;

  /// `group` is told the how many-th it is, from 1 on.
  std::optional<int> keep(const std::function<int(int)>& group) {
    return GroupKeeper(shared->signs, clock, options).keep([&] { return group(shared->groups.fetch_add(1) + 1); });
  }
  const GroupSigns::Loss& loss() const { return shared->signs.newest_loss; }
};

int wait_for_ever() {
  for (;;) pause();
  return 0;
}

}  // namespace

TEST_CASE("silence lasts from a sign to the next look at which there is none, as long as the watcher is awake") {
  Silence silence;
  CHECK(silence.look(0, 1000 * kMs) == 0);  // none expected
  CHECK(silence.look(0, 1010 * kMs) == 0);
  CHECK(silence.look(7, 1020 * kMs) == 0);  // heard
  CHECK(silence.look(7, 1030 * kMs) == 10 * kMs);
  CHECK(silence.look(7, 1050 * kMs) == 30 * kMs);
  CHECK(silence.look(7, 9050 * kMs) == 80 * kMs);  // eight seconds in which nobody ran
  CHECK(silence.look(8, 9060 * kMs) == 0);
  CHECK(silence.look(8, 9070 * kMs) == 10 * kMs);
  CHECK(silence.look(0, 9080 * kMs) == 0);  // no sign is expected any more
}

TEST_CASE("the code of a group that ends by itself is that of the run") {
  GroupScene scene;
  CHECK(scene.keep([](int) { return 3; }) == 3);
  CHECK(scene.shared->groups.load() == 1);
  CHECK(scene.shared->signs.losses.load() == 0);
  CHECK(scene.cleaned.empty());
}

TEST_CASE("a group whose first process dies is cleared up after, noted and started anew") {
  GroupScene scene;
  CHECK(scene.keep([](int number) { return number == 1 ? raise(SIGKILL) : 4; }) == 4);
  CHECK(scene.shared->groups.load() == 2);
  CHECK(scene.cleaned.size() == 1);
  REQUIRE(scene.shared->signs.losses.load() == 1);
  CHECK(std::string(scene.loss().cause.text()) == "the supervisor was ended by signal 9 (Killed)");
  REQUIRE(scene.said.size() == 1);
  CHECK(scene.said[0].find("all processes are started again") != std::string::npos);
}

TEST_CASE("a group that once gave a sign and gives none any more is ended and started anew") {
  GroupScene scene;
  const auto code = scene.keep([&](int number) {
    if (number == 2) return 0;
    scene.shared->signs.heartbeat_ns.store(77);
    return wait_for_ever();
  });
  CHECK(code == 0);
  REQUIRE(scene.shared->signs.losses.load() == 1);
  CHECK(scene.loss().from_ns == 77);  // lost since it was last heard
  CHECK(std::string(scene.loss().cause.text()) == "the transport's daemon gave no sign of life");
}

TEST_CASE("a group of ordinary threads may be silent for three times as long") {
  GroupScene scene;
  scene.shared->signs.ordinary.store(true);
  const int64_t begun_ns = scene.clock.now_ns();
  scene.keep([&](int number) {
    if (number == 2) return 0;
    scene.shared->signs.heartbeat_ns.store(77);
    return wait_for_ever();
  });
  CHECK(scene.shared->signs.losses.load() == 1);
  CHECK(scene.clock.now_ns() - begun_ns > 3 * scene.options.silence_ns);
}

TEST_CASE("nobody of a lost group lives on beside the next one") {
  GroupScene scene;
  const auto code = scene.keep([&](int number) {
    if (number == 2) return kill(scene.shared->member.load(), 0) == 0 ? 9 : 5;
    const pid_t member = fork();
    if (member == 0) wait_for_ever();  // does not die with who forked it
    scene.shared->member.store(member);
    return raise(SIGKILL);
  });
  CHECK(code == 5);
}

TEST_CASE("after any number of losses the newest one is told") {
  GroupScene scene;
  constexpr int kMany = 100;
  scene.options.restarts.most_in_window = kMany + 1;
  const auto code = scene.keep([&](int number) {
    if (number > kMany) return 0;
    scene.shared->signs.heartbeat_ns.store(number);
    return wait_for_ever();
  });
  CHECK(code == 0);
  CHECK(scene.shared->signs.losses.load() == kMany);
  CHECK(scene.loss().from_ns == kMany);
}

TEST_CASE("too many losses in a short time are the last one") {
  GroupScene scene;
  CHECK_FALSE(scene.keep([](int) { return raise(SIGKILL); }));
  CHECK(scene.shared->groups.load() == 3);
  CHECK(scene.shared->signs.losses.load() == 3);
}

TEST_CASE("asked to stop, it passes that on, and what ends then is no loss") {
  GroupScene scene;
  scene.options.stop_asked = [&] { return scene.shared->groups.load() == 1; };
  const auto group = [](int) {
    signal(SIGTERM, SIG_DFL);  // not as the test program would have it, which reports a crash
    return wait_for_ever();
  };
  CHECK(scene.keep(group) == 128 + SIGTERM);
  CHECK(scene.shared->groups.load() == 1);
  CHECK(scene.shared->signs.losses.load() == 0);
}
