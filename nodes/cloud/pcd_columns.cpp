// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include "nodes/cloud/cloud_input.hpp"

namespace takt::cloud {
namespace {

/// LZF, as the Point Cloud Library packs columns: a control byte below 32 announces so many bytes and one more; else
/// its upper three bits are a length and the rest, with the next byte, a distance back. False: damaged.
bool unpack_lzf(std::string_view packed, std::string& to, size_t size) {
  constexpr unsigned kLiterals = 32, kLong = 7;
  size_t at = 0;
  const auto byte = [&] { return static_cast<unsigned>(static_cast<unsigned char>(packed[at++])); };
  while (at < packed.size()) {
    const unsigned control = byte();
    if (control < kLiterals) {
      const size_t count = control + 1;
      if (count > packed.size() - at || count > size - to.size()) return false;
      to.append(packed.substr(at, count));
      at += count;
      continue;
    }
    size_t count = control >> 5U;
    if (count == kLong) {
      if (at == packed.size()) return false;
      count += byte();
    }
    if (at == packed.size()) return false;
    const size_t back = ((control & 31U) << 8U | byte()) + 1;
    count += 2;
    if (back > to.size() || count > size - to.size()) return false;
    for (size_t i = 0; i < count; ++i) to += to[to.size() - back];  // may overlap itself
  }
  return to.size() == size;
}

size_t bytes_of(Kind kind) {
  return visit_kind(kind, [](auto zero) { return sizeof zero; });
}

}  // namespace

std::string unpack_columns(Input& input, const Table& table) {
  const auto packed_size = input.value<uint32_t>(), size = input.value<uint32_t>();
  if (packed_size > input.left())
    input.bad_byte(fmt::format("{} packed bytes were announced, {} follow", packed_size, input.left()));
  uint64_t row_bytes = 0;
  for (const Column& column : table.columns) {
    if (column.count > std::numeric_limits<uint32_t>::max()) input.bad_byte("a COUNT beyond 32 bits");
    row_bytes += bytes_of(column.kind) * column.count;
  }
  if (row_bytes == 0 || size / row_bytes != table.rows || size % row_bytes != 0)
    input.bad_byte(fmt::format("{} bytes of columns, expected {} rows of {}", size, table.rows, row_bytes));
  constexpr uint64_t kMostRatio = 264;  // of LZF
  if (size > (packed_size + uint64_t{1}) * kMostRatio) input.bad_byte("the packed columns are damaged");
  std::string columns;
  columns.reserve(size);
  if (!unpack_lzf(input.rest().substr(0, packed_size), columns, size)) input.bad_byte("the packed columns are damaged");
  std::string rows(size, '\0');
  size_t from = 0, in_row = 0;
  for (const Column& column : table.columns) {
    const size_t width = bytes_of(column.kind) * column.count;
    for (size_t row = 0; row < table.rows; ++row, from += width)
      std::memcpy(rows.data() + row * row_bytes + in_row, columns.data() + from, width);
    in_row += width;
  }
  return rows;
}

}  // namespace takt::cloud
