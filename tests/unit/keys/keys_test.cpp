// SPDX-License-Identifier: Apache-2.0
// What `takt keys` writes, read back by openssl.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <array>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "graph/keys/documents.hpp"
#include "graph/keys/machine_keys.hpp"
#include "graph/keys/make_keys.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::keys;
namespace fs = std::filesystem;

namespace {

constexpr std::time_t kDay_s = 86'400;

graph::GraphSpec two_machines() {
  graph::GraphSpec graph;
  graph.name = "pair", graph.file = "pair.yaml";
  graph.network.domain = 7;
  for (const char* name : {"robot", "vision"}) graph.machines.push_back({name, "10.0.0.1", {}, {}, {}, {}});
  return graph;
}

graph::GraphSpec part(const std::string& machine) {
  graph::GraphSpec graph = two_machines();
  graph.machine = machine;
  return graph;
}

/// What a command prints, on stderr too; then its exit code.
std::pair<std::string, int> said_by(const std::string& command) {
  std::FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  std::string said;
  for (std::array<char, 4096> some; const size_t got = std::fread(some.data(), 1, some.size(), pipe);)
    said.append(some.data(), got);
  return {said, pclose(pipe)};
}

bool openssl_is_missing() {
  if (said_by("openssl version").second == 0) return false;
  MESSAGE("NOT RUN: openssl is missing");
  return true;
}

int mode_of(const fs::path& file) {
  struct stat found {};
  return stat(file.c_str(), &found) == 0 ? static_cast<int>(found.st_mode & 0777) : -1;
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Keys as they are, without openssl: for what a run looks at.
void write_folder(const fs::path& folder, const KeyNotes& notes) {
  fs::create_directories(folder);
  for (const char* name : {kAuthority, kCertificate, kPrivateKey, kGovernance, kPermissions})
    std::ofstream(folder / name) << "x";
  std::ofstream(folder / kNotes) << to_json(notes);
  fs::permissions(folder / kPrivateKey, fs::perms::owner_read | fs::perms::owner_write);
}

}  // namespace

TEST_CASE("Each machine has a certificate of one authority, a key for itself, and what the authority signed") {
  if (openssl_is_missing()) return;
  const test::TemporaryFolder folder;
  const fs::path out = folder.path / "out";
  const std::time_t now = std::time(nullptr);
  const auto done = make_keys(two_machines(), out, 30, now);
  REQUIRE_MESSAGE(done, done.error().what);
  CHECK(mode_of(out / "ca/ca.key") == 0600);
  for (const std::string machine : {"robot", "vision"}) {
    const fs::path own = out / machine;
    CHECK(mode_of(own) == 0700);
    CHECK(mode_of(own / "key.pem") == 0600);
    CHECK(!fs::exists(own / "ca.key"));
    CHECK(said_by(fmt::format("openssl verify -CAfile {0}/ca.pem {0}/certificate.pem", own.string())).second == 0);
    const auto shown =
        said_by(fmt::format("openssl x509 -in {}/certificate.pem -noout -subject -ext basicConstraints", own.string()))
            .first;
    CHECK(shown.find("CN = " + machine + ".pair") != std::string::npos);
    CHECK(shown.find("CA:FALSE") != std::string::npos);
    // Certificate and key are of each other.
    CHECK(said_by(fmt::format("openssl x509 -in {}/certificate.pem -noout -pubkey", own.string())).first ==
          said_by(fmt::format("openssl pkey -in {}/key.pem -pubout", own.string())).first);
    for (const char* document : {"governance", "permissions"}) {
      const auto [text, code] = said_by(
          fmt::format("openssl smime -verify -text -CAfile {0}/ca.pem -in {0}/{1}.p7s", own.string(), document));
      CHECK(code == 0);
      CHECK(text.find("<id>7</id>") != std::string::npos);
    }
    CHECK(check_keys(own, part(machine), now).problem.empty());
  }
  // Each key is another one.
  CHECK(text_of(out / "robot/key.pem") != text_of(out / "vision/key.pem"));
}

TEST_CASE("What is there stays; a machine that is added gets keys that the others trust; other graphs are refused") {
  if (openssl_is_missing()) return;
  const test::TemporaryFolder folder;
  const fs::path out = folder.path / "out";
  REQUIRE(make_keys(two_machines(), out, 30, std::time(nullptr)));
  const std::string before = text_of(out / "robot/key.pem");
  graph::GraphSpec more = two_machines();
  more.machines.push_back({"arm", "10.0.0.3", {}, {}, {}, {}});
  const auto done = make_keys(more, out, 30, std::time(nullptr));
  REQUIRE(done);
  CHECK(text_of(out / "robot/key.pem") == before);
  CHECK(done->at(1).find("there already, kept") != std::string::npos);
  CHECK(said_by(fmt::format("openssl verify -CAfile {0}/robot/ca.pem {0}/arm/certificate.pem", out.string())).second ==
        0);
  more.network.domain = 8;
  const auto refused = make_keys(more, out, 30, std::time(nullptr));
  REQUIRE(!refused);
  CHECK(refused.error().what.find("Nothing is overwritten") != std::string::npos);
  CHECK(!make_keys({}, folder.path / "none", 30, std::time(nullptr)));
}

TEST_CASE("In a git tree keys are kept out of git, and that is said") {
  if (openssl_is_missing()) return;
  const test::TemporaryFolder folder;
  fs::create_directory(folder.path / ".git");
  const auto done = make_keys(two_machines(), folder.path / "sub/keys", 30, std::time(nullptr));
  REQUIRE(done);
  CHECK(done->front().find("is a git tree") != std::string::npos);
  CHECK(text_of(folder.path / "sub/keys/.gitignore") == "*\n");
}

TEST_CASE("Permissions are those of one machine: it sends its own topics and reads those of the others") {
  const std::string text = permissions(two_machines(), "robot", 0, kDay_s);
  CHECK(text.find("<subject_name>CN=robot.pair</subject_name>") != std::string::npos);
  CHECK(text.find("<not_after>1970-01-02T00:00:00Z</not_after>") != std::string::npos);
  const size_t sends = text.find("<publish>"), reads = text.find("<subscribe>");
  CHECK(text.find("takt/pair/robot/*") > sends);
  CHECK(text.find("takt/pair/robot/*") < reads);
  CHECK(text.find("takt/pair/vision/*") > reads);
  CHECK(text.find("<default>DENY</default>") != std::string::npos);
}

TEST_CASE("Keys that a run cannot use are refused with the file and what to do") {
  const test::TemporaryFolder folder;
  const fs::path own = folder.path / "robot";
  const std::time_t now = 1'800'000'000;
  const auto problem = [&](const graph::GraphSpec& graph) { return check_keys(own, graph, now).problem; };
  const auto has = [](const std::string& text, const char* part_of_it) {
    CHECK_MESSAGE(text.find(part_of_it) != std::string::npos, text);
  };
  write_folder(own, {"pair", "robot", 7, now + 300 * kDay_s});
  CHECK(problem(part("robot")).empty());
  CHECK(check_keys(own, part("robot"), now).warning.empty());
  has(check_keys(folder.path, part("robot"), now).problem, "has the keys of all machines");
  has(problem(two_machines()), "--keys belongs to --machine");
  has(problem(part("vision")), "has keys for machine robot, this is vision");
  graph::GraphSpec other = part("robot");
  other.network.domain = 8;
  has(problem(other), "for domain 7, this is 8");
  other.name = "trio";
  has(problem(other), "for graph pair, this is trio");
  fs::permissions(own / kPrivateKey, fs::perms::group_read, fs::perm_options::add);
  has(problem(part("robot")), "(mode 640); run:  chmod 600");
  write_folder(own, {"pair", "robot", 7, now + kDay_s});
  fs::permissions(own / kPrivateKey, fs::perms::group_read, fs::perm_options::remove);
  has(check_keys(own, part("robot"), now).warning, "end on 2027-01-16");
  write_folder(own, {"pair", "robot", 7, now});
  has(problem(part("robot")), "ended on 2027-01-15");
  std::ofstream(own / kNotes) << "{}";
  has(problem(part("robot")), "not as `takt keys` writes it");
  fs::remove(own / kGovernance);
  has(problem(part("robot")), "governance.p7s");
}
