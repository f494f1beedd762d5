// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "graph/run/proof_report.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

std::string words(const Json& json, const char* key) { return json[key].get<std::string>(); }
double number(const Json& json, const char* key) { return json[key].get<double>(); }

std::string row_text(const Json& row) {
  std::string text =
      fmt::format("{} {:.3f} ms, proven {:.3f} ms: {} of {} samples", words(row, "what"), number(row, "observed_ms"),
                  number(row, "proven_ms"), row["samples_above"].get<uint64_t>(), row["of"].get<uint64_t>());
  if (row.contains("chance")) text += fmt::format(" (by chance {:.2g})", number(row, "chance"));
  return text;
}

}  // namespace

std::string unexplained_text(const Json& proofs) {
  std::string text;
  for (const Json& row : proofs["above_proof"])
    if (words(row, "cause") == "unexplained") text += "NOT AS PROVEN: " + row_text(row) + ", no cause found\n";
  return text;
}

std::string proofs_text(const Json& proofs) {
  std::string text;
  for (const Json& row : proofs["above_proof"]) {
    const std::string cause = words(row, "cause");
    if (cause == "unexplained") continue;
    text += fmt::format("above its proof: {}, {}\n", row_text(row),
                        cause == "host_stall" ? fmt::format("host_stall {:.1f} ms", number(row, "stall_ms")) : cause);
  }
  const Json& assumed = proofs["assumptions"];
  if (words(proofs, "verdict") == "none") return text + "proofs: none, " + words(proofs, "why") + "\n";
  return text + fmt::format("proofs {}: {} figures; overheads {}, stalls up to {:.2f} ms\n", words(proofs, "verdict"),
                            proofs["compared"].get<uint64_t>(), words(assumed, "overheads"),
                            number(assumed, "stall_ms"));
}

}  // namespace takt::command
