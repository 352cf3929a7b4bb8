#pragma once

#include <axlecast/argument_t.hpp>
#include <string>
#include <vector>

namespace axlecast {

// An order that the bridge gives by itself, or in the place of a client's operation.
struct BridgeOrder {
  std::string operation;
  std::vector<argument_t> arguments;
};

}  // namespace axlecast
