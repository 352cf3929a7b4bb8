#pragma once

#include <map>
#include <string>

#include "core/base/result.h"
#include "core/base/secret.h"

namespace axlecast {

// Secrets by file name; what is not there cannot be read.
class FixedSecrets final : public SecretSource {
 public:
  [[nodiscard]] Result<Secret> Read(const SecretPlace& place) override {
    const auto found = files.find(place.file.empty() ? place.credential : place.file);
    if (found == files.end() && any.empty()) return Failure(place.file + place.credential + " does not exist");
    return Secret(found == files.end() ? any : found->second);
  }

  std::map<std::string, std::string> files;
  std::string any;  // what every other file holds; empty: there is no other
};

}  // namespace axlecast
