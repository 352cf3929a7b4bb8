#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// What a key of the keyboard means to a replay.
enum class ReplayKey {
  kPause,  // or goes on
  kStep,
  kBack1,  // s
  kForward1,
  kBack10,
  kForward10,
  kFaster,
  kSlower,
  kQuit,
};

// Tells keys from the bytes of a terminal (ECMA-48; xterm's arrows), however they are cut into reads. Pure.
class ReplayKeys {
 public:
  // The keys that are complete now; others than ours are passed over.
  [[nodiscard]] std::vector<ReplayKey> On(std::string_view bytes);

 private:
  std::string pending_;  // the beginning of a sequence
};

inline constexpr const char* kReplayKeysHelp =
    "space pause, s or . step, left/right 1 s, down/up 10 s, + - speed, q quit";

}  // namespace axlecast
