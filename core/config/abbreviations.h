#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

#include "core/config/config_map.h"

namespace axlecast {

// Returns the machine's document with its abbreviations replaced by the full keys (docs/configuration.md, "Many axes"): merge
// keys (`<<`, YAML 1.1), ranges in the names below `buses` (`axis{01..12}`), and `defaults` of families and buses. A
// document without abbreviations is returned as it is. Every part of the file that an error may refer to keeps its line, except
// names and values that a range has made.
[[nodiscard]] YAML::Node ExpandAbbreviations(const YAML::Node& document, ConfigErrors& errors);

// Returns the document as YAML text.
[[nodiscard]] std::string YamlText(const YAML::Node& document);

}  // namespace axlecast
