// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/bandwidth.hpp"

#include <dirent.h>
#include <sched.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <future>
#include <list>
#include <memory>
#include <thread>

#include "rt/sched/grant.hpp"

namespace takt {
namespace {

constexpr double kCounted = 0.005;  // cores; less is rounding
constexpr const char *kRuntimeFile = "/proc/sys/kernel/sched_rt_runtime_us",
                     *kPeriodFile = "/proc/sys/kernel/sched_rt_period_us";

template <class Do>
void for_each_number(const std::string& folder, const Do& act) {
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(opendir(folder.c_str()), closedir);
  while (const dirent* entry = entries ? readdir(entries.get()) : nullptr)
    if (const int number = std::atoi(entry->d_name); number > 0) act(number);
}

std::optional<double> number_in(const std::string& file) {
  double value = 0;
  if (std::ifstream(file) >> value) return value;
  return std::nullopt;
}

std::string cores_text(double cores) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", cores);
  return text;
}

int allowed_cpus() {
  cpu_set_t set;
  return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

/// The fair server counts as a reservation of each CPU. Its share is in debugfs, which few may read.
double server_share() {
  utsname system{};
  int major = 0, minor = 0;
  if (uname(&system) != 0 || std::sscanf(system.release, "%d.%d", &major, &minor) != 2) return 0;
  if (major < 6 || (major == 6 && minor < 12)) return 0;
  const std::string folder = "/sys/kernel/debug/sched/fair_server/cpu0/";
  const auto runtime = number_in(folder + "runtime"), period = number_in(folder + "period");
  return runtime && period && *period > 0 ? *runtime / *period : 0.05;
}

double limit_here() {
  return deadline_limit(number_in(kRuntimeFile).value_or(950'000), number_in(kPeriodFile).value_or(1'000'000),
                        allowed_cpus(), server_share());
}

/// Holds the largest share of one CPU that the kernel gives until it is destroyed.
class Probe {
 public:
  Probe() : thread_([this] { hold(); }) { share_ = answer_.get_future().get(); }
  ~Probe() {
    end_.set_value();
    thread_.join();
  }
  Probe(const Probe&) = delete;
  Probe& operator=(const Probe&) = delete;
  static constexpr int64_t kPeriod_ns = 10'000'000;
  /// Of a CPU; -1: refused for another reason than that too much is held.
  double share() const { return share_; }

 private:
  static int ask(int64_t runtime_ns) {
    Reservation wanted;
    wanted.policy = Policy::deadline;
    wanted.runtime_ns = runtime_ns;
    wanted.deadline_ns = wanted.period_ns = kPeriod_ns;
    return apply(wanted, 0).error;
  }
  void hold() {
    constexpr int64_t kLeast_ns = 2'000, kStep_ns = 1'000;  // the kernel takes no runtime below 1024 ns
    int64_t held = kPeriod_ns;
    if (ask(held) != 0) {
      held = 0;
      if (const int error = ask(kLeast_ns); error == 0) held = kLeast_ns;
      else if (error != EBUSY) held = -kPeriod_ns;
      for (int64_t refused = kPeriod_ns; held > 0 && refused - held > kStep_ns;) {
        const int64_t middle = held + (refused - held) / 2;
        (ask(middle) == 0 ? held : refused) = middle;
      }
    }
    answer_.set_value(static_cast<double>(held) / static_cast<double>(kPeriod_ns));
    end_.get_future().wait();
    apply_default();
  }

  std::promise<double> answer_;
  std::promise<void> end_;
  double share_ = 0;
  std::thread thread_;  ///< last: it uses all of the above
};

}  // namespace

std::vector<DeadlineHolder> deadline_holders() {
  std::vector<DeadlineHolder> holders;
  for_each_number("/proc", [&](int process) {
    DeadlineHolder holder;
    holder.process = process;
    for_each_number("/proc/" + std::to_string(process) + "/task", [&](int thread) {
      const std::optional<Reservation> has = reservation_of(thread);
      if (!has) return;
      ++holder.threads;
      holder.cores += static_cast<double>(has->runtime_ns) / static_cast<double>(has->period_ns);
    });
    if (holder.threads == 0) return;
    std::getline(std::ifstream("/proc/" + std::to_string(process) + "/comm"), holder.name);
    holders.push_back(std::move(holder));
  });
  std::sort(holders.begin(), holders.end(), [](const auto& a, const auto& b) { return a.cores > b.cores; });
  return holders;
}

double cores_of(const std::vector<DeadlineHolder>& holders) {
  double sum = 0;
  for (const DeadlineHolder& holder : holders) sum += holder.cores;
  return sum;
}

std::string to_text(const std::vector<DeadlineHolder>& holders) {
  constexpr size_t kNamed = 4;
  std::string text;
  for (size_t i = 0; i < std::min(holders.size(), kNamed); ++i)
    text += (i > 0 ? ", " : "") + holders[i].name + " (pid " + std::to_string(holders[i].process) + ", " +
            std::to_string(holders[i].threads) + (holders[i].threads == 1 ? " thread) " : " threads) ") +
            cores_text(holders[i].cores);
  if (holders.size() > kNamed) text += " and " + std::to_string(holders.size() - kNamed) + " more";
  return text;
}

double deadline_limit(double runtime_us, double period_us, int cpus, double server_share) {
  const double share = runtime_us > 0 && period_us > 0 ? runtime_us / period_us : runtime_us == 0 ? server_share : 1;
  return std::max(0.0, share - server_share) * cpus;
}

std::optional<double> free_bandwidth() {
  double sum = 0;
  {
    std::list<Probe> probes;
    do {
      const double share = probes.emplace_back().share();
      if (share < 0) return std::nullopt;
      sum += share;
    } while (probes.back().share() >= 1 && probes.size() < CPU_SETSIZE);
  }
  const timespec until_returned{0, 2 * Probe::kPeriod_ns};  // their 0-lag times
  nanosleep(&until_returned, nullptr);
  return sum;
}

double DeadlineBandwidth::lost() const {
  const double lost = limit - free - cores_of(holders);
  return lost >= kCounted ? lost : 0;
}

std::optional<DeadlineBandwidth> deadline_bandwidth() {
  DeadlineBandwidth found;
  found.holders = deadline_holders();
  const std::optional<double> free = free_bandwidth();
  if (!free) return std::nullopt;
  found.free = *free;
  found.limit = limit_here();
  return found;
}

std::string recount_command() {
  return "sudo sysctl kernel.sched_rt_runtime_us=" +
         std::to_string(static_cast<int64_t>(number_in(kRuntimeFile).value_or(950'000)));
}

std::string why_busy(double asked, double least_refused, double limit, const std::vector<DeadlineHolder>& holders,
                     pid_t self) {
  std::vector<DeadlineHolder> others = holders;
  std::erase_if(others, [&](const DeadlineHolder& holder) { return holder.process == self; });
  std::string text = "asked for " + cores_text(asked) + " cores, the kernel reserves " + cores_text(limit) + " in all";
  if (!others.empty()) text += "; held by others: " + to_text(others);
  if (cores_of(holders) + least_refused <= limit - kCounted)
    return text + "; no thread holds the rest, it is lost until the kernel counts anew: " + recount_command();
  if (asked > limit) return text + "; lower the budgets in the schedule";
  return text + "; end those, or lower the budgets in the schedule";
}

std::string why_busy(double asked, double least_refused) {
  return why_busy(asked, least_refused, limit_here(), deadline_holders(), getpid());
}

}  // namespace takt
