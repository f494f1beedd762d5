// SPDX-License-Identifier: Apache-2.0
// Where the sockets of running graphs lie:
//
//   std::string why;
//   if (const auto folder = SocketFolder::own(Surroundings::of_this_process(), why))
//     bind(listener, &folder->address(getpid()), ...);
#pragma once
#include <sys/stat.h>
#include <sys/un.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace takt::attach {

/// What decides where the folder is; a test brings its own.
struct Surroundings {
  uid_t user = 0;
  std::string xdg_runtime, home;  ///< of the environment; "": not set
  std::filesystem::path run = "/run", tmp = "/tmp";
  static Surroundings of_this_process();
};

/// A folder that nobody else can take: opened without following a link, then checked, and used through its descriptor.
/// Whoever gives its name to something else afterwards changes nothing. One thread at a time.
class SocketFolder {
 public:
  /// The first of these that belongs to this user and admits nobody else (mode 0700), made if it is missing:
  ///
  ///   $XDG_RUNTIME_DIR/takt    /run/takt (if it is this user's)    /run/takt.UID (root)    /tmp/takt.UID
  ///   ~/.cache/takt/run
  ///
  /// /run/takt is the service's (RuntimeDirectory=takt); its group may be let in (mode 0750). `why`: each folder that
  /// was passed over because somebody else has it, with the way out; all of them if there is no folder.
  static std::optional<SocketFolder> own(const Surroundings& where, std::string& why);
  /// The service's, for those who ask: any owner, since only root can make it, but nobody else may write to it.
  static std::optional<SocketFolder> of_service(const Surroundings& where);

  SocketFolder(SocketFolder&& other) noexcept;
  SocketFolder& operator=(SocketFolder&&) = delete;
  SocketFolder(const SocketFolder&) = delete;
  SocketFolder& operator=(const SocketFolder&) = delete;
  ~SocketFolder();

  /// Its name, for a person.
  const std::filesystem::path& path() const { return path_; }
  /// Members of its group may speak to the runs in it.
  bool for_group() const { return (mode_ & S_IXGRP) != 0; }
  enum class Of { run, replay };
  /// Of the run or replay with that process id, by the descriptor: as long as this object lives.
  sockaddr_un address(int pid, Of whom = Of::run) const;
  /// Process ids of the sockets in it, sorted.
  std::vector<int> pids(Of whom = Of::run) const;
  void remove_socket(int pid, Of whom = Of::run) const;

 private:
  SocketFolder(int descriptor, std::filesystem::path path, mode_t mode)
      : descriptor_(descriptor), path_(std::move(path)), mode_(mode) {}
  enum class For { own, service };
  static std::optional<SocketFolder> open(const std::filesystem::path& path, const Surroundings& where, For whom,
                                          std::string& why);
  int descriptor_;
  std::filesystem::path path_;
  mode_t mode_;
};

}  // namespace takt::attach
