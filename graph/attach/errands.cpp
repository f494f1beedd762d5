// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/errands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace takt::attach {
namespace {

using Json = nlohmann::ordered_json;
constexpr auto kPatience = std::chrono::seconds(6);  // above that of who carries
constexpr auto kLookAgain = std::chrono::milliseconds(100);

}  // namespace

Json Errands::ask(const std::string& machine, Json question) {
  question["machine"] = machine;
  const auto errand = std::make_shared<Errand>(Errand{std::move(question), {}, false});
  std::unique_lock lock(mutex_);
  if (carriers_ == 0) return {{"error", fmt::format("machine {} cannot be asked: the process link is away", machine)}};
  waiting_.push_back(errand);
  changed_.notify_all();
  if (changed_.wait_for(lock, kPatience, [&] { return errand->done; })) return errand->answer;
  std::erase(waiting_, errand);
  return {{"error", fmt::format("machine {} does not answer", machine)}};
}

void Errands::carry(Connection& connection, const std::atomic<bool>& ending) {
  std::unique_lock lock(mutex_);
  ++carriers_;
  while (!ending.load() && !connection.gone()) {
    if (!changed_.wait_for(lock, kLookAgain, [&] { return !waiting_.empty(); })) continue;
    const std::shared_ptr<Errand> errand = waiting_.front();
    waiting_.pop_front();
    lock.unlock();
    const auto answer = answer_to(errand->question, connection, ending);
    lock.lock();
    errand->answer = answer ? *answer : Json{{"error", "the process link did not answer"}};
    errand->done = true;
    changed_.notify_all();
    if (!answer) break;  // a late answer would be taken for the next one
  }
  --carriers_;
}

std::optional<Json> Errands::answer_to(const Json& question, Connection& connection, const std::atomic<bool>& ending) {
  if (!connection.write(question)) return std::nullopt;
  for (auto waited = kLookAgain; !connection.readable(static_cast<int>(kLookAgain.count())); waited += kLookAgain)
    if (ending.load() || waited > kPatience) return std::nullopt;
  return connection.read_line();
}

}  // namespace takt::attach
