// SPDX-License-Identifier: Apache-2.0
// Names, types and places of all fields are part of every record: they stay as message_fields.txt has them.
#include <doctest/doctest.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "rt/msg/messages.hpp"
#include "rt/msg/scalar.hpp"

namespace {

using namespace takt;

std::string table() {
  std::ostringstream out;
  for (const MessageType* type : message_types()) {
    out << type->name << ' ' << type->header_bytes << " bytes";
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
      out << "  " << field.name << " [" << field.unit << "] " << name_of(field.scalar) << " at " << field.offset << " x "
          << field.count << ", " << field.element_bytes << " bytes\n";
  }
  return out.str();
}

}  // namespace

TEST_CASE("fields of the runtime's own messages lie where records have them") {
  std::ifstream file(TAKT_SOURCE_DIR "/tests/unit/rt/message_fields.txt");
  std::stringstream known;
  known << file.rdbuf();
  CHECK(table() == known.str());
}
