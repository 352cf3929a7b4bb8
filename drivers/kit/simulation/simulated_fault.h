#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/base/time.h"
#include "drivers/kit/simulation/seeded_random.h"

namespace axlecast {

// What can be wrong with a simulated encoder or its line, by name. docs/simulation.md describes each.
struct SimulatedFault {
  enum class Kind : std::uint8_t {
    kNone,
    kOff,           // nothing is answered; the encoder itself goes on
    kStuck,         // the position stands still, the shaft does not
    kGarbage,       // random bytes instead of a reply
    kBitFlip,       // amount: share of the reply's bits that are inverted
    kRequestFlip,   // amount: share of the request's bits that are inverted, delimiters too
    kShort,         // amount: share of replies that end early
    kSlow,          // amount: us by which the reply begins later
    kDelayed,       // amount: ms by which the adapter hands the reply over later
    kLate,          // amount: ms up to which the adapter hands each reply over later, by chance, in their order
    kScattered,     // as kLate, but each by a time of its own: later ones may overtake
    kIntermittent,  // amount: share of requests that are not answered
    kEcho,          // the adapter hears its own transmission
  };
  Kind kind = Kind::kNone;
  double amount = 0;
};

// "bit_flip:0.001", "bit-flip:0.001", "off"; without an amount its default. Empty when parsed, else what would be
// right.
[[nodiscard]] std::string ParseFault(std::string_view text, SimulatedFault& fault);
[[nodiscard]] std::string FaultText(const SimulatedFault& fault);

// What a CAN node says of it.
inline constexpr const char* kNotOnCan = "scattered: CAN adapters keep the order of frames; use late";

// Hands replies over as an adapter does that holds them back.
class LateAdapter {
 public:
  // When the host gets the reply that was on the line until `sent`.
  [[nodiscard]] MonoNs Due(MonoNs sent, const SimulatedFault& fault, SeededRandom& random);

 private:
  MonoNs latest_ = 0;  // of the replies that were held back by chance: no later one comes before it
};

// Inverts each bit with probability `rate`. `bits_per_byte` above 8 counts the delimiter too: returns true when a
// delimiter was hit.
bool FlipBits(std::span<std::uint8_t> bytes, int bits_per_byte, double rate, SeededRandom& random);

// Makes of the reply what a line with this fault delivers; returns how many of its bytes are left.
[[nodiscard]] std::size_t Damage(std::span<std::uint8_t> reply, const SimulatedFault& fault, SeededRandom& random);

}  // namespace axlecast
