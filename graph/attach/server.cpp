// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/server.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>
#include <thread>

#include "graph/attach/describe.hpp"
#include "graph/attach/follow.hpp"
#include "graph/attach/message_text.hpp"
#include "graph/attach/parameters.hpp"
#include "graph/compose/composition.hpp"
#include "graph/language/overlay.hpp"
#include "graph/language/param_text.hpp"
#include "graph/language/words.hpp"
#include "rt/capability.hpp"
#include "rt/memory/sanitized.hpp"
#include "rt/sched/param_mail.hpp"

namespace takt::attach {
namespace {

using Json = nlohmann::ordered_json;
constexpr size_t kMostClients = 8;
constexpr int kLookAgainMs = 100;
constexpr size_t kClientStack = 2 << 20;  // it draws pictures, with libraries

void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

int64_t now_ns() { return MonotonicClock().now_ns(); }

bool changes(const Json& question) {
  const std::string what = question.value("do", "");
  return what == "mode" || what == "set" || what == "forget" || what == "answer" || what == "mark" ||
         (what == "fault" && !question.value("fault", "").empty());
}

Json wrong(const std::string& text) { return {{"error", text}}; }

/// The user of the other side; nothing if the kernel does not say.
std::optional<uid_t> user_of(int descriptor) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return std::nullopt;
  return peer.uid;
}

/// True if the other side is this user or root; whom the service's group lets in, the socket's mode has decided.
bool trusted(int descriptor, bool group) {
  const auto user = user_of(descriptor);
  return group || (user && (*user == geteuid() || *user == 0));
}

}  // namespace

Server::Server(const Subject& subject) : subject_(subject), taps_(subject.transport, subject.plan.ports) {
  open();
  if (lacks_.empty()) thread_ = OwnThread([this] { accept_clients(); });
}

Server::~Server() {
  ending_.store(true);
  if (thread_.joinable()) thread_.join();
  for (Client& client : clients_) client.thread.join();
  if (listener_ >= 0) close(listener_);
  if (folder_) folder_->remove_socket(subject_.run, whom());
}

void Server::open() {
  std::string passed_over;
  if (auto own = SocketFolder::own(Surroundings::of_this_process(), passed_over)) {
    folder_.emplace(std::move(*own));
  } else {
    lacks_ = passed_over + "; or set XDG_RUNTIME_DIR to a folder of this user (mode 0700)";
    return;
  }
  if (!passed_over.empty()) note_ = fmt::format("sockets lie in {}: {}", folder_->path().string(), passed_over);
  folder_->remove_socket(subject_.run, whom());  // of a dead process that had our number
  listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const sockaddr_un address = folder_->address(subject_.run, whom());
  if (listener_ < 0 || bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      chmod(address.sun_path, folder_->for_group() ? 0660 : 0600) != 0 ||
      listen(listener_, static_cast<int>(kMostClients)) != 0)
    lacks_ = folder_->path().string() + ": " + std::strerror(errno);
}

void Server::accept_clients() {
  pthread_setname_np(pthread_self(), "takt-attach");
  keep_rights(Rights::none);
  while (!ending_.load()) {
    pollfd wait{listener_, POLLIN, 0};
    if (poll(&wait, 1, kLookAgainMs) <= 0) continue;
    const int descriptor = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (descriptor < 0) continue;
    for (auto client = clients_.begin(); client != clients_.end();) {
      if (client->done.load()) {
        client->thread.join();
        client = clients_.erase(client);
      } else {
        ++client;
      }
    }
    if (clients_.size() >= kMostClients || !trusted(descriptor, folder_->for_group())) {
      close(descriptor);
      continue;
    }
    Client& client = clients_.emplace_back();
    try {
      client.thread = OwnThread(
          [this, descriptor, &client] {
            serve(descriptor);
            client.done.store(true);
          },
          kClientStack);
    } catch (const std::system_error&) {  // no more threads: the run goes on unheard
      clients_.pop_back();
      close(descriptor);
    }
  }
}

void Server::serve(int descriptor) {
  // Short patience, so that a client that says nothing does not keep the run from ending.
  while (!ending_.load()) {
    pollfd wait{descriptor, POLLIN, 0};
    const int ready = poll(&wait, 1, kLookAgainMs);
    if (ready < 0 && errno != EINTR) break;
    if (ready > 0) break;
  }
  const uint32_t by_user = user_of(descriptor).value_or(geteuid());
  Connection connection(descriptor, 1000);
  while (!ending_.load()) {
    const auto question = connection.read_line();
    if (!question || !question->is_object()) return;
    try {
      if (!answer(*question, connection, by_user)) return;
    } catch (const std::exception& problem) {  // no question may end the run
      if (!connection.write(wrong(std::string("this cannot be answered: ") + problem.what()))) return;
    }
  }
}

bool Server::answer(const Json& question, Connection& connection, uint32_t by_user) {
  const std::string what = question.value("do", "");
  if (what == "echo") return echo(question, connection);
  if (what == "describe") return connection.write(describe_json(subject_));
  if (what == "follow") return Follow(subject_, taps_, connection).run(ending_), false;
  if (what == "carry") return errands_.carry(connection, ending_), false;
  return connection.write(reply(question, by_user));
}

std::string Server::machine_of(const Json& question) const {
  if (const std::string named = question.value("machine", ""); !named.empty()) return named;
  const std::string about = question.value("param", question.value("device", ""));
  const auto elsewhere = subject_.graph.elsewhere.find(about.substr(0, about.find('.')));
  return elsewhere == subject_.graph.elsewhere.end() ? "" : elsewhere->second;
}

Json Server::reply(const Json& question, uint32_t by_user) {
  const std::string machine = machine_of(question);
  std::vector<std::string> names;
  for (const graph::MachineSpec& one : subject_.graph.machines) names.push_back(one.name);
  if (!machine.empty() && std::find(names.begin(), names.end(), machine) == names.end())
    return wrong(fmt::format("there is no machine {}{}", graph::ticked(machine), graph::alternatives(machine, names)));
  const std::string& own = subject_.graph.machine;
  if (own.empty() || machine == own) return reply_here(question, by_user);
  if (!machine.empty()) return errands_.ask(machine, question);
  const std::string what = question.value("do", "");
  if (what != "mode" && what != "mark" && what != "stop") return reply_here(question, by_user);
  const bool last = what == "stop";  // who has stopped carries nothing
  Json all = last ? Json::object() : reply_here(question, by_user);
  Json others = Json::object();
  for (const std::string& name : names)
    if (name != own) others[name] = errands_.ask(name, question);
  if (last) all = reply_here(question, by_user);
  all["machines"] = others;
  return all;
}

Json Server::reply_here(const Json& question, uint32_t by_user) {
  const std::string what = question.value("do", "");
  if (what == "top") return top();
  if (!subject_.replay_of.empty() && changes(question))
    return wrong(fmt::format("this is a replay of {}: it can be looked at, and stopped", subject_.replay_of));
  if (what == "mode") return change_mode(question.value("mode", ""));
  if (what == "get") return get(question.value("param", ""));
  if (what == "set")
    return set(question.value("param", ""), {question.value("value", ""), question.value("keep", false), by_user});
  if (what == "fault") {
    const std::string device = question.value("device", ""), fault = question.value("fault", "");
    return fault.empty() ? faults(device) : switch_fault(device, fault, question.value("on", true), by_user);
  }
  if (what == "answer") return give_answer(question.value("device", ""), question.value("text", ""), by_user);
  if (what == "forget") return forget(question.value("param", ""));
  if (what == "mark") return mark(question.value("words", ""), by_user);
  if (what == "stop") {
    subject_.board.stop().raise(now_ns());
    return {{"ok", true}};
  }
  return wrong("unknown question " + what +
               "; known: top, echo, describe, follow, get, set, forget, fault, answer, mark, mode, stop");
}

Json Server::mark(const std::string& words, uint32_t by_user) {
  Mark mark{now_ns(), by_user, BoundedText<200>(words)};
  if (words.empty()) return wrong("a mark needs words");
  if (mark.words.text() != words) return wrong("a mark has at most 199 bytes");
  if (!subject_.board.marks().append(mark)) return wrong(fmt::format("this run has {} marks already", kMostMarks));
  const double at_s = static_cast<double>(mark.at_ns - subject_.board.epoch_ns().load()) / 1e9;
  return {{"ok", true}, {"at_s", at_s}};
}

Json Server::top() const {
  const int64_t epoch_ns = subject_.board.epoch_ns().load();
  Json nodes = Json::array();
  for (size_t t = 0; t < subject_.plan.tasks.size(); ++t) {
    const TaskPlan& task = subject_.plan.tasks[t];
    const TaskStatistics& s = subject_.board.task(t);
    nodes.push_back({{"name", task.name},
                     {"type", type_of(subject_, task.name)},
                     {"rate_hz", task.rate ? Json(task.rate->hz()) : Json(nullptr)},
                     {"completed", s.completed.load()},
                     {"deadline_misses", s.deadline_misses.load()},
                     {"skipped", s.skipped.load()},
                     {"paused", s.paused.load()},
                     {"level", s.last_level.load()},
                     {"exec_ms", static_cast<double>(s.last_exec_ns.load()) / 1e6},
                     {"response_ms", static_cast<double>(s.last_response_ns.load()) / 1e6}});
    if (!task.device) continue;
    const SourceRecord& source = subject_.board.source(t);
    nodes.back()["device"] = {{"state", to_text(source.state.load())},
                              {"losses", source.losses.load()},
                              {"received", source.received.load()}};
  }
  return {{"graph", subject_.graph.name},
          {"profile", subject_.graph.profile},
          {"transport", subject_.transport.name()},
          {"running_s", epoch_ns > 0 ? static_cast<double>(std::max<int64_t>(0, now_ns() - epoch_ns)) / 1e9 : 0.0},
          {"parameters", parameters_json(subject_.registry.nodes, subject_.graph, subject_.plan, subject_.board)},
          {"frozen", subject_.frozen ? subject_.frozen() : std::vector<std::string>{}},
          {"nodes", nodes}};
}

bool Server::echo(const Json& question, Connection& connection) {
  const auto port = find_port(subject_.plan, question.value("port", ""));
  if (!port) return connection.write(wrong(port.error()));
  const std::string as = question.value("as", "");
  const Json count = question.value("count", Json(1));
  const Json items = question.value("items", Json(8U));
  if (!count.is_number_integer() || !items.is_number_unsigned())
    return connection.write(wrong("count and items have to be whole numbers"));
  return stream(*port, as, items.get<size_t>(), count.get<int64_t>(), connection);
}

bool Server::stream(size_t port, const std::string& as, size_t items, int64_t count, Connection& connection) {
  const PortPlan& plan = subject_.plan.ports[port];
  const Pictures& pictures = subject_.registry.pictures;
  const Draw draw = as == "png" ? pictures.png : as == "ply" ? pictures.ply : nullptr;
  if (draw == nullptr && !as.empty())
    return connection.write(wrong(fmt::format("this program does not draw messages; leave --{} out", as)));
  const auto tap = taps_.at(port);
  uint64_t seen = 0;
  for (int64_t sent = 0; sent < count && !ending_.load();) {
    const auto message = tap->newer_than(seen, now_ns());
    if (message == nullptr) {
      if (connection.gone()) return false;
      pause_ms(2);
      continue;
    }
    seen = message->sequence;
    const auto file = draw != nullptr ? message->drawn(draw) : std::string();
    if (!file)
      return connection.write(wrong(fmt::format("a message of type {} is no {}; leave --{} out", plan.type->name,
                                                as == "png" ? "picture" : "point cloud", as)));
    const Json line{{"type", plan.type->name},
                    {"sequence", message->sequence},
                    {"level", message->level},
                    {"stamp_ns", message->stamp_ns},
                    {"age_ms", static_cast<double>(now_ns() - message->stamp_ns) / 1e6},
                    {"message", message_json(*plan.type, message->message(), items)},
                    {"bytes", file->size()}};
    if (!connection.write(line, *file)) return false;
    ++sent;
  }
  return true;
}

Json Server::change_mode(const std::string& name) {
  const Plan& plan = subject_.plan;
  std::vector<std::string> names;
  for (const ModePlan& mode : plan.modes) names.push_back(mode.name);
  const auto mode = std::find(names.begin(), names.end(), name);
  if (mode == names.end())
    return wrong(fmt::format("this run, started in mode {}, cannot change to {}{}", graph::ticked(plan.mode),
                             graph::ticked(name), graph::alternatives(name, names, "its modes")));
  const auto index = static_cast<uint32_t>(mode - names.begin());
  const int64_t from_ns = now_ns() + ModeLog::kLead_ns;
  if (!subject_.board.modes().request(index, from_ns, "asked for by takt mode", true))
    return wrong("the mode of this run has been changed too often; stop it and start it anew");
  return {{"ok", true}};
}

Json Server::set(const std::string& name, const Wish& wish) {
  const size_t colon = name.find(':');
  return colon == std::string::npos ? set_one(name, wish)
                                    : set_all(name.substr(0, colon), name.substr(colon + 1), wish);
}

Json Server::keep(const std::string& name, const std::string& text) {
  const auto file = graph::overlay_file(graph::state_folder(), subject_.graph.name);
  const std::lock_guard lock(keeping_);
  if (const auto kept = graph::change_overlay(file, subject_.graph.name, {{name, text}}); !kept)
    return wrong(fmt::format("{} has the value now, but not in later runs: {}", name, kept.error()));
  return {{"ok", true}, {"kept", file.string()}};
}

Json Server::forget(const std::string& name) {
  const auto file = graph::overlay_file(graph::state_folder(), subject_.graph.name);
  const std::lock_guard lock(keeping_);
  if (const auto done = graph::forget_value(file, subject_.graph.name, name); !done) return wrong(done.error());
  return {{"ok", true}, {"forgotten", file.string()}};
}

Json Server::get(const std::string& name) const {
  if (name.empty())
    return {{"ok", true},
            {"parameters", parameters_json(subject_.registry.nodes, subject_.graph, subject_.plan, subject_.board)}};
  std::vector<std::string> names;
  for (size_t t = 0; t < subject_.plan.tasks.size(); ++t) {
    const TaskPlan& task = subject_.plan.tasks[t];
    for (size_t p = 0; p < subject_.board.param_count(t); ++p) {
      names.push_back(task.name + "." + std::string(task.node->params()[p]->name()));
      if (names.back() == name)
        return {{"ok", true},
                {"parameters", Json::array({parameter_json(subject_.registry.nodes, subject_.graph, subject_.plan,
                                                           subject_.board, t, p)})}};
    }
  }
  return wrong(fmt::format("there is no parameter {}{}", graph::ticked(name), graph::alternatives(name, names)));
}

Json Server::set_all(const std::string& type, const std::string& key, const Wish& wish) {
  std::vector<std::string> types;
  Json answer;
  for (const graph::NodeSpec& spec : subject_.graph.nodes) {
    types.push_back(spec.type);
    if (spec.type != type) continue;
    const Json one = set_one(spec.id + "." + key, wish);
    if (!answer.contains("error")) answer = one;  // the first that refuses is told, the others are asked all the same
  }
  if (!answer.is_null()) return answer;
  return wrong(
      fmt::format("there is no node of type {}{}", graph::ticked(type), graph::alternatives(type, types, "types")));
}

Json Server::set_one(const std::string& name, const Wish& wish) {
  const size_t dot = name.find('.');
  const std::string id = name.substr(0, dot), key = dot == std::string::npos ? "" : name.substr(dot + 1);
  std::vector<std::string> ids, keys;
  for (const graph::NodeSpec& spec : subject_.graph.nodes) ids.push_back(spec.id);
  const auto spec = std::find_if(subject_.graph.nodes.begin(), subject_.graph.nodes.end(),
                                 [&](const graph::NodeSpec& s) { return s.id == id; });
  if (spec == subject_.graph.nodes.end())
    return wrong(fmt::format("there is no node {}{}", graph::ticked(id), graph::alternatives(id, ids)));
  const auto shell = subject_.registry.nodes.find(spec->type)->make();
  const auto task = std::find_if(subject_.plan.tasks.begin(), subject_.plan.tasks.end(),
                                 [&](const TaskPlan& t) { return t.name == id; });
  for (size_t p = 0; p < shell->params().size(); ++p) {
    ParamBase& param = *shell->params()[p];
    keys.emplace_back(param.name());
    if (param.name() != key) continue;
    if (!param.fixed().empty()) return wrong(fmt::format("parameter {} {}", graph::ticked(name), fixed_text(param)));
    const auto value = graph::parse_param(param, wish.text);
    const auto fits = value ? param.set(*value) : tl::make_unexpected(value.error());
    if (!fits) return wrong(fmt::format("parameter {} {}", graph::ticked(name), fits.error()));
    const auto index = static_cast<size_t>(task - subject_.plan.tasks.begin());
    Json answer = post_and_wait(index, p, *value, wish.by_user);
    return wish.keep && !answer.contains("error") ? keep(name, wish.text) : answer;
  }
  return wrong(fmt::format("node {} (type {}) has no parameter {}{}", graph::ticked(id), graph::ticked(spec->type),
                           graph::ticked(key), graph::alternatives(key, keys)));
}

Json Server::post_and_wait(size_t task, size_t param, const ParamValue& value, uint32_t by_user) {
  const std::lock_guard lock(setting_);
  ParamMail& mail = subject_.board.mail(task);
  if (!post(mail, param, value, by_user))
    return wrong("the node has not taken the last value yet, or the text is too long");
  const TaskPlan& plan = subject_.plan.tasks[task];
  const int64_t until = now_ns() + kSlowdown * 2'000'000'000LL;
  while (mail.state.load() == ParamMail::posted && now_ns() < until && !ending_.load()) pause_ms(1);
  const uint32_t state = mail.state.load();
  if (state == ParamMail::taken) return {{"ok", true}};
  if (state == ParamMail::posted)
    return wrong(plan.name + " ran no job within 2 s; it takes the value at its next one");
  return wrong(fmt::format("parameter {} of {} {}", graph::ticked(plan.node->params()[param]->name()), plan.name,
                           mail.refusal.text()));
}

}  // namespace takt::attach
