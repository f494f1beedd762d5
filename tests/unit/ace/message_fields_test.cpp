// SPDX-License-Identifier: Apache-2.0
// Names, types and places of all fields are part of every record: they stay as message_fields.txt has them, which
// lists the messages of the first records.
#include <doctest/doctest.h>

#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "graph/ace/ace_registry.hpp"
#include "graph/language/message_types.hpp"
#include "rt/msg/scalar.hpp"

namespace {

using namespace takt;

/// By the name of the type: how it lies in memory, a line for the whole and one for each field.
std::map<std::string, std::string> layouts() {
  std::map<std::string, std::string> all;
  const Registry registry = ace_registry();
  for (const auto& [name, type] : graph::message_types(registry)) {
    std::ostringstream out;
    out << name << ' ' << type->header_bytes << " bytes";
    for (const Capacity& capacity : {Capacity{}, Capacity{4, 3, 2, 5}}) {
      std::vector<uint32_t> counts(16, 77);
      type->capacities(capacity, counts);
      out << "; ";
      for (const uint32_t count : counts)
        if (count != 77) out << count << ' ';
      out << "elements, " << type->bytes(capacity) << " bytes";
    }
    out << '\n';
    for (const Field& field : type->fields)
      out << "  " << field.name << " [" << field.unit << "] " << name_of(field.scalar) << " at " << field.offset
          << " x " << field.count << ", " << field.element_bytes << " bytes\n";
    all[name] = out.str();
  }
  return all;
}

}  // namespace

TEST_CASE("fields of the messages that records hold lie where they have them") {
  const auto now = layouts();
  std::ifstream file(TAKT_SOURCE_DIR "/tests/unit/ace/message_fields.txt");
  std::map<std::string, std::string> recorded;
  std::string line, name;
  while (std::getline(file, line)) {
    if (!line.starts_with(' ')) name = line.substr(0, line.find(' '));
    recorded[name] += line + '\n';
  }
  CHECK(recorded.size() == 24);
  for (const auto& [type, layout] : recorded) {
    CAPTURE(type);
    REQUIRE(now.contains(type));
    CHECK(now.at(type) == layout);
  }
}
