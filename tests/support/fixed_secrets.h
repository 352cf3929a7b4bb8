#pragma once

#include <map>
#include <string>

#include "core/base/secret.h"

namespace axlecast {

// Secrets by file name; what is not there cannot be read.
class FixedSecrets final : public SecretSource {
 public:
  [[nodiscard]] std::string Read(const SecretPlace& place, Secret& into) override {
    const auto found = files.find(place.file.empty() ? place.credential : place.file);
    if (found == files.end() && any.empty()) return place.file + place.credential + " does not exist";
    into = Secret(found == files.end() ? any : found->second);
    return "";
  }

  std::map<std::string, std::string> files;
  std::string any;  // what every other file holds; empty: there is no other
};

}  // namespace axlecast
