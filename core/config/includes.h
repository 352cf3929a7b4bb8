#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// `include` of the machine's file (docs/configuration.md, "Several files").

inline constexpr std::size_t kMaxIncludeDepth = 4;     // an included file may include, and so on
inline constexpr std::size_t kMaxIncludedFiles = 256;  // of one machine
inline constexpr std::size_t kMaxIncluded = 500'000;   // bytes of all files of a machine with `include`

// Returns the content of a file of a machine: ReadConfigFile, or texts in memory.
using ConfigReader = std::function<Result<std::string>(const std::string& file)>;

// The document of a machine, before its abbreviations are replaced.
struct MachineDocument {
  YAML::Node root{YAML::NodeType::Undefined};  // undefined after an error; each part keeps the line of its file
  std::string text;                            // as MachineConfig has it
  std::vector<ConfigSource> sources;           // as MachineConfig has them
};

// Reads a file and those that it includes, and merges them. The errors name the file and the line.
[[nodiscard]] MachineDocument ReadMachineFile(const std::string& file, const ConfigReader& read,
                                              ConfigErrors& errors);

// Parses a text without a file. It cannot include files: `include` is an error.
[[nodiscard]] MachineDocument ParseMachineText(const std::string& text, ConfigErrors& errors);

// Returns the document of a machine that was loaded, from the texts that were read then.
[[nodiscard]] MachineDocument ReadAgain(const MachineConfig& machine, ConfigErrors& errors);

}  // namespace axlecast
