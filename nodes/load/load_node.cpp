// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <memory>

#include "nodes/load/burn.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

int64_t nanoseconds(double seconds) { return std::llround(seconds * 1e9); }

void sleep_for(int64_t ns) {
  timespec left{ns / 1'000'000'000, ns % 1'000'000'000};
  while (nanosleep(&left, &left) != 0 && errno == EINTR) {
  }
}

class LoadNode final : public Node {
 public:
  void setup(Setup& setup) override {
    real_ = !setup.clock.is_virtual();
    output_.reserve({0, 0, 1, static_cast<uint32_t>(message_size_())});
  }

  void run(Job& job) override {
    if (job.index() == static_cast<uint64_t>(allocate_at_())) allocate(job);
    // In virtual time a job takes its budget, whatever it does: waiting for it would only be waste.
    if (real_) spend(job);
    TextStatus* message = output_.loan();
    if (message == nullptr) return job.no_result();
    // A flood sends what it is given, over and over; that ends where it is refused.
    for (; message != nullptr; message = flood_() ? output_.loan() : nullptr) {
      fill(message->text, job.index());
      output_.send(input_.empty() ? job.release_ns() : input_.stamp_ns());
    }
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, trouble_); }

 private:
  void spend(Job& job) {
    const bool long_one = (job.index() + 1) % static_cast<uint64_t>(every_()) == 0;
    const double share = levels()[static_cast<size_t>(job.level())].cost;
    load::burn(nanoseconds(share * (work_() + (long_one ? extra_() : 0))));
    if (crash_from_() > 0 && poisoned()) std::abort();
    if (sleep_() > 0) sleep_for(nanoseconds(sleep_()));
    if (!trouble_.due(job.release_ns(), nanoseconds(stuck_every_()))) return;
    load::burn(stuck_for_() > 0 ? nanoseconds(stuck_for_()) : std::numeric_limits<int64_t>::max() / 2);
  }

  /// The newest message of another load says a number that its process is to end at.
  bool poisoned() const {
    if (input_.empty()) return false;
    const Array<char>& text = input_.newest()->text;
    int64_t number = 0;
    std::from_chars(text.data(), text.data() + text.size, number);
    return number >= crash_from_() && number <= crash_to_();
  }

  /// Takes the block and writes to every page of it, as a leak or a careless copy would. It is kept.
  void allocate(Job& job) {
    const size_t bytes = static_cast<size_t>(allocate_()) * 1'000'000;
    if (bytes == 0) return;
    block_.reset(static_cast<unsigned char*>(std::malloc(bytes)));
    if (block_ == nullptr) return job.no_result();
    for (size_t i = 0; i < bytes; i += 4096) block_.get()[i] = 1;
  }

  void fill(Array<char>& text, uint64_t index) {
    char digits[20];
    const char* end = std::to_chars(std::begin(digits), std::end(digits), index).ptr;
    text.resize(flood_() ? text.capacity : static_cast<size_t>(end - digits));
    if (flood_()) std::fill_n(text.data(), text.size, '.');
    std::copy_n(digits, std::min<size_t>(text.size, static_cast<size_t>(end - digits)), text.data());
  }

  struct Free {
    void operator()(unsigned char* block) const { std::free(block); }
  };

  Input<TextStatus> input_{this, "input", "output of another load; its stamp is carried on", Need::optional};
  Output<TextStatus> output_{this, "output", "number of the job; filled up to the capacity if it floods"};
  Levels levels_{this, {{"full", 1.0, "all of the work"}, {"half", 0.5}, {"quarter", 0.25}}};
  Param<double> work_{this, "work", 0.001, {0.0, 60.0}, "s", "CPU time of each job"};
  Param<double> extra_{this, "extra", 0.0, {0.0, 60.0}, "s", "CPU time more in each `every`-th job"};
  Param<int> every_{this, "every", 1, {1, 1'000'000}, "1", "which jobs take `extra`"};
  Param<double> sleep_{this, "sleep", 0.0, {0.0, 60.0}, "s", "each job sleeps that long, as no job should"};
  Param<double> stuck_every_{this,          "stuck_every", 0.0,
                             {0.0, 3600.0}, "s",           "so often a job spins and does not return; 0: never"};
  Param<double> stuck_for_{this, "stuck_for", 0.0, {0.0, 3600.0}, "s", "CPU time that it spins for; 0: for ever"};
  Param<int> allocate_{this, "allocate", 0, {0, 100'000}, "MB", "memory that one job takes, writes to and keeps"};
  Param<int> allocate_at_{this, "allocate_at", 0, {0, 1'000'000'000}, "1", "number of that job, from 0"};
  Param<int> crash_from_{
      this, "crash_from",
      0,    {0, 1'000'000'000},
      "1",  "first number in a message of `input` whose job ends the process by SIGABRT; 0: none does"};
  Param<int> crash_to_{this, "crash_to", 0, {0, 1'000'000'000}, "1", "last of these numbers"};
  Param<int> message_size_{this,        "message_size", 64, {20, 16'000'000}, "1", "capacity of the output, characters",
                           kSizesMemory};
  Param<bool> flood_{this, "flood", false, "", "fills each message up to the capacity and sends until it is refused"};

  bool real_ = true;
  load::Trouble trouble_;
  std::unique_ptr<unsigned char, Free> block_;
};

}  // namespace

void register_load(NodeTypes& types) {
  types.add<LoadNode>("load", Layer::perception, "Uses a known amount of CPU time; misbehaves on request");
}

}  // namespace takt
