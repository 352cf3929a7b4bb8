#include "tools/axlecast/common/program.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace axlecast {

std::string ProgramFolder() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "." : program.parent_path().string();
}

std::string CompanionProgram(std::string_view name) { return ProgramFolder() + "/axlecast-" + std::string(name); }

std::string DriverProgram(std::string_view family_name) {
  std::string name(family_name);
  std::replace(name.begin(), name.end(), '_', '-');
  return CompanionProgram(name);
}

std::string Become(const std::vector<std::string>& argv) {
  std::vector<char*> arguments;
  arguments.reserve(argv.size() + 1);
  for (const std::string& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  static_cast<void>(signal(SIGPIPE, SIG_DFL));  // an ignored signal would stay ignored
  execvp(arguments[0], arguments.data());
  return "cannot run " + argv[0] + ": " + std::strerror(errno);
}

std::string ShellText(const std::vector<std::string>& argv) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./:=,+@%";
  std::string text;
  for (const std::string& argument : argv) {
    if (!text.empty()) text += ' ';
    if (!argument.empty() && argument.find_first_not_of(kPlain) == std::string::npos) {
      text += argument;
      continue;
    }
    text += '\'';
    for (const char character : argument)
      text += character == '\'' ? std::string("'\\''") : std::string(1, character);
    text += '\'';
  }
  return text;
}

}  // namespace axlecast
