// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/dds/security.hpp"

#include <dds/dds.h>
#include <dlfcn.h>

#include <tuple>

namespace takt::machines {
namespace {

namespace fs = std::filesystem;

/// Debian has the plug-ins in a folder next to libddsc, and the loader does not look there. Elsewhere it finds them.
std::string plugin(const std::string& name) {
  Dl_info library{};
  dladdr(reinterpret_cast<const void*>(&dds_create_domain), &library);
  const fs::path beside = fs::weakly_canonical(library.dli_fname).parent_path();
  for (const fs::path& folder : {beside / "libddsc0debian", beside})
    if (const fs::path file = folder / ("lib" + name + ".so"); fs::exists(file)) return file.string();
  return name;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> security_properties(const fs::path& keys) {
  const auto file = [&](const char* name) { return "file:" + fs::absolute(keys / name).string(); };
  std::vector<std::pair<std::string, std::string>> all{{"dds.sec.auth.identity_ca", file("ca.pem")},
                                                       {"dds.sec.auth.identity_certificate", file("certificate.pem")},
                                                       {"dds.sec.auth.private_key", file("key.pem")},
                                                       {"dds.sec.access.permissions_ca", file("ca.pem")},
                                                       {"dds.sec.access.governance", file("governance.p7s")},
                                                       {"dds.sec.access.permissions", file("permissions.p7s")}};
  for (const auto& [part, library, entry] : {std::tuple{"auth", "dds_security_auth", "authentication"},
                                             std::tuple{"access", "dds_security_ac", "access_control"},
                                             std::tuple{"crypto", "dds_security_crypto", "crypto"}}) {
    const std::string prefix = std::string("dds.sec.") + part + ".library.";
    all.emplace_back(prefix + "path", plugin(library));
    all.emplace_back(prefix + "init", std::string("init_") + entry);
    all.emplace_back(prefix + "finalize", std::string("finalize_") + entry);
  }
  return all;
}

}  // namespace takt::machines
