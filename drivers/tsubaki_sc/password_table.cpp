#include "drivers/tsubaki_sc/password_table.h"

namespace axlecast::tsubaki_sc {

std::string PasswordTable::Read(std::string_view name, Secret& into) const {
  const auto place = settings_.passwords.find(name);
  const std::string shown(name);
  if (place == settings_.passwords.end()) return "the configuration has no password named " + shown;
  const std::string problem = source_.Read(place->second, into);
  if (!problem.empty()) return "password " + shown + ": " + problem;
  if (IsPassword(into.text())) return {};
  into = Secret();
  return "password " + shown + ": what its file holds is none: 8 to 16 characters from ! to ~, no blanks";
}

}  // namespace axlecast::tsubaki_sc
