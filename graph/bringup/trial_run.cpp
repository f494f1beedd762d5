// SPDX-License-Identifier: Apache-2.0
#include "graph/bringup/trial_run.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "graph/attach/endpoint.hpp"
#include "graph/run/member_process.hpp"

namespace takt::bringup {

using Json = nlohmann::ordered_json;

namespace {

constexpr double kBegins_s = 60, kEnds_s = 15;

std::optional<attach::Connection> asked(pid_t run, const Json& question) {
  auto connection = attach::connect_to(run);
  if (!connection || !connection->write(question)) return std::nullopt;
  return connection;
}

}  // namespace

bool comes_to_be(double within_s, const std::function<bool()>& condition) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(within_s);
  return command::wait_until(
      condition, [&] { return std::chrono::steady_clock::now() >= until; }, std::chrono::milliseconds(50));
}

TrialRun::TrialRun(const Registry& registry, const command::RunOptions& options, const std::filesystem::path& log)
    : log_(log) {
  std::fflush(nullptr);
  process_ = fork();
  if (process_ < 0) throw std::runtime_error("no process for a trial");
  if (process_ > 0) return;
  const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const int nothing = open("/dev/null", O_RDONLY);
  if (file < 0 || nothing < 0) _exit(command::kDeviceOrSystem);
  dup2(nothing, STDIN_FILENO), dup2(file, STDOUT_FILENO), dup2(file, STDERR_FILENO);
  const int code = command::run_graph(registry, options);
  std::fflush(nullptr);
  _exit(code);
}

TrialRun::~TrialRun() {
  if (process_ == 0) return;
  kill(process_, SIGTERM);
  if (!comes_to_be(kEnds_s, [&] { return waitpid(process_, nullptr, WNOHANG) != 0; })) {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
}

bool TrialRun::begun() {
  const bool come = comes_to_be(kBegins_s, [&] {
    if (process_ != 0 && waitpid(process_, nullptr, WNOHANG) != 0) process_ = 0;
    return process_ == 0 || ask({{"do", "top"}}).value("running_s", 0.0) > 0;
  });
  return come && process_ != 0;
}

std::string TrialRun::why() const {
  std::ifstream file(log_);
  std::string newest;
  for (std::string line; std::getline(file, line);)
    if (line.find("error:") != std::string::npos) newest = line;
  return newest.empty() ? "see " + log_.string() : newest;
}

Json TrialRun::ask(const Json& question) const {
  auto connection = asked(process_, question);
  const auto answer = connection ? connection->read_line() : std::nullopt;
  return answer && answer->is_object() ? *answer : Json{{"error", "it does not answer"}};
}

std::optional<Json> TrialRun::message(const std::string& port, size_t items) const {
  const Json answer = ask({{"do", "echo"}, {"port", port}, {"items", items}});
  const auto message = answer.find("message");
  return message != answer.end() ? std::optional(*message) : std::nullopt;
}

std::optional<std::string> TrialRun::picture(const std::string& port) const {
  auto connection = asked(process_, {{"do", "echo"}, {"port", port}, {"as", "png"}});
  const auto line = connection ? connection->read_line() : std::nullopt;
  if (!line || !line->is_object() || line->value("bytes", size_t{0}) == 0) return std::nullopt;
  return connection->read_bytes(line->at("bytes").get<size_t>());
}

Json TrialRun::device(const std::string& id) const {
  for (const Json& node : ask({{"do", "top"}}).value("nodes", Json::array()))
    if (node.value("name", "") == id && node.contains("device")) {
      Json device = node["device"];
      device["completed"] = node.value("completed", uint64_t{0});
      return device;
    }
  return {};
}

}  // namespace takt::bringup
