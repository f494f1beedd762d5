// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <atomic>
#include <memory>
#include <string>

#include "hal/interaction/interaction.hpp"

namespace takt {

/// Words that fit into a task, without memory from the heap.
struct TaskWords {
  std::array<char, Interaction::kLongestTask> characters;
  size_t size = 0;
  std::string_view text() const { return {characters.data(), size}; }
  /// False: they are too long, and the words before stay.
  bool set(std::string_view words);
};

/// One answer on its way from the thread of a double to the jobs of its driver. Neither side waits.
class AnswerLine {
 public:
  /// False: the one before has not been taken yet, or this one is too long.
  bool put(std::string_view words);
  /// False: there is none.
  bool take(TaskWords& into);

 private:
  std::atomic<bool> full_{false};
  TaskWords words_;
};

/// The robot's own screen, in a browser: what `takt web` is given under Touch comes as answer(). The page reads what
/// the robot says from the port that `speech` is connected to, so saying it needs nothing here.
class WebScreen final : public Interaction {
 public:
  /// `fingers`: where a double's answers come from; null: it is no double.
  explicit WebScreen(std::shared_ptr<AnswerLine> fingers = nullptr) : fingers_(std::move(fingers)) {}
  DeviceResult open() override;
  void close() override { open_ = started_ = false; }
  DeviceResult start(int64_t) override;
  void stop() override { started_ = false; }
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  InteractionReading read(int64_t wanted_ns) override;
  bool say(std::string_view) override { return started_; }
  void go_on_after(uint32_t number, std::string_view last) override;
  bool takes_answers() const override { return true; }
  bool answer(std::string_view words) override;
  SourceCounts counts() const override { return {received_, 0, 0, 0, 0}; }

 private:
  std::shared_ptr<AnswerLine> fingers_;
  TaskWords task_, next_;
  bool waits_ = false;  ///< next_ has not been read yet
  uint32_t number_ = 0;
  uint64_t received_ = 0;
  bool open_ = false, started_ = false;
};

}  // namespace takt
