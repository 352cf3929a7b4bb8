#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace axlecast {

// The number bdSeq of the connections of an edge node, 0..255: it ties an NDEATH to its NBIRTH. It is kept in a file and continues
// after a restart. The specification lets a process begin at 0. A will of the process before it, which a broker may deliver
// later, could then have the number of the present session and would declare it dead.
class BirthSequence {
 public:
  explicit BirthSequence(std::string file) : file_(std::move(file)) {}

  // Returns the number of a new connection. It is on the disk when this function returns. If the file cannot be read, the numbers
  // continue from the last one of this process, or begin at 0; see problem().
  [[nodiscard]] std::uint8_t Next();
  [[nodiscard]] const std::string& problem() const { return problem_; }  // of the last call; empty: none

 private:
  std::string file_;
  std::optional<std::uint8_t> last_;
  std::string problem_;
};

// The content of the file: "bdSeq 17\n", the last number that was used. ParseBirthSequence returns nothing for any other text.
[[nodiscard]] std::string FormatBirthSequence(std::uint8_t number);
[[nodiscard]] std::optional<std::uint8_t> ParseBirthSequence(std::string_view text);

}  // namespace axlecast
