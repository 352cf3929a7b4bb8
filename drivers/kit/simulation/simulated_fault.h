#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "core/base/time.h"

namespace axlecast {

// A repeatable stream of random numbers (splitmix64): the same seed gives the same faults on every machine.
class SeededRandom {
 public:
  explicit SeededRandom(std::uint64_t seed) : state_(seed) {}

  std::uint64_t Next() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15U;
    z = (z ^ z >> 30U) * 0xBF58476D1CE4E5B9U;
    z = (z ^ z >> 27U) * 0x94D049BB133111EBU;
    return z ^ z >> 31U;
  }
  // In [0, 1).
  double Share() { return static_cast<double>(Next() >> 11U) * 0x1p-53; }
  // In [-bound, bound].
  std::int64_t Around(std::int64_t bound) {
    const auto values = static_cast<std::uint64_t>(bound) * 2 + 1;
    return static_cast<std::int64_t>(Next() % values) - bound;
  }

 private:
  std::uint64_t state_;
};

// What can be wrong with a simulated encoder or its line, by name. docs/simulation.md describes each.
struct SimulatedFault {
  enum class Kind : std::uint8_t {
    kNone,
    kOff,           // no reply is sent; the encoder itself runs
    kStuck,         // the position does not change, the shaft does
    kGarbage,       // random bytes instead of a reply
    kBitFlip,       // amount: share of the reply's bits that are inverted
    kRequestFlip,   // amount: share of the request's bits that are inverted, delimiters too
    kShort,         // amount: share of replies that end early
    kSlow,          // amount: us by which the reply begins later
    kDelayed,       // amount: ms by which the adapter hands the reply over later
    kLate,          // amount: ms up to which the adapter hands each reply over later, by chance, in their order
    kScattered,     // as kLate, but each by a time of its own: later ones may overtake
    kIntermittent,  // amount: share of requests that are not answered
    kEcho,          // the adapter receives its own transmission
  };
  Kind kind = Kind::kNone;
  double amount = 0;
};

// Parses "bit_flip:0.001", "bit-flip:0.001" or "off". Without an amount, the fault has its default.
[[nodiscard]] Result<SimulatedFault> ParseFault(std::string_view text);
[[nodiscard]] std::string FaultText(const SimulatedFault& fault);

// The error of a CAN node for the fault `scattered`.
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
