#pragma once

#include <cstdint>
#include <string>

namespace axlecast {

// What became of a conversion.
struct Conversion {
  std::string problem;        // why there is no output, and what to do; empty: it is whole
  std::int64_t written = 0;   // messages, frames or rows
  std::int64_t left_out = 0;  // events that the format cannot hold, or that are malformed
  std::string note;           // what the reader should know of the output; empty: nothing
};

}  // namespace axlecast
