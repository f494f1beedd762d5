// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <ctime>
#include <optional>

#include "rt/sched/grant.hpp"

namespace takt {

class Lookout;

/// Between one worker and the watchdog: what the worker runs, and what was done to it. The worker writes a few words at
/// the begin and the end of a job and makes no system call; only a worker that was demoted makes one, to get back what
/// it had.
class JobWatch {
 public:
  struct Running {
    uint64_t serial = 0;  ///< of the job on this worker; 0: none runs
    uint32_t member = 0;  ///< of the lane
    uint64_t index = 0;
    int64_t release_ns = 0, cpu_limit_ns = 0;
    bool acted = false;  ///< demoted, or its overrun was told
  };

  // The worker's side.
  /// By the thread that will run the jobs, before the first: what it has, and is given back after a demotion.
  void bind(const Reservation& has);
  /// The same where the kernel had no bandwidth for it: the thread goes on under SCHED_FIFO as after a lift, and asks
  /// again after each of its jobs.
  void bind_beside(const Reservation& wanted, bool behind);
  /// It has done its work, up to this reading of its CPU clock.
  void rest(int64_t cpu_ns) { rested_cpu_ns_.store(cpu_ns, std::memory_order_release); }
  /// Before the worker sleeps, wherever the runtime itself makes it sleep, and after it: not even a lift that is under
  /// way meets a sleeping thread then (see runnable()). It waits for that as long as its own reservation lasts at most:
  /// the watchdog goes on when that is used up.
  void falls_asleep();
  void awakes() { wake_.store(Wake::awake, std::memory_order_release); }
  /// No job begins before this instant.
  void expect(int64_t release_ns) { expected_ns_.store(release_ns, std::memory_order_release); }
  /// `cpu_limit_ns`: reading of the thread's CPU clock at which the budget is used up.
  void begin(uint32_t member, uint64_t index, int64_t release_ns, int64_t cpu_limit_ns);
  /// After the node returned, before anything is published. True if the job had been demoted: the thread has its own
  /// priority back.
  bool end();

  /// After a job that used that much more than its budget: a reservation owes it to the kernel.
  void overran(int64_t by_ns, int64_t at_ns);

  // The watchdog's side.
  /// Is woken when a job has ended that was acted on: until then it has nothing to look at. Null: nobody.
  void set_lookout(Lookout* lookout) { lookout_.store(lookout, std::memory_order_release); }
  Running running() const;
  int64_t expected_ns() const { return expected_ns_.load(std::memory_order_acquire); }
  /// CPU clock of the worker, ns; -1 if it cannot be read.
  int64_t cpu_ns() const;
  /// Runtime of its reservation; 0: it has none.
  int64_t runtime_ns() const { return runtime_ns_.load(std::memory_order_acquire); }
  int64_t period_ns() const { return has_.period_ns; }
  /// Reading of its CPU clock at which a whole runtime is used since it rested.
  int64_t reserve_end_ns() const { return rested_cpu_ns_.load(std::memory_order_acquire) + runtime_ns(); }
  /// Puts the worker behind everybody else until its job ends; false if job `serial` ended or was demoted before, or
  /// the kernel refuses.
  bool demote(uint64_t serial);
  /// Lets the worker, which has a reservation, go on under SCHED_FIFO: before all workers, or `behind` all of them
  /// (where that is refused, as an ordinary thread). The `owed_ns` that it owes the kernel are forgotten only with time
  /// (measured: the kernel keeps the debt of a thread that leaves and comes back). After the first job that ends when
  /// that has passed, the worker takes its reservation back. `refused`: the thread sleeps, or the kernel does.
  /// `slept`: lifted, and asleep straight afterwards, so perhaps while it was: then its bandwidth is lost.
  enum class Lift : uint8_t { refused, done, slept };
  Lift lift(int64_t now_ns, int64_t owed_ns, bool behind);
  /// Lifts a worker that the kernel does not run any more, though it has work and a reservation (see judge_reserve()):
  /// whatever it was about to do, falling asleep and taking its reservation back included. It goes on from there, and
  /// takes its reservation back after two periods.
  Lift rescue(int64_t now_ns, bool behind);
  /// A lifted worker goes on as an ordinary thread from here on, unless it takes its reservation back this moment.
  void drop();
  /// How often the thread has asked for its reservation in vain.
  uint32_t refusals() const { return refusals_.load(std::memory_order_acquire); }
  /// What the thread has now, read back.
  Grant grant() const { return read_back(has_, thread_.load(std::memory_order_acquire)); }
  /// By how much jobs that ended within StolenTime::kWindow_ns overran.
  int64_t owed_ns(int64_t now_ns) const;
  /// The worker was lifted and has not taken its reservation back.
  bool lifted() const { return place() != Place::own; }
  /// Where, if it is: before all workers, behind them, or as an ordinary thread.
  bool first() const { return place() == Place::first; }
  bool ordinary() const { return place() == Place::ordinary; }
  /// It takes its reservation back this moment. For the thread that lifts.
  bool returns() const { return place() == Place::moving; }
  /// Notes that the overrun of job `serial` was told; false if the job ended before, was demoted or told already.
  bool tell(uint64_t serial);

 private:
  enum Phase : uint64_t { idle, at_work, acting, demoted, told };
  /// Where the thread is: under its own reservation, or lifted. `moving`: watchdog or worker change that.
  enum class Place : uint32_t { own, moving, first, behind, ordinary };
  static constexpr uint64_t kPhases = 8;  // state = serial * kPhases + phase
  void settle_down();
  /// `held`: a lift is under way, the worker must not fall asleep.
  enum class Wake : uint32_t { awake, asleep, held };
  /// From one phase to the other; false if job `serial` is in another one.
  bool advance(uint64_t serial, Phase from, Phase to);
  Place place() const { return place_.load(std::memory_order_acquire); }
  /// To `moving`, by whoever is about to change the thread's policy: the place it had. Nothing if the other side is
  /// changing it: nobody waits for that, the worker least of all.
  std::optional<Place> claim_place();

  std::atomic<uint64_t> state_{idle};
  std::atomic<uint32_t> member_{0};
  std::atomic<uint64_t> index_{0};
  std::atomic<int64_t> release_ns_{0}, cpu_limit_ns_{0}, expected_ns_{0};
  std::atomic<int64_t> lifted_until_ns_{0};
  std::atomic<Place> place_{Place::own};
  std::atomic<uint32_t> refusals_{0};
  std::atomic<Wake> wake_{Wake::awake};
  std::atomic<Lookout*> lookout_{nullptr};
  std::atomic<int64_t> owed_ns_{0}, owed_at_ns_{0}, rested_cpu_ns_{0};
  std::atomic<int> thread_{0};
  std::atomic<clockid_t> clock_{0};
  std::atomic<int64_t> runtime_ns_{0};  ///< of `has_`, for the watchdog, which looks before the worker is bound
  Reservation has_;
};

}  // namespace takt
