// SPDX-License-Identifier: Apache-2.0
// takt-bench SUITE [--json FILE] [--rounds N] [--only CONDITION]
#include <sys/utsname.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>

#include "bench/suite.hpp"
#include "graph/cli/boundary.hpp"
#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "hal/settings/json.hpp"

namespace {

using namespace takt::bench;

nlohmann::json number(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
}

nlohmann::json to_json(const Row& row) {
  const Samples& s = row.samples;
  return {{"name", row.name},
          {"value", row.value},
          {"unit", row.unit},
          {"p50", number(s.quantile(0.5))},
          {"p99", number(s.quantile(0.99))},
          {"p999", s.size() >= 1000 ? number(s.quantile(0.999)) : nullptr},
          {"max", number(s.max())},
          {"samples", s.size()},
          {"reference", row.reference.empty() ? nlohmann::json(nullptr) : nlohmann::json(row.reference)},
          {"reference_value", number(row.reference_value)},
          {"ratio", number(row.ratio)},
          {"granted", row.granted}};
}

void print(const Row& row) {
  const auto cell = [](const std::optional<double>& v) {
    char text[32];
    if (v) std::snprintf(text, sizeof text, "%.4g", *v);
    return v ? std::string(text) : std::string("-");
  };
  std::printf("%-52s %10s %-5s p50 %-8s p99 %-8s max %-8s n %-6zu ratio %-6s %s%s\n", row.name.c_str(),
              cell(row.value).c_str(), row.unit.c_str(), cell(row.samples.quantile(0.5)).c_str(),
              cell(row.samples.quantile(0.99)).c_str(), cell(row.samples.max()).c_str(), row.samples.size(),
              cell(row.ratio).c_str(), row.reference.empty() ? "" : ("of " + row.reference + " ").c_str(),
              row.granted.empty() ? "" : ("[" + row.granted + "]").c_str());
}

void describe_machine() {
  utsname system{};
  uname(&system);
  std::string model = "?";
  std::ifstream cpu("/proc/cpuinfo");
  for (std::string line; std::getline(cpu, line);)
    if (line.rfind("model name", 0) == 0) {
      model = line.substr(line.find(':') + 2);
      break;
    }
  std::fprintf(stderr, "%s, %ld CPUs, %s %s%s\n", model.c_str(), sysconf(_SC_NPROCESSORS_ONLN), system.sysname,
               system.release,
               geteuid() == 0 ? "" : "; not root: real-time policies may be refused, see column granted");
}

int run(int argc, char** argv) {
  CLI::App app("Benchmarks of Takt against named references, measured in the same run in pairs A B A B");
  std::string suite_name, json_file, list;
  Options options;
  for (const Suite& suite : suites()) list += "\n  " + std::string(suite.name) + ": " + std::string(suite.what);
  app.add_option("suite", suite_name, "what to measure:" + list)->required();
  takt::command::writes_file(app.add_option("--json", json_file, "write the rows to this file as one JSON array"));
  app.add_option("--rounds", options.rounds, "interleaved rounds (default: the suite's own)")
      ->check(CLI::Range(1, 10000));
  app.add_option("--only", options.only, "one condition of a suite that has several (release, release_loads)");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const Suite* chosen = nullptr;
  for (const Suite& suite : suites())
    if (suite.name == suite_name) chosen = &suite;
  if (chosen == nullptr) {
    std::cerr << "takt-bench: no suite `" << suite_name << "`; there are:" << list << '\n';
    return 2;
  }
  if (const std::string refused = refused_condition(*chosen, options.only); !refused.empty()) {
    std::cerr << "takt-bench: " << refused << '\n';
    return 2;
  }
  describe_machine();
  std::vector<Row> rows;
  try {
    rows = chosen->run(options);
  } catch (const std::exception& error) {
    std::cerr << "takt-bench: " << suite_name << ": " << error.what() << '\n';
    return 3;
  }
  for (const Row& row : rows) print(row);
  if (json_file.empty()) return 0;
  nlohmann::json array = nlohmann::json::array();
  for (const Row& row : rows) array.push_back(to_json(row));
  return takt::command::write_output(json_file, array.dump(1) + "\n", "--json");
}

}  // namespace

int main(int argc, char** argv) {
  return takt::command::at_boundary(argc, argv, [&] { return run(argc, argv); });
}
