#include "tools/axlecast/logs/replay_keys.h"

#include <optional>

namespace axlecast {
namespace {

constexpr char kEscape = '\x1b';
constexpr char kEndOfTransmission = '\x04';  // Ctrl-D
constexpr std::size_t kLongestSequence = 32;

std::optional<ReplayKey> PlainKey(char key) {
  switch (key) {
    case ' ':
      return ReplayKey::kPause;
    case 's':
    case '.':
      return ReplayKey::kStep;
    case '+':
    case '=':
      return ReplayKey::kFaster;
    case '-':
      return ReplayKey::kSlower;
    case 'q':
    case 'Q':
    case kEndOfTransmission:
      return ReplayKey::kQuit;
    default:
      return std::nullopt;
  }
}

std::optional<ReplayKey> Arrow(char final_byte) {
  switch (final_byte) {
    case 'A':
      return ReplayKey::kForward10;
    case 'B':
      return ReplayKey::kBack10;
    case 'C':
      return ReplayKey::kForward1;
    case 'D':
      return ReplayKey::kBack1;
    default:
      return std::nullopt;
  }
}

// Bytes of the control sequence (CSI or SS3) that `bytes` begin with; 0 while it is not complete, 1 when it is none.
std::size_t SequenceSize(std::string_view bytes) {
  if (bytes.size() < 2) return 0;
  if (bytes[1] != '[' && bytes[1] != 'O') return 1;
  for (std::size_t i = 2; i < bytes.size(); ++i) {
    if (bytes[i] >= '@' && bytes[i] <= '~') return i + 1;
    if (bytes[i] < ' ' || bytes[i] > '~' || i > kLongestSequence) return i;
  }
  return 0;
}

}  // namespace

std::vector<ReplayKey> ReplayKeys::On(std::string_view bytes) {
  pending_ += bytes;
  std::string_view rest = pending_;
  std::vector<ReplayKey> keys;
  while (!rest.empty()) {
    const std::size_t size = rest.front() == kEscape ? SequenceSize(rest) : 1;
    if (size == 0) break;
    const auto key = size > 2 ? Arrow(rest[size - 1]) : PlainKey(rest.front());
    if (key) keys.push_back(*key);
    rest.remove_prefix(size);
  }
  pending_ = std::string(rest);
  return keys;
}

}  // namespace axlecast
