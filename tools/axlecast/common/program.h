#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// The folder that this program stands in: its companions stand there too.
[[nodiscard]] std::string ProgramFolder();
[[nodiscard]] std::string CompanionProgram(std::string_view name);      // <folder>/axlecast-<name>
[[nodiscard]] std::string DriverProgram(std::string_view family_name);  // of a family's buses

// Becomes the program; returns only when that fails, with the reason.
[[nodiscard]] std::string Become(const std::vector<std::string>& argv);

// As one would type it in a shell.
[[nodiscard]] std::string ShellText(const std::vector<std::string>& argv);

}  // namespace axlecast
