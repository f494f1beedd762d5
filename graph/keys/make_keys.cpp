// SPDX-License-Identifier: Apache-2.0
#include "graph/keys/make_keys.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "graph/flight/remote_shell.hpp"
#include "graph/keys/documents.hpp"
#include "graph/keys/machine_keys.hpp"
#include "rt/file/output_file.hpp"

namespace takt::keys {
namespace {

namespace fs = std::filesystem;
using flight::shell_word;

constexpr const char* kHome = "ca";  ///< the folder of the authority
constexpr const char* kAuthorityKey = "ca.key";
constexpr std::time_t kDay_s = 86'400;

struct Refused {
  KeysFailure why;
};

void write(const fs::path& file, const std::string& text) {
  if (const auto done = write_file(file, text); !done) throw Refused{{done.error().what, true}};
}

std::string word(const fs::path& file) { return shell_word(file.string()); }

/// Lines of openssl for a shell. What they write can be read by its owner only.
void carry_out(const std::string& script) {
  auto shell = flight::RemoteShell::here();
  if (!shell) throw Refused{{shell.error(), true}};
  shell->say("exec 2>&1; umask 077; set -e\n" + script + "exit 0");
  std::string said;
  while (const auto line = shell->line()) said += "\n  " + *line;
  const int code = shell->end();
  if (code == 127) throw Refused{{"openssl is missing; run:  sudo apt install openssl", true}};
  if (code != 0) throw Refused{{fmt::format("openssl ended with {}:{}", code, said), true}};
}

/// A self-made certificate and its key, P-256, which is what DDS Security and all of its plug-ins know.
std::string certificate(const fs::path& work, const std::string& subject, int days, const std::string& more,
                        const fs::path& key, const fs::path& certificate) {
  return fmt::format(
      "openssl req -x509 -config {} -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days {} -subj {} {} "
      "-keyout {} -out {} </dev/null\n",
      word(work / "openssl.cnf"), days, shell_word("/" + subject), more, word(key), word(certificate));
}

std::string sign(const fs::path& document, const fs::path& result, const fs::path& authority) {
  return fmt::format("openssl smime -sign -text -in {} -out {} -signer {} -inkey {} </dev/null\n", word(document),
                     word(result), word(authority / kAuthority), word(authority / kAuthorityKey));
}

class Maker {
 public:
  Maker(const graph::GraphSpec& graph, const fs::path& folder, int days, std::time_t now)
      : graph_(graph), folder_(folder), work_(folder / fmt::format(".part.{}", getpid())), days_(days), now_(now) {}
  ~Maker() {
    std::error_code ignored;
    fs::remove_all(work_, ignored);
  }

  std::vector<std::string> make() {
    refuse_strange_input();
    fs::create_directories(work_);
    fs::permissions(work_, fs::perms::owner_all);
    write(work_ / "openssl.cnf", "[req]\ndistinguished_name = dn\n[dn]\n");
    keep_from_git();
    make_authority();
    for (const graph::MachineSpec& machine : graph_.machines) make_machine(machine.name);
    return lines_;
  }

 private:
  void refuse_strange_input() const {
    if (graph_.machines.empty())
      throw Refused{{fmt::format("graph `{}` has no `machines`: who should have keys?", graph_.name)}};
    for (const graph::MachineSpec& machine : graph_.machines)
      if (machine.name == kHome)
        throw Refused{{fmt::format("machine `{}` has the name of the authority's folder; give it another one", kHome)}};
    for (const auto& name : names())
      if (fs::exists(folder_ / name)) require_same(folder_ / name, name == kHome ? "" : name);
  }
  std::vector<std::string> names() const {
    std::vector<std::string> all{kHome};
    for (const graph::MachineSpec& machine : graph_.machines) all.push_back(machine.name);
    return all;
  }
  void require_same(const fs::path& place, const std::string& machine) const {
    try {
      const KeyNotes notes = read_notes(place);
      if (notes.graph == graph_.name && notes.domain == graph_.network.domain && notes.machine == machine) return;
      throw Refused{
          {fmt::format("{} has keys for graph {}, domain {}; this is graph {}, domain {}. Nothing is "
                       "overwritten: give another --out",
                       place.string(), notes.graph, notes.domain, graph_.name, graph_.network.domain)}};
    } catch (const std::runtime_error& problem) {
      throw Refused{{fmt::format("{}; nothing is overwritten: give another --out", problem.what())}};
    }
  }

  void keep_from_git() {
    fs::path tree = fs::weakly_canonical(folder_);
    while (tree != tree.root_path() && !fs::exists(tree / ".git")) tree = tree.parent_path();
    if (!fs::exists(tree / ".git") || fs::exists(folder_ / ".gitignore")) return;
    write(folder_ / ".gitignore", "*\n");
    lines_.push_back(fmt::format("{}: {} is a git tree, and keys belong in none: its .gitignore leaves them out",
                                 folder_.string(), tree.string()));
  }

  void finish(const fs::path& made, const std::string& name, std::time_t until, const std::string& what) {
    write(made / kNotes,
          to_json({graph_.name, name == kHome ? "" : name, graph_.network.domain, until}).dump(2) + "\n");
    fs::rename(made, folder_ / name);
    lines_.push_back(fmt::format("{}: {}, until {}", (folder_ / name).string(), what, utc(until)));
  }

  void make_authority() {
    if (fs::exists(authority())) {
      authority_until_ = read_notes(authority()).until;
      if (authority_until_ <= now_)
        throw Refused{{fmt::format("{} ended on {}; make keys for all machines anew, with another --out",
                                   authority().string(), utc(authority_until_))}};
      return lines_.push_back(
          fmt::format("{}: there already, kept, until {}", authority().string(), utc(authority_until_)));
    }
    const fs::path made = work_ / kHome;
    make_private(made);
    carry_out(
        certificate(work_, "CN=" + graph_.name, days_,
                    "-addext basicConstraints=critical,CA:TRUE -addext keyUsage=critical,keyCertSign,digitalSignature",
                    made / kAuthorityKey, made / kAuthority));
    authority_until_ = now_ + days_ * kDay_s;
    finish(made, kHome, authority_until_, "the authority; its key makes machines, so it goes to none");
  }

  void make_machine(const std::string& name) {
    if (fs::exists(folder_ / name))
      return lines_.push_back(
          fmt::format("{}: there already, kept; remove it to have it made anew", (folder_ / name).string()));
    const fs::path made = work_ / name;
    make_private(made);
    const std::time_t until = std::min(authority_until_, now_ + days_ * kDay_s);
    const int days = static_cast<int>((until - now_) / kDay_s);
    write(work_ / "governance.xml", governance(graph_));
    write(work_ / "permissions.xml", permissions(graph_, name, now_ - kDay_s, until));
    carry_out(certificate(work_, subject_of(graph_, name), days,
                          fmt::format("-CA {} -CAkey {} -addext basicConstraints=critical,CA:FALSE",
                                      word(authority() / kAuthority), word(authority() / kAuthorityKey)),
                          made / kPrivateKey, made / kCertificate) +
              sign(work_ / "governance.xml", made / kGovernance, authority()) +
              sign(work_ / "permissions.xml", made / kPermissions, authority()));
    fs::copy_file(authority() / kAuthority, made / kAuthority);
    finish(made, name, until, "copy it to that machine only, and run there with --keys");
  }

  static void make_private(const fs::path& made) {
    fs::create_directory(made);
    fs::permissions(made, fs::perms::owner_all);
  }
  fs::path authority() const { return folder_ / kHome; }

  const graph::GraphSpec& graph_;
  const fs::path folder_, work_;
  const int days_;
  const std::time_t now_;
  std::time_t authority_until_ = 0;
  std::vector<std::string> lines_;
};

}  // namespace

tl::expected<std::vector<std::string>, KeysFailure> make_keys(const graph::GraphSpec& graph, const fs::path& folder,
                                                              int days, std::time_t now) {
  try {
    return Maker(graph, folder, days, now).make();
  } catch (const Refused& refused) {
    return tl::make_unexpected(refused.why);
  } catch (const fs::filesystem_error& problem) {
    return tl::make_unexpected(
        KeysFailure{fmt::format("{}: {}", problem.path1().string(), problem.code().message()), true});
  }
}

}  // namespace takt::keys
