// SPDX-License-Identifier: Apache-2.0
#include "graph/web/frozen_files.hpp"

#include <doctest/doctest.h>
#include <sys/stat.h>

#include <fstream>
#include <thread>

#include "tests/temporary_folder.hpp"

using namespace takt;
using web::FrozenFiles;
using Json = web::Json;

namespace {

/// A folder with two records and what is none, and a program in the place of takt.
struct Disk {
  test::TemporaryFolder folder;
  FrozenFiles files{[this] { return folder.path / "frozen"; }, folder.path / "takt"};

  Disk() {
    std::filesystem::create_directory(folder.path / "frozen");
    for (const char* name : {"frozen/ace-1-miss.mcap", "frozen/ace-2-mark.mcap", "frozen/notes.txt", "secret.mcap"})
      folder.write(name, std::string("bytes of ") + name);
    std::filesystem::create_symlink(folder.path / "secret.mcap", folder.path / "frozen/link.mcap");
  }
  void be_takt(const std::string& script) const { chmod(folder.write("takt", "#!/bin/sh\n" + script).c_str(), 0700); }
  Json replayed_until(const std::string& state) {
    for (int i = 0; i < 2000; ++i) {
      const Json told = files.answer({{"do", "replayed"}});
      if (told["state"] == state) return told;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return files.answer({{"do", "replayed"}});
  }
};

}  // namespace

TEST_CASE("frozen records are listed, the newest first, and nothing else is") {
  Disk disk;
  const Json told = disk.files.answer({{"do", "frozen"}});
  REQUIRE(told["files"].size() == 2);
  CHECK(told["files"][0]["file"] == "ace-2-mark.mcap");
  CHECK(told["files"][1]["file"] == "ace-1-miss.mcap");
  CHECK(told["files"][0]["mb"].get<double>() == doctest::Approx(32e-6));
  FrozenFiles none([] { return std::filesystem::path(); }, "takt");
  CHECK(none.answer({{"do", "frozen"}})["files"].empty());
  FrozenFiles gone([] { return std::filesystem::path("/nowhere"); }, "takt");
  CHECK(gone.answer({{"do", "frozen"}})["files"].empty());
}

TEST_CASE("a ticket is for one file, once; what does not lie among the frozen ones gets none") {
  Disk disk;
  for (const char* name :
       {"", ".", "..", "../secret.mcap", "link.mcap", "notes.txt", "ace-3-mark.mcap", "/etc/passwd"}) {
    CHECK_MESSAGE(disk.files.answer({{"do", "download"}, {"file", name}}).contains("error"), name);
    CHECK_MESSAGE(disk.files.answer({{"do", "replay"}, {"file", name}}).contains("error"), name);
  }
  CHECK(disk.files.answer({{"do", "download"}, {"file", 5}}).contains("error"));
  const std::string path = disk.files.answer({{"do", "download"}, {"file", "ace-1-miss.mcap"}})["path"];
  const std::string begin = "/frozen/ace-1-miss.mcap?ticket=";
  REQUIRE(path.substr(0, begin.size()) == begin);
  const std::string ticket = path.substr(begin.size());
  CHECK_FALSE(disk.files.redeem("ace-1-miss.mcap", "").has_value());
  CHECK_FALSE(disk.files.redeem("ace-1-miss.mcap", ticket.substr(1)).has_value());
  const auto file = disk.files.redeem("ace-1-miss.mcap", ticket);
  REQUIRE(file.has_value());
  CHECK(file->filename() == "ace-1-miss.mcap");
  CHECK_FALSE(disk.files.redeem("ace-1-miss.mcap", ticket).has_value());
  const std::string other = disk.files.answer({{"do", "download"}, {"file", "ace-2-mark.mcap"}})["path"];
  CHECK_FALSE(disk.files.redeem("ace-1-miss.mcap", other.substr(begin.size())).has_value());
}

TEST_CASE("of many tickets the oldest ones go") {
  Disk disk;
  std::vector<std::string> tickets;
  for (int i = 0; i < 20; ++i) {
    const std::string path = disk.files.answer({{"do", "download"}, {"file", "ace-1-miss.mcap"}})["path"];
    tickets.push_back(path.substr(path.find('=') + 1));
  }
  CHECK_FALSE(disk.files.redeem("ace-1-miss.mcap", tickets[3]).has_value());
  CHECK(disk.files.redeem("ace-1-miss.mcap", tickets[4]).has_value());
  CHECK(disk.files.redeem("ace-1-miss.mcap", tickets[19]).has_value());
}

TEST_CASE("a replay tells its address once it is there, ends with the next one, and says why there is none") {
  Disk disk;
  CHECK(disk.files.answer({{"do", "replayed"}})["state"] == "none");
  CHECK(disk.files.answer({{"do", "replay"}, {"file", "ace-1-miss.mcap"}})["ok"] == true);
  CHECK(disk.replayed_until("ended")["why"].get<std::string>().find("could not be started") != std::string::npos);

  disk.be_takt(
      "echo \"$@\" >$(dirname $0)/told; echo 'takt: reading' >&2; echo 'http://127.0.0.1:4711/#token=abc' >&2; sleep "
      "100 & wait\n");
  disk.files.answer({{"do", "replay"}, {"file", "ace-1-miss.mcap"}});
  const Json shown = disk.replayed_until("shown");
  CHECK(shown["address"] == "http://127.0.0.1:4711/#token=abc");
  CHECK(shown["file"] == "ace-1-miss.mcap");
  std::string told;
  std::getline(std::ifstream(disk.folder.path / "told") >> std::ws, told);
  CHECK(told.find("replay " + (disk.folder.path / "frozen/ace-1-miss.mcap").string() + " --web --output ") == 0);

  disk.be_takt("echo 'takt: error: the record is damaged' >&2; exit 2\n");
  disk.files.answer({{"do", "replay"}, {"file", "ace-2-mark.mcap"}});
  const Json ended = disk.replayed_until("ended");
  CHECK(ended["why"] == "takt: error: the record is damaged");
  CHECK(ended["file"] == "ace-2-mark.mcap");
}
