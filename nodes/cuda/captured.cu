// SPDX-License-Identifier: Apache-2.0
#include "nodes/cuda/captured.cuh"

#include <time.h>

#include <algorithm>

namespace takt::cuda {
namespace {

constexpr int kRehearsals = 20, kMeasured = 10;
constexpr int64_t kRehearsal_ns = 2'000'000'000;
constexpr int64_t kWriting_ns = 20'000'000;  // several time slices of other processes
constexpr int64_t kStep_ns = 50'000;         // of a wait that sleeps

/// Before anything is written: the CPU sees that this run writes, or this sees that it was withdrawn, or both.
__global__ void announce(volatile Turn* turn, bool* withdrawn) {
  const uint32_t wanted = turn->wanted;
  turn->writing = wanted;
  __threadfence_system();
  *withdrawn = turn->withdrawn == wanted;
}

/// Behind all the rest: what was written is there before the CPU sees this.
__global__ void tell(volatile Turn* turn, const bool* withdrawn) {
  __threadfence_system();
  if (!*withdrawn) turn->written = turn->wanted;
  __threadfence_system();
  turn->done = turn->wanted;
}

}  // namespace

Captured::Captured(int card) : card_(card) {
  check(cudaSetDevice(card), "cudaSetDevice");
  check(cudaStreamCreateWithFlags(&stream_.handle, cudaStreamNonBlocking), "cudaStreamCreate");
  turn_ = shared_memory_.take<Turn>(1);
  withdrawn_ = card_memory_.take<bool>(1);
}

Captured::~Captured() {
  cudaSetDevice(card_);
  if (stream_.handle != nullptr) cudaStreamSynchronize(stream_.handle);
}

void Captured::begin_capture() {
  check(cudaStreamBeginCapture(stream(), cudaStreamCaptureModeThreadLocal), "cudaStreamBeginCapture");
}

void Captured::begin_to_write(cudaStream_t stream) { announce<<<1, 1, 0, stream>>>(turn_, withdrawn_); }

void Captured::end_capture() {
  tell<<<1, 1, 0, stream()>>>(turn_, withdrawn_);
  check(cudaStreamEndCapture(stream(), &graph_.handle), "cudaStreamEndCapture");
  check(cudaGraphInstantiate(&runs_.handle, graph_.handle, 0), "cudaGraphInstantiate");
  check(cudaGraphUpload(runs_.handle, stream()), "cudaGraphUpload");
}

void Captured::rehearse() {
  spin_ns_ = kRehearsal_ns;
  int64_t longest_ns = 0;
  for (int i = 0; i < kRehearsals; ++i) {
    const int64_t begun_ns = now_ns();
    if (run(begun_ns + kRehearsal_ns) != Outcome::done) {
      check(cudaGetLastError(), "the first run");
      check(cudaStreamSynchronize(stream()), "the first run");
      throw CardError("the first run took longer than 2 s");
    }
    if (i >= kRehearsals - kMeasured) longest_ns = std::max(longest_ns, now_ns() - begun_ns);
  }
  spin_ns_ = longest_ns + longest_ns / 4;
}

Outcome Captured::run(int64_t until_ns) {
  if (cudaSetDevice(card_) != cudaSuccess) return Outcome::failed;
  turn().wanted = turn().wanted + 1;
  if (cudaGraphLaunch(runs_.handle, stream()) != cudaSuccess) return Outcome::failed;
  const Outcome outcome = wait(until_ns);
  return outcome == Outcome::late ? withdraw() : outcome;
}

/// Spins while it is about to end; what takes longer is left the CPU in steps.
Outcome Captured::wait(int64_t until_ns) const {
  constexpr int kAskEvery = 4096;
  const int64_t sleeps_from_ns = now_ns() + spin_ns_;
  for (int looked = 1; turn().done != turn().wanted; ++looked) {
    const int64_t now = now_ns();
    if (now >= until_ns) return Outcome::late;
    const bool sleeps = now >= sleeps_from_ns;
    if (sleeps) {
      const timespec step{0, std::min(kStep_ns, until_ns - now)};
      clock_nanosleep(CLOCK_MONOTONIC, 0, &step, nullptr);
    }
    if (!sleeps && looked % kAskEvery != 0) continue;
    const cudaError_t state = cudaStreamQuery(stream());
    if (state != cudaSuccess && state != cudaErrorNotReady) return Outcome::failed;
  }
  std::atomic_thread_fence(std::memory_order_acquire);
  return Outcome::done;
}

Outcome Captured::withdraw() {
  turn().withdrawn = turn().wanted;
  std::atomic_thread_fence(std::memory_order_seq_cst);
  if (turn().writing != turn().wanted) return Outcome::late;
  if (wait(now_ns() + kWriting_ns) != Outcome::done) return Outcome::failed;
  return turn().written == turn().wanted ? Outcome::done : Outcome::late;
}

}  // namespace takt::cuda
