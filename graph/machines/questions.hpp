// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "graph/machines/wire.hpp"
#include "hal/settings/json.hpp"
#include "rt/own_thread.hpp"

namespace takt::machines {

/// What is asked of the run on one machine and answered by that on another: a mode, a parameter, the stop.
///
///   Questions questions({"robot", 81, answer}, [&](auto bytes) { wire.send(topic, bytes); });
///   questions.ask("vision", {{"do", "top"}})       // waits; {"error": ...} if no answer comes within 5 s
///   questions.take(bytes);                         // what comes from others
///
/// ask() on any thread; take() does not wait. Questions to this machine are answered one by one, on a thread of its
/// own.
class Questions {
 public:
  using Json = nlohmann::ordered_json;
  struct Options {
    std::string machine;
    uint64_t run = 0;                         ///< another number after each start
    std::function<Json(const Json&)> answer;  ///< null: this machine takes no words from others
  };
  Questions(Options options, std::function<void(std::span<const std::byte>)> send);
  ~Questions();
  Questions(const Questions&) = delete;
  Questions& operator=(const Questions&) = delete;

  Json ask(const std::string& machine, const Json& question);
  void take(std::span<const std::byte> bytes);
  /// Nothing is sent from here on; who waits for an answer has none.
  void stop();

 private:
  struct Asked {
    std::string from;
    uint64_t id = 0;
    Json question;
  };
  void answer_on(const std::stop_token& end);
  void say(const Json& words);

  const Options options_;
  const std::function<void(std::span<const std::byte>)> send_;
  std::mutex sending_, mutex_;
  std::condition_variable changed_;
  uint64_t next_id_;
  std::map<uint64_t, std::optional<Json>> answers_;  ///< to what this machine asked and waits for
  std::deque<Asked> asked_;
  bool ending_ = false;
  OwnThread answering_;
};

}  // namespace takt::machines
