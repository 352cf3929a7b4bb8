#pragma once

#include <string>
#include <string_view>

#include "core/base/secret.h"
#include "drivers/tsubaki_sc/settings.h"

namespace axlecast::tsubaki_sc {

// The passwords of one unit, known by their names. Each is read from its place when it is needed.
class PasswordTable {
 public:
  PasswordTable(const ScSettings& settings, SecretSource& source)
      : settings_(settings), source_(source), active_(settings.password) {}

  // The one that the unit has now; empty: the configuration names none.
  [[nodiscard]] const std::string& active() const { return active_; }
  [[nodiscard]] bool Has(std::string_view name) const { return settings_.passwords.contains(name); }
  void Use(const std::string& name) { active_ = name; }

  // An empty string when it was read and is a password, else the cause and the remedy; the content never shows.
  [[nodiscard]] std::string Read(std::string_view name, Secret& into) const;

 private:
  const ScSettings& settings_;
  SecretSource& source_;
  std::string active_;
};

}  // namespace axlecast::tsubaki_sc
