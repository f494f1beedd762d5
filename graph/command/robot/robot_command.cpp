// SPDX-License-Identifier: Apache-2.0
#include "graph/command/robot/robot_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>

#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/command/attach_commands.hpp"
#include "graph/robot/known_objects.hpp"
#include "nodes/robot_client/task.hpp"

namespace takt::command {
namespace {

using robot::KnownObject;
using Json = nlohmann::ordered_json;

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// To the only one of several runs that has a robot client (`wanted`, unless it is empty); else nothing, and why is
/// said.
std::optional<attach::Connection> find_robot(const std::vector<int>& runs, const std::string& wanted) {
  std::optional<attach::Connection> found;
  std::vector<std::string> choices;
  for (const int run : runs) {
    auto connection = attach::connect_to(run);
    const auto top = connection && connection->write({{"do", "top"}}) ? connection->read_line() : std::nullopt;
    if (!top) continue;  // it is about to begin, or to end
    const auto clients = robot::robot_clients(*top);
    if (wanted.empty() ? clients.empty() : !contains(clients, wanted)) continue;
    choices.push_back(fmt::format("{} ({}: {})", run, top->at("graph").get<std::string>(), fmt::join(clients, ", ")));
    found.emplace(std::move(*connection));
  }
  if (choices.size() == 1) return found;
  if (choices.empty())
    refuse(fmt::format("none of the graphs that run ({}) has a {}", fmt::join(runs, ", "),
                       wanted.empty() ? "node of type robot_client" : "robot client " + wanted),
           kDeviceOrSystem);
  else
    refuse(fmt::format("several running graphs have a robot; choose with --run: {}", fmt::join(choices, ", ")),
           kDeviceOrSystem);
  return std::nullopt;
}

/// The robot client of the run; empty where there is none or which one is meant is not clear, and why is said.
std::string client_of(attach::Connection& connection, const std::string& wanted) {
  Json top;
  if (ask(connection, {{"do", "top"}}, top) != kOk) return "";
  const auto clients = robot::robot_clients(top);
  if (contains(clients, wanted)) return wanted;
  if (wanted.empty() && clients.size() == 1) return clients.front();
  refuse(clients.empty() ? "the run has no node of type robot_client"
                         : fmt::format("name the robot with --node: {}", fmt::join(clients, ", ")),
         kBadInput);
  return "";
}

/// Objects where they are (Graphviz's neato keeps the places), with their types and states.
std::string dot_of(const std::vector<KnownObject>& objects) {
  std::string text = "graph map {\n  node [shape=ellipse]\n";
  for (const KnownObject& o : objects)
    text += fmt::format("  \"{0}\" [pos=\"{2:.2f},{3:.2f}!\", label=\"{0}\\n{1}\\n{4}\"]\n", o.name, o.type, o.x_m,
                        o.y_m, robot::states_text(o));
  return text + "}\n";
}

/// Connects, finds the client, then does `work(connection, client)`.
template <class Work>
int with_client(const RobotOptions& o, Work work) {
  return understood([&]() -> int {
    const std::vector<int> runs = attach::running();
    auto connection = o.run == 0 && runs.size() > 1 ? find_robot(runs, o.node) : attached(o.run);
    if (!connection) return kDeviceOrSystem;
    const std::string client = client_of(*connection, o.node);
    if (client.empty()) return kBadInput;
    return work(*connection, client);
  });
}

/// The newest message of an output of the client.
int echo(attach::Connection& connection, const std::string& port, Json& message, int64_t count = 1) {
  const int code =
      ask(connection, {{"do", "echo"}, {"port", port}, {"count", count}, {"items", robot::kAllItems}}, message);
  if (code == kOk) message = Json(message.at("message"));
  return code;
}

int known_objects(attach::Connection& connection, const std::string& client, std::vector<KnownObject>& objects) {
  Json answer;
  const int code = ask(connection, robot::map_question(client), answer);
  if (code == kOk) objects = robot::known_objects(answer.at("message"));
  return code;
}

int hand_in(const RobotOptions& o, const std::string& verb) {
  const std::string text = fmt::format("{}{}", verb, fmt::join(o.words, " "));
  if (const auto task = robot_client::parse_task(text); !task) return refuse(task.error(), kBadInput);
  return with_client(o, [&](attach::Connection& connection, const std::string& client) -> int {
    Json answer;
    return ask(connection, robot::task_question(client, text), answer);
  });
}

int print_map(const RobotOptions& o) {
  return with_client(o, [&](attach::Connection& connection, const std::string& client) -> int {
    std::vector<KnownObject> objects;
    if (const int code = known_objects(connection, client, objects); code != kOk) return code;
    if (!o.dot.empty())
      if (const int code = write_output(o.dot, dot_of(objects), "--dot"); code != kOk) return code;
    std::printf("%-20s %-12s %8s %8s  %s\n", "object", "type", "x m", "y m", "states");
    for (const KnownObject& object : objects)
      std::printf("%-20s %-12s %8.2f %8.2f  %s\n", object.name.c_str(), object.type.c_str(), object.x_m, object.y_m,
                  robot::states_text(object).c_str());
    return kOk;
  });
}

int answer_about(const RobotOptions& o) {
  return with_client(o, [&](attach::Connection& connection, const std::string& client) -> int {
    std::vector<KnownObject> objects;
    if (const int code = known_objects(connection, client, objects); code != kOk) return code;
    const auto answer = robot::answer_about(objects, o.object);
    if (!answer) return refuse(answer.error(), kBadInput);
    std::printf("%s\n", answer->c_str());
    return kOk;
  });
}

int print_text(const RobotOptions& o, const char* port) {
  return with_client(o, [&](attach::Connection& connection, const std::string& client) -> int {
    Json message;
    const int code = echo(connection, client + port, message);
    if (code == kOk) std::printf("%s\n", message.at("text").get<std::string>().c_str());
    return code;
  });
}

/// Until the run ends.
int watch(const RobotOptions& o) {
  return with_client(o, [&](attach::Connection& connection, const std::string& client) -> int {
    Json message;
    const int code = echo(connection, client + ".status", message, INT64_MAX);
    std::string last;
    while (code == kOk) {
      if (const auto text = message.at("text").get<std::string>(); text != last) {
        std::printf("%s\n", text.c_str());
        std::fflush(stdout);
        last = text;
      }
      const auto line = connection.read_line();
      if (!line) return kOk;
      message = Json(line->at("message"));
    }
    return code;
  });
}

}  // namespace

void add_robot(CLI::App& app, RobotOptions& o, int& exit_code) {
  CLI::App* robot = app.add_subcommand("robot", "tells and asks the robot of a running graph");
  robot->require_subcommand(1);
  robot->add_option("--run", o.run, "process id of the run, where several have a robot");
  robot->add_option("--node", o.node, "the robot client, where there are several");
  const auto add = [&](const char* name, const char* purpose, const char* example, auto run) {
    CLI::App* command = robot->add_subcommand(name, purpose);
    command->footer(fmt::format("Example: takt robot {}{}", name, example));
    command->callback([&exit_code, run] { exit_code = run(); });
    return command;
  };
  add("goal", "wants states: cup_1.level=full", " cup_1.level=full", [&] { return hand_in(o, "goal "); })
      ->add_option("facts", o.words, "OBJECT.ATTRIBUTE=VALUE, several")
      ->required();
  add("tell", "tells what is so: cup_1.level=empty", " cup_1.level=empty", [&] { return hand_in(o, "tell "); })
      ->add_option("facts", o.words, "OBJECT.ATTRIBUTE=VALUE, several")
      ->required();
  add("task",
      "any task: drive 3 1 | rotate 90deg | ahead 0.5 | explore | do fill cup_1 bottle_2 | add cup cup_3 1 2 | "
      "move cup_3 2 2 | remove cup_3 | stop",
      " drive 3 1", [&] { return hand_in(o, ""); })
      ->add_option("words", o.words, "the task")
      ->required();
  add("ask", "what the robot knows of an object", " cup_1", [&] { return answer_about(o); })
      ->add_option("object", o.object, "OBJECT or OBJECT.ATTRIBUTE")
      ->required();
  add("plan", "the plan, what its steps were to take and took", "", [&] { return print_text(o, ".plan"); });
  add("map", "what the robot knows of objects", "", [&] {
    return print_map(o);
  })->add_option("--dot", o.dot, "writes it for Graphviz (neato -n) as well");
  add("watch", "what the robot does, line by line as it changes", "", [&] { return watch(o); });
}

}  // namespace takt::command
