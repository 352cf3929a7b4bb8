#include "drivers/kit/simulation/simulated_fault.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/kit/simulation/quantity.h"

namespace axlecast {
namespace {

using Kind = SimulatedFault::Kind;

struct FaultName {
  Kind kind;
  std::string_view name;
  std::string_view unit;  // of the amount; empty: it takes none
  double usual = 0;
  double maximum = 0;
};
constexpr std::array<FaultName, 13> kFaults = {{
    {Kind::kNone, "none", ""},
    {Kind::kOff, "off", ""},
    {Kind::kStuck, "stuck", ""},
    {Kind::kGarbage, "garbage", ""},
    {Kind::kBitFlip, "bit_flip", "of the bits", 0.001, 1},
    {Kind::kRequestFlip, "request_flip", "of the bits", 0.001, 1},
    {Kind::kShort, "short", "of the replies", 1, 1},
    {Kind::kSlow, "slow", "us", 200, 1e6},
    {Kind::kDelayed, "delayed", "ms", 5, 10'000},
    {Kind::kLate, "late", "ms", 100, 10'000},
    {Kind::kScattered, "scattered", "ms", 100, 10'000},
    {Kind::kIntermittent, "intermittent", "of the requests", 0.1, 1},
    {Kind::kEcho, "echo", ""},
}};

const FaultName* FindFault(const std::string& name) {
  const auto* found =
      std::find_if(kFaults.begin(), kFaults.end(), [&](const FaultName& f) { return f.name == name; });
  return found == kFaults.end() ? nullptr : found;
}

std::string KnownFaults() {
  std::string names;
  for (const FaultName& fault : kFaults) names += (names.empty() ? "" : ", ") + std::string(fault.name);
  return names;
}

}  // namespace

Result<SimulatedFault> ParseFault(std::string_view text) {
  const std::size_t colon = text.find(':');
  std::string name(text.substr(0, colon));
  std::replace(name.begin(), name.end(), '-', '_');
  const FaultName* found = FindFault(name);
  if (found == nullptr) return Failure("'" + std::string(text) + "' is not a fault: use one of " + KnownFaults());
  SimulatedFault fault{found->kind, found->usual};
  if (colon == std::string_view::npos) return fault;
  if (found->unit.empty()) return Failure("'" + std::string(text) + "': " + name + " takes no amount");
  const Result<double> amount = ParseNumber(text.substr(colon + 1), 0, found->maximum, found->unit);
  if (!amount) return Failure(amount.error());
  fault.amount = *amount;
  return fault;
}

std::string FaultText(const SimulatedFault& fault) {
  const FaultName& name =
      *std::find_if(kFaults.begin(), kFaults.end(), [&](const FaultName& f) { return f.kind == fault.kind; });
  std::string text(name.name);
  if (!name.unit.empty()) text += ':' + NumberText(fault.amount);
  return text;
}

MonoNs LateAdapter::Due(MonoNs sent, const SimulatedFault& fault, SeededRandom& random) {
  const double amount = fault.amount * static_cast<double>(kMillisecond);
  if (fault.kind == Kind::kDelayed) return sent + std::llround(amount);
  if (fault.kind == Kind::kScattered) return sent + std::llround(amount * random.Share());
  const MonoNs held = fault.kind == Kind::kLate ? std::llround(amount * random.Share()) : 0;
  const MonoNs due = std::max(sent + held, latest_ + 1);
  if (held > 0) latest_ = due;
  return due;
}

bool FlipBits(std::span<std::uint8_t> bytes, int bits_per_byte, double rate, SeededRandom& random) {
  if (rate <= 0) return false;
  bool delimiter_hit = false;
  const auto per_byte = static_cast<double>(bits_per_byte);
  const double all = static_cast<double>(bytes.size()) * per_byte;
  // Draws how many bits pass unharmed before the next one that is hit.
  const auto gap = [&] { return rate >= 1 ? 0.0 : std::floor(std::log1p(-random.Share()) / std::log1p(-rate)); };
  for (double bit = gap(); bit < all; bit += 1 + gap()) {
    const auto in_byte = static_cast<unsigned>(std::fmod(bit, per_byte));
    const auto byte = static_cast<std::size_t>(bit / per_byte);
    if (in_byte >= 8) {
      delimiter_hit = true;
    } else {
      bytes[byte] = static_cast<std::uint8_t>(bytes[byte] ^ 1U << in_byte);
    }
  }
  return delimiter_hit;
}

std::size_t Damage(std::span<std::uint8_t> reply, const SimulatedFault& fault, SeededRandom& random) {
  if (fault.kind == Kind::kGarbage) {
    for (std::uint8_t& byte : reply) byte = static_cast<std::uint8_t>(random.Next());
  } else if (fault.kind == Kind::kBitFlip) {
    FlipBits(reply, 8, fault.amount, random);
  } else if (fault.kind == Kind::kShort && random.Share() < fault.amount) {
    return random.Next() % reply.size();
  }
  return reply.size();
}

}  // namespace axlecast
