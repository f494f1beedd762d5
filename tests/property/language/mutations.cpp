// SPDX-License-Identifier: Apache-2.0
// Damaged files: nothing crashes, every failure stands somewhere, and our words agree with the JSON Schema library.
#include <fmt/format.h>

#include <array>
#include <random>
#include <utility>

#include "../../unit/language/fixture.hpp"
#include "graph/language/quantity.hpp"
#include "graph/language/schema.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::test;
using namespace takt::graph;

namespace {

constexpr std::string_view kGarble = "abz019 .,:;-_+*&!?|>%@'\"{}[]()#/\\\n\t~<=$\x01\x80\xff\xc3";

std::string mutated(std::string text, std::mt19937& random) {
  const auto below = [&](size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(random); };
  for (size_t edits = 1 + below(4); edits > 0 && !text.empty(); --edits) {
    const size_t at = below(text.size()), length = std::min(1 + below(12), text.size() - at);
    switch (below(5)) {
      case 0: text.erase(at, length); break;
      case 1: text.insert(below(text.size()), text.substr(at, length)); break;
      case 2: text[at] = kGarble[below(kGarble.size())]; break;
      case 3: text.insert(at, 1, kGarble[below(kGarble.size())]); break;
      default: {  // a whole line again, or gone
        const size_t start = text.rfind('\n', at) + 1, end = std::min(text.find('\n', at), text.size() - 1) + 1;
        if (end <= start) break;
        if (below(2) == 0) text.insert(start, text.substr(start, end - start));
        else text.erase(start, end - start);
      }
    }
  }
  return text;
}

void check_result(const Loaded& loaded) {
  CHECK(loaded.graph.has_value() == loaded.problems.empty());
  for (const auto& problem : loaded.problems) {
    const std::string text = to_string(problem);
    if (problem.position.line < 1 || problem.position.column < 1 || problem.position.file.empty() ||
        problem.text.empty() || text.find("bug of Takt") != std::string::npos)
      FAIL_CHECK(text);
  }
}

}  // namespace

TEST_CASE("No damage to a graph or schedule crashes the loader, and every failure carries a position") {
  std::mt19937 random(test::seed(7));
  const Files files;
  size_t refused = 0;
  const int rounds = test::rounds(3000);
  for (int i = 0; i < rounds; ++i) {
    const bool graph = i % 2 == 0;
    const std::string text = mutated(graph ? kGraph : kSchedule, random);
    CAPTURE(text);
    files.write("graph.yaml", graph ? text : kGraph);
    files.write("schedule.yaml", graph ? kSchedule : text);
    const Loaded loaded = files.load();
    check_result(loaded);
    refused += loaded.graph ? 0 : 1;
  }
  // Damage that goes through unseen should be the exception (a changed number, a comment).
  CHECK(refused > rounds * 7 / 10);
}

TEST_CASE("Random bytes and random YAML punctuation never crash") {
  std::mt19937 random(test::seed(11));
  const Files files;
  for (int i = 0; i < test::rounds(1500); ++i) {
    std::string text;
    const size_t length = std::uniform_int_distribution<size_t>(0, 200)(random);
    for (size_t k = 0; k < length; ++k)
      text += i % 3 == 0 ? static_cast<char>(random() & 0xFF) : kGarble[random() % (kGarble.size() - 4)];
    CAPTURE(text);
    files.write("graph.yaml", text);
    check_result(files.load());
  }
}

TEST_CASE("Deep nesting and aliases end in an error, not in a crash") {
  const std::vector<std::string> texts{std::string(100'000, '['),
                                       std::string(100'000, '{'),
                                       "a: &a [*a]\n",
                                       "a: &a {b: *a}\n",
                                       "? [a]: b\n: c\n",
                                       std::string(5000, '-') + "\n",
                                       "a: " + std::string(2000, 'x') + "\n",
                                       "name: " + std::string(2000, '1') + "\n"};
  for (const auto& text : texts) {
    const Loaded loaded = Files(text).load();
    CHECK(!loaded.graph);
    check_result(loaded);
  }
}

const std::string kScenario = R"(takt: 1
name: go
seed: 7
faults:
  - {kind: drop, target: camera.pair, from: 2s, to: 4s, probability: 0.5}
  - {kind: cpu_hog, threads: 2, policy: fixed}
  - {kind: full_disk, megabytes: 2}
expect:
  modes: [full, no_stereo]
  rates: {stereo: 14.5, planner: {at_least: 1, at_most: 2}}
  ages: {reaction: 300ms}
  recovery: 2s
  lost: 0
  exit: 0
)";

TEST_CASE("Our explanation and the JSON Schema library agree on what is valid") {
  std::mt19937 random(test::seed(13));
  size_t valid = 0, invalid = 0;
  for (int i = 0; i < test::rounds(3750); ++i) {
    const std::array sources{std::pair(Schema::graph, kGraph), std::pair(Schema::schedule, kSchedule),
                             std::pair(Schema::faults, kScenario)};
    const auto& [schema, sound] = sources[static_cast<size_t>(i) % sources.size()];
    const std::string text = mutated(sound, random);
    CAPTURE(text);
    std::vector<Problem> reading, problems;
    const Document document = parse_document(text, "f.yaml", ".", reading);
    if (!reading.empty() || document.root.is_null()) continue;
    const bool ours = validate(document, schema, problems);
    CHECK(ours == valid_by_library(document.root, schema));
    CHECK(ours == problems.empty());
    for (const auto& problem : problems) CHECK(problem.text.find("breaks the schema") == std::string::npos);
    (ours ? valid : invalid)++;
  }
  CHECK(valid >= test::at_scale(100));
  CHECK(invalid >= test::at_scale(100));
}

TEST_CASE("Durations agree with arithmetic in long double") {
  std::mt19937_64 random(test::seed(17));
  for (int i = 0; i < test::rounds(20'000); ++i) {
    const auto whole = static_cast<int64_t>(random() % 1'000'000), below = static_cast<int64_t>(1 + random() % 100'000);
    const bool fraction = i % 2 == 0;
    const std::string text =
        fraction ? fmt::format("{}/{} ms", whole, below) : fmt::format("{}.{:03}us", whole, below % 1000);
    const long double exact = fraction
                                  ? 1e6L * static_cast<long double>(whole) / static_cast<long double>(below)
                                  : 1e3L * static_cast<long double>(whole) + static_cast<long double>(below % 1000);
    const auto ns = parse_duration_ns(text);
    REQUIRE(ns);
    CAPTURE(text);
    CHECK(std::abs(static_cast<long double>(*ns) - exact) <= 0.5L);
  }
}
