// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/questions.hpp"

#include <fmt/format.h>
#include <pthread.h>

#include <chrono>
#include <utility>

namespace takt::machines {
namespace {

using Json = Questions::Json;
constexpr auto kPatience = std::chrono::seconds(5);
constexpr size_t kMostWaiting = 16;

Json wrong(const std::string& text) { return {{"error", text}}; }

}  // namespace

Questions::Questions(Options options, std::function<void(std::span<const std::byte>)> send)
    : options_(std::move(options)), send_(std::move(send)), next_id_(options_.run) {
  answering_ = OwnThread([this](const std::stop_token& end) { answer_on(end); });
}

Questions::~Questions() { stop(); }

void Questions::stop() {
  {
    const std::scoped_lock lock(mutex_, sending_);
    ending_ = true;
  }
  changed_.notify_all();
  answering_.request_stop();
  if (answering_.joinable()) answering_.join();
}

Json Questions::ask(const std::string& machine, const Json& question) {
  std::unique_lock lock(mutex_);
  const uint64_t id = ++next_id_;
  answers_[id] = std::nullopt;
  lock.unlock();
  say({{"from", options_.machine}, {"to", machine}, {"id", id}, {"question", question}});
  lock.lock();
  changed_.wait_for(lock, kPatience, [&] { return ending_ || answers_[id]; });
  const auto answer = std::move(answers_[id]);
  answers_.erase(id);
  return answer ? *answer : wrong(fmt::format("machine {} does not answer", machine));
}

void Questions::take(std::span<const std::byte> bytes) {
  const auto* const text = reinterpret_cast<const char*>(bytes.data());
  const Json words = Json::parse(text, text + bytes.size(), nullptr, false);
  if (!words.is_object() || words.value("to", Json()) != options_.machine) return;
  const Json from = words.value("from", Json()), id = words.value("id", Json());
  if (!from.is_string() || !id.is_number_unsigned()) return;
  const std::lock_guard lock(mutex_);
  if (words.contains("answer")) {
    const auto mine = answers_.find(id.get<uint64_t>());
    if (mine != answers_.end()) mine->second = words["answer"];
  } else if (words.contains("question") && asked_.size() < kMostWaiting) {  // beyond that, no answer is one, too
    asked_.push_back({from.get<std::string>(), id.get<uint64_t>(), words["question"]});
  }
  changed_.notify_all();
}

void Questions::answer_on(const std::stop_token& end) {
  pthread_setname_np(pthread_self(), "takt-answer");
  while (!end.stop_requested()) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return ending_ || !asked_.empty(); });
    if (ending_) return;
    const Asked asked = std::move(asked_.front());
    asked_.pop_front();
    lock.unlock();
    const Json answer =
        options_.answer
            ? options_.answer(asked.question)
            : wrong(fmt::format("machine {} takes no words from others: give all of them keys (takt keys), or say "
                                "`trusted: true` in `network` if nobody else can reach it",
                                options_.machine));
    say({{"from", options_.machine}, {"to", asked.from}, {"id", asked.id}, {"answer", answer}});
  }
}

void Questions::say(const Json& words) {
  const std::string text = words.dump(-1, ' ', false, Json::error_handler_t::replace);
  const std::lock_guard lock(sending_);
  if (ending_) return;
  send_(std::as_bytes(std::span(text.data(), text.size())));
}

}  // namespace takt::machines
