#pragma once

#include "drivers/ssi/settings.h"

namespace axlecast {
class ConfigMap;
}  // namespace axlecast

namespace axlecast::ssi {

// Reads the keys of a device that say what its word looks like: README.md, "The word". Errors go into the map's list;
// what is left can be decoded all the same.
void ParseWordKeys(ConfigMap& device, Maker maker, SsiSettings& settings);

}  // namespace axlecast::ssi
